// Binary bounding volume hierarchy over axis-aligned boxes. TriangleTree and CompoundView use it.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::collision {

/// Closed single-precision box in metres, relative to the origin of its tree, rounded outwards.
struct FloatAabb {
  std::array<float, 3> min, max;
};

/// Conservative conversion: the result always contains `box - origin`.
FloatAabb toFloatAabb(const Aabb& box, const Vec3& origin);

inline bool overlaps(const FloatAabb& a, const FloatAabb& b) {
  return a.min[0] <= b.max[0] && b.min[0] <= a.max[0] && a.min[1] <= b.max[1] &&
         b.min[1] <= a.max[1] && a.min[2] <= b.max[2] && b.min[2] <= a.max[2];
}

/// Binary tree. Items are numbered in the order of the leaves, see `order`.
struct BoxTree {
  /// A subtree and its box.
  struct Branch {
    FloatAabb box;
    std::uint32_t first;  ///< leaf: first item; inner: index into `nodes`
    std::uint32_t count;  ///< leaf: number of items, at least 1; inner: 0
    bool isLeaf() const { return count > 0; }
  };
  struct Node {
    std::array<Branch, 2> children;  ///< 64 bytes: one cache line
  };

  Vec3 origin = Vec3::Zero();        ///< metres; the boxes are relative to it
  double extent = 0;                 ///< maximum |coordinate| in the tree's frame, metres
  Branch root{};                     ///< empty tree: first and count are 0, no nodes
  std::vector<Node> nodes;           ///< parents before children
  std::vector<std::uint32_t> order;  ///< item i of the leaves is box order[i] of the input

  bool empty() const { return order.empty(); }
};

/// Sum of the box's edges, metres. Within a tree, a child is never larger than its parent.
inline double computeBranchSize(const BoxTree::Branch& branch) {
  double size = 0;
  for (std::size_t i = 0; i < 3; ++i)
    size += static_cast<double>(branch.box.max[i]) - static_cast<double>(branch.box.min[i]);
  return size;
}

/// Maximum number of branches on a path from the root.
constexpr std::size_t kMaxTreeDepth = 96;

/// Builds a tree with at most `leafSize` items per leaf, ascending by input index within a leaf.
/// Boxes must be finite and not empty.
BoxTree buildBoxTree(std::span<const Aabb> boxes, std::uint32_t leafSize);

/// Calls visit(first item, count) for each leaf such that open(box) is true for it and for all
/// branches above it. Of two branches, the second is visited first if isBefore(second, first).
/// open() is called right before a visit, after everything before it has been visited.
template <typename Open, typename IsBefore, typename Visit>
void descend(const BoxTree& tree, Open&& open, IsBefore&& isBefore, Visit&& visit) {
  if (tree.empty()) return;
  std::array<const BoxTree::Branch*, kMaxTreeDepth> stack;
  std::size_t depth = 0;
  stack[depth++] = &tree.root;
  while (depth > 0) {  // each branch once
    const BoxTree::Branch& branch = *stack[--depth];
    if (!open(branch.box)) continue;
    if (branch.isLeaf()) {
      visit(branch.first, branch.count);
      continue;
    }
    const auto& [first, second] = tree.nodes[branch.first].children;
    const bool swap = isBefore(second.box, first.box);
    stack[depth++] = swap ? &first : &second;
    stack[depth++] = swap ? &second : &first;
  }
}

/// The same for each leaf whose box overlaps `box`, in ascending item order.
template <typename Visit>
void forEachOverlappingLeaf(const BoxTree& tree, const FloatAabb& box, Visit&& visit) {
  descend(
      tree, [&](const FloatAabb& branch) { return overlaps(branch, box); },
      [](const FloatAabb&, const FloatAabb&) { return false; }, visit);
}

}  // namespace enfilade::collision
