// Compares the cached lower bound of a body pair's distance with the exact distance.
#include "scene/physics/body_pair.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/scene/physics_scene.hpp"

namespace enfilade::scene {
namespace {

using collision::InterpolatedMotion;

class BodyPairs : public ::testing::Test {
 protected:
  double drawNumber(double size) {
    return std::uniform_real_distribution<double>(-size, size)(random_);
  }
  Vec3 drawVector(double size) {
    const double x = drawNumber(size), y = drawNumber(size);
    return {x, y, drawNumber(size)};
  }
  Quat drawRotation() { return Quat(1, drawNumber(1), drawNumber(1), drawNumber(1)).normalized(); }
  PhysicsBody makeBox(const Vec3& at) {
    const collision::Hull* hull = &hull_;
    return makeDynamicBody({&hull, 1}, 1000, {drawRotation(), at});
  }
  /// Part of the motion is a rotation.
  InterpolatedMotion makeMotion(const PhysicsBody& solid, double length) {
    InterpolatedMotion way = makeStationaryMotion(solid);
    way.isStationary = false;
    way.to.centre += drawVector(length);
    way.to.rotation =
        (way.to.rotation * Quat(1, drawNumber(0.1), drawNumber(0.1), drawNumber(0.1))).normalized();
    updateDerived(way);
    return way;
  }

