// Time of impact of two moving and rotating convex bodies.
#pragma once

#include "collision/motion/moving_pose.hpp"

namespace enfilade::collision {

enum class Impact : std::uint8_t {
  none,     ///< proved: no contact before the horizon; lo = hi = horizon
  contact,  ///< proved: the first contact is within [lo, hi]
  unproved  ///< separated on [0, lo); unknown from lo to hi = horizon
};

struct TimeOfImpact {
  Impact impact = Impact::none;
  double lo = 0;  ///< seconds: separated at all times before lo
  double hi = 0;  ///< seconds: touching, penetrating, or crossed by hi (contact only). hi - lo is
                  ///< at most 1e-12 (1 s + hi). It is larger only if the approach is so slow that
                  ///< the rounding of a rotated pose (PairAtTime::error()) hides the time
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B; of the last separating plane
  std::uint32_t queries = 0;    ///< number of narrow-phase queries
};

/// First time in [0, horizon] at which A and B touch; horizon >= 0, finite (seconds). `cache` as
/// for computeSeparation(), of the bodies at time 0.
TimeOfImpact computeTimeOfImpact(const MovingBody& a, const MovingBody& b, double horizon,
                                 FeatureCache& cache);

}  // namespace enfilade::collision
