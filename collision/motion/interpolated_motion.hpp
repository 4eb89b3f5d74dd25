// Interpolated motion of convex bodies between two poses: proofs that two of them stay separated.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// Motion of a body within a step. The centre moves straight, and the rotation is uniform, by the
/// shorter way.
struct InterpolatedMotion {
  Vec3 fromCentre = Vec3::Zero(), toCentre = Vec3::Zero();
  Quat fromRotation = Quat::Identity(), toRotation = Quat::Identity();
  double radius = 0;                  ///< metres about the centre: bound of all vertices
  Vec3 centreInFrame = Vec3::Zero();  ///< centre of mass in the frame of the parts
  bool isStationary = false;          ///< it does not move: its frame is then exact to the last bit
  double rotationAngle = 0;           ///< upper bound in radians; set by updateDerived()
  /// Rotation matrix and origin of the frame at both ends; set by updateDerived().
  Mat3 fromMatrix = Mat3::Identity(), toMatrix = Mat3::Identity();
  Vec3 fromPosition = Vec3::Zero(), toPosition = Vec3::Zero();
};

/// Updates the derived fields. Call it after a change of centres or rotations.
void updateDerived(InterpolatedMotion& motion);

/// Bound of the displacement of any point, in metres.
double computeMaxDisplacement(const InterpolatedMotion& motion);

/// The part of a motion that bounds the change of a distance.
struct DisplacementBound {
  Vec3 displacement = Vec3::Zero();  ///< of the centre, metres
  double rotationalBound = 0;        ///< metres: bound of the displacement that rotation adds
};
DisplacementBound computeDisplacementBound(const InterpolatedMotion& motion);

/// Bound of the change of the distance between two bodies, in metres.
double computeApproachBound(const DisplacementBound& a, const DisplacementBound& b);

/// Pose at an instant of a motion, by centre of mass and rotation.
struct CentrePose {
  Vec3 centre = Vec3::Zero();
  Quat rotation = Quat::Identity();
};
CentrePose computeMiddlePose(const InterpolatedMotion& motion);

/// Return the first and the second half of a motion.
InterpolatedMotion makeFirstHalf(const InterpolatedMotion& motion, const CentrePose& middle);
InterpolatedMotion makeSecondHalf(const InterpolatedMotion& motion, const CentrePose& middle);

inline constexpr int kMaxHalvings = 6;

/// Returns the first `fraction` of a motion: a multiple of 2^-kMaxHalvings.
InterpolatedMotion truncateMotion(const InterpolatedMotion& motion, double fraction);

/// A shape and the motion of its body.
struct InterpolatedShape {
  ConvexShape shape;
  const InterpolatedMotion& motion;
};

/// Returns the fraction of the motions during which a plane normal to `axis` (unit, from A to B)
/// separates the shapes. Cheap test. 0: the plane has no margin left; negative: no result.
double computeClearFractionAlong(const InterpolatedShape& a, const InterpolatedShape& b,
                                 const Vec3& axis);

/// Returns whether the shapes are separated at the end of their motions.
bool isSeparatedAtEnd(const InterpolatedShape& a, const InterpolatedShape& b, FeatureCache cache);

struct ClearanceResult {
  double fraction = 1;        ///< proved clear up to here: a multiple of 2^-kMaxHalvings, or 0
  std::uint32_t queries = 0;  ///< narrow-phase queries
};

/// Returns the common fraction of both motions during which the shapes are proved separated.
/// `cache`: of a query at the start or before. `lowerBound`: metres, certified distance at the
/// start; 0: unknown.
ClearanceResult computeClearance(const InterpolatedShape& a, const InterpolatedShape& b,
                                 const FeatureCache& cache, double lowerBound = 0);

}  // namespace enfilade::collision
