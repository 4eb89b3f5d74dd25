#include "collision/narrow_phase/axis_separation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "collision/shapes/hull.hpp"

namespace enfilade::collision {
namespace {

Vec3 drawDirection(std::mt19937& random) {
  std::normal_distribution<double> number;
  return Vec3(number(random), number(random), number(random)).normalized();
}

Hull makeSmallHull(std::mt19937& random, int points) {
  std::vector<Vec3> corners;
  for (int i = 0; i < points; ++i) corners.push_back(0.1 * drawDirection(random));
  return buildHull(corners);
}

TEST(AxisSeparation, IsNeverMoreThanTheDistanceAndAllOfItAlongTheClosestPoints) {
  std::mt19937 random(5);
  int apart = 0;
  for (int i = 0; i < 2000; ++i) {
    const int corners = i % 4 == 0 ? 60 : 6 + i % 11;  // many: by climbing
    const Hull a = makeSmallHull(random, corners), b = makeSmallHull(random, 8);
    const Mat3 turned = Eigen::AngleAxisd(1.0 + i, drawDirection(random)).toRotationMatrix();
    const PlacedConvex bodyA{a.vertices, 5 * drawDirection(random), &turned, &a};
    const PlacedConvex bodyB{b.vertices, bodyA.translation + 0.25 * drawDirection(random), nullptr,
                             &b};
    FeatureCache cache;
    const SeparationResult separation = computeSeparation(bodyA, bodyB, cache);
    const double distance = separation.distance + separation.errorBound;
    EXPECT_LE(computeAxisSeparation(bodyA, bodyB, drawDirection(random)).lowerBound, distance) << i;
    if (separation.verdict != Verdict::separated) continue;
    ++apart;
    const AxisSeparation along = computeAxisSeparation(bodyA, bodyB, separation.normal);
    EXPECT_LE(along.lowerBound, distance) << i;
    EXPECT_NEAR(along.lowerBound, separation.distance, 1e-13) << i;
    EXPECT_NEAR(along.value, separation.distance, 1e-13) << i;
  }
  EXPECT_GT(apart, 600);
}

TEST(AxisSeparation, SwappingTheBodiesAndTheDirectionChangesNothing) {
  std::mt19937 random(6);
  for (int i = 0; i < 200; ++i) {
    const Hull a = makeSmallHull(random, 8), b = makeSmallHull(random, 8);
    const PlacedConvex bodyA{a.vertices, drawDirection(random), nullptr, &a};
    const PlacedConvex bodyB{b.vertices, drawDirection(random), nullptr, &b};
    const Vec3 direction = drawDirection(random);
    const AxisSeparation one = computeAxisSeparation(bodyA, bodyB, direction),
                         other = computeAxisSeparation(bodyB, bodyA, -direction);
    EXPECT_NEAR(one.value, other.value, 1e-15);
    EXPECT_EQ(one.vertices.a, other.vertices.b);
    EXPECT_EQ(one.vertices.b, other.vertices.a);
  }
}

TEST(AxisSeparation, NonFiniteInputCertifiesNothing) {
  std::mt19937 random(7);
  const Hull a = makeSmallHull(random, 8);
  const PlacedConvex here{a.vertices, Vec3::Zero(), nullptr, &a};
  const PlacedConvex nowhere{a.vertices, {std::nan(""), 0, 0}, nullptr, &a};
  EXPECT_EQ(computeAxisSeparation(here, nowhere, Vec3::UnitX()).lowerBound,
            -std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace enfilade::collision
