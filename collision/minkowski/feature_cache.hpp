// Vertex pairs of two convex bodies, and the closest ones as the warm start of the next query.
#pragma once

#include <array>

#include "collision/types.hpp"

namespace enfilade::collision {

/// A vertex of A and a vertex of B: their difference is a point of the Minkowski difference B - A.
struct VertexPair {
  std::uint32_t a = 0, b = 0;
  bool operator==(const VertexPair&) const = default;
};

/// The closest features of the previous query for the same pair, used as a warm start. Results are
/// correct for any value; a good value makes the query cost O(1).
struct FeatureCache {
  std::array<VertexPair, 4> pairs{};  ///< the simplex; 4 pairs: the bodies penetrate
  int size = 0;                       ///< used entries of `pairs`, 0 to 4; 0: no previous query
  Vec3 axis = Vec3::Zero();           ///< separating axis from A to B, any length; zero: unknown
};

}  // namespace enfilade::collision
