// A tree of boxes over boxes: what TriangleTree and PartTree descend.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::collision {

/// A closed box in metres, relative to the origin of its tree, rounded outwards to floats.
struct NarrowBox {
  std::array<float, 3> min, max;
};

/// Never smaller than `box - origin`.
NarrowBox narrowed(const Box& box, const Vec3& origin);

inline bool overlaps(const NarrowBox& a, const NarrowBox& b) {
  return a.min[0] <= b.max[0] && b.min[0] <= a.max[0] && a.min[1] <= b.max[1] &&
         b.min[1] <= a.max[1] && a.min[2] <= b.max[2] && b.min[2] <= a.max[2];
}

/// Binary; items are numbered in the order of the leaves, see `order`.
struct BoxTree {
  /// A box and what is in it.
  struct Branch {
    NarrowBox box;
    std::uint32_t first;  ///< leaf: first item; else: a node
    std::uint32_t count;  ///< leaf: number of items, at least 1; else 0
    bool isLeaf() const { return count > 0; }
  };
  struct Node {
    std::array<Branch, 2> children;  ///< one line of the processor's cache
  };

  Vec3 origin = Vec3::Zero();        ///< metres; the boxes are relative to it
  double extent = 0;                 ///< greatest |coordinate| in the tree's frame, metres
  Branch root{};                     ///< count and first 0 and no nodes: the tree is empty
  std::vector<Node> nodes;           ///< parents before children
  std::vector<std::uint32_t> order;  ///< item i of the leaves is box order[i] of the input

  bool empty() const { return order.empty(); }
};

/// Paths from the root are never longer than this many branches.
constexpr std::size_t kTreeDepthBound = 96;

/// Boxes must not be empty, and finite. Leaves hold up to `leafSize` items, ascending in the input.
BoxTree buildBoxTree(std::span<const Box> boxes, std::uint32_t leafSize);

/// Calls see(first item, count) for the leaves whose boxes overlap `box`, items ascending.
template <typename See>
void forEachLeafMeeting(const BoxTree& tree, const NarrowBox& box, See&& see) {
  if (tree.empty() || !overlaps(tree.root.box, box)) return;
  std::array<const BoxTree::Branch*, kTreeDepthBound> stack;
  std::size_t depth = 0;
  stack[depth++] = &tree.root;
  while (depth > 0) {  // each branch once
    const BoxTree::Branch& branch = *stack[--depth];
    if (branch.isLeaf()) {
      see(branch.first, branch.count);
      continue;
    }
    const BoxTree::Node& node = tree.nodes[branch.first];
    if (overlaps(node.children[1].box, box)) stack[depth++] = &node.children[1];
    if (overlaps(node.children[0].box, box)) stack[depth++] = &node.children[0];
  }
}

}  // namespace enfilade::collision
