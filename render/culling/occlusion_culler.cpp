// Traverses the tree from the root, once for all views: each node with the views that may see it.
// A view does not test the nodes above its drawn items, because they contain a visible item. All
// other subtrees are tested as a whole first (J. Bittner, M. Wimmer, H. Piringer, W. Purgathofer
// 2004, "Coherent hierarchical culling", with a depth pyramid instead of occlusion queries). The
// cost depends on the visible items and not on the scene's size.
#include "render/culling/occlusion_culler.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

// Items. With fewer there are more nodes to test; with more, a leaf with one visible item has more
// items to test one by one.
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

/// Calls `each` with the number of each set bit, ascending.
template <class Each>
void forEachBit(std::uint64_t bits, const Each& each) {
  for (; bits != 0; bits &= bits - 1) each(static_cast<std::size_t>(std::countr_zero(bits)));
}

}  // namespace

OcclusionCuller::OcclusionCuller(std::span<const DrawItem> items) : items_(items) {
  std::vector<scene::Aabb> boxes;
  std::vector<std::uint32_t> staticItems;
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    if (!items[i].isStatic()) {
      dynamicItems_.push_back(i);
    } else if (!items[i].box.empty()) {
      staticItems.push_back(i);
      boxes.push_back(items[i].box);
    }
  }
  tree_ = collision::buildBoxTree(boxes, kLeafSize);
  for (const std::uint32_t item : tree_.order) itemOfTreeEntry_.push_back(staticItems[item]);
  nodeOfItem_.assign(items.size(), kNoNode);
  itemMarks_.assign(items.size(), {});
  parent_.assign(tree_.nodes.size(), 0);
  subtreeItemCount_.assign(tree_.nodes.size(), 0);
  nodeMarks_.assign(tree_.nodes.size(), {});
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

/// Whether the mark lacked the view.
bool OcclusionCuller::addMark(Mark& mark, std::uint64_t view) {
  if (mark.generation != generation_) mark = {generation_, 0};
  const bool isNew = (mark.views & view) == 0;
  mark.views |= view;
  return isNew;
}

void OcclusionCuller::markVisible(const std::vector<std::uint32_t>& items, std::uint64_t view) {
  for (const std::uint32_t item : items) {
    ENFILADE_ASSERT(item < items_.size());
    addMark(itemMarks_[item], view);
    std::uint32_t node = nodeOfItem_[item];
    while (node != kNoNode && addMark(nodeMarks_[node], view)) node = parent_[node];
  }
}

/// One traversal for all views.
struct OcclusionCuller::CullingPass {
  const OcclusionCuller& culler;
  std::span<const CullingView> views;
  std::vector<CullingResult> found;  ///< one per view
  std::vector<Vec3> eyeFromTree;     ///< one per view

  CullingPass(const OcclusionCuller& one, std::span<const CullingView> all)
      : culler(one), views(all), found(all.size()) {
    const Vec3& origin = culler.tree_.origin;
    for (const CullingView& view : views)
      eyeFromTree.push_back(view.visibility.toEyeSpace({origin, origin}).centre);
  }

  bool count(std::size_t v, Visibility result, std::uint32_t itemCount) {
    if (result == Visibility::culled) found[v].culled += itemCount;
    if (result == Visibility::occluded) found[v].occluded += itemCount;
    return result == Visibility::visible;
  }

  void testItem(std::uint32_t item, std::size_t v, const scene::Aabb& box) {
    const CullingView& view = views[v];
    if (culler.items_[item].object + 1 == view.hiddenEntity) return;
    if (count(v, view.visibility.test(view.visibility.toEyeSpace(box), view.depth), 1))
      found[v].items.push_back(item);
  }

  void testStaticItem(std::uint32_t item, std::uint64_t untested) {
    forEachBit(untested & ~culler.getMarkedViews(culler.itemMarks_[item]),
               [&](std::size_t v) { testItem(item, v, culler.items_[item].box); });
  }

  void testDynamicItem(std::uint32_t item, std::uint64_t untested) {
    const std::vector<BodyPlacement>* bodies = nullptr;  // to which `box` belongs
    scene::Aabb box;
    forEachBit(untested & ~culler.getMarkedViews(culler.itemMarks_[item]), [&](std::size_t v) {
      if (bodies != &views[v].bodies) box = computeItemAabb(culler.items_[item], views[v].bodies);
      bodies = &views[v].bodies;
      testItem(item, v, box);
    });
  }

  /// The views that may see something below the branch.
  std::uint64_t testBranch(const collision::BoxTree::Branch& branch, std::uint64_t untested) {
    std::uint64_t seeing = untested & culler.getMarkedViews(culler.nodeMarks_[branch.first]);
    forEachBit(untested & ~seeing, [&](std::size_t v) {
      const EyeSpaceAabb box = toEyeSpaceAabb(branch.box, eyeFromTree[v]);
      if (count(v, views[v].visibility.testWhole(box, views[v].depth),
                culler.subtreeItemCount_[branch.first]))
        seeing |= std::uint64_t{1} << v;
    });
    return seeing;
  }

  void testTree(std::uint64_t all) {
    struct Pending {
      collision::BoxTree::Branch branch;
      std::uint64_t views;
    };
    const collision::BoxTree& tree = culler.tree_;
    std::array<Pending, collision::kMaxTreeDepth> stack;
    std::size_t height = 0;
    if (!tree.empty()) stack[height++] = {tree.root, all};
    while (height > 0) {  // each branch once
      const auto [branch, untested] = stack[--height];
      if (branch.isLeaf()) {
        for (std::uint32_t i = 0; i < branch.count; ++i) {
          testStaticItem(culler.itemOfTreeEntry_[branch.first + i], untested);
        }
        continue;
      }
      const std::uint64_t seeing = testBranch(branch, untested);
      if (seeing == 0) continue;
      ENFILADE_ASSERT(height + 2 <= stack.size());
      for (const auto& child : tree.nodes[branch.first].children) stack[height++] = {child, seeing};
    }
  }
};

std::vector<OcclusionCuller::CullingResult> OcclusionCuller::findVisible(
    std::span<const CullingView> views) {
  ENFILADE_ASSERT(!views.empty() && views.size() <= kMaxViews);
  ++generation_;
  std::uint64_t all = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    markVisible(views[v].drawn, std::uint64_t{1} << v);
    all |= std::uint64_t{1} << v;
  }
  CullingPass pass(*this, views);
  pass.testTree(all);
  for (const std::uint32_t item : dynamicItems_) pass.testDynamicItem(item, all);
  for (CullingResult& result : pass.found) std::sort(result.items.begin(), result.items.end());
  return std::move(pass.found);
}

}  // namespace enfilade::render
