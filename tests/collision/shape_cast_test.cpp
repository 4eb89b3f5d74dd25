#include "collision/motion/shape_cast.hpp"

#include <gtest/gtest.h>

#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

constexpr ContactOffset kBand{0.0004375, 0.000515625};

MotionResult castShapeCold(const PlacedConvex& a, const Vec3& by, const PlacedConvex& b) {
  FeatureCache cache;
  return castShape(a, by, b, kBand, cache);
}

TEST(ShapeCast, ACubeTwoMetresFromAWallStopsAfterTwoMetres) {
  const std::vector<Vec3> wall{{3, -5, -5}, {3, 5, -5}, {3, 0, 9}};
  const MotionResult result = castShapeCold({kUnitCube, Vec3::Zero()}, {10, 0, 0}, {wall});
  ASSERT_FALSE(result.isClear());
  EXPECT_NEAR(10 * result.lo, 2, 6e-4);
  EXPECT_LT(10 * result.lo, 2 - kBand.min);
  EXPECT_NEAR(result.separation.normal.x(), 1, 1e-12);
}

TEST(ShapeCast, MovingAwayMisses) {
  const std::vector<Vec3> wall{{3, -5, -5}, {3, 5, -5}, {3, 0, 9}};
  EXPECT_TRUE(castShapeCold({kUnitCube, Vec3::Zero()}, {-10, 0, 0}, {wall}).isClear());
}

TEST(ShapeCast, AMoveTooShortToArriveMisses) {
  const std::vector<Vec3> wall{{3, -5, -5}, {3, 5, -5}, {3, 0, 9}};
  EXPECT_TRUE(castShapeCold({kUnitCube, Vec3::Zero()}, {1.99, 0, 0}, {wall}).isClear());
}

TEST(ShapeCast, AThinPaneIsNotCrossedAtAnySpeed) {
  const std::vector<Vec3> pane{{3, -5, -5}, {3, 5, -5}, {3, 0, 9}};
  for (const double length : {3.0, 100.0, 1e4, 1e7}) {
    const MotionResult result = castShapeCold({kUnitCube, Vec3::Zero()}, {length, 0, 0}, {pane});
    ASSERT_FALSE(result.isClear()) << length;
    EXPECT_LT(length * result.lo, 2) << length;
  }
}

TEST(ShapeCast, ARestingBodyGlidesOverTheSeamOfItsFloor) {
  // Two floor plates that meet at x = 1.2; the cube rests at the rest offset above both.
  const std::vector<Vec3> next{{1.2, 0, -5}, {9, 0, -5}, {1.2, 0, 9}};
  const MotionResult result = castShapeCold({kUnitCube, {0, kBand.rest, 0}}, {3, 0, 0}, {next});
  EXPECT_TRUE(result.isClear());
}

TEST(ShapeCast, NearerThanTheBandOnlyMovesThatDoNotCloseInAreGranted) {
  const std::vector<Vec3> wall{{1.0001, -5, -5}, {1.0001, 5, -5}, {1.0001, 0, 9}};
  const PlacedConvex cube{kUnitCube, Vec3::Zero()};
  EXPECT_EQ(castShapeCold(cube, {0.01, 0, 0}, {wall}).lo, 0);
  EXPECT_TRUE(castShapeCold(cube, {0, 0.3, 0}, {wall}).isClear());
  EXPECT_TRUE(castShapeCold(cube, {-0.01, 0, 0}, {wall}).isClear());
}

TEST(ShapeCast, RandomSweepsEqualSmallStepsAndNeverPenetrate) {
  Random random(7);
  int stops = 0;
  for (int i = 0; i < 300; ++i) {
    const std::vector<Vec3> a = makeRandomPoints(random, 12, 0.5);
    const std::vector<Vec3> b = makeRandomPoints(random, 3, 1.5);
    const Vec3 at = makeRandomPoint(random, 2);
    const Vec3 by = -2 * at + makeRandomPoint(random, 1);
    FeatureCache cache;
    if (computeSeparation({a, at}, {b}, cache).distance < 2 * kBand.rest) continue;
    const MotionResult result = castShapeCold({a, at}, by, {b});
    stops += result.isClear() ? 0 : 1;
    constexpr int kSteps = 200;
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= kSteps; ++k) {
      const double s = result.lo * k / kSteps;
      const SeparationResult d = computeSeparation({a, at + s * by}, {b}, cache);
      ASSERT_EQ(d.verdict, Verdict::separated) << "case " << i << " step " << k;
      nearest = std::min(nearest, d.distance);
    }
    EXPECT_GE(nearest, kBand.min - 1e-12) << "case " << i;
    if (result.isClear()) continue;
    // A slightly larger fraction would come closer than the contact offset.
    const double beyond = (2 * kBand.rest + 1e-9) / by.norm();
    const double rest = std::min(1.0, result.lo + beyond * 40);
    double deepest = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= kSteps; ++k) {
      const double s = result.lo + (rest - result.lo) * k / kSteps;
      deepest = std::min(deepest, computeSeparation({a, at + s * by}, {b}, cache).distance);
    }
    EXPECT_LT(deepest, kBand.rest) << "case " << i;
  }
  EXPECT_GT(stops, 40);
  EXPECT_LT(stops, 260);
}

}  // namespace
}  // namespace enfilade::collision
