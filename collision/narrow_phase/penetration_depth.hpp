// Penetration depth of two convex polytopes, in doubles with a certified error bound. The solver
// uses this level.
#pragma once

#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// The previous polytope around the origin, inside the Minkowski difference B - A, used as a warm
/// start. Results are correct for the cache of any pair. The cache of the same pair reduces the
/// cost to little more than two support queries.
struct DepthCache {
  using Facet = std::array<std::uint16_t, 3>;  ///< indices into `vertices`
  std::vector<VertexPair> vertices;
  std::vector<Facet> facets;
};

/// The result of computePenetrationDepth().
struct PenetrationResult {
  double depth = 0;       ///< metres, >= 0: moving B by depth * normal separates the interiors
  double errorBound = 0;  ///< metres; see `global`
  bool global = false;    ///< certified: no translation shorter than depth - errorBound separates;
                          ///< otherwise `depth` is an upper bound (up to errorBound)
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B
  Vec3 pointA = Vec3::Zero();   ///< the deepest points, world: pointB = pointA - depth * normal,
  Vec3 pointB = Vec3::Zero();   ///< up to rounding
};

/// Computes the depth of two bodies with the verdict `penetrating`. If no polytope is certified to
/// contain the origin, the depth is an upper bound along some axes (`global` is false). `features`:
/// the cache of computeSeparation() for this pair.
PenetrationResult computePenetrationDepth(const PlacedConvex& a, const PlacedConvex& b,
                                          const FeatureCache& features, DepthCache& cache);

}  // namespace enfilade::collision
