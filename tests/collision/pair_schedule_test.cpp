#include "collision/motion/pair_schedule.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using testing::Random;

TEST(PairSchedule, GivesTheEarliestPairFirst) {
  PairSchedule schedule;
  schedule.set(1, 2, 0.3);
  schedule.set(5, 3, 0.1);
  schedule.set(2, 7, 0.2);
  const auto first = schedule.popDue(1);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->pair, PairSchedule::BodyPair(3, 5));
  EXPECT_EQ(first->time, 0.1);
  EXPECT_EQ(schedule.size(), 2u);
}

TEST(PairSchedule, GivesNothingBeforeItsTime) {
  PairSchedule schedule;
  EXPECT_FALSE(schedule.popDue(1e9));
  schedule.set(1, 2, 0.5);
  EXPECT_FALSE(schedule.popDue(0.4));
  EXPECT_TRUE(schedule.popDue(0.5));
}

TEST(PairSchedule, EqualTimesComeInTheOrderOfTheirPairs) {
  PairSchedule schedule;
  for (const auto& [a, b] : {std::pair{4u, 9u}, {1u, 9u}, {1u, 3u}, {2u, 5u}})
    schedule.set(a, b, 1);
  std::vector<PairSchedule::BodyPair> order;
  while (const auto entry = schedule.popDue(1)) order.push_back(entry->pair);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
  EXPECT_EQ(order.size(), 4u);
}

TEST(PairSchedule, AnImpulseMakesAllPairsOfItsBodyDueAndNoOther) {
  PairSchedule schedule;
  schedule.set(1, 2, 5);
  schedule.set(2, 3, 6);
  schedule.set(3, 4, 7);
  schedule.set(2, 4, 0.5);
  schedule.scheduleBodyNow(2, 1);
  EXPECT_EQ(schedule.findTime(2, 1), 1);
  EXPECT_EQ(schedule.findTime(3, 2), 1);
  EXPECT_EQ(schedule.findTime(4, 2), 0.5);  // was due before
  EXPECT_EQ(schedule.findTime(3, 4), 7);
  schedule.validate();
}

TEST(PairSchedule, RefusesInvalidPairsAndTimes) {
  PairSchedule schedule;
  EXPECT_THROW(schedule.set(3, 3, 1), std::invalid_argument);
  EXPECT_THROW(schedule.set(3, 4, std::nan("")), std::invalid_argument);
  EXPECT_EQ(schedule.size(), 0u);
}

TEST(PairSchedule, EqualsASortedMapThroughRandomOperations) {
  Random random(3);
  PairSchedule schedule;
  std::map<PairSchedule::BodyPair, double> reference;
  int popped = 0;
  for (int step = 0; step < 20000; ++step) {
    const auto a = static_cast<std::uint32_t>(random() % 30);
    const auto b = static_cast<std::uint32_t>(a + 1 + random() % 5);
    const double time = static_cast<double>(random() % 64);
    switch (random() % 8) {
      case 0:
        EXPECT_EQ(schedule.remove(b, a), reference.erase({a, b}) == 1);
        break;
      case 1:
        schedule.scheduleBodyNow(a, time);
        for (auto& [pair, at] : reference)
          if (pair.first == a || pair.second == a) at = std::min(at, time);
        break;
      case 2:
      case 3: {
        const auto first =
            std::min_element(reference.begin(), reference.end(), [](const auto& p, const auto& q) {
              return std::pair(p.second, p.first) < std::pair(q.second, q.first);
            });
        const auto entry = schedule.popDue(time);
        ASSERT_EQ(entry.has_value(), first != reference.end() && first->second <= time);
        if (!entry) break;
        EXPECT_EQ(entry->pair, first->first);
        EXPECT_EQ(entry->time, first->second);
        reference.erase(first);
        ++popped;
        break;
      }
      default:
        schedule.set(a, b, time);
        reference[{a, b}] = time;
    }
    ASSERT_EQ(schedule.size(), reference.size());
    if (step % 100 == 0) schedule.validate();
  }
  EXPECT_GT(popped, 1000);
}

}  // namespace
}  // namespace enfilade::collision
