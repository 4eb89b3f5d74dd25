#include "collision/narrow_phase/contact_manifold.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "tests/collision/moving_shapes.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

Hull makeBoxHull(const Vec3& half) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back(i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(),
                         i & 4 ? half.z() : -half.z());
  return buildHull(corners);
}

PlacedConvex makeConvex(const Hull& hull, const Vec3& at, const Mat3* rotation = nullptr) {
  return {hull.vertices, at, rotation, &hull};
}

ContactManifold computeManifold(const PlacedConvex& a, const PlacedConvex& b, double limit,
                                std::size_t maxPoints = 4) {
  FeatureCache features;
  const SeparationResult separation = computeSeparation(a, b, features);
  if (separation.verdict != Verdict::penetrating)
    return computeContactManifold(
        a, b, {separation.normal, separation.pointA, separation.pointB, limit, maxPoints});
  DepthCache cache;
  const PenetrationResult depth = computePenetrationDepth(a, b, features, cache);
  return computeContactManifold(a, b, {depth.normal, depth.pointA, depth.pointB, limit, maxPoints});
}

/// Each point of `expected` (x and z, at height 0) occurs exactly once.
void expectPoints(const ContactManifold& manifold, const std::vector<Vec3>& expected,
                  double separation) {
  ASSERT_EQ(manifold.size, expected.size());
  for (const Vec3& point : expected) {
    const auto near = [&](const ContactPoint& p) { return (p.pointA - point).norm() < 1e-12; };
    const auto list = manifold.activePoints();
    EXPECT_EQ(std::count_if(list.begin(), list.end(), near), 1) << point.transpose();
  }
  for (const ContactPoint& point : manifold.activePoints()) {
    EXPECT_NEAR(point.separation, separation, 1e-12);
    EXPECT_NEAR((point.pointB - point.pointA - point.separation * manifold.normal).norm(), 0,
                1e-12);
  }
}

const Hull kFloor = makeBoxHull({10, 1, 10});  // its top is at 0 when it stands at -1
const Vec3 kFloorAt(0, -1, 0);

TEST(ContactManifold, ABoxOnABoxHasItsFourCorners) {
  const Hull box = makeBoxHull({0.5, 0.25, 1});
  for (const double gap : {0.0, 1e-4}) {
    const auto m =
        computeManifold(makeConvex(kFloor, kFloorAt), makeConvex(box, {2, 0.25 + gap, 3}), 1e-3);
    EXPECT_NEAR((m.normal - Vec3::UnitY()).norm(), 0, 1e-10);  // rounding over the gap
    expectPoints(m, {{1.5, 0, 2}, {2.5, 0, 2}, {1.5, 0, 4}, {2.5, 0, 4}}, gap);
  }
}

TEST(ContactManifold, APenetratingBoxHasFourCornersAtItsDepth) {
  const Hull box = makeBoxHull({0.5, 0.25, 1});
  const auto m =
      computeManifold(makeConvex(kFloor, kFloorAt), makeConvex(box, {2, 0.25 - 0.01, 3}), 1e-3);
  EXPECT_NEAR((m.normal - Vec3::UnitY()).norm(), 0, 1e-9);
  expectPoints(m, {{1.5, 0, 2}, {2.5, 0, 2}, {1.5, 0, 4}, {2.5, 0, 4}}, -0.01);
}

TEST(ContactManifold, ABoxThatHangsOverIsCutAtTheBorder) {
  const Hull box = makeBoxHull({1, 1, 1});
  const auto m = computeManifold(makeConvex(kFloor, kFloorAt), makeConvex(box, {10, 1, 0}), 0);
  expectPoints(m, {{9, 0, -1}, {9, 0, 1}, {10, 0, -1}, {10, 0, 1}}, 0);
}

TEST(ContactManifold, AVertexOnAFaceIsOnePoint) {
  const Hull tip = buildHull(std::vector<Vec3>{{0, 0, 0}, {1, 1, 0}, {-1, 1, 1}, {-1, 1, -1}});
  expectPoints(computeManifold(makeConvex(kFloor, kFloorAt), makeConvex(tip, {3, 0, 4}), 1e-3),
               {{3, 0, 4}}, 0);
}

TEST(ContactManifold, AnEdgeOnAFaceIsTwoPoints) {
  const Hull roof = buildHull(
      std::vector<Vec3>{{0, 0, -1}, {0, 0, 1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, -1}, {-1, 1, 1}});
  expectPoints(computeManifold(makeConvex(kFloor, kFloorAt), makeConvex(roof, {3, 0, 4}), 1e-3),
               {{3, 0, 3}, {3, 0, 5}}, 0);
}

TEST(ContactManifold, TwoEdgesThatCrossMeetInOnePoint) {
  const Hull roof = buildHull(
      std::vector<Vec3>{{0, 0, -1}, {0, 0, 1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, -1}, {-1, 1, 1}});
  const Hull ridge = buildHull(
      std::vector<Vec3>{{-1, 0, 0}, {1, 0, 0}, {-1, -1, 1}, {1, -1, 1}, {-1, -1, -1}, {1, -1, -1}});
  const PlacedConvex a = makeConvex(ridge, {0.25, 0, 0.5}), b = makeConvex(roof, {0, 1e-4, 0});
  expectPoints(computeManifold(a, b, 1e-3), {{0, 0, 0.5}}, 1e-4);
}

