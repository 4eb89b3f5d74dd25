// Best-first traversal of two trees (Hjaltason and Samet 1998, "Incremental distance join
// algorithms for spatial databases"). Of all open pairs of branches, the pair with the nearest
// boxes is expanded: the larger branch is replaced by its children. Two leaves are tested exactly.
// The search ends when the nearest open boxes are farther apart than the nearest parts so far. Two
// large meshes that are far apart thus cost a few paths through their trees. The cost of the search
// is known while it runs.
//
// Ties (all overlapping boxes have distance 0) are broken in favour of the last pair. This is a
// depth-first descent to penetrating parts, which end the search, with few open pairs.
//
// The rounding pad of both objects (compound_view.cpp) is deducted from each gap.
#include "collision/compound/nearest_parts.hpp"

#include <algorithm>
#include <queue>
#include <vector>

namespace enfilade::collision {
namespace {

using Branch = BoxTree::Branch;

struct OpenBranch {
  const CompoundView* view;
  const Branch* branch;
};

struct OpenPair {
  double gap;  ///< lower bound of the distance of all parts below, metres
  std::uint64_t number;
  OpenBranch a, b;

  bool operator<(const OpenPair& other) const {  // the queue pops the maximum first
    return gap != other.gap ? gap > other.gap : number < other.number;
  }
};

/// Distance of two boxes, at least 0. `pad`: rounding error of both.
double computeGap(const Aabb& a, const Aabb& b, double pad) {
  return std::max(0.0, computeGap(a, b) - pad);
}

/// World box of the i-th item of a leaf.
Aabb computeItemAabb(const OpenBranch& leaf, std::uint32_t i) {
  const CompoundView& view = *leaf.view;
  return view.box ? view.box(leaf.branch->first + i) : computeBranchAabb(view, *leaf.branch);
}

PlacedConvex placeItem(const OpenBranch& leaf, std::uint32_t i) {
  return leaf.view->part(leaf.branch->first + i);
}

class BestFirstSearch {
 public:
  BestFirstSearch(double within, std::size_t& budget) : limit_(within), budget_(budget) {}

  void pushPair(const OpenBranch& a, const OpenBranch& b) {
    const double gap =
        computeGap(computeBranchAabb(*a.view, *a.branch), computeBranchAabb(*b.view, *b.branch),
                   computeRoundingPad(*a.view) + computeRoundingPad(*b.view));
    if (gap <= limit_) open_.push({gap, ++count_, a, b});
  }

  NearestParts run() {
    while (!open_.empty() && best_.separation.verdict != Verdict::penetrating) {
      const OpenPair pair = open_.top();
      open_.pop();
      if (pair.gap > limit_) break;
      if (!spendBudget(1)) return {NearestParts::Outcome::budgetExhausted, {}, {}, {}};
      if (pair.a.branch->isLeaf() && pair.b.branch->isLeaf()) {
        if (!testLeaves(pair)) return {NearestParts::Outcome::budgetExhausted, {}, {}, {}};
      } else {
        expand(pair);
      }
    }
    return best_;
  }

 private:
  bool spendBudget(std::size_t cost) {
    const bool enough = budget_ >= cost;
    budget_ -= std::min(budget_, cost);
    return enough;
  }

  void expand(const OpenPair& pair) {
    const bool first = shouldOpenFirst(*pair.a.branch, *pair.b.branch);
    const OpenBranch& opened = first ? pair.a : pair.b;
    for (const Branch& child : opened.view->tree->nodes[opened.branch->first].children) {
      const OpenBranch one{opened.view, &child};
      if (first) pushPair(one, pair.b);
      if (!first) pushPair(pair.a, one);
    }
  }

  /// Tests all pairs of parts of two leaves. False if the budget is exhausted.
  bool testLeaves(const OpenPair& pair) {
    const double pad = computeRoundingPad(*pair.a.view) + computeRoundingPad(*pair.b.view);
    boxesOfB_.clear();
    for (std::uint32_t k = 0; k < pair.b.branch->count; ++k)
      boxesOfB_.push_back(computeItemAabb(pair.b, k));
    for (std::uint32_t i = 0; i < pair.a.branch->count; ++i) {
      const Aabb box = computeItemAabb(pair.a, i);
      for (std::uint32_t k = 0; k < pair.b.branch->count; ++k) {
        if (!spendBudget(1)) return false;
        if (computeGap(box, boxesOfB_[k], pad) > limit_) continue;
        if (!spendBudget(kSeparationCost)) return false;
        considerParts(placeItem(pair.a, i), placeItem(pair.b, k));
      }
    }
    return true;
  }

  void considerParts(const PlacedConvex& a, const PlacedConvex& b) {
    FeatureCache cache;
    const auto separation = computeSeparationWithin(a, b, limit_, cache);
    if (!separation) return;
    const bool first = best_.outcome == NearestParts::Outcome::outOfRange;
    const SeparationResult& best = best_.separation;
    const bool closer = separation->verdict != best.verdict ? separation->verdict > best.verdict
                                                            : separation->distance < best.distance;
    if (!first && !closer) return;
    best_ = {NearestParts::Outcome::nearest, *separation, a, b};
    limit_ = std::min(limit_, separation->distance + separation->errorBound);
  }

  double limit_;  ///< current search distance, metres
  std::size_t& budget_;
  std::uint64_t count_ = 0;
  std::priority_queue<OpenPair> open_;
  std::vector<Aabb> boxesOfB_;  ///< scratch of testLeaves()
  NearestParts best_;
};

}  // namespace

NearestParts findNearestParts(std::span<const CompoundView> a, std::span<const CompoundView> b,
                              double within, std::size_t& budget) {
  BestFirstSearch search(within, budget);
  for (const CompoundView& one : a)
    for (const CompoundView& other : b)
      if (!one.tree->empty() && !other.tree->empty())
        search.pushPair({&one, &one.tree->root}, {&other, &other.tree->root});
  return search.run();
}

}  // namespace enfilade::collision
