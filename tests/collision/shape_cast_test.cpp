#include "collision/motion/shape_cast.hpp"

#include <gtest/gtest.h>

#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

const std::vector<Vec3> kUnitCube{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                  {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
constexpr StoppingBand kBand{0.0004375, 0.000515625};

SweepResult sweepCold(const ConvexBody& a, const Vec3& by, const ConvexBody& b) {
  FeatureCache cache;
  return sweep(a, by, b, kBand, cache);
}

TEST(Sweep, ACubeTwoMetresFromAWallStopsAfterTwoMetres) {
  const std::vector<Vec3> wall{{3, -5, -5}, {3, 5, -5}, {3, 0, 9}};
  const SweepResult result = sweepCold({kUnitCube, Vec3::Zero()}, {10, 0, 0}, {wall});
  ASSERT_TRUE(result.stopped);
  EXPECT_NEAR(10 * result.fraction, 2, 6e-4);
  EXPECT_LT(10 * result.fraction, 2 - kBand.low);
  EXPECT_NEAR(result.atStop.normal.x(), 1, 1e-12);
}

TEST(Sweep, MovingAwayMisses) {
  const std::vector<Vec3> wall{{3, -5, -5}, {3, 5, -5}, {3, 0, 9}};
  EXPECT_FALSE(sweepCold({kUnitCube, Vec3::Zero()}, {-10, 0, 0}, {wall}).stopped);
}

TEST(Sweep, AMoveTooShortToArriveMisses) {
  const std::vector<Vec3> wall{{3, -5, -5}, {3, 5, -5}, {3, 0, 9}};
  EXPECT_FALSE(sweepCold({kUnitCube, Vec3::Zero()}, {1.99, 0, 0}, {wall}).stopped);
}

TEST(Sweep, AThinPaneIsNotCrossedAtAnySpeed) {
  const std::vector<Vec3> pane{{3, -5, -5}, {3, 5, -5}, {3, 0, 9}};
  for (const double length : {3.0, 100.0, 1e4, 1e7}) {
    const SweepResult result = sweepCold({kUnitCube, Vec3::Zero()}, {length, 0, 0}, {pane});
    ASSERT_TRUE(result.stopped) << length;
    EXPECT_LT(length * result.fraction, 2) << length;
  }
}

TEST(Sweep, ARestingBodyGlidesOverTheSeamOfItsFloor) {
  // Two floor plates that meet at x = 1.2; the cube rests at the high mark above both.
  const std::vector<Vec3> next{{1.2, 0, -5}, {9, 0, -5}, {1.2, 0, 9}};
  const SweepResult result = sweepCold({kUnitCube, {0, kBand.high, 0}}, {3, 0, 0}, {next});
  EXPECT_FALSE(result.stopped);
}

TEST(Sweep, NearerThanTheBandOnlyMovesThatDoNotCloseInAreGranted) {
  const std::vector<Vec3> wall{{1.0001, -5, -5}, {1.0001, 5, -5}, {1.0001, 0, 9}};
  const ConvexBody cube{kUnitCube, Vec3::Zero()};
  EXPECT_EQ(sweepCold(cube, {0.01, 0, 0}, {wall}).fraction, 0);
  EXPECT_FALSE(sweepCold(cube, {0, 0.3, 0}, {wall}).stopped);
  EXPECT_FALSE(sweepCold(cube, {-0.01, 0, 0}, {wall}).stopped);
}

TEST(Sweep, RandomSweepsEqualSmallStepsAndNeverPenetrate) {
  Random random(7);
  int stops = 0;
  for (int i = 0; i < 300; ++i) {
    const std::vector<Vec3> a = randomPoints(random, 12, 0.5);
    const std::vector<Vec3> b = randomPoints(random, 3, 1.5);
    const Vec3 at = randomPoint(random, 2);
    const Vec3 by = -2 * at + randomPoint(random, 1);
    FeatureCache cache;
    if (decide({a, at}, {b}, cache).distance < 2 * kBand.high) continue;
    const SweepResult result = sweepCold({a, at}, by, {b});
    stops += result.stopped ? 1 : 0;
    constexpr int kSteps = 200;
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= kSteps; ++k) {
      const double s = result.fraction * k / kSteps;
      const Decision d = decide({a, at + s * by}, {b}, cache);
      ASSERT_EQ(d.verdict, Verdict::separated) << "case " << i << " step " << k;
      nearest = std::min(nearest, d.distance);
    }
    EXPECT_GE(nearest, kBand.low - 1e-12) << "case " << i;
    if (!result.stopped) continue;
    // A little further it would come nearer than the band.
    const double beyond = (2 * kBand.high + 1e-9) / by.norm();
    const double rest = std::min(1.0, result.fraction + beyond * 40);
    double deepest = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= kSteps; ++k) {
      const double s = result.fraction + (rest - result.fraction) * k / kSteps;
      deepest = std::min(deepest, decide({a, at + s * by}, {b}, cache).distance);
    }
    EXPECT_LT(deepest, kBand.high) << "case " << i;
  }
  EXPECT_GT(stops, 40);
  EXPECT_LT(stops, 260);
}

}  // namespace
}  // namespace enfilade::collision
