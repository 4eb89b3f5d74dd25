#include "collision/motion/shape_cast.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "collision/shapes/hull.hpp"

namespace enfilade::collision {
namespace {

constexpr ContactOffset kRotationBand{0.875e-3, 1.03125e-3};

std::vector<Vec3> makeBoxPoints(const Vec3& min, const Vec3& max) {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    points.emplace_back(i & 1 ? max.x() : min.x(), i & 2 ? max.y() : min.y(),
                        i & 4 ? max.z() : min.z());
  return points;
}

double computeDistanceAfter(const PlacedConvex& a, const AxisRotation& turn, double fraction,
                            const PlacedConvex& b) {
  const RigidTransform at = computeTransformAfter(a, turn, fraction);
  FeatureCache cache;
  const PlacedConvex moved{a.vertices, at.translation, &at.rotation, a.hull};
  const SeparationResult separation = computeSeparation(moved, b, cache);
  return separation.verdict == Verdict::separated ? separation.distance : -1;
}

TEST(RotationalShapeCast, ARodStopsEpsilonBeforeTheWallItsTipComesTo) {
  const auto rod = makeBoxPoints({0, -0.05, -0.05}, {1, 0.05, 0.05});
  const auto wall = makeBoxPoints({-2, -1, -0.6}, {2, 1, -0.55});  // +Y rotation: towards -Z
  FeatureCache cache;
  const AxisRotation turn{Vec3::Zero(), Vec3::UnitY(), 2};
  const MotionResult swept = castShape({rod}, turn, {wall}, kRotationBand, cache);
  ASSERT_FALSE(swept.isClear());
  // The corner (1, 0.05) is at -sin(phi) - 0.05 cos(phi), and must be at -0.55 + 1.03 mm.
  const double far = std::hypot(1, 0.05), start = std::atan2(0.05, 1);
  EXPECT_NEAR(swept.lo * turn.angle, std::asin((0.55 - kRotationBand.rest) / far) - start, 1e-5);
  EXPECT_NEAR(computeDistanceAfter({rod}, turn, swept.lo, {wall}), kRotationBand.rest, 1e-5);
  EXPECT_LT(swept.queries, 12u);
}

TEST(RotationalShapeCast, APostNearThePivotIsReachedInFewStepsThoughTheTipIsFast) {
  const auto rod = makeBoxPoints({0, -0.05, -0.01}, {3, 0.05, 0.01});
  const auto post = makeBoxPoints({0.1, -1, -0.2}, {0.12, 1, -0.1});
  FeatureCache cache;
  const AxisRotation turn{Vec3::Zero(), Vec3::UnitY(), 3};
  const MotionResult swept = castShape({rod}, turn, {post}, kRotationBand, cache);
  ASSERT_FALSE(swept.isClear());
  EXPECT_NE(swept.outcome, MotionOutcome::unproved);
  EXPECT_LT(swept.queries, 20u);
  EXPECT_NEAR(computeDistanceAfter({rod}, turn, swept.lo, {post}), kRotationBand.rest, 1e-5);
}

TEST(RotationalShapeCast, ATurnAlongATableIsFreeAndOneAwayFromItToo) {
  const auto rod = makeBoxPoints({0, 0.001, -0.05}, {1, 0.1, 0.05});
  const auto table = makeBoxPoints({-2, -0.1, -2}, {2, 0, 2});
  FeatureCache cache;
  EXPECT_TRUE(
      castShape({rod}, AxisRotation{Vec3::Zero(), Vec3::UnitY(), 6}, {table}, kRotationBand, cache)
          .isClear());
  const AxisRotation up{{-0.5, 0, 0}, Vec3::UnitZ(), 1};
  EXPECT_TRUE(castShape({rod}, up, {table}, kRotationBand, cache).isClear());
  const AxisRotation down{{-0.5, 0, 0}, Vec3::UnitZ(), -1};
  EXPECT_EQ(castShape({rod}, down, {table}, kRotationBand, cache).lo, 0);
}

TEST(RotationalShapeCast, NothingIsCrossedOnTheWayOfRandomTurns) {
  std::mt19937_64 random(3);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const auto point = [&](double size) {
    const double x = uniform(-size, size), y = uniform(-size, size);
    return Vec3(x, y, uniform(-size, size));
  };
  int stopped = 0, queryCount = 0;
  for (int k = 0; k < 400; ++k) {
    std::vector<Vec3> a, b;
    for (int i = 0; i < 8; ++i) a.push_back(point(0.5));
    for (int i = 0; i < 3; ++i) b.push_back(point(0.5));  // a triangle: no thickness
    const Vec3 away = point(0.9);
    for (Vec3& v : b) v += away;
    const Vec3 direction = point(1);
    const AxisRotation turn{point(1), direction.normalized(), uniform(-4, 4)};
    if (!(computeDistanceAfter({a}, turn, 0, {b}) > kRotationBand.rest)) continue;
    FeatureCache cache;
    const MotionResult swept = castShape({a}, turn, {b}, kRotationBand, cache);
    ++queryCount, stopped += !swept.isClear();
    EXPECT_NE(swept.outcome, MotionOutcome::unproved) << k;
    for (int i = 0; i <= 100; ++i)
      ASSERT_GT(computeDistanceAfter({a}, turn, swept.lo * i / 100, {b}),
                kRotationBand.min * (1 - 1e-9))
          << k << " at " << i;
    if (swept.isClear()) continue;
    EXPECT_LT(computeDistanceAfter({a}, turn, swept.lo, {b}), kRotationBand.rest * 1.01) << k;
  }
  EXPECT_GT(stopped, queryCount / 20);
  EXPECT_LT(stopped, queryCount / 2);
}

}  // namespace
}  // namespace enfilade::collision
