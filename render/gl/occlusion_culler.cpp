// The tree is descended from the root. Above what is drawn there is nothing to ask: something under
// such a node is seen. What hangs beside those paths is asked for as a whole first (J. Bittner,
// M. Wimmer, H. Piringer, W. Purgathofer 2004, "Coherent hierarchical culling", with a depth
// pyramid in place of the queries), so that the cost follows what is seen and not the scene.
#include "render/gl/occlusion_culler.hpp"

#include <algorithm>

namespace enfilade::render {
namespace {

constexpr std::uint32_t kLeafSize = 4;
constexpr std::uint32_t kNone = 0xFFFF'FFFFu;

EyeBox relative(const collision::NarrowBox& box, const Vec3& eyeFromTree) {
  EyeBox result;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const double low = box.min[i], high = box.max[i];
    result.centre[axis] = 0.5 * (low + high) + eyeFromTree[axis];
    result.half[axis] = 0.5 * (high - low);
  }
  return result;
}

}  // namespace

PartSearch::PartSearch(const std::vector<Part>& parts) : parts_(parts) {
  std::vector<scene::Box> boxes;
  std::vector<std::uint32_t> still;
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    if (parts[p].body != kStill) {
      moving_.push_back(p);
    } else if (!parts[p].box.empty()) {
      still.push_back(p);
      boxes.push_back(parts[p].box);
    }
  }
  tree_ = collision::buildBoxTree(boxes, kLeafSize);
  for (const std::uint32_t item : tree_.order) partOfItem_.push_back(still[item]);
  nodeOfPart_.assign(parts.size(), kNone);
  partTurn_.assign(parts.size(), 0);
  parent_.assign(tree_.nodes.size(), 0);
  held_.assign(tree_.nodes.size(), 0);
  nodeTurn_.assign(tree_.nodes.size(), 0);
  if (!tree_.nodes.empty()) link(0);
}

/// Fills parent_, held_ and nodeOfPart_ below `node`; returns how many parts it holds.
std::uint32_t PartSearch::link(std::uint32_t node) {
  std::uint32_t count = 0;
  for (const collision::BoxTree::Branch& branch : tree_.nodes[node].children) {
    if (branch.isLeaf()) {
      for (std::uint32_t i = 0; i < branch.count; ++i)
        nodeOfPart_[partOfItem_[branch.first + i]] = node;
      count += branch.count;
    } else {
      parent_[branch.first] = node;
      count += link(branch.first);
    }
  }
  return held_[node] = count;
}

void PartSearch::markDrawn(const std::vector<std::uint32_t>& parts) {
  ++turn_;
  for (const std::uint32_t part : parts) {
    partTurn_[part] = turn_;
    std::uint32_t node = nodeOfPart_[part];
    while (node != kNone && nodeTurn_[node] != turn_) {  // up to the root, or where another was
      nodeTurn_[node] = turn_;
      node = parent_[node];
    }
  }
}

PartSearch::Found PartSearch::search(const BoxSight& sight, const DepthPyramid& depth,
                                     const std::vector<BodyPlacement>& bodies,
                                     scene::EntityId hidden) const {
  Found found;
  const auto count = [&](Sight what, std::uint32_t parts) {
    if (what == Sight::outside) found.outside += parts;
    if (what == Sight::hidden) found.hidden += parts;
    return what == Sight::maybe;
  };
  const auto lookAt = [&](std::uint32_t part, const scene::Box& box) {
    if (partTurn_[part] == turn_ || parts_[part].object + 1 == hidden) return;
    if (count(sight.look(sight.relative(box), depth), 1)) found.parts.push_back(part);
  };
  const Vec3 eyeFromTree = sight.relative({tree_.origin, tree_.origin}).centre;
  std::array<collision::BoxTree::Branch, collision::kTreeDepthBound> stack;
  std::size_t height = 0;
  if (!tree_.empty()) stack[height++] = tree_.root;
  while (height > 0) {  // each branch once
    const collision::BoxTree::Branch branch = stack[--height];
    if (branch.isLeaf()) {
      for (std::uint32_t i = 0; i < branch.count; ++i) {
        const std::uint32_t part = partOfItem_[branch.first + i];
        lookAt(part, parts_[part].box);
      }
      continue;
    }
    const bool drawn = nodeTurn_[branch.first] == turn_;
    if (!drawn &&
        !count(sight.glance(relative(branch.box, eyeFromTree), depth), held_[branch.first]))
      continue;
    for (const auto& child : tree_.nodes[branch.first].children) stack[height++] = child;
  }
  for (const std::uint32_t part : moving_) lookAt(part, placedBox(parts_[part], bodies));
  std::sort(found.parts.begin(), found.parts.end());
  return found;
}

}  // namespace enfilade::render
