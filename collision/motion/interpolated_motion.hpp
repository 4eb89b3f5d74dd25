// Interpolated motion of convex bodies between two poses: proofs that two of them stay separated.
#pragma once

#include "collision/motion/motion_result.hpp"
#include "collision/motion/rigid_motion.hpp"

namespace enfilade::collision {

/// Pose at an instant of a motion, by centre of mass and rotation.
struct CentrePose {
  Vec3 centre = Vec3::Zero();
  Quat rotation = Quat::Identity();
};

/// worldFromFrame of a frame in which the centre of mass is at `centreInFrame`.
RigidTransform placeFrame(const CentrePose& pose, const Vec3& centreInFrame);

/// Motion of a body within a step. The centre moves straight, and the rotation is uniform, by the
/// shorter way.
struct InterpolatedMotion {
  CentrePose from, to;
  double radius = 0;                  ///< metres about the centre: bound of all vertices
  Vec3 centreInFrame = Vec3::Zero();  ///< centre of mass in the frame of the parts
  bool isStationary = false;          ///< it does not move: its frame is then exact to the last bit
  double rotationAngle = 0;           ///< upper bound in radians; set by updateDerived()
  RigidTransform fromFrame, toFrame;  ///< of the frame at both ends; set by updateDerived()
};

/// Updates the derived fields. Call it after a change of `from` or `to`.
void updateDerived(InterpolatedMotion& motion);

/// The part of a motion that bounds the change of a distance.
struct DisplacementBound {
  Vec3 displacement = Vec3::Zero();  ///< of the centre, metres
  double rotationalBound = 0;        ///< metres: bound of the displacement that rotation adds
};
DisplacementBound computeDisplacementBound(const InterpolatedMotion& motion);

/// Bound of the change of the distance between two bodies, in metres.
double computeApproachBound(const DisplacementBound& a, const DisplacementBound& b);

/// Bound of the displacement of any point, in metres.
inline double computeMaxDisplacement(const InterpolatedMotion& motion) {
  return computeApproachBound(computeDisplacementBound(motion), {});
}

/// The pose halfway between two others.
CentrePose computeMiddlePose(const CentrePose& from, const CentrePose& to);

/// Returns `motion` with other ends, and its derived fields updated.
InterpolatedMotion replaceEnds(const InterpolatedMotion& motion, const CentrePose& from,
                               const CentrePose& to);

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

/// Proves the shapes separated during a common fraction of both motions: `lo`, a multiple of
/// 2^-kMaxHalvings, or 0. Never proves a contact. `cache`: of a query at the start or before.
/// `lowerBound`: metres, certified distance at the start; 0: unknown.
MotionResult computeClearance(const InterpolatedShape& a, const InterpolatedShape& b,
                              const FeatureCache& cache, double lowerBound = 0);

}  // namespace enfilade::collision
