// Shape casts: the free fraction of a convex body's motion, for every kind of motion.
#pragma once

#include "collision/motion/motion_result.hpp"
#include "collision/motion/rigid_motion.hpp"

namespace enfilade::collision {

/// The two distances of a shape cast, in metres, 0 < min < rest. A cast stops at about `rest` from
/// an obstacle, but only if the motion would come closer than `min`. The gap between the two lets a
/// body at `rest` slide over the seams of its support.
struct ContactOffset {
  double min;
  double rest;
};

/// True unless the bodies are certified to be farther apart than `distance` (metres).
inline bool isWithin(const SeparationResult& separation, double distance) {
  return separation.verdict != Verdict::separated ||
         separation.distance - separation.errorBound <= distance;
}

// The free fraction of a cast is MotionResult::lo. If it is not clear, the body stops there at
// MotionResult::separation, and `hi` is 1: the rest of the motion would come closer than `min`.

/// Moves A by `displacement` (metres, world) against the static B. Up to the resulting fraction, A
/// and B stay at least min(offset.min, initial distance) apart, up to a billionth of the
/// displacement and SeparationResult::errorBound. If they start closer than `min` or overlap, only
/// motions that do not approach are allowed.
MotionResult castShape(const PlacedConvex& a, const Vec3& displacement, const PlacedConvex& b,
                       const ContactOffset& offset, FeatureCache& cache);

/// Rotates A against the static B. Up to the resulting fraction, A and B stay at least
/// min(offset.min, 15/16 of their initial distance) apart. This holds up to the rounding of the
/// rotated poses and SeparationResult::errorBound. If they start closer than `min`, only rotations
/// that do not approach initially are allowed. If they overlap, none is allowed.
MotionResult castShape(const PlacedConvex& a, const AxisRotation& rotation, const PlacedConvex& b,
                       const ContactOffset& offset, FeatureCache& cache);

/// A shape (vertices in body frame) that performs a motion.
struct MovingShape {
  ConvexShape shape;
  const ScrewMotion& motion;
};

/// Moves A against the stationary B; contract as for translations, up to the rounding of a rotated
/// pose. If they overlap, no motion is allowed. The cast also stops where no step makes progress:
/// then isWithin(separation, offset.rest) is false.
MotionResult castShape(const MovingShape& a, const PlacedConvex& b, const ContactOffset& offset,
                       FeatureCache& cache);

/// The same for two shapes that move simultaneously.
MotionResult castShape(const MovingShape& a, const MovingShape& b, const ContactOffset& offset,
                       FeatureCache& cache);

}  // namespace enfilade::collision
