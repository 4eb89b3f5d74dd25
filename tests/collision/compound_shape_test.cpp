#include "collision/compound/compound_shape.hpp"

#include <gtest/gtest.h>

#include "tests/collision/moving_shapes.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

std::vector<PartPair> bruteForcePairs(std::span<const PlacedCompound> a,
                                      std::span<const PlacedCompound> b, double clearance) {
  std::vector<PartPair> pairs;
  for (std::uint32_t i = 0; i < a.size(); ++i)
    for (std::uint32_t p = 0; p < a[i].shape->size(); ++p) {
      const Aabb box = inflated(computeAabb(a[i], p), clearance);
      for (std::uint32_t j = 0; j < b.size(); ++j)
        for (std::uint32_t q = 0; q < b[j].shape->size(); ++q)
          if (overlaps(box, computeAabb(b[j], q))) pairs.push_back({i, p, j, q});
    }
  return pairs;
}

SeparationResult computeSeparationCold(const PlacedCompound& a, std::uint32_t p,
                                       const PlacedCompound& b, std::uint32_t q) {
  FeatureCache cold;
  return computeSeparation({a.shape->vertices(p), a.translation, &a.rotation, a.shape->hull(p)},
                           {b.shape->vertices(q), b.translation, &b.rotation, b.shape->hull(q)},
                           cold);
}

/// A ring of small hulls around the y axis: concave, with a hole.
CompoundShape ring(Random& random, int count, double radius) {
  std::vector<Hull> parts;
  for (int i = 0; i < count; ++i) {
    const double t = 4.0 * i / count;
    const Vec3 at(radius * wave(t), 0, radius * wave(t + 1));
    std::vector<Vec3> points = randomPoints(random, 8, 0.1);
    for (Vec3& p : points) p += at;
    parts.push_back(buildHull(points));
  }
  return CompoundShape(std::move(parts));
}

CompoundShape crumpledSheet(Random& random, int n) {
  std::vector<Triangle> triangles;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec3 at(2.0 * i / n - 1, uniform(random, -0.05, 0.05), 2.0 * j / n - 1);
      const double side = 2.0 / n;
      triangles.push_back({at, at + Vec3(side, 0, 0), at + Vec3(0, 0, side)});
    }
  return CompoundShape(std::move(triangles));
}

TEST(CompoundShape, PairsAreThoseOfBruteForceOnTheWholeWay) {
  Random random(31);
  const CompoundShape hoop = ring(random, 40, 1), sheet = crumpledSheet(random, 16);
  CompoundCache cache;
  std::size_t pairs = 0, empty = 0;
  for (int tick = 0; tick < 250; ++tick) {
    const double t = 0.02 * tick;
    const std::vector<PlacedCompound> a{
        {&hoop, rotationAt(t, Vec3(1, 0.2, 0.4)), Vec3(0, 2 * wave(t), 0)}};
    const std::vector<PlacedCompound> b{
        {&sheet, rotationAt(-0.3 * t, Vec3(0, 1, 1)), Vec3::Zero()}};
    const auto& found = findOverlappingParts(a, b, 0.01, cache);
    ASSERT_EQ(found, bruteForcePairs(a, b, 0.01)) << "tick " << tick;
    pairs += found.size();
    empty += found.empty() ? 1 : 0;
  }
  EXPECT_GT(pairs, 1000u);
  EXPECT_GT(empty, 20u);
  EXPECT_LT(cache.aabbTests, 250u * 40 * 256 / 20);
}

