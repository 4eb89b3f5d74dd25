// Plane bound: how long a plane that separates two moving bodies keeps them apart. The one bound of
// a step for rotations, for uniform motions between two poses, and for the time of impact.
#pragma once

#include <limits>

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// A plane that separates two bodies.
struct SeparatingPlane {
  Vec3 normal = Vec3::UnitY();  ///< from A to B, unit
  /// Metres, proved: the distance of the bodies along the normal. <= 0 proves nothing.
  double gap = -std::numeric_limits<double>::infinity();
};

/// A body that rotates about a reference point. Rates are per unit of the motion's parameter: per
/// second, or per fraction of a motion.
struct RotatingBody {
  PlacedConvex body;
  Vec3 reference = Vec3::Zero();        ///< the point, from body.translation, world axes, metres
  Vec3 angularVelocity = Vec3::Zero();  ///< radians, world
  double radius = 0;                    ///< metres: bound of the vertices' distance from the point
};

/// Scale of the rounding errors of a vertex about the reference point, in metres. The product with
/// a rotation has an error of 3u times its Frobenius norm, below 2, times the length.
double computeMagnitude(const RotatingBody& body);

/// Two bodies at one position of their motion.
struct PairMotion {
  RotatingBody a, b;
  Vec3 offset = Vec3::Zero(), velocity = Vec3::Zero();  ///< of B's reference point from A's
  Vec3 acceleration = Vec3::Zero();                     ///< constant
  double keptDistance = 0;  ///< metres, deducted from the gap of a plane
};

/// Lower bound of the parameter for which the bodies stay more than the kept distance apart, at
/// most `cap`. `features` are those of the query that found the plane.
double computeCertifiedStep(const PairMotion& at, const SeparatingPlane& plane,
                            const FeatureCache& features, double cap);

}  // namespace enfilade::collision
