// Time of impact of two moving and rotating convex bodies.
#pragma once

#include "collision/motion/motion_result.hpp"
#include "collision/motion/moving_pose.hpp"

namespace enfilade::collision {

/// First time in [0, horizon] at which A and B touch; horizon >= 0, finite (seconds). `cache` as
/// for computeSeparation(), of the bodies at time 0. The result is in seconds: A and B are
/// separated at all times before `lo`; on contact they touch, penetrate or have crossed by `hi`.
/// Then hi - lo is at most 1e-12 (1 s + hi). It is larger only if the approach is so slow that the
/// rounding of a rotated pose (PairAtTime::error()) hides the time. `separation`: at a time up to
/// `lo`, between the rounded poses; its normal is that of the last separating plane.
MotionResult computeTimeOfImpact(const MovingBody& a, const MovingBody& b, double horizon,
                                 FeatureCache& cache);

}  // namespace enfilade::collision
