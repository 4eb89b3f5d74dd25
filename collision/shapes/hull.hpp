// Convex polytopes: built once from any list of points, then only read.
#pragma once

#include <span>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::collision {

/// The convex hull of a list of points, in the body's frame, in metres. It may be flat: a polygon,
/// a segment or one point. Faces are convex polygons, counter-clockwise seen from outside.
struct Hull {
  std::vector<Vec3> vertices;                     ///< extreme points only, each once
  std::vector<std::vector<std::uint32_t>> faces;  ///< solids: >= 4; a polygon: 2; otherwise none
  std::vector<std::uint32_t> neighbourStart;      ///< size vertices+1; offsets into `neighbours`
  std::vector<std::uint32_t> neighbours;          ///< vertices joined by an edge, ascending
  double radius = 0;                              ///< greatest distance of a vertex from the origin

  std::span<const std::uint32_t> neighboursOf(std::uint32_t vertex) const {
    return {neighbours.data() + neighbourStart[vertex],
            neighbours.data() + neighbourStart[vertex + 1]};
  }
};

/// The hull of `points` (at least one, all finite; throws std::invalid_argument otherwise).
/// Orientation tests are exact, so duplicates, coplanar and collinear points do no harm.
Hull buildHull(std::span<const Vec3> points);

/// Euler's formula, convexity (exact) and adjacency; throws std::logic_error naming what is broken.
void validate(const Hull& hull);

}  // namespace enfilade::collision
