// A broad phase that is compared with brute force at every tick, and random scenes for it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include "collision/broad_phase/broad_phase_audit.hpp"
#include "collision/broad_phase/sort_and_sweep.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {

using testing::drawUniform;
using testing::Random;
using Pairs = std::vector<ProxyPair>;

inline int drawInteger(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}
inline Vec3 drawVector(Random& random, const Vec3& low, const Vec3& high) {
  const double x = drawUniform(random, low.x(), high.x());
  const double y = drawUniform(random, low.y(), high.y());
  const double z = drawUniform(random, low.z(), high.z());
  return {x, y, z};
}
inline Aabb makeBoxAt(const Vec3& corner, const Vec3& size) {
  return {corner, corner + size};
}

/// A broad phase with a list of its boxes; updateAndCheck() compares it with brute force.
class CheckedSweep {
 public:
  explicit CheckedSweep(std::vector<Aabb> boxes)
      : staticBoxes_(std::move(boxes)), sweep_(staticBoxes_) {}

  ProxyId insert(const Aabb& box) {
    const ProxyId id = sweep_.insert(box);
    EXPECT_FALSE(dynamicBoxes_.contains(id)) << "an id in use was assigned again";
    dynamicBoxes_[id] = box;
    return id;
  }
  void move(ProxyId id, const Aabb& box) {
    sweep_.move(id, box);
    dynamicBoxes_[id] = box;
  }
  void remove(ProxyId id) {
    sweep_.remove(id);
    dynamicBoxes_.erase(id);
  }
  StaticId insertStatic(const Aabb& box) {
    const StaticId id = sweep_.insertStatic(box);
    if (id >= staticBoxes_.size()) staticBoxes_.resize(id + std::size_t{1});
    EXPECT_TRUE(staticBoxes_[id].empty()) << "an id in use was assigned again";
    staticBoxes_[id] = box;
    return id;
  }
  void removeStatic(StaticId id) {
    sweep_.removeStatic(id);
    staticBoxes_[id] = Aabb{};
  }
  void updateAndCheck();

  std::map<ProxyId, Aabb>& getDynamicBoxes() { return dynamicBoxes_; }
  SortAndSweep& getSweep() { return sweep_; }
  const std::vector<Aabb>& getStaticBoxes() const {
    return staticBoxes_;
  }  ///< an empty box for a removed id
  std::size_t pairsAdded = 0, pairsRemoved = 0, dynamicPairsAdded = 0;

 private:
  void checkOverlaps(const Pairs& expected);

  std::vector<Aabb> staticBoxes_;
  SortAndSweep sweep_;
  std::map<ProxyId, Aabb> dynamicBoxes_;
  Pairs lastPairs_;
};

inline Pairs subtractPairs(const Pairs& a, const Pairs& b) {
  Pairs result;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

inline void CheckedSweep::updateAndCheck() {
  sweep_.update();
  const std::vector<std::pair<ProxyId, Aabb>> active(dynamicBoxes_.begin(), dynamicBoxes_.end());
  Pairs expected = findPairsBruteForce(staticBoxes_, active);
  const Pairs added(sweep_.addedPairs().begin(), sweep_.addedPairs().end());
  const Pairs removed(sweep_.removedPairs().begin(), sweep_.removedPairs().end());
  ASSERT_EQ(added, subtractPairs(expected, lastPairs_));
  ASSERT_EQ(removed, subtractPairs(lastPairs_, expected));
  ASSERT_EQ(sweep_.pairCount(), expected.size());
  ASSERT_EQ(sweep_.staticCount(),
            static_cast<std::size_t>(std::count_if(staticBoxes_.begin(), staticBoxes_.end(),
                                                   [](const Aabb& box) { return !box.empty(); })));
  checkOverlaps(expected);
  pairsAdded += added.size();
  pairsRemoved += removed.size();
  dynamicPairsAdded += static_cast<std::size_t>(std::count_if(
      added.begin(), added.end(), [](const ProxyPair& p) { return p.otherIsDynamic; }));
  lastPairs_ = std::move(expected);
}

inline void CheckedSweep::checkOverlaps(const Pairs& expected) {
  std::map<ProxyId, std::vector<ProxyOverlap>> expectedOverlaps;
  for (const ProxyPair& pair : expected) {
    expectedOverlaps[pair.proxy].push_back({pair.other, pair.otherIsDynamic});
    if (pair.otherIsDynamic) expectedOverlaps[pair.other].push_back({pair.proxy, true});
  }
  for (auto& [id, list] : expectedOverlaps) std::sort(list.begin(), list.end());
  for (const auto& [id, box] : dynamicBoxes_) {
    const auto reported = sweep_.getOverlaps(id);
    ASSERT_TRUE(std::equal(reported.begin(), reported.end(), expectedOverlaps[id].begin(),
                           expectedOverlaps[id].end()))
        << "proxy " << id;
  }
}

inline std::vector<Aabb> makeFurnishedHall(Random& random, std::size_t count, const Vec3& extent) {
  std::vector<Aabb> boxes;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 corner = drawVector(random, Vec3::Zero(), extent);
    const Vec3 size = drawVector(random, Vec3::Constant(0.05), Vec3(1.5, 1.0, 1.5));
    boxes.push_back(makeBoxAt(corner, k % 40 == 0 ? Vec3(12 * size) : size));
  }
  return boxes;
}

}  // namespace enfilade::collision
