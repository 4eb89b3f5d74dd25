// Boxes of moving convex bodies (seed 5.2.1): the fixed cube, and the tight box from extremal
// vertices that are kept from the last tick.
#pragma once

#include <array>

#include "collision/hull.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

/// Last tick's extremal vertices: for -x, +x, -y, +y, -z, +z the index of a vertex of the hull.
/// Any indices are right (climbing goes on from there); good ones make the update cost O(1).
struct ExtremalVertices {
  std::array<std::uint32_t, 6> vertex{};
};

/// The box of the sphere of the body: only its centre moves. Never smaller than the exact box.
Box fixedCube(const Hull& hull, const Pose& worldFromBody);

/// The tight box: climbs from last tick's extremal vertices to a neighbour while that neighbour's
/// one coordinate is more extreme. Outward by a proved rounding bound, so that it contains the
/// exact box of the exact pose. `last` is replaced by this tick's extremal vertices.
Box tightBox(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last);

/// The slow twin of tightBox(): every vertex, every axis.
Box tightBoxBruteForce(const Hull& hull, const Pose& worldFromBody);

}  // namespace enfilade::collision
