// How deep two convex polytopes penetrate, in doubles with a proved bound: what the solver uses.
#pragma once

#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// Last tick's polytope around the origin, inside the Minkowski difference B - A. Any value that
/// penetrationDepth() left is right, of whatever bodies; that of the same two makes the query cost
/// little more than its two supports.
struct DepthCache {
  using Facet = std::array<std::uint16_t, 3>;  ///< indices into `vertices`
  std::vector<VertexPair> vertices;
  std::vector<Facet> facets;
};

struct Depth {
  double depth = 0;       ///< metres, >= 0: moving B by depth * normal parts the interiors
  double errorBound = 0;  ///< metres; see `global`
  bool global = false;    ///< proved: no shorter translation parts them than depth - errorBound;
                          ///< otherwise `depth` is an upper bound (up to errorBound)
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B
  Vec3 pointA = Vec3::Zero();   ///< the deepest points, world: pointB = pointA - depth * normal,
  Vec3 pointB = Vec3::Zero();   ///< up to rounding
};

/// The depth of two bodies that decide() calls penetrating; an upper bound by some axes, not
/// global, where no polytope is proved to hold the origin. `decided` is decide()'s cache for this
/// pair.
Depth penetrationDepth(const ConvexBody& a, const ConvexBody& b, const FeatureCache& decided,
                       DepthCache& cache);

}  // namespace enfilade::collision
