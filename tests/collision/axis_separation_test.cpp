#include "collision/narrow_phase/axis_separation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "collision/shapes/hull.hpp"

namespace enfilade::collision {
namespace {

Vec3 anyUnit(std::mt19937& random) {
  std::normal_distribution<double> number;
  return Vec3(number(random), number(random), number(random)).normalized();
}

Hull anyHull(std::mt19937& random, int points) {
  std::vector<Vec3> corners;
  for (int i = 0; i < points; ++i) corners.push_back(0.1 * anyUnit(random));
  return buildHull(corners);
}

TEST(Gap, IsNeverMoreThanTheDistanceAndAllOfItAlongTheClosestPoints) {
  std::mt19937 random(5);
  int apart = 0;
  for (int i = 0; i < 2000; ++i) {
    const int corners = i % 4 == 0 ? 60 : 6 + i % 11;  // many: by climbing
    const Hull a = anyHull(random, corners), b = anyHull(random, 8);
    const Mat3 turned = Eigen::AngleAxisd(1.0 + i, anyUnit(random)).toRotationMatrix();
    const ConvexBody bodyA{a.vertices, 5 * anyUnit(random), &turned, &a};
    const ConvexBody bodyB{b.vertices, bodyA.translation + 0.25 * anyUnit(random), nullptr, &b};
    FeatureCache cache;
    const Decision decision = decide(bodyA, bodyB, cache);
    const double distance = decision.distance + decision.errorBound;
    EXPECT_LE(gapAlong(bodyA, bodyB, anyUnit(random)).proved, distance) << i;
    if (decision.verdict != Verdict::separated) continue;
    ++apart;
    const Gap along = gapAlong(bodyA, bodyB, decision.normal);
    EXPECT_LE(along.proved, distance) << i;
    EXPECT_NEAR(along.proved, decision.distance, 1e-13) << i;
    EXPECT_NEAR(along.value, decision.distance, 1e-13) << i;
  }
  EXPECT_GT(apart, 600);
}

TEST(Gap, SwappingTheBodiesAndTheDirectionChangesNothing) {
  std::mt19937 random(6);
  for (int i = 0; i < 200; ++i) {
    const Hull a = anyHull(random, 8), b = anyHull(random, 8);
    const ConvexBody bodyA{a.vertices, anyUnit(random), nullptr, &a};
    const ConvexBody bodyB{b.vertices, anyUnit(random), nullptr, &b};
    const Vec3 direction = anyUnit(random);
    const Gap one = gapAlong(bodyA, bodyB, direction), other = gapAlong(bodyB, bodyA, -direction);
    EXPECT_NEAR(one.value, other.value, 1e-15);
    EXPECT_EQ(one.vertices.a, other.vertices.b);
    EXPECT_EQ(one.vertices.b, other.vertices.a);
  }
}

TEST(Gap, WhatIsNotFiniteProvesNothing) {
  std::mt19937 random(7);
  const Hull a = anyHull(random, 8);
  const ConvexBody here{a.vertices, Vec3::Zero(), nullptr, &a};
  const ConvexBody nowhere{a.vertices, {std::nan(""), 0, 0}, nullptr, &a};
  EXPECT_EQ(gapAlong(here, nowhere, Vec3::UnitX()).proved,
            -std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace enfilade::collision
