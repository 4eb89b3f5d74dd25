#include "collision/motion/separating_planes.hpp"

#include <gtest/gtest.h>

#include "collision/narrow_phase/refine.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

Aabb computeBox(const PlacedConvex& body) {
  Aabb box;
  for (const Vec3& vertex : body.vertices) box.include(vertex + body.translation);
  return box;
}

/// As a caller does: by the planes, or by the axis of the last query.
bool haveMissed(SeparatingPlanes& planes, const PlacedConvex& body, const Vec3& axis) {
  return planes.haveMissed(body, computeBox(body)) || planes.tryAxis(body, computeBox(body), axis);
}
bool haveMissed(SeparatingPlanes& planes, const std::vector<Vec3>& vertices, const Vec3& axis) {
  return haveMissed(planes, PlacedConvex{vertices}, axis);
}

/// Triangle parallel to the plane x = 0 at `x`.
std::vector<Vec3> makePaneAt(double x, double z) {
  return {{x, 0, z}, {x, 1, z}, {x, 0, z + 1}};
}

TEST(SeparatingPlanes, OnePlaneServesTheNeighboursThatHaveNoAxisYet) {
  const PlacedConvex cube{kUnitCube};
  SeparatingPlanes planes(cube, {0.25, 0, 0}, 0.125);
  EXPECT_FALSE(haveMissed(planes, makePaneAt(2, 0), Vec3::Zero()));
  EXPECT_TRUE(haveMissed(planes, makePaneAt(2, 0), {3, 0, 0}));
  for (int i = 1; i < 50; ++i) EXPECT_TRUE(haveMissed(planes, makePaneAt(2, i), Vec3::Zero())) << i;
  EXPECT_TRUE(planes.haveMissed(Aabb{{2, 0, 0}, {3, 9, 9}}));
  EXPECT_FALSE(planes.haveMissed(Aabb{{1.3, 0, 0}, {3, 9, 9}}));
}

TEST(SeparatingPlanes, WhatTheMotionReachesIsNotMissed) {
  const PlacedConvex cube{kUnitCube};
  const Vec3 axis = Vec3::UnitX();
  SeparatingPlanes planes(cube, {0.25, 0, 0}, 0.125);
  EXPECT_FALSE(haveMissed(planes, makePaneAt(1.375, 0), axis));  // exactly at the distance
  EXPECT_TRUE(haveMissed(planes, makePaneAt(1.375 + 1e-12, 0), axis));
  planes.reduceTo({0.125, 0, 0}, 0.125);
  EXPECT_TRUE(haveMissed(planes, makePaneAt(1.26, 0), axis));
  EXPECT_FALSE(haveMissed(planes, makePaneAt(1.25, 0), axis));
}

TEST(SeparatingPlanes, ALargeTriangleIsMissedThoughItsBoxIsNot) {
  const std::vector<Vec3> slope{{0, 2.5, 0}, {2.5, 0, 0}, {0, 2.5, 1}};
  const PlacedConvex cube{kUnitCube};
  SeparatingPlanes planes(cube, Vec3::Zero(), 0.125);
  EXPECT_TRUE(haveMissed(planes, slope, {1, 1, 0}));
}

TEST(SeparatingPlanes, AxesOfAnyLengthAndNoneAreAllowed) {
  const PlacedConvex cube{kUnitCube};
  for (const double length : {5e-324, 1e-200, 2.3e-162, 1e-155, 1e-30, 1.0, 1e30, 1e200, 1e308}) {
    SeparatingPlanes planes(cube, Vec3::Zero(), 0.125);
    EXPECT_FALSE(haveMissed(planes, makePaneAt(1.121, 0), {length, 0, 0})) << length;
    EXPECT_FALSE(haveMissed(planes, makePaneAt(2, 0), {-length, 0, 0})) << length;
    EXPECT_TRUE(haveMissed(planes, makePaneAt(1.126, 0), {length, 0, 0})) << length;
  }
  SeparatingPlanes planes(cube, Vec3::Zero(), 0.125);
  EXPECT_FALSE(haveMissed(planes, makePaneAt(2, 0), Vec3::Zero()));
}
/// Dyadic points up to `size` (a power of two) from the origin: sums with other such points are
/// exact.
std::vector<Vec3> makeDyadicPoints(Random& random, int count, double size) {
  std::vector<Vec3> points = makeLatticePoints(random, count, 1024);
  for (Vec3& point : points) point *= size / 1024;
  return points;
}

struct Tally {
  int missed = 0, reached = 0;
};

/// One body among 40 others near `origin`. Every proved miss is checked exactly, with the hull of
/// the body at the start and at the end.
void checkMotion(Random& random, const Vec3& origin, Tally& tally) {
  const std::vector<Vec3> vertices = makeDyadicPoints(random, 12, 0.5);
  const Vec3 displacement = makeDyadicPoints(random, 1, 0.25).front();
  const double distance = 0x1p-6;
  const PlacedConvex a{vertices, origin};
  std::vector<Vec3> swept = vertices;
  for (const Vec3& vertex : vertices) swept.push_back(vertex + displacement);
  const PlacedConvex whole{swept, origin};
  SeparatingPlanes planes(a, displacement, distance);
  for (int i = 0; i < 40; ++i) {
    const std::vector<Vec3> obstacle = makeDyadicPoints(random, 3 + 7 * (i % 2), 0.5);
    const PlacedConvex b{obstacle, origin + makeDyadicPoints(random, 1, 2).front()};
    FeatureCache cache;
    if (i % 4 != 0) computeSeparation(a, b, cache);
    const bool missed = haveMissed(planes, b, cache.axis);
    FeatureCache cold;
    const bool reached = isCloserThan(whole, b, distance, cold);
    ASSERT_FALSE(missed && reached) << i;
    tally.missed += missed ? 1 : 0, tally.reached += reached ? 1 : 0;
  }
}

TEST(SeparatingPlanes, AProvedMissIsAMissExactly) {
  Random random(11);
  for (const double far : {0.0, 1024.0, 0x1p20}) {
    Tally tally;
    for (int i = 0; i < 100; ++i) checkMotion(random, {far, -far, 0.5 * far}, tally);
    EXPECT_GT(tally.reached, 100) << far;
    EXPECT_GT(tally.missed, 0.9 * (4000 - tally.reached)) << far;
  }
}

}  // namespace
}  // namespace enfilade::collision
