// Proof that two bodies meet within an interval though they are separated at both ends. A vertex
// passes through a triangle, or an edge through an edge. Thin bodies meet at no time that is a
// double, as a rule.
#pragma once

#include <optional>

#include "collision/motion/moving_pose.hpp"

namespace enfilade::collision {

/// True if it is proved that features of A and B cross between the times `from` and `to` (seconds,
/// 0 <= from < to). `features`: of a query near that time; they are tried first. Only bodies of few
/// vertices are searched for others.
bool isCrossingProved(const MovingBody& a, const MovingBody& b, double from, double to,
                      const FeatureCache& features);

/// Seconds, consecutive doubles or one double; infinite: the bodies never meet.
struct CrossingTime {
  double lo, hi;
};

/// The exact first contact of two separated bodies of few vertices that translate uniformly
/// relative to each other. nullopt: other motions, larger bodies, or all motion is within one
/// plane.
std::optional<CrossingTime> findExactCrossingTime(const MovingBody& a, const MovingBody& b);

}  // namespace enfilade::collision
