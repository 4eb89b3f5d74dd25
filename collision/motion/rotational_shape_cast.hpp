// Rotational shape cast: how far a body can rotate about a fixed line before contact. Used for the
// links of a chain and the leaves of doors; the counterpart of castShape() for rotation.
#pragma once

#include "collision/motion/shape_cast.hpp"

namespace enfilade::collision {

/// Rotation about a line, counter-clockwise seen against the axis.
struct AxisRotation {
  Vec3 pivot = Vec3::Zero();  ///< a point of the line, world, metres
  Vec3 axis = Vec3::UnitY();  ///< unit, world
  double angle = 0;           ///< radians, signed, at most a million
};

struct RigidTransform {
  Mat3 rotation = Mat3::Identity();  ///< worldFromBody
  Vec3 translation = Vec3::Zero();   ///< metres
};

/// worldFromBody of `body` after `fraction` (0..1) of the rotation.
RigidTransform computeTransformAfter(const PlacedConvex& body, const AxisRotation& rotation,
                                     double fraction);

/// Rotates A against the static B; `fraction` of the result is that of the angle. Up to it, A and B
/// stay at least min(offset.min, 15/16 of their initial distance) apart, up to the rounding of the
/// rotated poses and SeparationResult::errorBound. If they start closer than `min`, only rotations
/// that do not approach initially are allowed. If they overlap, none is allowed.
ShapeCastResult castShapeRotating(const PlacedConvex& a, const AxisRotation& rotation,
                                  const PlacedConvex& b, const ContactOffset& offset,
                                  FeatureCache& cache);

}  // namespace enfilade::collision
