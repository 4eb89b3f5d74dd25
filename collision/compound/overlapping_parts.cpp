// Bounding volume test tree (BVTT) traversal with front tracking.
//
// Steps
//  1. If the boxes of two branches overlap, the traversal descends into the larger branch. The
//     pairs where it ends (separated boxes, or two leaves) are the front.
//  2. The next call starts at the last front (Ehmann and Lin 2001, section 5.2; after Klosowski
//     1998). Their paper is "Accurate and fast proximity queries between polyhedra using convex
//     surface decomposition". If a pair of the front now overlaps, the traversal continues below
//     it. If two siblings are separated and their parents are, too, the front is raised to the
//     parents.
//  3. A pair separated by a gap is not tested again before the motions of both objects, summed,
//     have used up the gap. No point of a box moves farther than its object's farthest point.
//  4. World boxes are computed on demand. That of a leaf comes from the boxes of its parts. That of
//     another branch comes from its box in the frame of the tree, inflated by the margin.
// Departures: the choice of the branch to descend depends on the trees, not on the poses. Each pair
// of branches thus has one parent, and the front needs no tree. It is an array in traversal order,
// in which siblings are adjacent.
//
// Parent of (a, b). Sizes do not increase downwards. The traversal descends the ancestors of a and
// of b in descending order of size, A first among equals (a merge of two sorted lists). The last
// one is the smaller of the two parents, B's among equals.
//
// Rounding. Twice the pad of compound_view.cpp inflates each branch, so that it contains the boxes
// of its parts, and is deducted from each gap. `clock` and its users round towards an earlier test.
#include "collision/compound/overlapping_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"

namespace enfilade::collision {
namespace {

using Branch = BoxTree::Branch;
using Entry = PartFront::Entry;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kOverlapping = -1;  // Entry::separatedUntil

double computePad(const CompoundView& view) {
  return 2 * computeRoundingPad(view);
}

double roundUp(double x) {
  return std::nextafter(x, kInfinity);
}

/// Largest gap between the boxes along an axis, metres. Positive exactly if they do not overlap.
double computeAxisGap(const Aabb& a, const Aabb& b) {
  return (a.min - b.max).cwiseMax(b.min - a.max).maxCoeff();
}

/// Upper bound of the motion of any point of the object since the last call, metres.
double computeMotion(const PartFront::Object& object, const CompoundView& view) {
  const Mat3 turn = view.rotation - object.rotation;
  const Vec3 shift = view.translation - object.translation;
  if (turn.isZero(0) && shift.isZero(0)) return 0;
  const FloatAabb& box = view.tree->root.box;
  const Vec3 min(box.min[0], box.min[1], box.min[2]), max(box.max[0], box.max[1], box.max[2]);
  const Vec3 centre = 0.5 * (min + max) + view.tree->origin;
  // The difference of two rotations stretches no vector by more than its norm / sqrt(2).
  const double motion =
      (turn * centre + shift).norm() + 0.7072 * turn.norm() * (0.5 * (max - min)).norm();
  return motion * kRoundUpFactor + computePad(view);
}

/// An object with its tree and the world boxes of this call.
class ObjectTraversal {
 public:
  ObjectTraversal(const PartBounds& bounds, PartFront::Object& object, PartFront& front)
      : bounds_(bounds),
        tree_(*bounds.view.tree),
        pad_(computePad(bounds.view)),
        object_(object),
        front_(front) {}

  const Branch& operator[](std::uint32_t branch) const {
    return branch == 0 ? tree_.root : tree_.nodes[(branch - 1) / 2].children[(branch - 1) % 2];
  }
  std::uint32_t findParent(std::uint32_t branch) const {
    return object_.branchOfNode[(branch - 1) / 2];
  }
  std::uint32_t firstChild(std::uint32_t branch) const { return 2 * (*this)[branch].first + 1; }
  std::span<const std::uint32_t> parts(std::uint32_t leaf) const {
    return std::span(tree_.order).subspan((*this)[leaf].first, (*this)[leaf].count);
  }
  const Aabb& partBox(std::uint32_t part) const { return bounds_.boxes[part]; }
  double pad() const { return pad_; }

