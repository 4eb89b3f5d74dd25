// Separation of two convex bodies along one axis: cheaper than their distance, with a certified
// lower bound.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// The result of computeAxisSeparation().
struct AxisSeparation {
  double value = 0;       ///< metres, rounded: the gap from A to B along the direction; negative if
                          ///< they overlap along it
  double lowerBound = 0;  ///< metres: certified lower bound of the distance, or -infinity
  VertexPair vertices;    ///< A's support vertex along the direction, B's against it
};

/// Computes the separation along `direction` (world, from A to B, unit up to a few roundings).
/// Bodies with few vertices are scanned in doubles, others use certified supports. For values that
/// are not finite the lower bound is minus infinity.
AxisSeparation computeAxisSeparation(const PlacedConvex& a, const PlacedConvex& b,
                                     const Vec3& direction);

}  // namespace enfilade::collision
