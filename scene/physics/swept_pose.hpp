// Continuous collision of two moving, rotating convex parts: proved, not sampled.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/physics/physics_body.hpp"

namespace enfilade::scene {

/// Motion of a body within a step. The centre moves straight, and the rotation is uniform, by the
/// shorter way.
struct SweptPose {
  Vec3 fromCentre = Vec3::Zero(), toCentre = Vec3::Zero();
  collision::Quat fromRotation = collision::Quat::Identity();
  collision::Quat toRotation = collision::Quat::Identity();
  double radius = 0;                  ///< metres about the centre: bound of all vertices
  Vec3 centreInFrame = Vec3::Zero();  ///< centre of mass in the frame of the parts
  /// set if it does not move: its frame is then exact to the last bit
  const PhysicsBody* stationaryBody = nullptr;
  double rotationAngle = 0;  ///< upper bound in radians; set by updateDerived()
  /// Rotation matrix and origin of the frame at both ends; set by updateDerived().
  Mat3 fromMatrix = Mat3::Identity(), toMatrix = Mat3::Identity();
  Vec3 fromPosition = Vec3::Zero(), toPosition = Vec3::Zero();
};

/// Returns the motion of a stationary body.
SweptPose makeStationaryPose(const PhysicsBody& body);

/// Updates the derived fields. Call it after a change of centres or rotations.
void updateDerived(SweptPose& sweep);

/// Bound of the displacement of any point, in metres.
double computeMaxDisplacement(const SweptPose& sweep);

/// The part of a motion that bounds the change of a distance.
struct MotionBound {
  Vec3 displacement = Vec3::Zero();  ///< of the centre, metres
  double rotationalBound = 0;        ///< metres: bound of the displacement that rotation adds
};
MotionBound computeMotionBound(const SweptPose& sweep);

/// Bound of the change of the distance between two bodies, in metres.
double computeClosingBound(const MotionBound& a, const MotionBound& b);
inline double computeClosingBound(const SweptPose& a, const SweptPose& b) {
  return computeClosingBound(computeMotionBound(a), computeMotionBound(b));
}

/// Pose at an instant of a motion, by centre of mass and rotation.
struct CentrePose {
  Vec3 centre = Vec3::Zero();
  collision::Quat rotation = collision::Quat::Identity();
};
CentrePose computeMiddlePose(const SweptPose& sweep);

/// Return the first and the second half of a motion.
SweptPose makeFirstHalf(const SweptPose& sweep, const CentrePose& middle);
SweptPose makeSecondHalf(const SweptPose& sweep, const CentrePose& middle);

/// Returns the first `fraction` of a motion: a multiple of 2^-kMaxHalvings.
SweptPose truncateSweep(const SweptPose& sweep, double fraction);

/// Returns the fraction of the motions during which a plane normal to `axis` (unit, from A to B)
/// separates the parts. Cheap test. 0: the plane has no margin left; negative: no result.
double clearFractionAlong(const PartShape& partA, const SweptPose& a, const PartShape& partB,
                          const SweptPose& b, const Vec3& axis);

/// Returns whether the parts are separated at the end of their motions.
bool isSeparatedAtEnd(const PartShape& partA, const SweptPose& a, const PartShape& partB,
                      const SweptPose& b, collision::FeatureCache cache);

struct ClearanceResult {
  double fraction = 1;        ///< proved clear up to here: a multiple of 2^-kMaxHalvings, or 0
  std::uint32_t queries = 0;  ///< narrow-phase queries
};
inline constexpr int kMaxHalvings = 6;

/// Returns the common fraction of both motions during which the parts are proved separated.
/// `cache`: of a query at the start or before. `lowerBound`: metres, certified distance at the
/// start; 0: unknown.
ClearanceResult computeClearance(const PartShape& partA, const SweptPose& a, const PartShape& partB,
                                 const SweptPose& b, const collision::FeatureCache& cache,
                                 double lowerBound = 0);

}  // namespace enfilade::scene
