// The global penetration depth of two convex polytopes in exact integers. Internal to refine.cpp.
#pragma once

#include "collision/exact/exact_minkowski.hpp"

namespace enfilade::collision {

/// The facet of M = B - A nearest to the origin, which is inside M: the plane normal . w = offset.
struct ExactFacet {
  ExactPoint normal;  ///< outward; not zero
  Integer offset;     ///< > 0; the depth is offset / |normal|, times 2^scale metres
  int scale = 0;
};

/// Finds the nearest facet of two penetrating bodies. `depthBound`: a certified upper bound of the
/// depth in metres; infinity is allowed, a tight bound saves most of the work. Costs milliseconds
/// for hulls of a hundred vertices.
ExactFacet findNearestFacetExactly(const PlacedConvex& a, const PlacedConvex& b, double depthBound);

}  // namespace enfilade::collision
