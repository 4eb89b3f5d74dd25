// Best-first descent of two trees (Hjaltason and Samet 1998, "Incremental distance join algorithms
// for spatial databases"): of all pairs of branches that are open, the one whose boxes are nearest
// goes on, and of its two branches the larger one is replaced by its children. Two leaves are
// decided exactly. When the nearest boxes are farther apart than the nearest parts so far, nothing
// nearer is left. So two large meshes that are far apart cost some paths through their trees, and
// what the search costs is known while it runs.
//
// Among equals (all boxes that overlap are 0 apart) the last one goes on: down to parts that
// penetrate, which ends it, with few pairs kept open.
//
// Rounding. A turned box is off by some units u = 2^-53 of M = |translation| + 3 * (extent of the
// tree), as part_tree.cpp works out; what is taken from a gap is 128u of both, which is above that,
// the subtraction and the root.
#include "collision/compound/compound_distance.hpp"

#include <algorithm>
#include <queue>
#include <vector>

namespace enfilade::collision {
namespace {

constexpr double kPad = 128 * 0x1p-53;  // see the file's head

using Branch = BoxTree::Branch;

struct OpenBranch {
  const TreeOfParts* tree;
  const Branch* branch;
};

struct OpenPair {
  double gap;  ///< metres: no parts under the two are nearer
  std::uint64_t number;
  OpenBranch a, b;

  bool operator<(const OpenPair& other) const {  // the greatest goes on first
    return gap != other.gap ? gap > other.gap : number < other.number;
  }
};

Box worldBox(const OpenBranch& open) {
  const NarrowBox& box = open.branch->box;
  const Vec3 min(box.min[0], box.min[1], box.min[2]), max(box.max[0], box.max[1], box.max[2]);
  const TreeOfParts& tree = *open.tree;
  const Vec3 middle = tree.rotation * (0.5 * (min + max) + tree.boxes->origin) + tree.translation;
  const Vec3 reach = tree.rotation.cwiseAbs() * (0.5 * (max - min));
  return {middle - reach, middle + reach};
}

double padOf(const TreeOfParts& tree) {
  const double extent = tree.boxes->origin.cwiseAbs().maxCoeff() + tree.boxes->extent;
  return kPad * (tree.translation.cwiseAbs().maxCoeff() + 3 * extent);
}

/// `pad`: what both are off by.
double gapOf(const Box& a, const Box& b, double pad) {
  const double gap = (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(0).norm();
  return std::max(0.0, gap - pad);
}

/// A part that is an item of a leaf, and its box.
struct Item {
  ConvexBody body;
  Box box;
};

std::vector<Item> itemsOf(const OpenBranch& leaf) {
  std::vector<Item> items;
  for (std::uint32_t i = 0; i < leaf.branch->count; ++i) {
    Item& item = items.emplace_back(Item{leaf.tree->part(leaf.branch->first + i), {}});
    const ConvexBody& body = item.body;
    for (const Vec3& v : body.vertices)
      item.box.include(Vec3((body.rotation ? *body.rotation * v : v) + body.translation));
  }
  return items;
}

double sizeOf(const Branch& branch) {
  double size = 0;
  for (std::size_t i = 0; i < 3; ++i)
    size += static_cast<double>(branch.box.max[i]) - static_cast<double>(branch.box.min[i]);
  return size;
}

bool opensA(const OpenPair& pair) {
  if (pair.a.branch->isLeaf()) return false;
  return pair.b.branch->isLeaf() || sizeOf(*pair.a.branch) >= sizeOf(*pair.b.branch);
}

class Search {
 public:
  Search(double within, std::size_t& work) : limit_(within), work_(work) {}

  void open(const OpenBranch& a, const OpenBranch& b) {
    const double gap = gapOf(worldBox(a), worldBox(b), padOf(*a.tree) + padOf(*b.tree));
    if (gap <= limit_) open_.push({gap, ++count_, a, b});
  }

  NearestParts run() {
    while (!open_.empty() && best_.decision.verdict != Verdict::penetrating) {
      const OpenPair pair = open_.top();
      open_.pop();
      if (pair.gap > limit_) break;
      if (!take(1)) return {NearestParts::Found::gaveUp, {}, {}, {}};
      if (pair.a.branch->isLeaf() && pair.b.branch->isLeaf()) {
        if (!decide(pair)) return {NearestParts::Found::gaveUp, {}, {}, {}};
      } else {
        goOn(pair);
      }
    }
    return best_;
  }

 private:
  bool take(std::size_t cost) {
    const bool enough = work_ >= cost;
    work_ -= std::min(work_, cost);
    return enough;
  }

  void goOn(const OpenPair& pair) {
    const bool first = opensA(pair);
    const OpenBranch& opened = first ? pair.a : pair.b;
    for (const Branch& child : opened.tree->boxes->nodes[opened.branch->first].children) {
      const OpenBranch one{opened.tree, &child};
      if (first) open(one, pair.b);
      if (!first) open(pair.a, one);
    }
  }

  /// False when the work is used up.
  bool decide(const OpenPair& pair) {
    const double pad = padOf(*pair.a.tree) + padOf(*pair.b.tree);
    const std::vector<Item> second = itemsOf(pair.b);
    for (const Item& a : itemsOf(pair.a)) {
      for (const Item& b : second) {
        if (!take(1)) return false;
        if (gapOf(a.box, b.box, pad) > limit_) continue;
        if (!take(kDecisionWork)) return false;
        consider(a.body, b.body);
      }
    }
    return true;
  }

  void consider(const ConvexBody& a, const ConvexBody& b) {
    FeatureCache cache;
    const auto decision = decideWithin(a, b, limit_, cache);
    if (!decision) return;
    const bool first = best_.found == NearestParts::Found::none;
    const Decision& best = best_.decision;
    const bool worse = decision->verdict != best.verdict ? decision->verdict > best.verdict
                                                         : decision->distance < best.distance;
    if (!first && !worse) return;
    best_ = {NearestParts::Found::nearest, *decision, a, b};
    limit_ = std::min(limit_, decision->distance + decision->errorBound);
  }

  double limit_;  ///< metres: nothing beyond matters
  std::size_t& work_;
  std::uint64_t count_ = 0;
  std::priority_queue<OpenPair> open_;
  NearestParts best_;
};

}  // namespace

Box boxOf(const TreeOfParts& tree) {
  return grown(worldBox({&tree, &tree.boxes->root}), padOf(tree));
}

NearestParts nearestParts(std::span<const TreeOfParts> a, std::span<const TreeOfParts> b,
                          double within, std::size_t& work) {
  Search search(within, work);
  for (const TreeOfParts& one : a)
    for (const TreeOfParts& other : b)
      if (!one.boxes->empty() && !other.boxes->empty())
        search.open({&one, &one.boxes->root}, {&other, &other.boxes->root});
  return search.run();
}

}  // namespace enfilade::collision
