// Convex hulls of point sets: immutable convex polytopes.
#pragma once

#include <span>
#include <vector>

#include "collision/shapes/placed_convex.hpp"

namespace enfilade::collision {

/// Convex polytope in the body frame, in metres. It may be flat: a polygon, a segment or a point.
/// Faces are convex polygons, counter-clockwise seen from outside.
struct Hull {
  std::vector<Vec3> vertices;                     ///< extreme points only, no duplicates
  std::vector<std::vector<std::uint32_t>> faces;  ///< solid: >= 4; polygon: 2; otherwise 0
  std::vector<std::uint32_t> neighbourOffsets;    ///< size vertices+1; offsets into `neighbours`
  std::vector<std::uint32_t> neighbours;          ///< vertices joined by an edge, ascending
  double radius = 0;                              ///< maximum distance of a vertex from the origin

  std::span<const std::uint32_t> getNeighbours(std::uint32_t vertex) const {
    return {neighbours.data() + neighbourOffsets[vertex],
            neighbours.data() + neighbourOffsets[vertex + 1]};
  }
};

inline ConvexShape makeConvexShape(const Hull& hull) {
  return {hull.vertices, &hull};
}

/// Builds the convex hull of `points` (at least one, all finite; throws std::invalid_argument
/// otherwise). Orientation tests are exact: duplicate, coplanar and collinear points are allowed.
Hull buildHull(std::span<const Vec3> points);

/// Checks Euler's formula, convexity (exact) and adjacency. Throws std::logic_error that names the
/// violated property.
void validateHull(const Hull& hull);

}  // namespace enfilade::collision
