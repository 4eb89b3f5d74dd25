// Steps
//  1. Until the boxes of two links overlap, nothing of them is opened, or even built.
//  2. The descent of two trees opens, of two branches whose boxes overlap, the larger one. The
//     pairs where it ends (boxes apart, or two parts) are its front.
//  3. The next tick starts at the last front (Ehmann and Lin 2001, "Accurate and fast proximity
//     queries between polyhedra using convex surface decomposition", section 5.2; after Klosowski
//     1998). Where a pair of the front now overlaps, the descent goes on from it; where two
//     siblings are apart and so are their parents, the front is raised to the parents.
//  4. World boxes are made from the boxes of the piece's frame when the descent asks for them: of a
//     branch from its centre and half sides by |R|, of a part from its vertices.
// Departures: which branch is opened depends on the sizes in the pieces' own frames, not on the
// poses. So each pair of branches has one parent, and the front needs no tree of its own; it is an
// array in the order of the descent, in which siblings are neighbours.
//
// The parent of (a, b). Sizes do not grow downwards, so the descent opens the branches above a and
// those above b in descending order of size, A first among equals (a merge of two sorted lists).
// The one opened last is the smaller of their two parents, B's among equals.
//
// Rounding. A turned and moved vertex is off by less than 8u M, M = |t| + 3r (rows of a rotation
// have a 1-norm below 2). A part's box takes 16u M outwards. A branch's box is off by as little and
// takes 64u M, so that it holds the boxes of its parts, as computed.
#include "collision/compound/compound_shape.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

namespace enfilade::collision {
namespace {

constexpr double kUnit = 0x1p-53;
constexpr double kPartPad = 16 * kUnit;    // see the file's head
constexpr double kBranchPad = 64 * kUnit;  // see the file's head

double sizeOf(const PlacedParts& placed) {
  return placed.translation.cwiseAbs().maxCoeff() +
         3 * placed.parts->radius() * std::max(1.0, placed.rotation.cwiseAbs().maxCoeff());
}

/// The world box of a box of the piece's frame.
Box turnedBox(const PlacedParts& placed, const Vec3& centre, const Vec3& half) {
  const Vec3 middle = placed.rotation * centre + placed.translation;
  const Vec3 reach = placed.rotation.cwiseAbs() * half;
  return grown(Box{middle - reach, middle + reach}, kBranchPad * sizeOf(placed));
}

Box boxOfPiece(const PlacedParts& placed) {
  const Box& box = placed.parts->box();
  return turnedBox(placed, box.centre(), 0.5 * box.size());
}

using Branch = BoxTree::Branch;

Box boxOfBranch(const PlacedParts& placed, const PartTree::Opened& tree, const Branch& branch) {
  if (branch.isLeaf()) return boxOf(placed, tree.boxes.order[branch.first]);
  const NarrowBox& box = branch.box;
  const Vec3 min(box.min[0], box.min[1], box.min[2]), max(box.max[0], box.max[1], box.max[2]);
  return turnedBox(placed, 0.5 * (min + max) + tree.boxes.origin, 0.5 * (max - min));
}

/// Of branches in one tree, a child's is never greater than its parent's.
double sizeOf(const Branch& branch) {
  double size = 0;
  for (std::size_t i = 0; i < 3; ++i)
    size += static_cast<double>(branch.box.max[i]) - static_cast<double>(branch.box.min[i]);
  return size;
}

/// One link, its tree and this tick's boxes.
class Side {
 public:
  Side(const PlacedParts& placed, PartsCache::LinkBoxes& boxes, PartsCache& cache)
      : placed_(placed), tree_(placed.parts->opened()), boxes_(boxes), cache_(cache) {
    boxes_.boxes.resize(2 * tree_.boxes.nodes.size() + 1);
    boxes_.madeAt.resize(boxes_.boxes.size(), 0);
  }

  const Branch& operator[](std::uint32_t branch) const { return tree_.branch(branch); }
  std::uint32_t parent(std::uint32_t branch) const { return tree_.branchOfNode[(branch - 1) / 2]; }
  std::uint32_t firstChild(std::uint32_t branch) const { return 2 * (*this)[branch].first + 1; }
  std::uint32_t part(std::uint32_t leaf) const { return tree_.boxes.order[(*this)[leaf].first]; }

  const Box& box(std::uint32_t branch) {
    if (boxes_.madeAt[branch] != cache_.tick) {
      boxes_.boxes[branch] = boxOfBranch(placed_, tree_, (*this)[branch]);
      boxes_.madeAt[branch] = cache_.tick;
      ++cache_.boxesMade;
    }
    return boxes_.boxes[branch];
  }

