// Bounding volume hierarchy over the triangles of a static mesh, for box overlap queries.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "collision/shapes/box_tree.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

/// Positions of the three corners in the world frame, in metres.
using Triangle = std::array<Vec3, 3>;

inline Aabb computeAabb(const Triangle& t) {
  return {t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2])};
}

class TriangleTree {
 public:
  TriangleTree() = default;
  /// All corners must be finite.
  explicit TriangleTree(const std::vector<Triangle>& triangles);

  /// Triangles in leaf order. All indices below refer to this list.
  const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Index of a triangle in the list that the tree was built from.
  std::uint32_t inputIndex(std::uint32_t triangle) const { return tree_.order[triangle]; }
  /// Appends the indices of all triangles whose bounding box overlaps `box`, ascending per call.
  void query(const Aabb& box, std::vector<std::uint32_t>& indices) const;

  /// Box tree whose leaf items are indices into triangles().
  const BoxTree& boxes() const { return tree_; }

 private:
  std::vector<Triangle> triangles_;
  BoxTree tree_;
};

}  // namespace enfilade::collision
