#include "collision/motion/rotational_shape_cast.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "collision/shapes/hull.hpp"

namespace enfilade::collision {
namespace {

constexpr StoppingBand kBand{0.875e-3, 1.03125e-3};

std::vector<Vec3> boxPoints(const Vec3& min, const Vec3& max) {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    points.emplace_back(i & 1 ? max.x() : min.x(), i & 2 ? max.y() : min.y(),
                        i & 4 ? max.z() : min.z());
  return points;
}

double distanceAfter(const ConvexBody& a, const Turn& turn, double fraction, const ConvexBody& b) {
  const Placement at = placementAfter(a, turn, fraction);
  FeatureCache cache;
  const ConvexBody moved{a.vertices, at.translation, &at.rotation, a.hull};
  const Decision decision = decide(moved, b, cache);
  return decision.verdict == Verdict::separated ? decision.distance : -1;
}

TEST(TurningSweep, ARodStopsEpsilonBeforeTheWallItsTipComesTo) {
  const auto rod = boxPoints({0, -0.05, -0.05}, {1, 0.05, 0.05});
  const auto wall = boxPoints({-2, -1, -0.6}, {2, 1, -0.55});  // a turn about +Y goes towards -Z
  FeatureCache cache;
  const Turn turn{Vec3::Zero(), Vec3::UnitY(), 2};
  const SweepResult swept = sweepTurning({rod}, turn, {wall}, kBand, cache);
  ASSERT_TRUE(swept.stopped);
  // The corner (1, 0.05) is at -sin(phi) - 0.05 cos(phi), and must be at -0.55 + 1.03 mm.
  const double far = std::hypot(1, 0.05), start = std::atan2(0.05, 1);
  EXPECT_NEAR(swept.fraction * turn.angle, std::asin((0.55 - kBand.high) / far) - start, 1e-5);
  EXPECT_NEAR(distanceAfter({rod}, turn, swept.fraction, {wall}), kBand.high, 1e-5);
  EXPECT_LT(swept.queries, 12u);
}

TEST(TurningSweep, APostNearThePivotIsReachedInFewStepsThoughTheTipIsFast) {
  const auto rod = boxPoints({0, -0.05, -0.01}, {3, 0.05, 0.01});
  const auto post = boxPoints({0.1, -1, -0.2}, {0.12, 1, -0.1});
  FeatureCache cache;
  const Turn turn{Vec3::Zero(), Vec3::UnitY(), 3};
  const SweepResult swept = sweepTurning({rod}, turn, {post}, kBand, cache);
  ASSERT_TRUE(swept.stopped);
  EXPECT_FALSE(swept.boundReached);
  EXPECT_LT(swept.queries, 20u);
  EXPECT_NEAR(distanceAfter({rod}, turn, swept.fraction, {post}), kBand.high, 1e-5);
}

TEST(TurningSweep, ATurnAlongATableIsFreeAndOneAwayFromItToo) {
  const auto rod = boxPoints({0, 0.001, -0.05}, {1, 0.1, 0.05});
  const auto table = boxPoints({-2, -0.1, -2}, {2, 0, 2});
  FeatureCache cache;
  EXPECT_FALSE(
      sweepTurning({rod}, {Vec3::Zero(), Vec3::UnitY(), 6}, {table}, kBand, cache).stopped);
  const Turn up{{-0.5, 0, 0}, Vec3::UnitZ(), 1};
  EXPECT_FALSE(sweepTurning({rod}, up, {table}, kBand, cache).stopped);
  const Turn down{{-0.5, 0, 0}, Vec3::UnitZ(), -1};
  EXPECT_EQ(sweepTurning({rod}, down, {table}, kBand, cache).fraction, 0);
}

TEST(TurningSweep, NothingIsCrossedOnTheWayOfRandomTurns) {
  std::mt19937_64 random(3);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const auto point = [&](double size) {
    const double x = uniform(-size, size), y = uniform(-size, size);
    return Vec3(x, y, uniform(-size, size));
  };
  int stopped = 0, asked = 0;
  for (int k = 0; k < 400; ++k) {
    std::vector<Vec3> a, b;
    for (int i = 0; i < 8; ++i) a.push_back(point(0.5));
    for (int i = 0; i < 3; ++i) b.push_back(point(0.5));  // a triangle: no thickness
    const Vec3 away = point(0.9);
    for (Vec3& v : b) v += away;
    const Vec3 direction = point(1);
    const Turn turn{point(1), direction.normalized(), uniform(-4, 4)};
    if (!(distanceAfter({a}, turn, 0, {b}) > kBand.high)) continue;
    FeatureCache cache;
    const SweepResult swept = sweepTurning({a}, turn, {b}, kBand, cache);
    ++asked, stopped += swept.stopped;
    EXPECT_FALSE(swept.boundReached) << k;
    for (int i = 0; i <= 100; ++i)
      ASSERT_GT(distanceAfter({a}, turn, swept.fraction * i / 100, {b}), kBand.low * (1 - 1e-9))
          << k << " at " << i;
    if (!swept.stopped) continue;
    EXPECT_LT(distanceAfter({a}, turn, swept.fraction, {b}), kBand.high * 1.01) << k;
  }
  EXPECT_GT(stopped, asked / 20);
  EXPECT_LT(stopped, asked / 2);
}

}  // namespace
}  // namespace enfilade::collision
