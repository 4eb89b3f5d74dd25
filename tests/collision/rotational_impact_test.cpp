// Time of impact of rotating bodies: known answers, small steps as the reference, and invariants of
// every answer.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/motion/time_of_impact.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

std::vector<Vec3> makeBox(const Vec3& low, const Vec3& high) {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    points.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                        (i & 4) != 0 ? high.z() : low.z());
  return points;
}

const std::vector<Vec3> kCube = makeBox(Vec3::Constant(-1), Vec3::Constant(1));
const std::vector<Vec3> kHalfCube = makeBox(Vec3::Constant(-0.5), Vec3::Constant(0.5));

Motion makeSpinning(const Vec3& angularVelocity) {
  return {Vec3::Zero(), Vec3::Zero(), angularVelocity};
}

MotionResult findImpactCold(const MovingBody& a, const MovingBody& b, double horizon) {
  FeatureCache cache;
  return computeTimeOfImpact(a, b, horizon, cache);
}

void expectContactAt(const MotionResult& impact, double time) {
  ASSERT_EQ(impact.outcome, MotionOutcome::contact);
  EXPECT_LE(impact.lo, time + 4e-15 * (1 + time));
  EXPECT_GE(impact.hi, time - 4e-15 * (1 + time));
  EXPECT_LE(impact.hi - impact.lo, 1e-12 * (1 + impact.hi));
}

TEST(RotationalImpact, ARodAlongAWallMeetsItWithItsTip) {
  const auto wall = makeBox({-5, -1, -5}, {5, 0, 5});
  for (const double height : {1e-6, 1e-4, 0.01, 0.5}) {
    const auto rod = makeBox({-1, 0, -0.01}, {1, 0.02, 0.01});
    const MovingBody a{{rod, {0, height, 0}}, makeSpinning({0, 0, 2})};
    // The lower corner at (-1, 0) rotates down.
    expectContactAt(findImpactCold(a, {{wall}, {}}, 10), std::asin(height) / 2);
  }
}

TEST(RotationalImpact, ACubeNextToAWallMeetsItWithItsEdge) {
  const auto wall = makeBox({1.2, -5, -5}, {2, 5, 5});
  const MovingBody cube{{kCube}, makeSpinning({0, 0.5, 0})};
  const double angle = std::atan(1.0) - std::acos(1.2 / std::sqrt(2.0));
  expectContactAt(findImpactCold(cube, {{wall}, {}}, 10), angle / 0.5);
}

TEST(RotationalImpact, ACubeThatHasRoomTurnsForever) {
  const auto wall = makeBox({1.4143, -5, -5}, {2, 5, 5});
  const MovingBody cube{{kCube}, makeSpinning({0, 3, 0})};
  const MotionResult impact = findImpactCold(cube, {{wall}, {}}, 20);
  EXPECT_EQ(impact.outcome, MotionOutcome::clear);
  EXPECT_EQ(impact.lo, 20);
}

TEST(RotationalImpact, ADoorMeetsAPostNearItsHingeInFewSteps) {
  const auto door = makeBox({0, 0, -0.02}, {1, 2, 0.02});
  for (const double far : {0.05, 0.2, 0.9}) {
    const std::vector<Vec3> post{{0, 1, 0}};
    const double angle = 1;  // of the post, seen from the hinge; the door rotates towards it
    const MovingBody b{{post, {far * std::cos(angle), 0, -far * std::sin(angle)}}, {}};
    const MovingBody a{{door}, makeSpinning({0, 0.25, 0})};
    const MotionResult impact = findImpactCold(a, b, 64);
    expectContactAt(impact, (angle - std::asin(0.02 / far)) / 0.25);
    EXPECT_LE(impact.queries, 25u) << far;
  }
}

TEST(RotationalImpact, TwoTurningRodsCrossedMeetEdgeOnEdge) {
  // Each rotates about its own centre; they meet at long edges, inclined to each other.
  const auto rod = makeBox({-2, -0.05, -0.05}, {2, 0.05, 0.05});
  const Mat3 across = Eigen::AngleAxisd(1.2, Vec3::UnitY()).toRotationMatrix();
  const MovingBody a{{rod}, makeSpinning({0.3, 0, 0.2})};
  const MovingBody b{{rod, {0.3, 0.4, 0.2}, &across}, makeSpinning({0, 0.1, -0.25})};
  const MotionResult impact = findImpactCold(a, b, 64);
  ASSERT_EQ(impact.outcome, MotionOutcome::contact);
  EXPECT_LE(impact.hi - impact.lo, 1e-12 * (1 + impact.hi));
  EXPECT_LE(impact.queries, 40u);
}

TEST(RotationalImpact, BodiesThatRotateTogetherNeverMeet) {
  const MovingBody a{{kCube}, makeSpinning({0, 1, 0})};
  const MovingBody b{{kHalfCube, {0, 1.5 + 1e-9, 0}}, makeSpinning({0, 1, 0})};
  EXPECT_EQ(findImpactCold(a, b, 10).outcome, MotionOutcome::clear);
}

