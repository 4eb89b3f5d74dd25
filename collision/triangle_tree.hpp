// A tree of boxes over triangles: which triangles of a still object may a box meet?
#pragma once

#include <array>
#include <span>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::collision {

/// World positions of the three corners, in metres.
using Triangle = std::array<Vec3, 3>;

class TriangleTree {
 public:
  TriangleTree() = default;
  explicit TriangleTree(std::vector<Triangle> triangles);

  const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Appends the indices of all triangles whose boxes overlap `box`, ascending within the call.
  void query(const Box& box, std::vector<std::uint32_t>& indices) const;

 private:
  struct Node {
    Box box;
    std::uint32_t first = 0;  ///< leaf: first triangle; inner: index of the right child
    std::uint32_t count = 0;  ///< leaf: number of triangles; inner: 0 (left child follows)
  };
  std::vector<Triangle> triangles_;  ///< in the order of the leaves
  std::vector<Node> nodes_;          ///< depth first
};

}  // namespace enfilade::collision
