// Bounding volume test tree (BVTT) traversal with front tracking.
//
// Steps
//  1. Until the boxes of two links overlap, their trees are not traversed and not even built.
//  2. If the boxes of two branches overlap, the traversal descends into the larger branch. The
//     pairs where it ends (separated boxes, or two parts) are the front.
//  3. The next tick starts at the last front (Ehmann and Lin 2001, "Accurate and fast proximity
//     queries between polyhedra using convex surface decomposition", section 5.2; after Klosowski
//     1998). If a pair of the front now overlaps, the traversal continues below it. If two siblings
//     are separated and their parents are, too, the front is raised to the parents.
//  4. World boxes are computed on demand from the boxes in the frame of the piece: of a branch from
//     its centre and half extents by |R|, of a part from its vertices.
// Departures: the choice of the branch to descend depends on the sizes in the frames of the pieces,
// not on the poses. Each pair of branches thus has one parent, and the front needs no tree. It is
// an array in traversal order, in which siblings are adjacent.
//
// Parent of (a, b). Sizes do not increase downwards. The traversal descends the ancestors of a and
// of b in descending order of size, A first among equals (a merge of two sorted lists). The last
// one is the smaller of the two parents, B's among equals.
//
// Rounding. The error of a rotated and translated vertex is less than 8u M, M = |t| + 3r (rows of a
// rotation have a 1-norm below 2). The box of a part is inflated by 16u M. The box of a branch has
// the same error and is inflated by 64u M, so that it contains the computed boxes of its parts.
#include "collision/compound/compound_shape.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"

namespace enfilade::collision {
namespace {

constexpr double kPartPad = 16 * kRoundoff;    // see the head of this file
constexpr double kBranchPad = 64 * kRoundoff;  // see the head of this file

double computeMagnitude(const PlacedCompound& placed) {
  return placed.translation.cwiseAbs().maxCoeff() +
         3 * placed.shape->radius() * std::max(1.0, placed.rotation.cwiseAbs().maxCoeff());
}

/// Conservative world box of a box in the frame of the piece.
Aabb computeRotatedAabb(const PlacedCompound& placed, const Vec3& centre, const Vec3& half) {
  const Vec3 middle = placed.rotation * centre + placed.translation;
  const Vec3 halfExtent = placed.rotation.cwiseAbs() * half;
  return inflated(Aabb{middle - halfExtent, middle + halfExtent},
                  kBranchPad * computeMagnitude(placed));
}

Aabb computePieceAabb(const PlacedCompound& placed) {
  const Aabb& box = placed.shape->box();
  return computeRotatedAabb(placed, box.centre(), 0.5 * box.size());
}

using Branch = BoxTree::Branch;

Aabb computeBranchAabb(const PlacedCompound& placed, const CompoundShape::Bvh& tree,
                       const Branch& branch) {
  if (branch.isLeaf()) return computeAabb(placed, tree.tree.order[branch.first]);
  const FloatAabb& box = branch.box;
  const Vec3 min(box.min[0], box.min[1], box.min[2]), max(box.max[0], box.max[1], box.max[2]);
  return computeRotatedAabb(placed, 0.5 * (min + max) + tree.tree.origin, 0.5 * (max - min));
}

/// One link with its tree and the world boxes of this tick.
class LinkTraversal {
 public:
  LinkTraversal(const PlacedCompound& placed, CompoundCache::LinkAabbs& boxes, CompoundCache& cache)
      : placed_(placed), tree_(placed.shape->bvh()), boxes_(boxes), cache_(cache) {
    boxes_.boxes.resize(2 * tree_.tree.nodes.size() + 1);
    boxes_.computedAt.resize(boxes_.boxes.size(), 0);
  }

  const Branch& operator[](std::uint32_t branch) const { return tree_.branch(branch); }
  std::uint32_t parent(std::uint32_t branch) const { return tree_.branchOfNode[(branch - 1) / 2]; }
  std::uint32_t firstChild(std::uint32_t branch) const { return 2 * (*this)[branch].first + 1; }
  std::uint32_t part(std::uint32_t leaf) const {
    ENFILADE_ASSERT((*this)[leaf].count == 1);
    return tree_.tree.order[(*this)[leaf].first];
  }

  const Aabb& box(std::uint32_t branch) {
    if (boxes_.computedAt[branch] != cache_.tick) {
      boxes_.boxes[branch] = computeBranchAabb(placed_, tree_, (*this)[branch]);
      boxes_.computedAt[branch] = cache_.tick;
      ++cache_.aabbsComputed;
    }
    return boxes_.boxes[branch];
  }

 private:
  const PlacedCompound& placed_;
  const CompoundShape::Bvh& tree_;
  CompoundCache::LinkAabbs& boxes_;
  CompoundCache& cache_;
};

using BvttFrontEntry = CompoundCache::BvttFrontEntry;

/// Traversal of the trees of two links, from one front to the next.
class BvttTraversal {
 public:
  BvttTraversal(LinkTraversal a, LinkTraversal b, double clearance, CompoundCache& cache)
      : a_(a), b_(b), clearance_(clearance), cache_(cache) {}