TEST(ContactManifold, TwoEdgesSideBySideHaveTwoPoints) {
  const std::vector<Vec3> a{{0, 0, 0}, {2, 0, 0}}, b{{1, 1e-4, 0}, {5, 1e-4, 0}};
  expectPoints(computeManifold({a}, {b}, 1e-3), {{1, 0, 0}, {2, 0, 0}}, 1e-4);
}

TEST(ContactManifold, FlatBodiesHaveTheirCorners) {
  const std::vector<Vec3> triangle{{-4, 0, -4}, {8, 0, -4}, {-4, 0, 8}};
  const Hull box = makeBoxHull({0.5, 0.5, 0.5});
  const auto m = computeManifold({triangle}, makeConvex(box, {0, 0.5, 0}), 0);
  expectPoints(m, {{-.5, 0, -.5}, {.5, 0, -.5}, {-.5, 0, .5}, {.5, 0, .5}}, 0);
  const std::vector<Vec3> point{{0, 0, 0}};
  expectPoints(computeManifold({triangle}, {point, Vec3(1, 0, 1)}, 0), {{1, 0, 1}}, 0);
}

TEST(ContactManifold, ALeaningBoxStandsOnTwoPointsAndOnFourWithinTheLimit) {
  const Hull box = makeBoxHull({0.5, 0.5, 0.5});
  const Mat3 rotation = computeRotationAt(1e-3, Vec3(0, 0, 1));  // the far edge is 1 mm up
  const Vec3 at(0, 0.5005, 0);
  const PlacedConvex floor = makeConvex(kFloor, kFloorAt), leaning = makeConvex(box, at, &rotation);
  EXPECT_EQ(computeManifold(floor, leaning, 1e-4).size, 2u);
  EXPECT_EQ(computeManifold(floor, leaning, 5e-3).size, 4u);
}

TEST(ContactManifold, DistantBodiesHaveNoPoints) {
  const Hull box = makeBoxHull({0.5, 0.5, 0.5});
  EXPECT_EQ(computeManifold(makeConvex(kFloor, kFloorAt), makeConvex(box, {0, 1, 0}), 1e-3).size,
            0u);
}

TEST(ContactManifold, OnlyAsManyPointsAsWantedAndTheDeepestAmongThem) {
  std::vector<Vec3> drum;
  for (int i = 0; i < 16; ++i) {
    const Vec3 at = computeRotationAt(1, Vec3(0, 1, 0)) *
                    Vec3(computeWave(0.25 * i), 0, computeWave(0.25 * i + 1));
    drum.push_back(at);
    drum.push_back(at + Vec3(0, 1, 0));
  }
  const Hull hull = buildHull(drum);
  const Mat3 rotation = computeRotationAt(1e-5, Vec3(1, 0, 2));
  const PlacedConvex floor = makeConvex(kFloor, kFloorAt),
                     b = makeConvex(hull, {0, 1e-4, 0}, &rotation);
  for (const std::size_t maxPoints : {1u, 3u, 8u}) {
    const auto m = computeManifold(floor, b, 1e-3, maxPoints);
    ASSERT_EQ(m.size, maxPoints);
    FeatureCache cold;
    EXPECT_NEAR(m.points[0].separation, computeSeparation(floor, b, cold).distance, 1e-12);
  }
}

TEST(ContactManifold, SwappingFlipsTheNormalAndKeepsThePoints) {
  Random random(41);
  int points = 0;
  for (int i = 0; i < 60; ++i) {
    const Hull first = makeBoxHull({1, 0.5, 1}),
               second = buildHull(makeRandomPoints(random, 12, 0.7));
    const Mat3 turned = computeRotationAt(drawUniform(random, -2, 2), makeRandomPoint(random, 1));
    PlacedConvex a = makeConvex(first, Vec3::Zero()),
                 b = makeConvex(second, {0.1, 3, 0.2}, &turned);
    FeatureCache cold;
    b.translation.y() -= 0.9999 * std::max(0.0, computeSeparation(a, b, cold).distance);
    FeatureCache there, back;
    const SeparationResult one = computeSeparation(a, b, there),
                           two = computeSeparation(b, a, back);
    ASSERT_EQ(one.verdict, Verdict::separated);
    const double limit = one.distance + 1e-2;
    const auto m = computeContactManifold(a, b, {one.normal, one.pointA, one.pointB, limit, 8});
    const auto n = computeContactManifold(b, a, {-one.normal, one.pointB, one.pointA, limit, 8});
    EXPECT_NEAR((one.normal + two.normal).norm(), 0, 1e-9);
    EXPECT_EQ(m.normal, -n.normal);
    ASSERT_EQ(m.size, n.size);
    for (const ContactPoint& p : m.activePoints()) {
      const auto same = [&](const ContactPoint& q) {
        return (p.pointA - q.pointB).norm() < 1e-9 && (p.pointB - q.pointA).norm() < 1e-9;
      };
      EXPECT_TRUE(std::any_of(n.activePoints().begin(), n.activePoints().end(), same));
      EXPECT_GE(p.separation, one.distance - 1e-12);
    }
    points += static_cast<int>(m.size);
  }
  EXPECT_GT(points, 60);
}

}  // namespace
}  // namespace enfilade::collision
