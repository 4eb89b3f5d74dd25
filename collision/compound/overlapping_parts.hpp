// Pairs of overlapping parts of two compound objects that are in motion, from call to call.
#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/compound/compound_view.hpp"

namespace enfilade::collision {

/// An object and the boxes of its parts. A part's index is that of its box in the tree's input.
struct PartBounds {
  const CompoundView& view;
  /// By part: world box of the part at the view's pose, inflated by `margin`. Rounding errors below
  /// half of computeRoundingPad() are permitted.
  std::span<const Aabb> boxes;
  double margin = 0;  ///< metres, >= 0; may change from call to call
};

struct PartPair {
  std::uint32_t a = 0, b = 0;
  auto operator<=>(const PartPair&) const = default;
};

/// The nodes at which the last descent of two trees ended. It holds for these two trees and is
/// reset, at the cost of a descent, with others. A tree is known by its address and size. Poses may
/// change arbitrarily. The pairs found never depend on it.
struct PartFront {
  /// Two branches. Branch 0 is the root; 2k + 1 and 2k + 2 are the children of node k.
  struct Entry {
    std::uint32_t a = 0, b = 0;
    double separatedUntil = 0;  ///< separated while `clock` + both margins are less; negative:
                                ///< parts of two leaves overlap
  };
  struct Object {
    const BoxTree* tree = nullptr;
    std::size_t size = 0;                     ///< number of parts
    Mat3 rotation;                            ///< of the last call
    Vec3 translation;                         ///< of the last call
    std::vector<std::uint32_t> branchOfNode;  ///< inverse of Branch::first
    std::vector<Aabb> boxes;                  ///< by branch, with the margin, computed on demand
    std::vector<std::uint64_t> computedAt;    ///< by branch: `calls` when its box was computed
  };
  std::vector<Entry> entries;  ///< in the order of the descent, siblings adjacent
  Object a, b;
  double clock = 0;  ///< metres, upper bound: motions of A and B so far, summed
  std::uint64_t calls = 0, aabbTests = 0;  ///< counters
};

/// Replaces `pairs` by the pairs of parts whose boxes in `a` and `b` overlap: exactly those for
/// which overlaps() is true, ascending.
void findOverlappingParts(const PartBounds& a, const PartBounds& b, PartFront& front,
                          std::vector<PartPair>& pairs);

}  // namespace enfilade::collision
