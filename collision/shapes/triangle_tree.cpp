#include "collision/shapes/triangle_tree.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

// Chosen by measurement of mesh queries on 50,880 triangles: 2 and 8 are slower.
constexpr std::uint32_t kLeafSize = 4;

BoxTree buildTree(const std::vector<Triangle>& triangles) {
  std::vector<Aabb> boxes;
  boxes.reserve(triangles.size());
  for (const Triangle& t : triangles) boxes.push_back(computeAabb(t));
  return buildBoxTree(boxes, kLeafSize);
}

}  // namespace

TriangleTree::TriangleTree(const std::vector<Triangle>& triangles) : tree_(buildTree(triangles)) {
  triangles_.reserve(triangles.size());
  for (const std::uint32_t i : tree_.order) triangles_.push_back(triangles[i]);
}

void TriangleTree::query(const Aabb& box, std::vector<std::uint32_t>& indices) const {
  const auto begin = static_cast<std::ptrdiff_t>(indices.size());
  forEachOverlappingLeaf(tree_, toFloatAabb(box, tree_.origin),
                         [&](std::uint32_t first, std::uint32_t count) {
                           for (std::uint32_t i = first; i < first + count; ++i)
                             if (overlaps(computeAabb(triangles_[i]), box)) indices.push_back(i);
                         });
  ENFILADE_ASSERT(std::is_sorted(indices.begin() + begin, indices.end()));
}

}  // namespace enfilade::collision
