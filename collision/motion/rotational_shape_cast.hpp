// How far a body may turn about a fixed line: what moves the links of a chain and the leaves of
// doors. The counterpart of sweep() for rotation.
#pragma once

#include "collision/motion/shape_cast.hpp"

namespace enfilade::collision {

/// A turn about a line, counter-clockwise where the axis points to the eye.
struct Turn {
  Vec3 pivot = Vec3::Zero();  ///< a point of the line, world, metres
  Vec3 axis = Vec3::UnitY();  ///< unit, world
  double angle = 0;           ///< radians, of any sign, at most a million
};

struct Placement {
  Mat3 rotation = Mat3::Identity();  ///< worldFromBody
  Vec3 translation = Vec3::Zero();   ///< metres
};

/// Where `body` is after `fraction` (0..1) of the turn.
Placement placementAfter(const ConvexBody& body, const Turn& turn, double fraction);

/// Turns A against B, which stands: `fraction` is that of the angle. Along the whole part that is
/// granted A and B stay at least min(band.low, 15/16 of their distance at the start) apart, up to
/// the rounding of the turned poses and what Decision::errorBound states. When they start nearer
/// than `low`, only turns that do not close in at first are granted; when they overlap, none.
SweepResult sweepTurning(const ConvexBody& a, const Turn& turn, const ConvexBody& b,
                         const StoppingBand& band, FeatureCache& cache);

}  // namespace enfilade::collision
