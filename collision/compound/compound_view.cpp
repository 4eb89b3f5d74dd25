// Rounding. All values are below M = |translation| + 3 * (extent of the tree), because rows of a
// rotation have a 1-norm below 2. The error of a rotated and translated point or half extent is
// less than 8u M, u = 2^-53. The pad of 128u M covers a branch, a part that others place, and a few
// further operations on both. These are a margin, a subtraction and a square root.
#include "collision/compound/compound_view.hpp"

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"

namespace enfilade::collision {

Aabb computeBranchAabb(const CompoundView& view, const BoxTree::Branch& branch) {
  const FloatAabb& box = branch.box;
  const Vec3 min(box.min[0], box.min[1], box.min[2]), max(box.max[0], box.max[1], box.max[2]);
  const Vec3 middle = view.rotation * (0.5 * (min + max) + view.tree->origin) + view.translation;
  const Vec3 halfExtent = view.rotation.cwiseAbs() * (0.5 * (max - min));
  return {middle - halfExtent, middle + halfExtent};
}

double computeRoundingPad(const CompoundView& view) {
  const double extent = view.tree->origin.cwiseAbs().maxCoeff() + view.tree->extent;
  return 128 * kRoundoff * (view.translation.cwiseAbs().maxCoeff() + 3 * extent);
}

Aabb computeAabb(const CompoundView& view) {
  return inflate(computeBranchAabb(view, view.tree->root), computeRoundingPad(view));
}

bool shouldOpenFirst(const BoxTree::Branch& a, const BoxTree::Branch& b) {
  ENFILADE_ASSERT(!a.isLeaf() || !b.isLeaf());
  if (a.isLeaf()) return false;
  return b.isLeaf() || computeBranchSize(a) >= computeBranchSize(b);
}

}  // namespace enfilade::collision
