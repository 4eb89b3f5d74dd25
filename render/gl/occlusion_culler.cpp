// Traverses the tree from the root. Nodes above marked items are not tested, because they contain a
// visible item. All other subtrees are tested as a whole first (J. Bittner, M. Wimmer, H. Piringer,
// W. Purgathofer 2004, "Coherent hierarchical culling", with a depth pyramid instead of occlusion
// queries). The cost depends on the visible items and not on the scene's size.
#include "render/gl/occlusion_culler.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

constexpr std::uint32_t kLeafSize = 4;
constexpr std::uint32_t kNoNode = 0xFFFF'FFFFu;

EyeSpaceAabb toEyeSpaceAabb(const collision::FloatAabb& box, const Vec3& eyeFromTree) {
  EyeSpaceAabb result;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const double low = box.min[i], high = box.max[i];
    result.centre[axis] = 0.5 * (low + high) + eyeFromTree[axis];
    result.halfExtent[axis] = 0.5 * (high - low);
  }
  return result;
}

}  // namespace

OcclusionCuller::OcclusionCuller(const std::vector<DrawItem>& items) : items_(items) {
  std::vector<scene::Aabb> boxes;
  std::vector<std::uint32_t> staticItems;
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    if (items[i].body != kNoBody) {
      dynamicItems_.push_back(i);
    } else if (!items[i].box.empty()) {
      staticItems.push_back(i);
      boxes.push_back(items[i].box);
    }
  }
  tree_ = collision::buildBoxTree(boxes, kLeafSize);
  for (const std::uint32_t item : tree_.order) itemOfTreeEntry_.push_back(staticItems[item]);
  nodeOfItem_.assign(items.size(), kNoNode);
  itemGeneration_.assign(items.size(), 0);
  parent_.assign(tree_.nodes.size(), 0);
  subtreeItemCount_.assign(tree_.nodes.size(), 0);
  nodeGeneration_.assign(tree_.nodes.size(), 0);
  if (!tree_.nodes.empty()) linkNodes(0);
  ENFILADE_ASSERT(tree_.nodes.empty() || subtreeItemCount_[0] == staticItems.size());
}

/// Fills parent_, subtreeItemCount_ and nodeOfItem_ below `node`; returns its number of items.
std::uint32_t OcclusionCuller::linkNodes(std::uint32_t node) {
  std::uint32_t count = 0;
  for (const collision::BoxTree::Branch& branch : tree_.nodes[node].children) {
    if (branch.isLeaf()) {
      for (std::uint32_t i = 0; i < branch.count; ++i)
        nodeOfItem_[itemOfTreeEntry_[branch.first + i]] = node;
      count += branch.count;
    } else {
      parent_[branch.first] = node;
      count += linkNodes(branch.first);
    }
  }
  return subtreeItemCount_[node] = count;
}

void OcclusionCuller::markVisible(const std::vector<std::uint32_t>& items) {
  ++generation_;
  for (const std::uint32_t item : items) {
    ENFILADE_ASSERT(item < items_.size());
    itemGeneration_[item] = generation_;
    std::uint32_t node = nodeOfItem_[item];
    while (node != kNoNode &&
           nodeGeneration_[node] != generation_) {  // up to the root or a marked node
      nodeGeneration_[node] = generation_;
      node = parent_[node];
    }
  }
}

OcclusionCuller::CullingResult OcclusionCuller::findVisible(
    const BoxVisibility& visibility, const DepthPyramid& depth,
    const std::vector<BodyPlacement>& bodies, scene::EntityId hiddenEntity) const {
  CullingResult found;
  const auto count = [&](Visibility result, std::uint32_t itemCount) {
    if (result == Visibility::culled) found.culled += itemCount;
    if (result == Visibility::occluded) found.occluded += itemCount;
    return result == Visibility::visible;
  };
  const auto testItem = [&](std::uint32_t item, const scene::Aabb& box) {
    if (itemGeneration_[item] == generation_ || items_[item].object + 1 == hiddenEntity) return;
    if (count(visibility.test(visibility.toEyeSpace(box), depth), 1)) found.items.push_back(item);
  };
  const Vec3 eyeFromTree = visibility.toEyeSpace({tree_.origin, tree_.origin}).centre;
  std::array<collision::BoxTree::Branch, collision::kMaxTreeDepth> stack;
  std::size_t height = 0;
  if (!tree_.empty()) stack[height++] = tree_.root;
  while (height > 0) {  // each branch once
    const collision::BoxTree::Branch branch = stack[--height];
    if (branch.isLeaf()) {
      for (std::uint32_t i = 0; i < branch.count; ++i) {
        const std::uint32_t item = itemOfTreeEntry_[branch.first + i];
        testItem(item, items_[item].box);
      }
      continue;
    }
    const bool drawn = nodeGeneration_[branch.first] == generation_;
    if (!drawn && !count(visibility.testWhole(toEyeSpaceAabb(branch.box, eyeFromTree), depth),
                         subtreeItemCount_[branch.first]))
      continue;
    ENFILADE_ASSERT(height + 2 <= stack.size());
    for (const auto& child : tree_.nodes[branch.first].children) stack[height++] = child;
  }
  for (const std::uint32_t item : dynamicItems_)
    testItem(item, computeItemAabb(items_[item], bodies));
  std::sort(found.items.begin(), found.items.end());
  return found;
}

}  // namespace enfilade::render
