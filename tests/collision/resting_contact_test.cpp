// Bodies on a floor or against a wall at 0 m over many ticks: exact verdicts without rationals.

#include <gtest/gtest.h>

#include <cmath>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/collision/random_shapes.hpp"
#include "tests/collision/rational_verdict.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

std::vector<Vec3> makeBox(const Vec3& size) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k)
    corners.emplace_back(k & 1 ? size.x() : 0, k & 2 ? size.y() : 0, k & 4 ? size.z() : 0);
  return corners;
}

/// A rotation about the vertical; its second row and column are exact.
Mat3 makeRotationAboutY(double radians) {
  const double c = std::cos(radians), s = std::sin(radians);
  Mat3 rotation;
  rotation << c, 0, s, 0, 1, 0, -s, 0, c;
  return rotation;
}

const Hull kFloor = buildHull(makeBox({20, 0.25, 20}));
const Hull kChairLeg = buildHull(makeBox({0.05, 0.45, 0.04}));

TEST(RestingContact, AChairTurnedOnAFloorTouchesItByExpansionAtEveryStep) {
  const PlacedConvex floor{kFloor.vertices, {-10, -0.25, -10}, nullptr, &kFloor};
  FeatureCache cache;
  for (int step = 0; step < 200; ++step) {
    const Mat3 rotation = makeRotationAboutY(0.03 * step);
    const Vec3 at(0.01 * step, 0, -0.02 * step);
    const SeparationResult d =
        computeSeparation({kChairLeg.vertices, at, &rotation, &kChairLeg}, floor, cache);
    ASSERT_EQ(d.verdict, Verdict::touching) << "step " << step;
    ASSERT_EQ(d.certificate, Certificate::expansion) << "step " << step;
    ASSERT_EQ(d.normal, Vec3(-Vec3::UnitY())) << "step " << step;
  }
}

TEST(RestingContact, AWallFollowedAtNoDistanceTouchesByExpansion) {
  const Hull wall = buildHull(makeBox({0.2, 3, 8}));
  const PlacedConvex stands{wall.vertices, {0.375, 0, 0}, nullptr, &wall};
  const Hull box = buildHull(makeBox({0.375, 1.5, 0.3}));
  FeatureCache cache;
  for (int step = 0; step < 100; ++step) {
    const Vec3 at(0, 0.001 * step, 0.07 * step);
    const SeparationResult d = computeSeparation({box.vertices, at, nullptr, &box}, stands, cache);
    ASSERT_EQ(d.verdict, Verdict::touching);
    ASSERT_EQ(d.certificate, Certificate::expansion) << "step " << step;
  }
}

TEST(RestingContact, OneUlpUpOrDownIsSeenAtAnyTurn) {
  const PlacedConvex floor{kFloor.vertices, {-10, -0.25, -10}, nullptr, &kFloor};
  const double ulp = std::nextafter(0.25, 1) - 0.25;
  for (int step = 0; step < 40; ++step) {
    const Mat3 rotation = makeRotationAboutY(0.1 * step);
    FeatureCache cache;
    const auto verdictAt = [&](double y) {
      return computeSeparation({kChairLeg.vertices, {0.3, y, 0.7}, &rotation, &kChairLeg}, floor,
                               cache)
          .verdict;
    };
    EXPECT_EQ(verdictAt(0), Verdict::touching);
    EXPECT_EQ(verdictAt(ulp), Verdict::separated);
    EXPECT_EQ(verdictAt(-ulp), Verdict::penetrating);
    EXPECT_EQ(verdictAt(0), Verdict::touching);
  }
}

/// Boxes of few bits on a grid: face, edge and corner contacts, gaps and overlaps, all frequent.
TEST(RestingContact, BoxesOnAGridAgreeWithRationals) {
  Random random(11);
  std::uniform_int_distribution<int> eighths(1, 4), place(-4, 4);
  const auto some = [&](auto& distribution) {
    const double x = distribution(random), y = distribution(random), z = distribution(random);
    return Vec3(Vec3(x, y, z) / 8);
  };
  int expansions = 0, touching = 0;
  for (int i = 0; i < 400; ++i) {
    const std::vector<Vec3> boxA = makeBox(some(eighths)), boxB = makeBox(some(eighths));
    const PlacedConvex a{boxA, some(place)}, b{boxB, some(place)};
    FeatureCache cache;
    const SeparationResult d = computeSeparation(a, b, cache);
    ASSERT_EQ(d.verdict, computeRationalVerdict(a, b)) << "case " << i;
    touching += d.verdict == Verdict::touching;
    expansions += d.certificate == Certificate::expansion;
  }
  EXPECT_GT(touching, 30);
  EXPECT_EQ(expansions, touching);
}

TEST(RestingContact, BoxesWithOneCentreHaveAGlobalDepth) {
  const std::vector<Vec3> outer = makeBox({2, 3, 4}), inner = makeBox({1, 1, 1});
  const PlacedConvex a{outer, Vec3::Zero()}, b{inner, {0.5, 1, 1.5}};
  FeatureCache cache;
  const SeparationResult d = computeSeparation(a, b, cache);
  EXPECT_EQ(d.verdict, Verdict::penetrating);
  EXPECT_EQ(d.certificate, Certificate::filter);
  DepthCache none;
  const PenetrationResult depth = computePenetrationDepth(a, b, cache, none);
  EXPECT_TRUE(depth.global);
  EXPECT_NEAR(depth.depth, 1.5, 4e-15);
}

}  // namespace
}  // namespace enfilade::collision