TEST(RotationalImpact, BodiesThatTouchHaveMetAlready) {
  const MovingBody a{{kCube}, makeSpinning({0, 1, 0})};
  const MovingBody b{{kCube, {2, 0, 0}}, {}};
  const MotionResult impact = findImpactCold(a, b, 10);
  EXPECT_EQ(impact.outcome, MotionOutcome::contact);
  EXPECT_EQ(impact.hi, 0);
}

TEST(RotationalImpact, AFallingCubeMeetsTheFloorAfterTheRootOfTwiceTheHeight) {
  const auto floor = makeBox({-5, -1, -5}, {5, 0, 5});
  const MovingBody cube{{kCube, {0, 1 + 4.9, 0}}, {Vec3::Zero(), {0, -9.8, 0}, Vec3::Zero()}};
  expectContactAt(findImpactCold(cube, {{floor}, {}}, 10), 1);
}

TEST(RotationalImpact, ABallThrownUpComesBack) {
  const auto floor = makeBox({-5, -1, -5}, {5, 0, 5});
  const MovingBody cube{{kCube, {0, 1.5, 0}}, {{0, 4.9, 0}, {0, -9.8, 0}, Vec3::Zero()}};
  const double time = (4.9 + std::sqrt(4.9 * 4.9 + 2 * 9.8 * 0.5)) / 9.8;
  expectContactAt(findImpactCold(cube, {{floor}, {}}, 10), time);
}

TEST(GrazingImpact, ABodyThatSlidesOnAFaceMeetsItWhenItsEdgeIsOverIt) {
  // Their faces lie in one plane: they touch and never penetrate. Contact at x = 1.
  const auto table = makeBox({1, -1, -5}, {9, 0, 5});
  for (const double speed : {1.0, 0.3, 7.77}) {
    const MovingBody a{{kCube, {-3, 1, 0}}, {{speed, 0, 0}, Vec3::Zero(), Vec3::Zero()}};
    expectContactAt(findImpactCold(a, {{table}, {}}, 60), 3 / speed);
  }
}

TEST(GrazingImpact, OneUlpOfRoomIsRoom) {
  const auto table = makeBox({1, -1, -5}, {9, 0, 5});
  const MovingBody a{{kCube, {-3, 1 + 0x1p-52, 0}}, {{0.3, 0, 0}, Vec3::Zero(), Vec3::Zero()}};
  const MotionResult impact = findImpactCold(a, {{table}, {}}, 60);
  EXPECT_EQ(impact.outcome, MotionOutcome::clear);
}

TEST(GrazingImpact, OneUlpTooLittleIsAContact) {
  const auto table = makeBox({1, -1, -5}, {9, 0, 5});
  const MovingBody a{{kCube, {-3, 1 - 0x1p-53, 0}}, {{0.3, 0, 0}, Vec3::Zero(), Vec3::Zero()}};
  expectContactAt(findImpactCold(a, {{table}, {}}, 60), 10);
}

TEST(GrazingImpact, PolygonsInOnePlaneMeet) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const MovingBody a{{square}, {{0.7, 0, 0}, Vec3::Zero(), Vec3::Zero()}};
  expectContactAt(findImpactCold(a, {{square, {3, 0.5, 0}}, {}}, 60), 2 / 0.7);
}

/// Shortly before and shortly after contact they are separated.
TEST(GrazingImpact, AContactOfOneInstantIsFoundIfTheInstantIsADouble) {
  const std::vector<Vec3> point{{0, 0, 0}}, rod{{0, 0, -1}, {0, 0, 1}};
  for (const double time : {0.5, 0.4375, 3.0, 40.125}) {
    const MovingBody a{{point, {-2 * time, 0, 0}}, {{2, 0, 0}, Vec3::Zero(), Vec3::Zero()}};
    const MotionResult impact = findImpactCold(a, {{rod}, {}}, 64);
    expectContactAt(impact, time);
    EXPECT_EQ(impact.hi, time);
  }
}

TEST(GrazingImpact, AThrownCubeThatJustFailsToReachTheCeilingMisses) {
  // It rises by 1/2 m: v^2 / 2g with v = g = 1.
  const auto ceiling = makeBox({-5, 0, -5}, {5, 1, 5});
  const Motion thrown{{0, 1, 0}, {0, -1, 0}, Vec3::Zero()};
  const MovingBody low{{kCube, {0, -1.5 - 1e-12, 0}}, thrown};
  EXPECT_EQ(findImpactCold(low, {{ceiling}, {}}, 2).outcome, MotionOutcome::clear);
  const MovingBody high{{kCube, {0, -1.5 + 0x1p-20, 0}}, thrown};
  expectContactAt(findImpactCold(high, {{ceiling}, {}}, 2), 1 - std::sqrt(0x1p-19));
}

