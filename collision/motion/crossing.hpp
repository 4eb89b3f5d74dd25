// Proof that two bodies meet within an interval though they are separated at both ends: a vertex
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

/// For bodies of few vertices that translate uniformly relative to each other: the first crossing
/// of a vertex and a triangle or of two edges, their boundaries included, in exact arithmetic.
/// Seconds after time 0, rounded up. nullopt: no such crossing, or another motion.
std::optional<double> findExactCrossingTime(const MovingBody& a, const MovingBody& b);

}  // namespace enfilade::collision