  const Aabb& box(std::uint32_t branch) {
    if (object_.computedAt[branch] != front_.calls) {
      object_.boxes[branch] = computeBox(branch);
      object_.computedAt[branch] = front_.calls;
    }
    return object_.boxes[branch];
  }

 private:
  Aabb computeBox(std::uint32_t branch) const {
    const Aabb outer = inflate(computeBranchAabb(bounds_.view, (*this)[branch]),
                               bounds_.margin * (1 + 0x1p-48) + pad_);
    if (!(*this)[branch].isLeaf()) return outer;
    Aabb box;
    for (const std::uint32_t part : parts(branch)) box.include(partBox(part));
    ENFILADE_ASSERT(contains(outer, box));  // the precondition on PartBounds::boxes
    return box;
  }

  const PartBounds& bounds_;
  const BoxTree& tree_;
  double pad_;
  PartFront::Object& object_;
  PartFront& front_;
};

/// Traversal of two trees from one front to the next.
class BvttTraversal {
 public:
  BvttTraversal(const PartBounds& a, const PartBounds& b, PartFront& front,
                std::vector<PartPair>& pairs)
      : a_(a, front.a, front),
        b_(b, front.b, front),
        margins_(a.margin + b.margin),
        now_(roundUp(roundUp(margins_) + front.clock)),
        front_(front),
        pairs_(pairs) {}

  void run() {
    if (front_.entries.size() > 1)  // objects that part leave no long front behind
      if (const double until = testBranches(0, 0); until >= 0) front_.entries = {{0, 0, until}};
    next_.reserve(front_.entries.size());
    for (const Entry& entry : front_.entries) {
      if (now_ < entry.separatedUntil) {
        next_.push_back(entry);
      } else {
        descend(entry);
      }
    }
    front_.entries.swap(next_);
  }

 private:
  /// Entry::separatedUntil of two branches. Negative: their boxes overlap.
  double testBranches(std::uint32_t a, std::uint32_t b) {
    ++front_.aabbTests;
    const double gap = computeAxisGap(a_.box(a), b_.box(b));
    if (!(gap > 0)) return kOverlapping;
    const double margins = margins_ * (1 - 0x1p-48);
    return std::max(0.0, (front_.clock + (margins + gap - a_.pad() - b_.pad())) * (1 - 0x1p-48));
  }

  /// Adds the overlapping pairs of parts of two leaves. Returns Entry::separatedUntil.
  double testLeaves(std::uint32_t a, std::uint32_t b) {
    const std::size_t before = pairs_.size();
    for (const std::uint32_t partA : a_.parts(a))
      for (const std::uint32_t partB : b_.parts(b)) {
        ++front_.aabbTests;
        if (overlaps(a_.partBox(partA), b_.partBox(partB))) pairs_.push_back({partA, partB});
      }
    return pairs_.size() > before ? kOverlapping : 0;
  }

  void descend(const Entry& from) {
    std::array<Entry, 2 * kMaxTreeDepth + 2> stack;
    std::size_t depth = 0;
    stack[depth++] = from;
    while (depth > 0) {  // each pair of branches once
      ENFILADE_ASSERT(depth + 1 < stack.size());
      Entry pair = stack[--depth];
      const bool bothLeaves = a_[pair.a].isLeaf() && b_[pair.b].isLeaf();
      pair.separatedUntil = testBranches(pair.a, pair.b);
      if (bothLeaves && pair.separatedUntil < 0) pair.separatedUntil = testLeaves(pair.a, pair.b);
      if (bothLeaves || pair.separatedUntil >= 0) {
        next_.push_back(pair);
        raiseFront();
      } else if (shouldOpenFirst(a_[pair.a], b_[pair.b])) {
        const std::uint32_t child = a_.firstChild(pair.a);
        stack[depth++] = {child + 1, pair.b};
        stack[depth++] = {child, pair.b};
      } else {
        const std::uint32_t child = b_.firstChild(pair.b);
        stack[depth++] = {pair.a, child + 1};
        stack[depth++] = {pair.a, child};
      }
    }
  }

