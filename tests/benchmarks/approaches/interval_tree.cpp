// Interval tree for 2-D intersection tests (Lin 1993, section 5.2.3).
//
// A line sweeps along x. At the start of a box, its interval on z is inserted into an interval tree
// and compared with those in it. At its end it is removed. Overlapping pairs of rectangles are then
// tested on y. The static end points on x are sorted once and merged with the dynamic boxes' each
// tick. Static and dynamic intervals are in two trees, so that no two static boxes are paired.
// Every tick sweeps over the whole static scene: O(n log n), as in the thesis.
//
// Departures: the split values are a sample of at most 4095 static ends, fixed for all ticks. A
// node's intervals are unordered and tested one by one.
#include <algorithm>
#include <array>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr std::size_t kMaxSplits = 4095;

class IntervalTree {
 public:
  /// `splits` ascending, 2^k - 1 of them.
  IntervalTree(std::vector<double> splits, std::size_t ids)
      : splits_(std::move(splits)), nodes_(splits_.size()), places_(ids) {}

  void insert(std::uint32_t id, double low, double high) {
    std::size_t first = 0, size = splits_.size();
    while (true) {
      const std::size_t middle = first + size / 2;
      Node& node = nodes_[middle];
      ++node.below;
      if (size == 1 || (low <= splits_[middle] && splits_[middle] <= high)) {
        places_[id] = {static_cast<std::uint32_t>(middle),
                       static_cast<std::uint32_t>(node.ids.size())};
        node.ids.push_back(id);
        return;
      }
      if (low > splits_[middle]) first = middle + 1;
      size /= 2;
    }
  }

  void remove(std::uint32_t id) {
    const Place place = places_[id];
    std::size_t first = 0, size = splits_.size();
    while (true) {  // walks down to the node by its index
      const std::size_t middle = first + size / 2;
      --nodes_[middle].below;
      if (middle == place.node) break;
      if (place.node > middle) first = middle + 1;
      size /= 2;
    }
    std::vector<std::uint32_t>& ids = nodes_[place.node].ids;
    ids[place.at] = ids.back();
    places_[ids[place.at]].at = place.at;
    ids.pop_back();
  }

  /// Visits all intervals that may overlap [low, high]; skips nodes that cannot.
  template <typename Visit>
  void ask(double low, double high, Visit&& visit) const {
    ask(0, splits_.size(), low, high, visit);
  }

 private:
  struct Node {
    std::uint32_t below = 0;  ///< intervals in this node and all nodes below
    std::vector<std::uint32_t> ids;
  };
  struct Place {
    std::uint32_t node, at;
  };

  template <typename Visit>
  void ask(std::size_t first, std::size_t size, double low, double high, Visit& visit) const {
    if (size == 0) return;
    const std::size_t middle = first + size / 2;
    if (nodes_[middle].below == 0) return;
    for (const std::uint32_t id : nodes_[middle].ids) visit(id);
    if (low <= splits_[middle]) ask(first, size / 2, low, high, visit);
    if (high >= splits_[middle]) ask(middle + 1, size / 2, low, high, visit);
  }

  std::vector<double> splits_;
  std::vector<Node> nodes_;    ///< in the order of the splits: an implicit balanced tree
  std::vector<Place> places_;  ///< by id
};

class IntervalSweep : public BroadPhase {
 public:
  explicit IntervalSweep(std::span<const Aabb> staticBoxes)
      : staticBoxes_(staticBoxes),
        splits_(sampleSplits(staticBoxes)),
        staticTree_(splits_, staticBoxes.size()) {
    for (std::uint32_t s = 0; s < staticBoxes.size(); ++s) {
      addEnds({staticBoxes[s].min.x(), s, false, false}, staticBoxes[s].max.x(), staticEnds_);
    }
    std::sort(staticEnds_.begin(), staticEnds_.end(), isBefore);
  }

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    if (!dynamicTree_) dynamicTree_ = std::make_unique<IntervalTree>(splits_, dynamicBoxes.size());
    dynamicEnds_.clear();
    for (std::uint32_t id = 0; id < dynamicBoxes.size(); ++id) {
      addEnds({dynamicBoxes[id].min.x(), id, true, false}, dynamicBoxes[id].max.x(), dynamicEnds_);
    }
    std::sort(dynamicEnds_.begin(), dynamicEnds_.end(), isBefore);
    auto staticBoxes = staticEnds_.begin();
    for (const End& end : dynamicEnds_) {
      for (; staticBoxes != staticEnds_.end() && isBefore(*staticBoxes, end); ++staticBoxes)
        meet(*staticBoxes, dynamicBoxes, tally);
      meet(end, dynamicBoxes, tally);
    }
    for (; staticBoxes != staticEnds_.end(); ++staticBoxes) meet(*staticBoxes, dynamicBoxes, tally);
  }

 private:
  struct End {
    double at;
    std::uint32_t id;
    bool moves, upper;
  };
  /// At equal positions lower ends come first: closed intervals that touch overlap.
  static bool isBefore(const End& a, const End& b) {
    return a.at != b.at ? a.at < b.at : a.upper < b.upper;
  }
  static void addEnds(End lower, double upperAt, std::vector<End>& ends) {
    ends.push_back(lower);
    ends.push_back({upperAt, lower.id, lower.moves, true});
  }

  static std::vector<double> sampleSplits(std::span<const Aabb> staticBoxes) {
    std::vector<double> all;
    for (const Aabb& box : staticBoxes) all.insert(all.end(), {box.min.z(), box.max.z()});
    std::sort(all.begin(), all.end());
    std::size_t count = 1;
    while (2 * count + 1 <= std::min(all.size(), kMaxSplits)) count = 2 * count + 1;
    std::vector<double> splits(count);
    for (std::size_t k = 0; k < count; ++k) splits[k] = all[(k + 1) * all.size() / (count + 1)];
    return splits;
  }

  void meet(const End& end, std::span<const Aabb> dynamicBoxes, PairTally& tally) {
    const Aabb& box = end.moves ? dynamicBoxes[end.id] : staticBoxes_[end.id];
    IntervalTree& own = end.moves ? *dynamicTree_ : staticTree_;
    if (end.upper) {
      own.remove(end.id);
      return;
    }
    dynamicTree_->ask(box.min.z(), box.max.z(), [&](std::uint32_t other) {
      if (!collision::overlaps(box, dynamicBoxes[other])) return;
      if (end.moves) tally.addDynamicPair(end.id, other);
      if (!end.moves) tally.addStaticPair(other, end.id);
    });
    if (end.moves) {
      staticTree_.ask(box.min.z(), box.max.z(), [&](std::uint32_t other) {
        if (collision::overlaps(box, staticBoxes_[other])) tally.addStaticPair(end.id, other);
      });
    }
    own.insert(end.id, box.min.z(), box.max.z());
  }

  std::span<const Aabb> staticBoxes_;
  std::vector<double> splits_;
  IntervalTree staticTree_;
  std::unique_ptr<IntervalTree> dynamicTree_;
  std::vector<End> staticEnds_, dynamicEnds_;
};

}  // namespace

BroadPhaseMethod makeIntervalTree() {
  return {"2-D interval tree", BroadPhaseMethod::Kind::approach, 100000,
          "every tick sweeps over all static boxes", bindMaker<IntervalSweep>()};
}

}  // namespace enfilade::benchmarks