  /// Replaces the front by that of this tick. Calls onOverlap(part of A, part of B) for each
  /// overlapping pair.
  template <typename OnOverlap>
  void run(std::vector<BvttFrontEntry>& front, const OnOverlap& onOverlap) {
    if (front.empty()) front.push_back({0, 0, true});
    next_.reserve(front.size());
    for (const BvttFrontEntry& pair : front) descend(pair, onOverlap);
    front.swap(next_);
  }

 private:
  bool areSeparated(std::uint32_t a, std::uint32_t b) {
    ++cache_.aabbTests;
    return !overlaps(inflated(a_.box(a), clearance_), b_.box(b));
  }

  bool shouldOpenA(std::uint32_t a, std::uint32_t b) const {
    if (a_[a].isLeaf()) return false;
    return b_[b].isLeaf() || computeBranchSize(a_[a]) >= computeBranchSize(b_[b]);
  }

  template <typename OnOverlap>
  void descend(const BvttFrontEntry& from, const OnOverlap& onOverlap) {
    std::array<BvttFrontEntry, 2 * kMaxTreeDepth + 2> stack;
    std::size_t depth = 0;
    stack[depth++] = from;
    while (depth > 0) {  // each pair of branches once
      BvttFrontEntry pair = stack[--depth];
      ENFILADE_ASSERT(depth + 2 <= stack.size());
      pair.separated = areSeparated(pair.a, pair.b);
      const bool bothLeaves = a_[pair.a].isLeaf() && b_[pair.b].isLeaf();
      if (pair.separated || bothLeaves) {
        if (!pair.separated) onOverlap(a_.part(pair.a), b_.part(pair.b));
        next_.push_back(pair);
        if (pair.separated) raiseFront();
      } else if (shouldOpenA(pair.a, pair.b)) {
        const std::uint32_t child = a_.firstChild(pair.a);
        stack[depth++] = {child + 1, pair.b, true};
        stack[depth++] = {child, pair.b, true};
      } else {
        const std::uint32_t child = b_.firstChild(pair.b);
        stack[depth++] = {pair.a, child + 1, true};
        stack[depth++] = {pair.a, child, true};
      }
    }
  }

  BvttFrontEntry findParent(const BvttFrontEntry& pair) const {
    const bool openedA =
        pair.b == 0 || (pair.a != 0 && computeBranchSize(a_[a_.parent(pair.a)]) <
                                           computeBranchSize(b_[b_.parent(pair.b)]));
    return openedA ? BvttFrontEntry{a_.parent(pair.a), pair.b, true}
                   : BvttFrontEntry{pair.a, b_.parent(pair.b), true};
  }

  /// Replaces the last two front pairs by their parent while they are siblings, and they and their
  /// parent are separated.
  void raiseFront() {
    while (next_.size() >= 2) {
      const BvttFrontEntry &last = next_.back(), &before = next_[next_.size() - 2];
      if (!before.separated || (last.a == 0 && last.b == 0) || (before.a == 0 && before.b == 0))
        return;
      const BvttFrontEntry parent = findParent(last), other = findParent(before);
      if (parent.a != other.a || parent.b != other.b || !areSeparated(parent.a, parent.b)) return;
      next_.pop_back();
      next_.back() = parent;
    }
  }

