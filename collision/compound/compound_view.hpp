// CompoundView: a concave or articulated object, as convex parts under a tree of boxes at a pose.
#pragma once

#include <functional>

#include "collision/shapes/box_tree.hpp"
#include "collision/shapes/placed_convex.hpp"

namespace enfilade::collision {

/// Non-owning view of convex parts under a box tree. An object consists of one or more views.
struct CompoundView {
  const BoxTree* tree = nullptr;
  Mat3 rotation = Mat3::Identity();  ///< worldFromTree
  Vec3 translation = Vec3::Zero();   ///< metres
  /// Maps an item of the tree to its part in the world frame.
  std::function<PlacedConvex(std::uint32_t)> part;
  /// Maps an item of the tree to its world box, for which a rounding error below half of
  /// computeRoundingPad() is permitted. Null: a search uses the box of the item's leaf.
  std::function<Aabb(std::uint32_t)> box = nullptr;
};

/// World box of a branch, rounded. It contains the exact one if inflated by computeRoundingPad().
Aabb computeBranchAabb(const CompoundView& view, const BoxTree::Branch& branch);

/// More than the rounding error of a branch's world box plus that of a part's, metres.
double computeRoundingPad(const CompoundView& view);

/// Conservative world box of all parts. The tree must not be empty.
Aabb computeAabb(const CompoundView& view);

/// True if a descent replaces `a` by its children, not `b`. Not both may be leaves. The larger
/// branch is opened, `a` if they are equal: the order depends on the trees alone, not on the poses.
bool shouldOpenFirst(const BoxTree::Branch& a, const BoxTree::Branch& b);

}  // namespace enfilade::collision
