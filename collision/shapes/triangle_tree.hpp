// A tree of boxes over triangles: which triangles of a still object may a box meet?
#pragma once

#include <array>
#include <span>
#include <vector>

#include "collision/shapes/box_tree.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

/// World positions of the three corners, in metres.
using Triangle = std::array<Vec3, 3>;

inline Box boxOf(const Triangle& t) {
  return {t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2])};
}

class TriangleTree {
 public:
  TriangleTree() = default;
  /// All corners finite.
  explicit TriangleTree(const std::vector<Triangle>& triangles);

  /// In the order of the leaves. All indices below are into this list.
  const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Where a triangle stood in the list that the tree was built from.
  std::uint32_t given(std::uint32_t triangle) const { return tree_.order[triangle]; }
  /// Appends the indices of all triangles whose boxes overlap `box`, ascending within the call.
  void query(const Box& box, std::vector<std::uint32_t>& indices) const;

  /// The boxes; items of its leaves are indices into triangles().
  const BoxTree& boxes() const { return tree_; }

 private:
  std::vector<Triangle> triangles_;
  BoxTree tree_;
};

}  // namespace enfilade::collision