struct Tumble {
  std::vector<Vec3> pointsA, pointsB;
  Mat3 rotationB;
  MovingBody a, b;
};

void makeTumble(Random& random, Tumble& tumble) {
  tumble.pointsA = makeRandomPoints(random, 8, 0.5);
  tumble.pointsB = makeRandomPoints(random, 6, 0.5);
  tumble.rotationB =
      Eigen::AngleAxisd(drawUniform(random, 0, 6), makeRandomPoint(random, 1).normalized())
          .toRotationMatrix();
  const Vec3 start = makeRandomPoint(random, 1).normalized() * drawUniform(random, 1, 4);
  const Vec3 aim = makeRandomPoint(random, 0.8);
  tumble.a = {{tumble.pointsA},
              {aim - start, makeRandomPoint(random, 0.3), makeRandomPoint(random, 3)}};
  tumble.a.body.translation = start;
  tumble.b = {{tumble.pointsB, Vec3::Zero(), &tumble.rotationB},
              {makeRandomPoint(random, 0.2), Vec3::Zero(), makeRandomPoint(random, 3)}};
}

/// The separation at a time, with a pose by Eigen and libm.
SeparationResult computeSeparationAt(const Tumble& tumble, double time) {
  std::array<Mat3, 2> rotations;
  std::array<PlacedConvex, 2> bodies{tumble.a.body, tumble.b.body};
  const std::array<Motion, 2> motions{tumble.a.motion, tumble.b.motion};
  for (std::size_t i = 0; i < 2; ++i) {
    const Vec3& angularVelocity = motions[i].angularVelocity;
    rotations[i] = Eigen::AngleAxisd(angularVelocity.norm() * time, angularVelocity.normalized())
                       .toRotationMatrix();
    if (bodies[i].rotation != nullptr) rotations[i] *= *bodies[i].rotation;
    bodies[i].rotation = &rotations[i];
    bodies[i].translation +=
        motions[i].velocity * time + 0.5 * time * time * motions[i].acceleration;
  }
  FeatureCache cache;
  return computeSeparation(bodies[0], bodies[1], cache);
}

TEST(RotationalImpact, TumblingBodiesMeetWhenSmallStepsSayThatTheyDo) {
  Random random(21);
  constexpr double kHorizon = 3;
  constexpr int kSteps = 1500;
  int contacts = 0, misses = 0;
  for (int i = 0; i < 120; ++i) {
    Tumble tumble;
    makeTumble(random, tumble);
    const MotionResult impact = findImpactCold(tumble.a, tumble.b, kHorizon);
    ASSERT_NE(impact.outcome, MotionOutcome::unproved) << i;
    const bool contact = impact.outcome == MotionOutcome::contact;
    ++(contact ? contacts : misses);
    for (int k = 0; k <= kSteps; ++k) {
      const double time = kHorizon * k / kSteps;
      if (time >= impact.lo - 1e-12) break;
      ASSERT_EQ(computeSeparationAt(tumble, time).verdict, Verdict::separated)
          << i << " at " << time;
    }
    if (!contact || impact.hi == 0) continue;
    EXPECT_LE(impact.hi - impact.lo, 1e-12 * (1 + impact.hi)) << i;
    EXPECT_LT(computeSeparationAt(tumble, impact.lo).distance, 1e-10) << i;
    EXPECT_NE(computeSeparationAt(tumble, impact.hi + 1e-12).verdict, Verdict::separated) << i;
  }
  EXPECT_GT(contacts, 30);
  EXPECT_GT(misses, 20);
}

TEST(RotationalImpact, SwappingTheBodiesMeetsAtTheSameTime) {
  Random random(22);
  int contacts = 0;
  for (int i = 0; i < 60; ++i) {
    Tumble tumble;
    makeTumble(random, tumble);
    const MotionResult one = findImpactCold(tumble.a, tumble.b, 3);
    const MotionResult other = findImpactCold(tumble.b, tumble.a, 3);
    ASSERT_EQ(one.outcome, other.outcome) << i;
    if (one.outcome != MotionOutcome::contact) continue;
    ++contacts;
    EXPECT_LE(one.lo, other.hi) << i;
    EXPECT_LE(other.lo, one.hi) << i;
    EXPECT_LT(one.separation.normal.dot(other.separation.normal), one.hi > 0 ? -0.99 : 2) << i;
  }
  EXPECT_GT(contacts, 15);
}

TEST(RotationalImpact, FewQueriesAreNeeded) {
  Random random(23);
  std::vector<std::uint32_t> queries;
  for (int i = 0; i < 100; ++i) {
    Tumble tumble;
    makeTumble(random, tumble);
    queries.push_back(findImpactCold(tumble.a, tumble.b, 3).queries);
  }
  std::sort(queries.begin(), queries.end());
  EXPECT_LE(queries[50], 20u);
  EXPECT_LE(queries.back(), 120u);
}

}  // namespace
}  // namespace enfilade::collision
