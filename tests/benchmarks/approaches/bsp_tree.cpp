// Axis-aligned BSP tree of the static scene (Lin 1993, section 5.3.1).
//
// A node is split at the median of its boxes' centres, along the axis of their largest spread. A
// box that crosses the plane goes to both sides, so splitting ends where it no longer separates. A
// dynamic box descends into the sides it overlaps; a stamp prevents duplicate reports. Pairs of
// dynamic boxes come from one sort and sweep (dynamic_sweep.hpp), since a BSP does not suit moving
// boxes.
#include "tests/benchmarks/approaches/dynamic_sweep.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr std::size_t kLeafBoxes = 8;
constexpr int kMaxLevels = 32;

class BspTree : public BroadPhase {
 public:
  explicit BspTree(std::span<const Aabb> staticBoxes)
      : staticBoxes_(staticBoxes), stamp_(staticBoxes.size(), 0) {
    std::vector<std::uint32_t> all(staticBoxes.size());
    std::iota(all.begin(), all.end(), 0u);
    nodes_.emplace_back();
    build(0, std::move(all), 0);
  }

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    for (std::uint32_t id = 0; id < dynamicBoxes.size(); ++id) {
      ++now_;
      ask(0, dynamicBoxes[id], id, tally);
    }
    dynamicBoxes_.reportPairs(dynamicBoxes, tally);
  }

 private:
  struct Node {
    std::int32_t axis = -1;           ///< -1: a leaf
    double at = 0;                    ///< metres
    std::uint32_t low = 0, high = 0;  ///< children; a leaf: its range of `listed_`
  };

  void build(std::uint32_t node, std::vector<std::uint32_t> boxes, int level) {
    if (boxes.size() > kLeafBoxes && level < kMaxLevels && cut(node, boxes, level)) return;
    nodes_[node].low = static_cast<std::uint32_t>(listed_.size());
    listed_.insert(listed_.end(), boxes.begin(), boxes.end());
    nodes_[node].high = static_cast<std::uint32_t>(listed_.size());
  }

  bool cut(std::uint32_t node, std::vector<std::uint32_t>& boxes, int level) {
    Aabb centres;
    for (const std::uint32_t b : boxes) centres.include(staticBoxes_[b].centre());
    int axis = 0;
    centres.size().maxCoeff(&axis);
    const auto middle = boxes.begin() + static_cast<std::ptrdiff_t>(boxes.size() / 2);
    std::nth_element(boxes.begin(), middle, boxes.end(), [&](std::uint32_t a, std::uint32_t b) {
      return staticBoxes_[a].centre()[axis] < staticBoxes_[b].centre()[axis];
    });
    const double at = staticBoxes_[*middle].centre()[axis];
    std::vector<std::uint32_t> low, high;
    for (const std::uint32_t b : boxes) {
      if (staticBoxes_[b].min[axis] <= at) low.push_back(b);
      if (staticBoxes_[b].max[axis] >= at) high.push_back(b);
    }
    // Not worth it if most boxes would be on both sides.
    if (4 * std::max(low.size(), high.size()) > 3 * boxes.size()) return false;
    std::vector<std::uint32_t>().swap(boxes);
    const auto first = static_cast<std::uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    nodes_[node] = {axis, at, first, first + 1};
    build(first, std::move(low), level + 1);
    build(first + 1, std::move(high), level + 1);
    return true;
  }

  void ask(std::uint32_t index, const Aabb& box, std::uint32_t id, PairTally& tally) {
    const Node node = nodes_[index];
    if (node.axis >= 0) {
      if (box.min[node.axis] <= node.at) ask(node.low, box, id, tally);
      if (box.max[node.axis] >= node.at) ask(node.high, box, id, tally);
      return;
    }
    for (std::uint32_t k = node.low; k < node.high; ++k) {
      const std::uint32_t s = listed_[k];
      if (stamp_[s] == now_ || !collision::overlaps(box, staticBoxes_[s])) continue;
      stamp_[s] = now_;
      tally.addStaticPair(id, s);
    }
  }

  std::span<const Aabb> staticBoxes_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> listed_;
  std::vector<std::uint64_t> stamp_;  ///< by static box: the last query that reported it
  std::uint64_t now_ = 0;
  DynamicSweep dynamicBoxes_;
};

}  // namespace

BroadPhaseMethod makeBspTree() {
  return {"BSP of the static scene", BroadPhaseMethod::Kind::approach, SIZE_MAX, "",
          bindMaker<BspTree>()};
}

}  // namespace enfilade::benchmarks
