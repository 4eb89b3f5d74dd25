// A broad phase that is compared with brute force at every tick, and random scenes for it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"

namespace enfilade::collision {

using Random = std::mt19937_64;
using Pairs = std::vector<BoxPair>;

inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline int dice(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}
inline Vec3 uniform3(Random& random, const Vec3& low, const Vec3& high) {
  const double x = uniform(random, low.x(), high.x());
  const double y = uniform(random, low.y(), high.y());
  const double z = uniform(random, low.z(), high.z());
  return {x, y, z};
}
inline Box boxAt(const Vec3& corner, const Vec3& size) {
  return {corner, corner + size};
}

/// A broad phase beside the list of its movers; check() compares it with brute force.
class Watched {
 public:
  explicit Watched(std::vector<Box> still) : still_(std::move(still)), sweep_(still_) {}

  MoverId insert(const Box& box) {
    const MoverId id = sweep_.insert(box);
    EXPECT_FALSE(movers_.contains(id)) << "an id in use was given again";
    movers_[id] = box;
    return id;
  }
  void move(MoverId id, const Box& box) {
    sweep_.move(id, box);
    movers_[id] = box;
  }
  void remove(MoverId id) {
    sweep_.remove(id);
    movers_.erase(id);
  }
  StillId insertStill(const Box& box) {
    const StillId id = sweep_.insertStill(box);
    if (id >= still_.size()) still_.resize(id + std::size_t{1});
    EXPECT_TRUE(still_[id].empty()) << "an id in use was given again";
    still_[id] = box;
    return id;
  }
  void removeStill(StillId id) {
    sweep_.removeStill(id);
    still_[id] = Box{};
  }
  void updateAndCheck();

  std::map<MoverId, Box>& movers() { return movers_; }
  SortAndSweep& sweep() { return sweep_; }
  const std::vector<Box>& still() const { return still_; }  ///< empty where there is none
  std::size_t begins = 0, ends = 0, movingBegins = 0;

 private:
  void checkPartners(const Pairs& expected);

  std::vector<Box> still_;
  SortAndSweep sweep_;
  std::map<MoverId, Box> movers_;
  Pairs last_;
};

inline Pairs difference(const Pairs& a, const Pairs& b) {
  Pairs result;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

inline void Watched::updateAndCheck() {
  sweep_.update();
  const std::vector<std::pair<MoverId, Box>> live(movers_.begin(), movers_.end());
  Pairs expected = bruteForcePairs(still_, live);
  const Pairs begun(sweep_.begun().begin(), sweep_.begun().end());
  const Pairs ended(sweep_.ended().begin(), sweep_.ended().end());
  ASSERT_EQ(begun, difference(expected, last_));
  ASSERT_EQ(ended, difference(last_, expected));
  ASSERT_EQ(sweep_.pairCount(), expected.size());
  ASSERT_EQ(sweep_.stillCount(),
            static_cast<std::size_t>(std::count_if(still_.begin(), still_.end(),
                                                   [](const Box& box) { return !box.empty(); })));
  checkPartners(expected);
  begins += begun.size();
  ends += ended.size();
  movingBegins += static_cast<std::size_t>(
      std::count_if(begun.begin(), begun.end(), [](const BoxPair& p) { return p.otherMoves; }));
  last_ = std::move(expected);
}

inline void Watched::checkPartners(const Pairs& expected) {
  std::map<MoverId, std::vector<SortAndSweep::Partner>> partners;
  for (const BoxPair& pair : expected) {
    partners[pair.mover].push_back({pair.other, pair.otherMoves});
    if (pair.otherMoves) partners[pair.other].push_back({pair.mover, true});
  }
  for (auto& [id, list] : partners) std::sort(list.begin(), list.end());
  for (const auto& [id, box] : movers_) {
    const auto told = sweep_.partners(id);
    ASSERT_TRUE(std::equal(told.begin(), told.end(), partners[id].begin(), partners[id].end()))
        << "mover " << id;
  }
}

inline std::vector<Box> furnishedHall(Random& random, std::size_t count, const Vec3& extent) {
  std::vector<Box> still;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 corner = uniform3(random, Vec3::Zero(), extent);
    const Vec3 size = uniform3(random, Vec3::Constant(0.05), Vec3(1.5, 1.0, 1.5));
    still.push_back(boxAt(corner, k % 40 == 0 ? Vec3(12 * size) : size));
  }
  return still;
}

}  // namespace enfilade::collision
