// The global penetration depth of two convex polytopes in exact integers. Internal to refine.cpp.
#pragma once

#include "collision/exact/exact_minkowski.hpp"

namespace enfilade::collision {

/// The nearest facet of M = B - A, seen from the origin inside it: the plane normal . w = offset.
struct ExactFacet {
  ExactPoint normal;  ///< outward; not zero
  Integer offset;     ///< > 0; the depth is offset / |normal|, times 2^scale metres
  int scale = 0;
};

/// For bodies that penetrate, exactly. `atMost`: a proved upper bound of the depth in metres (any
/// value, infinity too; a close one saves most of the work). Milliseconds for hulls of a hundred
/// vertices.
ExactFacet nearestFacetExactly(const ConvexBody& a, const ConvexBody& b, double atMost);

}  // namespace enfilade::collision
