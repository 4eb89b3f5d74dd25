// Top-down build with the binned surface area heuristic (I. Wald 2007, "On fast construction of
// SAH-based bounding volume hierarchies").
//
// 1. For each axis, the items of a node are binned by their centres into kBins equal slices.
// 2. The node is split between the two bins with the minimum sum of area x item count.
// 3. If binning separates nothing (equal centres), or below kMaxBinnedDepth, the items are halved
//    by count along the longest axis; the index breaks ties.
// Departures: a node becomes a leaf only at `leafSize` items, because a box test is much cheaper
// than the work in a leaf. Boxes are floats relative to the centre of the root, rounded outwards.
// Both children lie in their parent node, so one cache line decides both.
//
// A split depends on the set of items only, not on the order that the standard library leaves, and
// leaves are sorted. The tree is therefore the same with every standard library.
#include "collision/shapes/box_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

constexpr int kBins = 16;
constexpr std::uint32_t kMaxBinnedDepth = 56;  // then halving: 2^32 items need 32 more levels

float roundDown(double x) {
  constexpr float kMaxFloat = std::numeric_limits<float>::max();
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  if (!(x < static_cast<double>(kMaxFloat))) return kMaxFloat;
  if (x < -static_cast<double>(kMaxFloat)) return -kInfinite;
  const float rounded = static_cast<float>(x);
  return static_cast<double>(rounded) > x ? std::nextafterf(rounded, -kInfinite) : rounded;
}

/// Moves `difference` in the direction of `sign` by more than the rounding error of a subtraction.
double roundOutward(double difference, double sign) {
  return difference + sign * std::abs(difference) * 0x1p-52;
}

double computeHalfArea(const Aabb& box) {
  const Vec3 size = box.size();
  return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
}

struct Bin {
  Aabb box;
  std::uint32_t count = 0;
  void include(const Bin& other) {
    box.include(other.box);
    count += other.count;
  }
};

/// Items in bins below `bin` along `axis` go left. axis -1: no split found.
struct Split {
  int axis = -1;
  int bin = 0;
  double cost = std::numeric_limits<double>::infinity();
};

/// Maps a centre to its bin. Monotone in the centre, so bins are intervals.
struct BinMapper {
  double min, scale;
  BinMapper(const Aabb& centres, int axis)
      : min(centres.min[axis]), scale(kBins / (centres.max[axis] - centres.min[axis])) {}
  int operator()(double centre) const {
    return std::min(kBins - 1, static_cast<int>((centre - min) * scale));
  }
};

class Builder {
 public:
  Builder(std::span<const Aabb> boxes, std::uint32_t leafSize)
      : boxes_(boxes), leafSize_(leafSize) {
    ENFILADE_ASSERT(leafSize >= 1);
    tree_.order.resize(boxes.size());
    std::iota(tree_.order.begin(), tree_.order.end(), 0u);
    centres_.reserve(boxes.size());
    for (const Aabb& box : boxes) {
      ENFILADE_ASSERT(!box.empty());
      centres_.push_back(box.centre());
    }
  }

  BoxTree build() {
    if (boxes_.empty()) return std::move(tree_);
    Task all{0, static_cast<std::uint32_t>(boxes_.size()), kNoParent, 0, 0, {}, {}};
    computeBounds(all);
    tree_.origin = all.box.centre();
    tree_.extent = (all.box.max - tree_.origin).cwiseMax(tree_.origin - all.box.min).maxCoeff();
    tasks_.push_back(all);
    while (!tasks_.empty()) {  // fewer than 2n branches in total
      const Task task = tasks_.back();
      tasks_.pop_back();
      buildBranch(task);
    }
    return std::move(tree_);
  }

 private:
  static constexpr std::uint32_t kNoParent = ~0u;
  struct Task {
    std::uint32_t first, last;  ///< range of tree_.order
    std::uint32_t parent, side, depth;
    Aabb box, centres;
  };

  void computeBounds(Task& task) const {
    for (std::uint32_t i = task.first; i < task.last; ++i) {
      task.box.include(boxes_[tree_.order[i]]);
      task.centres.include(centres_[tree_.order[i]]);
    }
  }