  std::mt19937 random_{1};
  collision::Hull hull_ = makeBoxHull({0.1, 0.2, 0.3});
};

TEST_F(BodyPairs, CertifiedFarPairsAreFarByQuery) {
  const PairStepSettings step{1.0 / 60, {0, -9.8, 0}, 0.5e-3};
  int far = 0, near = 0;
  for (int i = 0; i < 4000; ++i) {
    PhysicsBody a = makeBox(Vec3::Zero()), b = makeBox(drawVector(0.8));
    BodyPair pair;
    pair.key = {0, 1, 0, 0};
    updatePair(pair, a, b, step);
    const Vec3 wind = drawVector(5);
    for (PhysicsBody* solid : {&a, &b})
      solid->motion.velocity = wind + drawVector(4), solid->motion.angularVelocity = drawVector(3);
    if (i % 5 == 0) a.teleportedDistance += 0.05;
    const bool isFar =
        isCertifiedFar(pair, computeSpeedBound(a, wind), computeSpeedBound(b, wind), step);
    const double known = pair.lowerBound;
    const bool asked = updatePair(pair, a, b, step);
    ++(isFar ? far : near);
    if (!isFar) continue;
    EXPECT_FALSE(asked) << i;
    EXPECT_FALSE(pair.constraint()) << i;
    EXPECT_EQ(pair.lowerBound, known) << i;
  }
  EXPECT_GT(far, 500);
  EXPECT_GT(near, 500);
}

TEST_F(BodyPairs, NonFiniteDistancesAreNeverFar) {
  const PairStepSettings step{1.0 / 60, {0, -9.8, 0}, 0.5e-3};
  PhysicsBody a = makeBox(Vec3::Zero()), b = makeBox({3, 0, 0});
  BodyPair pair;
  updatePair(pair, a, b, step);
  EXPECT_TRUE(isCertifiedFar(pair, computeSpeedBound(a, Vec3::Zero()),
                             computeSpeedBound(b, Vec3::Zero()), step));
  a.motion.velocity.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(isCertifiedFar(pair, computeSpeedBound(a, Vec3::Zero()),
                              computeSpeedBound(b, Vec3::Zero()), step));
}

TEST_F(BodyPairs, FrictionInsideAKinematicBodyActsOnlyAheadOfIt) {
  const PairStepSettings step{1.0 / 60, {0, -9.8, 0}, 0.5e-3};
  const collision::Hull* hull = &hull_;
  PhysicsBody driven = makeKinematicBody({&hull, 1}, {});
  PhysicsBody inside = makeDynamicBody({&hull, 1}, 1000, {Quat::Identity(), {0.19, 0, 0}});
  struct Case {
    Vec3 velocity;
    double friction;  // of the pair; 0: released, the contact no longer constrains it
  };
  for (const auto& [velocity, friction] :
       {Case{{2, 0, 0}, 0.5}, Case{{2, 0, 1}, 0.5}, Case{{0, 2, 0}, 0}, Case{{1, 0, 3}, 0},
        Case{{-2, 0, 0}, 0}, Case{{0, 0, 0}, 0.5}}) {  // the last one is static
    for (const bool swapped : {false, true}) {
      driven.motion.velocity = velocity;
      BodyPair pair;
      pair.key = {0, 1, 0, 0};
      const PhysicsBody &a = swapped ? inside : driven, &b = swapped ? driven : inside;
      updatePair(pair, a, b, step);
      ASSERT_NEAR(pair.penetration(), 0.01, 1e-12);
      ASSERT_TRUE(pair.constraint());
      EXPECT_EQ(pair.constraint()->friction, friction) << velocity.transpose();
      EXPECT_EQ(isReleased(pair, a, b), friction == 0) << velocity.transpose();
    }
  }
}

TEST_F(BodyPairs, AFractionOfAMotionEqualsRepeatedHalving) {
  constexpr int kParts = 1 << collision::kMaxHalvings;
  const InterpolatedMotion way = makeMotion(makeBox(drawVector(1)), 0.5);
  for (int n = 1; n < kParts; ++n) {
    InterpolatedMotion rest = way, done = way;
    for (int bit = kParts / 2, left = n; left > 0; bit /= 2) {
      const collision::CentrePose middle = computeMiddlePose(rest.from, rest.to);
      if (left >= bit) {
        done = replaceEnds(rest, rest.from, middle);
        rest = replaceEnds(rest, middle, rest.to), left -= bit;
      } else {
        rest = replaceEnds(rest, rest.from, middle);
      }
    }
    const InterpolatedMotion part = truncateMotion(way, static_cast<double>(n) / kParts);
    EXPECT_EQ(part.to.centre, done.to.centre) << n;
    EXPECT_EQ(part.to.rotation.coeffs(), done.to.rotation.coeffs()) << n;
    EXPECT_EQ(part.toFrame.rotation, done.toFrame.rotation) << n;
    EXPECT_EQ(part.from.centre, way.from.centre) << n;
  }
}

TEST_F(BodyPairs, AMotionClearedByACachedBoundIsClear) {
  int whole = 0, cut = 0;
  for (int i = 0; i < 1500; ++i) {
    const PhysicsBody a = makeBox(Vec3::Zero()), b = makeBox(drawVector(0.5));
    collision::FeatureCache cache;
    const auto placeFirstPart = [](const PhysicsBody& solid) { return placePart(solid, 0); };
    const collision::SeparationResult start =
        collision::computeSeparation(placeFirstPart(a), placeFirstPart(b), cache);
    if (start.verdict != collision::Verdict::separated) continue;
    // Earlier knowledge: a distance bound below the true distance, and an outdated axis.
    const double apart = 0.5 * start.distance;
    cache.axis += 0.1 * cache.axis.norm() * drawVector(1);
    const collision::ConvexShape part = getPartShape(a, 0);
    const InterpolatedMotion wayA = makeMotion(a, 0.3), wayB = makeMotion(b, 0.3);
    const double fraction = computeClearance({part, wayA}, {part, wayB}, cache, apart).lo;
    ++(fraction == 1 ? whole : cut);
    for (double at = 0x1p-6; at <= fraction; at += 0x1p-6) {
      const InterpolatedMotion doneA = truncateMotion(wayA, at), doneB = truncateMotion(wayB, at);
      EXPECT_TRUE(isSeparatedAtEnd({part, doneA}, {part, doneB}, cache))
          << i << " at " << at << " of " << fraction;
    }
  }
  EXPECT_GT(whole, 100);
  EXPECT_GT(cut, 100);
}

/// Boxes that fall on one another, on the floor, and on a turntable that carries them along.
RigidScene makeBoxesOnATurntable() {
  RigidScene scene;
  scene.addFloor();
  const auto table = scene.addStill(makeBoxHull({0.6, 0.05, 0.6}), {0, 0.3, 0});
  scene.getBody(table).velocity = {0.3, 0, 0.1};
  scene.getBody(table).angularVelocity = {0, 0.8, 0};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int i = 0; i < 24; ++i) {
    const double x = 0.9 * number(random), z = 0.9 * number(random);
    const Quat turned = turnBy(Vec3::UnitX(), number(random));
    const auto box = scene.addFree(makeBoxHull({0.05, 0.08, 0.06}), {x, 0.6 + 0.2 * i, z}, turned);
    scene.getBody(box).angularVelocity = {number(random), 2, number(random)};
  }
  scene.pairAll();
  return scene;
}

/// Rods that rotate in place within reach of one another; only their ends come close.
RigidScene makeRodsThatTurn() {
  RigidScene scene;
  scene.settings.solver.gravity = Vec3::Zero();
  for (int i = 0; i < 6; ++i) {
    const auto rod = scene.addFree(makeBoxHull({1, 0.02, 0.02}), {0.3 * i, 0.9 * i, 0.06 * i});
    scene.getBody(rod).angularVelocity = {0, 0.1 * i, i % 2 == 0 ? 0.9 : -1.1};
  }
  scene.pairAll();
  return scene;
}

void expectKnownDistances(RigidScene scene) {
  const std::vector<BodyPair>& pairs = scene.dynamics.pairs;
  std::size_t looks = 0, contacts = 0;
  constexpr std::size_t kSteps = 120;
  for (std::size_t i = 0; i < kSteps; ++i) {
    looks += scene.run(1).narrowPhaseQueries;
    for (const BodyPair& pair : pairs) {
      const PhysicsBody &a = scene.dynamics.bodies[pair.key.a],
                        &b = scene.dynamics.bodies[pair.key.b];
      const double known = computeLowerBound(pair, a, b);
      if (known <= 0) continue;
      ++contacts;
      collision::FeatureCache cache;
      const auto truth = collision::computeSeparation(placePart(a, 0), placePart(b, 0), cache);
      ASSERT_LE(known, truth.distance + 1e-12) << pair.key.a << ", " << pair.key.b << " at " << i;
    }
  }
  EXPECT_GT(contacts, kSteps * pairs.size() / 2);
  EXPECT_LT(looks, kSteps * pairs.size() / 4);
}

TEST(KnownDistances, AreNeverMoreThanTheDistancesThoughFewPairsAreLookedAt) {
  expectKnownDistances(makeBoxesOnATurntable());
  expectKnownDistances(makeRodsThatTurn());
}

}  // namespace
}  // namespace enfilade::scene
