// Built top down by the surface area heuristic over bins (I. Wald 2007, "On fast construction of
// SAH-based bounding volume hierarchies").
//
// 1. The items of a node are sorted into kBins slices of the box of their centres, along each axis.
// 2. They are parted between the two slices where the sum of area x number is least.
// 3. Where bins part nothing (equal centres), or below kBinnedDepth, they are halved by number
//    along the longest axis; the index breaks ties.
// Departures: no leaf is made before `leafSize`, since a box test is much cheaper than what waits
// in a leaf; boxes are floats relative to the middle of the root, rounded outwards, and lie two and
// two with their parent, so that one cache line decides both children.
//
// Each split is a split of sets, whatever order the library leaves them in, and leaves are sorted:
// so the tree is the same with every standard library.
#include "collision/shapes/box_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade::collision {
namespace {

constexpr int kBins = 16;
constexpr std::uint32_t kBinnedDepth = 56;  // then halving: 2^32 items end after 32 more

float roundedDown(double x) {
  constexpr float kMost = std::numeric_limits<float>::max();
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  if (!(x < static_cast<double>(kMost))) return kMost;
  if (x < -static_cast<double>(kMost)) return -kInfinite;
  const float rounded = static_cast<float>(x);
  return static_cast<double>(rounded) > x ? std::nextafterf(rounded, -kInfinite) : rounded;
}

/// x rounded to the nearest double, and from there outwards by more than that rounding.
double outward(double difference, double sign) {
  return difference + sign * std::abs(difference) * 0x1p-52;
}

double halfArea(const Box& box) {
  const Vec3 size = box.size();
  return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
}

struct Bin {
  Box box;
  std::uint32_t count = 0;
  void include(const Bin& other) {
    box.include(other.box);
    count += other.count;
  }
};

/// Items left of `bin` along `axis` go left; axis -1: nothing found.
struct Split {
  int axis = -1;
  int bin = 0;
  double cost = std::numeric_limits<double>::infinity();
};

/// Which slice a centre falls in. Monotone in the centre, so that slices are slices.
struct Slicer {
  double low, scale;
  Slicer(const Box& centres, int axis)
      : low(centres.min[axis]), scale(kBins / (centres.max[axis] - centres.min[axis])) {}
  int operator()(double centre) const {
    return std::min(kBins - 1, static_cast<int>((centre - low) * scale));
  }
};

class Builder {
 public:
  Builder(std::span<const Box> boxes, std::uint32_t leafSize) : boxes_(boxes), leafSize_(leafSize) {
    tree_.order.resize(boxes.size());
    std::iota(tree_.order.begin(), tree_.order.end(), 0u);
    centres_.reserve(boxes.size());
    for (const Box& box : boxes) centres_.push_back(box.centre());
  }

  BoxTree build() {
    if (boxes_.empty()) return std::move(tree_);
    Task all{0, static_cast<std::uint32_t>(boxes_.size()), kNoParent, 0, 0, {}, {}};
    measure(all);
    tree_.origin = all.box.centre();
    tree_.extent = (all.box.max - tree_.origin).cwiseMax(tree_.origin - all.box.min).maxCoeff();
    tasks_.push_back(all);
    while (!tasks_.empty()) {  // fewer than 2n branches in all
      const Task task = tasks_.back();
      tasks_.pop_back();
      place(task);
    }
    return std::move(tree_);
  }

 private:
  static constexpr std::uint32_t kNoParent = ~0u;
  struct Task {
    std::uint32_t first, last;  ///< of the order
    std::uint32_t parent, side, depth;
    Box box, centres;
  };

  void measure(Task& task) const {
    for (std::uint32_t i = task.first; i < task.last; ++i) {
      task.box.include(boxes_[tree_.order[i]]);
      task.centres.include(centres_[tree_.order[i]]);
    }
  }

  void place(const Task& task) {
    BoxTree::Branch branch{narrowed(task.box, tree_.origin), task.first, task.last - task.first};
    const auto first = tree_.order.begin() + task.first, last = tree_.order.begin() + task.last;
    if (branch.count <= leafSize_) {
      std::sort(first, last);
    } else {
      branch = {branch.box, static_cast<std::uint32_t>(tree_.nodes.size()), 0};
      tree_.nodes.emplace_back();
      const std::uint32_t middle = parted(task);
      for (const std::uint32_t side : {1u, 0u}) {
        Task child{side == 0 ? task.first : middle,
                   side == 0 ? middle : task.last,
                   branch.first,
                   side,
                   task.depth + 1,
                   {},
                   {}};
        measure(child);
        tasks_.push_back(child);
      }
    }
    (task.parent == kNoParent ? tree_.root : tree_.nodes[task.parent].children[task.side]) = branch;
  }

  Split bestSplit(const Task& task) const {
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
      const Slicer slice(task.centres, axis);
      if (!std::isfinite(slice.scale)) continue;
      std::array<Bin, kBins> bins;
      for (std::uint32_t i = task.first; i < task.last; ++i) {
        const std::uint32_t item = tree_.order[i];
        Bin& bin = bins[static_cast<std::size_t>(slice(centres_[item][axis]))];
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
      leftCost[bin] = left.count > 0 ? halfArea(left.box) * left.count : -1;
    }
    Bin right;
    for (std::size_t bin = kBins - 1; bin > 0; --bin) {
      right.include(bins[bin]);
      if (right.count == 0 || leftCost[bin] < 0) continue;
      const double cost = leftCost[bin] + halfArea(right.box) * right.count;
      if (cost < best.cost) best = {axis, static_cast<int>(bin), cost};
    }
  }

  /// Parts the items of the task; where the right ones begin.
  std::uint32_t parted(const Task& task) {
    const auto first = tree_.order.begin() + task.first, last = tree_.order.begin() + task.last;
    const Split split = task.depth < kBinnedDepth ? bestSplit(task) : Split{};
    if (split.axis >= 0) {
      const Slicer slice(task.centres, split.axis);
      const auto middle = std::partition(first, last, [&](std::uint32_t item) {
        return slice(centres_[item][split.axis]) < split.bin;
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

  std::span<const Box> boxes_;
  std::uint32_t leafSize_;
  std::vector<Vec3> centres_;
  std::vector<Task> tasks_;
  BoxTree tree_;
};

}  // namespace

NarrowBox narrowed(const Box& box, const Vec3& origin) {
  NarrowBox narrow;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    narrow.min[i] = roundedDown(outward(box.min[axis] - origin[axis], -1));
    narrow.max[i] = -roundedDown(-outward(box.max[axis] - origin[axis], 1));
  }
  return narrow;
}

BoxTree buildBoxTree(std::span<const Box> boxes, std::uint32_t leafSize) {
  return Builder(boxes, leafSize).build();
}

}  // namespace enfilade::collision