  void buildBranch(const Task& task) {
    BoxTree::Branch branch{toFloatAabb(task.box, tree_.origin), task.first, task.last - task.first};
    const auto first = tree_.order.begin() + task.first, last = tree_.order.begin() + task.last;
    if (branch.count <= leafSize_) {
      std::sort(first, last);
    } else {
      branch = {branch.box, static_cast<std::uint32_t>(tree_.nodes.size()), 0};
      tree_.nodes.emplace_back();
      const std::uint32_t middle = partitionItems(task);
      ENFILADE_ASSERT(task.first < middle && middle < task.last);
      ENFILADE_ASSERT(task.depth + 1 < kMaxTreeDepth);
      for (const std::uint32_t side : {1u, 0u}) {
        Task child{side == 0 ? task.first : middle,
                   side == 0 ? middle : task.last,
                   branch.first,
                   side,
                   task.depth + 1,
                   {},
                   {}};
        computeBounds(child);
        tasks_.push_back(child);
      }
    }
    (task.parent == kNoParent ? tree_.root : tree_.nodes[task.parent].children[task.side]) = branch;
  }

  Split findBestSplit(const Task& task) const {
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
      const BinMapper toBin(task.centres, axis);
      if (!std::isfinite(toBin.scale)) continue;
      std::array<Bin, kBins> bins;
      for (std::uint32_t i = task.first; i < task.last; ++i) {
        const std::uint32_t item = tree_.order[i];
        Bin& bin = bins[static_cast<std::size_t>(toBin(centres_[item][axis]))];
        bin.box.include(boxes_[item]);
        ++bin.count;
      }
      sweepBins(bins, axis, best);
    }
    return best;
  }

  static void sweepBins(const std::array<Bin, kBins>& bins, int axis, Split& best) {
    std::array<double, kBins> leftCost{};
    Bin left;
    for (std::size_t bin = 1; bin < kBins; ++bin) {
      left.include(bins[bin - 1]);
      leftCost[bin] = left.count > 0 ? computeHalfArea(left.box) * left.count : -1;
    }
    Bin right;
    for (std::size_t bin = kBins - 1; bin > 0; --bin) {
      right.include(bins[bin]);
      if (right.count == 0 || leftCost[bin] < 0) continue;
      const double cost = leftCost[bin] + computeHalfArea(right.box) * right.count;
      if (cost < best.cost) best = {axis, static_cast<int>(bin), cost};
    }
  }

  /// Partitions the items of the task. Returns the first index of the right half.
  std::uint32_t partitionItems(const Task& task) {
    const auto first = tree_.order.begin() + task.first, last = tree_.order.begin() + task.last;
    const Split split = task.depth < kMaxBinnedDepth ? findBestSplit(task) : Split{};
    if (split.axis >= 0) {
      const BinMapper toBin(task.centres, split.axis);
      const auto middle = std::partition(first, last, [&](std::uint32_t item) {
        return toBin(centres_[item][split.axis]) < split.bin;
      });
      return static_cast<std::uint32_t>(middle - tree_.order.begin());
    }
    int axis = 0;
    task.centres.size().maxCoeff(&axis);
    const std::uint32_t middle = task.first + (task.last - task.first) / 2;
    std::nth_element(first, tree_.order.begin() + middle, last,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double ca = centres_[a][axis], cb = centres_[b][axis];
                       return ca != cb ? ca < cb : a < b;
                     });
    return middle;
  }

  std::span<const Aabb> boxes_;
  std::uint32_t leafSize_;
  std::vector<Vec3> centres_;
  std::vector<Task> tasks_;
  BoxTree tree_;
};

}  // namespace

FloatAabb toFloatAabb(const Aabb& box, const Vec3& origin) {
  FloatAabb result;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    result.min[i] = roundDown(roundOutward(box.min[axis] - origin[axis], -1));
    result.max[i] = -roundDown(-roundOutward(box.max[axis] - origin[axis], 1));
  }
  return result;
}

BoxTree buildBoxTree(std::span<const Aabb> boxes, std::uint32_t leafSize) {
  return Builder(boxes, leafSize).build();
}

}  // namespace enfilade::collision