  Entry findParent(const Entry& pair) const {
    const bool openedA =
        pair.b == 0 || (pair.a != 0 && computeBranchSize(a_[a_.findParent(pair.a)]) <
                                           computeBranchSize(b_[b_.findParent(pair.b)]));
    return openedA ? Entry{a_.findParent(pair.a), pair.b} : Entry{pair.a, b_.findParent(pair.b)};
  }

  /// Replaces the last two entries by their parent while they are siblings, and they and their
  /// parent are separated.
  void raiseFront() {
    while (next_.size() >= 2) {
      const Entry &last = next_.back(), &before = next_[next_.size() - 2];
      if (last.separatedUntil < 0 || before.separatedUntil < 0) return;
      Entry parent = findParent(last);
      const Entry other = findParent(before);
      if (parent.a != other.a || parent.b != other.b) return;
      parent.separatedUntil = testBranches(parent.a, parent.b);
      if (parent.separatedUntil < 0) return;
      next_.pop_back();
      next_.back() = parent;
    }
  }

  ObjectTraversal a_, b_;
  double margins_;  ///< of both objects, metres
  double now_;      ///< to compare with Entry::separatedUntil
  PartFront& front_;
  std::vector<PartPair>& pairs_;
  std::vector<Entry> next_;
};

bool isOfTree(const PartFront::Object& object, const BoxTree& tree) {
  return object.tree == &tree && object.size == tree.order.size() &&
         object.branchOfNode.size() == tree.nodes.size();
}

PartFront::Object makeObject(const CompoundView& view) {
  const BoxTree& tree = *view.tree;
  const std::size_t branches = 2 * tree.nodes.size() + 1;
  PartFront::Object object{&tree, tree.order.size(), view.rotation, view.translation, {}, {}, {}};
  object.boxes.resize(branches);
  object.computedAt.resize(branches, 0);
  object.branchOfNode.resize(tree.nodes.size(), 0);
  for (std::uint32_t k = 0; k < tree.nodes.size(); ++k)
    for (std::uint32_t side = 0; side < 2; ++side)
      if (const Branch& child = tree.nodes[k].children[side]; !child.isLeaf())
        object.branchOfNode[child.first] = 2 * k + 1 + side;
  return object;
}

/// Prepares the front for this call: advances its clock, or resets it for other trees.
void prepareFront(const CompoundView& a, const CompoundView& b, PartFront& front) {
  ++front.calls;
  if (!isOfTree(front.a, *a.tree) || !isOfTree(front.b, *b.tree)) {
    front.a = makeObject(a);
    front.b = makeObject(b);
    front.entries = {{}};
    return;
  }
  const double motion = computeMotion(front.a, a) + computeMotion(front.b, b);
  if (motion != 0) front.clock = roundUp(front.clock + roundUp(motion));
  front.a.rotation = a.rotation;
  front.a.translation = a.translation;
  front.b.rotation = b.rotation;
  front.b.translation = b.translation;
}

}  // namespace

void findOverlappingParts(const PartBounds& a, const PartBounds& b, PartFront& front,
                          std::vector<PartPair>& pairs) {
  pairs.clear();
  if (a.view.tree->empty() || b.view.tree->empty()) return;
  ENFILADE_ASSERT(a.boxes.size() == a.view.tree->order.size());
  ENFILADE_ASSERT(b.boxes.size() == b.view.tree->order.size());
  prepareFront(a.view, b.view, front);
  BvttTraversal(a, b, front, pairs).run();
  std::sort(pairs.begin(), pairs.end());
  ENFILADE_ASSERT(std::ranges::adjacent_find(pairs) == pairs.end());
}

}  // namespace enfilade::collision
