// Built top down: the triangles of a node are halved at the median of their centres along the
// longest axis of those centres. The index breaks ties, so that the halves are the same sets with
// every standard library, and leaves are sorted, so that the order is one as well. Queried depth
// first without recursion.
#include "collision/triangle_tree.hpp"

#include <algorithm>
#include <numeric>

namespace enfilade::collision {
namespace {

constexpr std::uint32_t kLeafSize = 4;
constexpr std::size_t kDepthBound = 64;  // halving 2^32 triangles ends after 32 levels

Box boxOf(const Triangle& t) {
  return {t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2])};
}

}  // namespace

TriangleTree::TriangleTree(std::vector<Triangle> triangles) {
  std::vector<std::uint32_t> order(triangles.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<Box> boxes;
  boxes.reserve(triangles.size());
  for (const Triangle& t : triangles) boxes.push_back(boxOf(t));

  struct Task {
    std::uint32_t first, last;
    std::int64_t parent;  ///< node whose right child this is, or -1
  };
  std::vector<Task> tasks;
  if (!triangles.empty()) tasks.push_back({0, static_cast<std::uint32_t>(triangles.size()), -1});
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    if (task.parent >= 0) nodes_[task.parent].first = index;
    Node node;
    Box centres;
    for (std::uint32_t i = task.first; i < task.last; ++i) {
      node.box.include(boxes[order[i]]);
      centres.include(boxes[order[i]].centre());
    }
    if (task.last - task.first <= kLeafSize) {
      std::sort(order.begin() + task.first, order.begin() + task.last);
      node.first = task.first;
      node.count = task.last - task.first;
      nodes_.push_back(node);
      continue;
    }
    nodes_.push_back(node);
    int axis = 0;
    centres.size().maxCoeff(&axis);
    const std::uint32_t middle = task.first + (task.last - task.first) / 2;
    std::nth_element(order.begin() + task.first, order.begin() + middle, order.begin() + task.last,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double ca = boxes[a].min[axis] + boxes[a].max[axis];
                       const double cb = boxes[b].min[axis] + boxes[b].max[axis];
                       return ca != cb ? ca < cb : a < b;
                     });
    tasks.push_back({middle, task.last, index});
    tasks.push_back({task.first, middle, -1});
  }
  triangles_.reserve(triangles.size());
  for (const std::uint32_t i : order) triangles_.push_back(triangles[i]);
}

void TriangleTree::query(const Box& box, std::vector<std::uint32_t>& indices) const {
  if (nodes_.empty()) return;
  std::array<std::uint32_t, kDepthBound> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t index = stack[--depth];
    const Node& node = nodes_[index];
    if (!overlaps(node.box, box)) continue;
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
      if (overlaps(boxOf(triangles_[i]), box)) indices.push_back(i);
    if (node.count > 0) continue;
    stack[depth++] = node.first;
    stack[depth++] = index + 1;
  }
}

}  // namespace enfilade::collision