  LinkTraversal a_, b_;
  double clearance_;
  CompoundCache& cache_;
  std::vector<BvttFrontEntry> next_;
};

/// Carries the feature caches of unchanged pairs over to the new list.
void carryOverFeatures(CompoundCache& cache, const std::vector<PartPair>& oldPairs,
                       const std::vector<FeatureCache>& oldFeatures) {
  ENFILADE_ASSERT(oldPairs.size() == oldFeatures.size());
  std::size_t old = 0;
  cache.features.clear();
  for (const PartPair& pair : cache.pairs) {
    while (old < oldPairs.size() && oldPairs[old] < pair) ++old;
    const bool known = old < oldPairs.size() && oldPairs[old] == pair;
    cache.features.push_back(known ? oldFeatures[old] : FeatureCache{});
  }
}

PlacedConvex placePart(const PlacedCompound& placed, std::uint32_t part) {
  return {placed.shape->vertices(part), placed.translation, &placed.rotation,
          placed.shape->hull(part)};
}

bool isCloser(const SeparationResult& separation, const std::optional<CompoundSeparation>& than) {
  if (!than) return true;
  if (separation.verdict != than->separation.verdict)
    return separation.verdict > than->separation.verdict;
  return separation.distance < than->separation.distance;
}

}  // namespace

// ---- CompoundShape -----------------------------------------------------------------------------

struct CompoundShape::LazyBvh {
  std::once_flag once;
  std::atomic<bool> built = false;
  Bvh bvh;
};

CompoundShape::CompoundShape(std::vector<Hull> hulls)
    : hulls_(std::move(hulls)), lazy_(std::make_unique<LazyBvh>()) {
  for (const Hull& hull : hulls_) {
    for (const Vec3& v : hull.vertices) box_.include(v);
    radius_ = std::max(radius_, hull.radius);
  }
}

CompoundShape::CompoundShape(std::vector<Triangle> triangles)
    : triangles_(std::move(triangles)), lazy_(std::make_unique<LazyBvh>()) {
  for (const Triangle& t : triangles_) {
    for (const Vec3& v : t) {
      box_.include(v);
      radius_ = std::max(radius_, v.norm());
    }
  }
}

CompoundShape::~CompoundShape() = default;
CompoundShape::CompoundShape(CompoundShape&&) noexcept = default;

std::uint32_t CompoundShape::size() const {
  return static_cast<std::uint32_t>(hulls_.size() + triangles_.size());
}

std::span<const Vec3> CompoundShape::vertices(std::uint32_t part) const {
  if (hulls_.empty()) return triangles_[part];
  return hulls_[part].vertices;
}

const Hull* CompoundShape::hull(std::uint32_t part) const {
  return hulls_.empty() ? nullptr : &hulls_[part];
}

bool CompoundShape::isBvhBuilt() const {
  return lazy_->built;
}

const CompoundShape::Bvh& CompoundShape::bvh() const {
  std::call_once(lazy_->once, [this] {
    std::vector<Aabb> boxes(size());
    for (std::uint32_t part = 0; part < size(); ++part)
      for (const Vec3& v : vertices(part)) boxes[part].include(v);
    Bvh& result = lazy_->bvh;
    result.tree = buildBoxTree(boxes, 1);
    ENFILADE_ASSERT(result.tree.order.size() == size());
    result.branchOfNode.assign(result.tree.nodes.size(), 0);
    for (std::uint32_t k = 0; k < result.tree.nodes.size(); ++k)
      for (std::uint32_t side = 0; side < 2; ++side) {
        const Branch& child = result.tree.nodes[k].children[side];
        if (!child.isLeaf()) result.branchOfNode[child.first] = 2 * k + 1 + side;
      }
    lazy_->built = true;
  });
  return lazy_->bvh;
}

// ---- queries -----------------------------------------------------------------------------------

Aabb computeAabb(const PlacedCompound& placed, std::uint32_t part) {
  Aabb box;
  for (const Vec3& v : placed.shape->vertices(part))
    box.include(Vec3(placed.rotation * v + placed.translation));
  return inflated(box, kPartPad * computeMagnitude(placed));
}

const std::vector<PartPair>& findOverlappingParts(std::span<const PlacedCompound> a,
                                                  std::span<const PlacedCompound> b,
                                                  double clearance, CompoundCache& cache) {
  ++cache.tick;
  cache.fronts.resize(a.size() * b.size());
  cache.boxesA.resize(a.size());
  cache.boxesB.resize(b.size());
  const std::vector<PartPair> oldPairs = std::move(cache.pairs);
  const std::vector<FeatureCache> oldFeatures = std::move(cache.features);
  cache.pairs.clear();
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    if (a[i].shape->size() == 0) continue;
    const Aabb boxA = inflated(computePieceAabb(a[i]), clearance);
    for (std::uint32_t j = 0; j < b.size(); ++j) {
      auto& front = cache.fronts[i * b.size() + j];
      ++cache.aabbTests;
      if (b[j].shape->size() == 0 || !overlaps(boxA, computePieceAabb(b[j]))) {
        front.clear();
        continue;
      }
      BvttTraversal descent({a[i], cache.boxesA[i], cache}, {b[j], cache.boxesB[j], cache},
                            clearance, cache);
      descent.run(front, [&](std::uint32_t partA, std::uint32_t partB) {
        cache.pairs.push_back({i, partA, j, partB});
      });
    }
  }
  std::sort(cache.pairs.begin(), cache.pairs.end());
  ENFILADE_ASSERT(std::ranges::adjacent_find(cache.pairs) == cache.pairs.end());
  carryOverFeatures(cache, oldPairs, oldFeatures);
  return cache.pairs;
}

std::optional<CompoundSeparation> computeCompoundSeparation(std::span<const PlacedCompound> a,
                                                            std::span<const PlacedCompound> b,
                                                            double clearance,
                                                            CompoundCache& cache) {
  const std::vector<PartPair>& pairs = findOverlappingParts(a, b, clearance, cache);
  std::optional<CompoundSeparation> closest;
  double limit = clearance;
  const auto consider = [&](std::size_t i) {
    const PartPair& pair = pairs[i];
    ++cache.separationQueries;
    const auto separation =
        computeSeparationWithin(placePart(a[pair.linkA], pair.partA),
                                placePart(b[pair.linkB], pair.partB), limit, cache.features[i]);
    if (!separation || !isCloser(*separation, closest)) return;
    closest = CompoundSeparation{pair, *separation};
    limit = std::min(limit, separation->distance + separation->errorBound);
  };
  const auto last = std::lower_bound(pairs.begin(), pairs.end(), cache.witnessPair);
  const bool known = last != pairs.end() && *last == cache.witnessPair;
  const auto first = static_cast<std::size_t>(last - pairs.begin());
  if (known) consider(first);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (closest && closest->separation.verdict == Verdict::penetrating) break;
    if (!known || i != first) consider(i);
  }
  if (closest) cache.witnessPair = closest->pair;
  return closest;
}

}  // namespace enfilade::collision