 private:
  const PlacedParts& placed_;
  const PartTree::Opened& tree_;
  PartsCache::LinkBoxes& boxes_;
  PartsCache& cache_;
};

using FrontPair = PartsCache::FrontPair;

/// The descent of two links' trees, from one front to the next.
class Descent {
 public:
  Descent(Side a, Side b, double clearance, PartsCache& cache)
      : a_(a), b_(b), clearance_(clearance), cache_(cache) {}

  /// Replaces the front by this tick's, and calls take(part of A, part of B) for overlapping ones.
  template <typename Take>
  void run(std::vector<FrontPair>& front, const Take& take) {
    if (front.empty()) front.push_back({0, 0, true});
    next_.reserve(front.size());
    for (const FrontPair& pair : front) open(pair, take);
    front.swap(next_);
  }

 private:
  bool areApart(std::uint32_t a, std::uint32_t b) {
    ++cache_.boxTests;
    return !overlaps(grown(a_.box(a), clearance_), b_.box(b));
  }

  bool opensA(std::uint32_t a, std::uint32_t b) const {
    if (a_[a].isLeaf()) return false;
    return b_[b].isLeaf() || sizeOf(a_[a]) >= sizeOf(b_[b]);
  }

  template <typename Take>
  void open(const FrontPair& from, const Take& take) {
    std::array<FrontPair, 2 * kTreeDepthBound + 2> stack;
    std::size_t depth = 0;
    stack[depth++] = from;
    while (depth > 0) {  // each pair of branches once
      FrontPair pair = stack[--depth];
      pair.apart = areApart(pair.a, pair.b);
      const bool parts = a_[pair.a].isLeaf() && b_[pair.b].isLeaf();
      if (pair.apart || parts) {
        if (!pair.apart) take(a_.part(pair.a), b_.part(pair.b));
        next_.push_back(pair);
        if (pair.apart) raise();
      } else if (opensA(pair.a, pair.b)) {
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

  FrontPair parentOf(const FrontPair& pair) const {
    const bool openedA = pair.b == 0 || (pair.a != 0 && sizeOf(a_[a_.parent(pair.a)]) <
                                                            sizeOf(b_[b_.parent(pair.b)]));
    return openedA ? FrontPair{a_.parent(pair.a), pair.b, true}
                   : FrontPair{pair.a, b_.parent(pair.b), true};
  }

  /// While the last two of the front are siblings, apart as their parents are: their parents.
  void raise() {
    while (next_.size() >= 2) {
      const FrontPair &last = next_.back(), &before = next_[next_.size() - 2];
      if (!before.apart || (last.a == 0 && last.b == 0) || (before.a == 0 && before.b == 0)) return;
      const FrontPair parent = parentOf(last), other = parentOf(before);
      if (parent.a != other.a || parent.b != other.b || !areApart(parent.a, parent.b)) return;
      next_.pop_back();
      next_.back() = parent;
    }
  }

  Side a_, b_;
  double clearance_;
  PartsCache& cache_;
  std::vector<FrontPair> next_;
};

/// The features of pairs that stay go with them.
void keepFeatures(PartsCache& cache, const std::vector<PartPair>& oldPairs,
                  const std::vector<FeatureCache>& oldFeatures) {
  std::size_t old = 0;
  cache.features.clear();
  for (const PartPair& pair : cache.pairs) {
    while (old < oldPairs.size() && oldPairs[old] < pair) ++old;
    const bool known = old < oldPairs.size() && oldPairs[old] == pair;
    cache.features.push_back(known ? oldFeatures[old] : FeatureCache{});
  }
}

ConvexBody bodyOf(const PlacedParts& placed, std::uint32_t part) {
  return {placed.parts->vertices(part), placed.translation, &placed.rotation,
          placed.parts->hull(part)};
}

bool isWorse(const Decision& decision, const std::optional<PartsDecision>& than) {
  if (!than) return true;
  if (decision.verdict != than->decision.verdict) return decision.verdict > than->decision.verdict;
  return decision.distance < than->decision.distance;
}

}  // namespace

// ---- PartTree ----------------------------------------------------------------------------------

struct PartTree::Lazy {
  std::once_flag once;
  std::atomic<bool> done = false;
  Opened opened;
};

PartTree::PartTree(std::vector<Hull> hulls)
    : hulls_(std::move(hulls)), lazy_(std::make_unique<Lazy>()) {
  for (const Hull& hull : hulls_) {
    for (const Vec3& v : hull.vertices) box_.include(v);
    radius_ = std::max(radius_, hull.radius);
  }
}

PartTree::PartTree(std::vector<Triangle> triangles)
    : triangles_(std::move(triangles)), lazy_(std::make_unique<Lazy>()) {
  for (const Triangle& t : triangles_) {
    for (const Vec3& v : t) {
      box_.include(v);
      radius_ = std::max(radius_, v.norm());
    }
  }
}

PartTree::~PartTree() = default;
PartTree::PartTree(PartTree&&) noexcept = default;

std::uint32_t PartTree::size() const {
  return static_cast<std::uint32_t>(hulls_.size() + triangles_.size());
}

std::span<const Vec3> PartTree::vertices(std::uint32_t part) const {
  if (hulls_.empty()) return triangles_[part];
  return hulls_[part].vertices;
}

const Hull* PartTree::hull(std::uint32_t part) const {
  return hulls_.empty() ? nullptr : &hulls_[part];
}

bool PartTree::isOpened() const {
  return lazy_->done;
}

const PartTree::Opened& PartTree::opened() const {
  std::call_once(lazy_->once, [this] {
    std::vector<Box> boxes(size());
    for (std::uint32_t part = 0; part < size(); ++part)
      for (const Vec3& v : vertices(part)) boxes[part].include(v);
    Opened& opened = lazy_->opened;
    opened.boxes = buildBoxTree(boxes, 1);
    opened.branchOfNode.assign(opened.boxes.nodes.size(), 0);
    for (std::uint32_t k = 0; k < opened.boxes.nodes.size(); ++k)
      for (std::uint32_t side = 0; side < 2; ++side) {
        const Branch& child = opened.boxes.nodes[k].children[side];
        if (!child.isLeaf()) opened.branchOfNode[child.first] = 2 * k + 1 + side;
      }
    lazy_->done = true;
  });
  return lazy_->opened;
}

// ---- queries -----------------------------------------------------------------------------------

Box boxOf(const PlacedParts& placed, std::uint32_t part) {
  Box box;
  for (const Vec3& v : placed.parts->vertices(part))
    box.include(Vec3(placed.rotation * v + placed.translation));
  return grown(box, kPartPad * sizeOf(placed));
}

const std::vector<PartPair>& overlappingParts(std::span<const PlacedParts> a,
                                              std::span<const PlacedParts> b, double clearance,
                                              PartsCache& cache) {
  ++cache.tick;
  cache.fronts.resize(a.size() * b.size());
  cache.boxesA.resize(a.size());
  cache.boxesB.resize(b.size());
  const std::vector<PartPair> oldPairs = std::move(cache.pairs);
  const std::vector<FeatureCache> oldFeatures = std::move(cache.features);
  cache.pairs.clear();
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    if (a[i].parts->size() == 0) continue;
    const Box boxA = grown(boxOfPiece(a[i]), clearance);
    for (std::uint32_t j = 0; j < b.size(); ++j) {
      auto& front = cache.fronts[i * b.size() + j];
      ++cache.boxTests;
      if (b[j].parts->size() == 0 || !overlaps(boxA, boxOfPiece(b[j]))) {
        front.clear();
        continue;
      }
      Descent descent({a[i], cache.boxesA[i], cache}, {b[j], cache.boxesB[j], cache}, clearance,
                      cache);
      descent.run(front, [&](std::uint32_t partA, std::uint32_t partB) {
        cache.pairs.push_back({i, partA, j, partB});
      });
    }
  }
  std::sort(cache.pairs.begin(), cache.pairs.end());
  keepFeatures(cache, oldPairs, oldFeatures);
  return cache.pairs;
}

std::optional<PartsDecision> decideParts(std::span<const PlacedParts> a,
                                         std::span<const PlacedParts> b, double clearance,
                                         PartsCache& cache) {
  const std::vector<PartPair>& pairs = overlappingParts(a, b, clearance, cache);
  std::optional<PartsDecision> worst;
  double limit = clearance;
  const auto consider = [&](std::size_t i) {
    const PartPair& pair = pairs[i];
    ++cache.decisions;
    const auto decision = decideWithin(bodyOf(a[pair.linkA], pair.partA),
                                       bodyOf(b[pair.linkB], pair.partB), limit, cache.features[i]);
    if (!decision || !isWorse(*decision, worst)) return;
    worst = PartsDecision{pair, *decision};
    limit = std::min(limit, decision->distance + decision->errorBound);
  };
  const auto last = std::lower_bound(pairs.begin(), pairs.end(), cache.decisive);
  const bool known = last != pairs.end() && *last == cache.decisive;
  const auto first = static_cast<std::size_t>(last - pairs.begin());
  if (known) consider(first);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (worst && worst->decision.verdict == Verdict::penetrating) break;
    if (!known || i != first) consider(i);
  }
  if (worst) cache.decisive = worst->pair;
  return worst;
}

}  // namespace enfilade::collision
