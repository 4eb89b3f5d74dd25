// Which contacts of two walks are the same one.
#include <gtest/gtest.h>

#include <random>

#include "server/diff/walk_difference.hpp"

namespace enfilade::server {
namespace {

Happening at(double x, double time) {
  Happening happening;
  happening.point = Vec3(x, 0, 0);
  happening.time = time;
  happening.tick = static_cast<std::uint64_t>(time * 60);
  return happening;
}

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// The least cost of pairing two lists in their order, by trying everything.
double leastCost(const std::vector<Happening>& before, std::size_t i,
                 const std::vector<Happening>& after, std::size_t j) {
  const auto left = static_cast<double>(before.size() - i + after.size() - j);
  double best = left * kSamePlace / 2;
  for (std::size_t k = i; k < before.size(); ++k) {
    for (std::size_t l = j; l < after.size(); ++l) {
      const double apart = (before[k].point - after[l].point).norm();
      if (apart >= kSamePlace) continue;
      const double skipped = static_cast<double>(k - i + l - j) * kSamePlace / 2;
      best = std::min(best, skipped + apart + leastCost(before, k + 1, after, l + 1));
    }
  }
  return best;
}

double costOf(const Pairs& pairs, const std::vector<Happening>& before,
              const std::vector<Happening>& after) {
  double cost =
      static_cast<double>(before.size() + after.size() - 2 * pairs.size()) * kSamePlace / 2;
  for (const auto& [i, j] : pairs) cost += (before[i].point - after[j].point).norm();
  return cost;
}

TEST(MatchedHappenings, TheSameListIsItsOwnMatch) {
  const std::vector<Happening> list{at(0, 1), at(5, 2), at(0, 3), at(0, 4)};
  EXPECT_EQ(matchedHappenings(list, list), (Pairs{{0, 0}, {1, 1}, {2, 2}, {3, 3}}));
}

TEST(MatchedHappenings, WhatIsNewInTheMiddleMovesNothing) {
  const std::vector<Happening> before{at(0, 1), at(6, 3), at(12, 5)};
  const std::vector<Happening> after{at(0, 1), at(3, 2), at(6, 3), at(12, 5)};
  EXPECT_EQ(matchedHappenings(before, after), (Pairs{{0, 0}, {1, 2}, {2, 3}}));
}

TEST(MatchedHappenings, ALaterTimeAtTheSamePlaceIsTheSame) {
  EXPECT_EQ(matchedHappenings({at(1, 10)}, {at(1, 40)}), (Pairs{{0, 0}}));
}

TEST(MatchedHappenings, AnotherPlaceIsAnother) {
  EXPECT_EQ(matchedHappenings({at(0, 10)}, {at(kSamePlace, 10)}), Pairs{});
  EXPECT_EQ(matchedHappenings({at(0, 10)}, {at(0.99 * kSamePlace, 10)}), (Pairs{{0, 0}}));
}

TEST(MatchedHappenings, NoMatchingIsCheaper) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0, 6);
  std::uniform_int_distribution<int> length(0, 5);
  int paired = 0, possible = 0;
  for (int round = 0; round < 200; ++round) {
    std::vector<Happening> before, after;
    for (int i = length(random); i > 0; --i)
      before.push_back(at(place(random), static_cast<double>(before.size())));
    for (int i = length(random); i > 0; --i)
      after.push_back(at(place(random), static_cast<double>(after.size())));
    const Pairs pairs = matchedHappenings(before, after);
    // Times decide between equal places with a millimetre a second.
    EXPECT_NEAR(costOf(pairs, before, after), leastCost(before, 0, after, 0), 0.1);
    paired += static_cast<int>(pairs.size());
    possible += static_cast<int>(std::min(before.size(), after.size()));
  }
  EXPECT_GT(paired, possible * 3 / 10);
  EXPECT_LT(paired, possible);
}

TEST(MatchedHappenings, LongListsAreCutIntoPieces) {
  std::vector<Happening> before, after;
  for (int i = 0; i < 4500; ++i) {
    before.push_back(at(i % 7, i));
    if (i % 10 != 3) after.push_back(at(i % 7, i));
  }
  const Pairs pairs = matchedHappenings(before, after);
  EXPECT_EQ(pairs.size(), after.size());
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    EXPECT_LT(pairs[i - 1].first, pairs[i].first);
    EXPECT_LT(pairs[i - 1].second, pairs[i].second);
  }
}

}  // namespace
}  // namespace enfilade::server