TEST(CompoundShape, AnArmOfLinksEqualsBruteForce) {
  Random random(32);
  const CompoundShape link = ring(random, 10, 0.4), other = ring(random, 24, 0.8);
  CompoundCache cache;
  std::size_t verdicts[3] = {};
  for (int tick = 0; tick < 120; ++tick) {
    const double t = 0.05 * tick;
    std::vector<PlacedCompound> arm;
    for (int i = 0; i < 3; ++i)
      arm.push_back(
          {&link, rotationAt(t * (1 + i), Vec3(0, i, 1)), Vec3(0.6 * i - 1.9, wave(t), 0)});
    const std::vector<PlacedCompound> b{
        {&other, Mat3::Identity(), Vec3(0.5 * wave(0.3 * t), 0, 0)}};
    const double clearance = 0.2;
    const auto decided = computeCompoundSeparation(arm, b, clearance, cache);
    ASSERT_EQ(cache.pairs, bruteForcePairs(arm, b, clearance));
    Verdict worst = Verdict::separated;
    double least = std::numeric_limits<double>::infinity();
    for (const PartPair& p : cache.pairs) {
      const SeparationResult cold =
          computeSeparationCold(arm[p.linkA], p.partA, b[p.linkB], p.partB);
      worst = std::max(worst, cold.verdict);
      least = std::min(least, cold.distance);
    }
    ASSERT_EQ(decided.has_value(), least <= clearance);
    if (!decided) continue;
    EXPECT_EQ(decided->separation.verdict, worst);
    EXPECT_NEAR(decided->separation.distance, least, 1e-12);
    ++verdicts[static_cast<int>(worst)];
  }
  EXPECT_GT(verdicts[0], 10u);
  EXPECT_GT(verdicts[2], 10u);
}

TEST(CompoundShape, TheFrontRisesAgainWhenTheObjectsPart) {
  Random random(33);
  const CompoundShape sheet = crumpledSheet(random, 16), other = crumpledSheet(random, 16);
  CompoundCache cache;
  std::size_t deepest = 0;
  for (int tick = 0; tick <= 45; ++tick) {
    const std::vector<PlacedCompound> a{{&sheet, Mat3::Identity(), Vec3(0, 0.3 - 0.01 * tick, 0)}};
    const std::vector<PlacedCompound> b{{&other, rotationAt(0.1, Vec3(0, 0, 1)), Vec3(0, 0, 0)}};
    ASSERT_EQ(findOverlappingParts(a, b, 0, cache), bruteForcePairs(a, b, 0));
    deepest = std::max(deepest, cache.fronts[0].size());
  }
  EXPECT_GT(deepest, 500u);
  EXPECT_LT(cache.fronts[0].size(), deepest / 2);
  EXPECT_FALSE(cache.fronts[0].empty());
}

TEST(CompoundShape, NothingIsBuiltUntilTheBoxesMeet) {
  Random random(34);
  const CompoundShape hoop = ring(random, 12, 1), sheet = crumpledSheet(random, 4);
  CompoundCache cache;
  const std::vector<PlacedCompound> a{{&hoop, Mat3::Identity(), Vec3(0, 3, 0)}};
  std::vector<PlacedCompound> b{{&sheet, Mat3::Identity(), Vec3::Zero()}};
  EXPECT_TRUE(findOverlappingParts(a, b, 1, cache).empty());
  EXPECT_EQ(cache.aabbTests, 1u);
  EXPECT_FALSE(hoop.isBvhBuilt());
  b[0].translation.y() = 2.9;
  EXPECT_FALSE(findOverlappingParts(a, b, 1, cache).empty());
  EXPECT_TRUE(hoop.isBvhBuilt());
}

TEST(CompoundShape, AnEmptyObjectMeetsNothing) {
  const CompoundShape none{std::vector<Hull>{}};
  CompoundCache cache;
  const std::vector<PlacedCompound> a{{&none, Mat3::Identity(), Vec3::Zero()}};
  EXPECT_TRUE(findOverlappingParts(a, a, 1, cache).empty());
  EXPECT_FALSE(computeCompoundSeparation(a, a, 1, cache));
}

TEST(CompoundShape, SwappingTheObjectsSwapsTheAnswer) {
  Random random(35);
  const CompoundShape hoop = ring(random, 20, 1), sheet = crumpledSheet(random, 8);
  for (int i = 0; i < 20; ++i) {
    const std::vector<PlacedCompound> a{
        {&hoop, rotationAt(i, Vec3(1, 1, 0)), Vec3(0, 0.1 * i - 1, 0.3)}};
    const std::vector<PlacedCompound> b{{&sheet, rotationAt(0.1 * i, Vec3(1, 0, 0)), Vec3::Zero()}};
    CompoundCache one, two;
    const auto there = computeCompoundSeparation(a, b, 0.5, one),
               back = computeCompoundSeparation(b, a, 0.5, two);
    ASSERT_EQ(there.has_value(), back.has_value());
    if (!there) continue;
    EXPECT_EQ(there->separation.verdict, back->separation.verdict);
    EXPECT_NEAR(there->separation.distance, back->separation.distance, 1e-14);
  }
}

}  // namespace
}  // namespace enfilade::collision
