// What is known of two solids without a look at them, against the look itself.
#include "scene/physics/body_pair.hpp"

#include <gtest/gtest.h>

#include <random>

#include "scene/physics/swept_pose.hpp"
#include "tests/scene/physics_scene.hpp"

namespace enfilade::scene {
namespace {

class NearPairs : public ::testing::Test {
 protected:
  double number(double size) {
    return std::uniform_real_distribution<double>(-size, size)(random_);
  }
  Vec3 vector(double size) {
    const double x = number(size), y = number(size);
    return {x, y, number(size)};
  }
  Quat rotation() { return Quat(1, number(1), number(1), number(1)).normalized(); }
  Solid box(const Vec3& at) {
    const collision::Hull* hull = &hull_;
    return freeSolid({&hull, 1}, 1000, {rotation(), at});
  }
  /// Some of it with a turn.
  Passage wayOf(const Solid& solid, double length) {
    Passage way = standing(solid);
    way.stands = nullptr;
    way.toCentre += vector(length);
    way.toRotation = (way.toRotation * Quat(1, number(0.1), number(0.1), number(0.1))).normalized();
    measure(way);
    return way;
  }

  std::mt19937 random_{1};
  collision::Hull hull_ = boxHull({0.1, 0.2, 0.3});
};

TEST_F(NearPairs, WhoIsFarByPacesIsFarByALook) {
  const NearPairStep step{1.0 / 60, {0, -9.8, 0}, 0.5e-3};
  int far = 0, near = 0;
  for (int i = 0; i < 4000; ++i) {
    Solid a = box(Vec3::Zero()), b = box(vector(0.8));
    NearPair pair;
    pair.key = {0, 1, 0, 0};
    look(pair, a, b, step);
    const Vec3 wind = vector(5);
    for (Solid* solid : {&a, &b})
      solid->motion.velocity = wind + vector(4), solid->motion.spin = vector(3);
    if (i % 5 == 0) a.jumped += 0.05;
    const bool isFar = areFar(pair, paceOf(a, wind), paceOf(b, wind), step);
    const double known = pair.apart;
    const bool asked = look(pair, a, b, step);
    ++(isFar ? far : near);
    if (!isFar) continue;
    EXPECT_FALSE(asked) << i;
    EXPECT_FALSE(pair.patch()) << i;
    EXPECT_EQ(pair.apart, known) << i;
  }
  EXPECT_GT(far, 500);
  EXPECT_GT(near, 500);
}

TEST_F(NearPairs, WhatIsNoNumberIsNeverFar) {
  const NearPairStep step{1.0 / 60, {0, -9.8, 0}, 0.5e-3};
  Solid a = box(Vec3::Zero()), b = box({3, 0, 0});
  NearPair pair;
  look(pair, a, b, step);
  EXPECT_TRUE(areFar(pair, paceOf(a, Vec3::Zero()), paceOf(b, Vec3::Zero()), step));
  a.motion.velocity.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(areFar(pair, paceOf(a, Vec3::Zero()), paceOf(b, Vec3::Zero()), step));
}

TEST_F(NearPairs, WhoIsInsideADrivenOneRubsOnItOnlyAheadOfIt) {
  const NearPairStep step{1.0 / 60, {0, -9.8, 0}, 0.5e-3};
  const collision::Hull* hull = &hull_;
  Solid driven = heldSolid({&hull, 1}, {});
  Solid inside = freeSolid({&hull, 1}, 1000, {Quat::Identity(), {0.19, 0, 0}});
  struct Case {
    Vec3 velocity;
    double friction;  // of the two; 0: it is let out
  };
  for (const auto& [velocity, friction] :
       {Case{{2, 0, 0}, 0.5}, Case{{2, 0, 1}, 0.5}, Case{{0, 2, 0}, 0}, Case{{1, 0, 3}, 0},
        Case{{-2, 0, 0}, 0}, Case{{0, 0, 0}, 0.5}}) {  // the last one stands
    for (const bool swapped : {false, true}) {
      driven.motion.velocity = velocity;
      NearPair pair;
      pair.key = {0, 1, 0, 0};
      const Solid &a = swapped ? inside : driven, &b = swapped ? driven : inside;
      look(pair, a, b, step);
      ASSERT_NEAR(pair.penetration(), 0.01, 1e-12);
      ASSERT_TRUE(pair.patch());
      EXPECT_EQ(pair.patch()->friction, friction) << velocity.transpose();
      EXPECT_EQ(isLetOut(pair, a, b), friction == 0) << velocity.transpose();
    }
  }
}

TEST_F(NearPairs, APartOfAWayIsWhatHalvingItLeaves) {
  constexpr int kParts = 1 << kMostHalvings;
  const Passage way = wayOf(box(vector(1)), 0.5);
  for (int n = 1; n < kParts; ++n) {
    Passage rest = way, done = way;
    for (int bit = kParts / 2, left = n; left > 0; bit /= 2) {
      const PassagePose middle = middleOf(rest);
      if (left >= bit) {
        done = firstHalf(rest, middle);
        rest = secondHalf(rest, middle), left -= bit;
      } else {
        rest = firstHalf(rest, middle);
      }
    }
    const Passage part = firstPart(way, static_cast<double>(n) / kParts);
    EXPECT_EQ(part.toCentre, done.toCentre) << n;
    EXPECT_EQ(part.toRotation.coeffs(), done.toRotation.coeffs()) << n;
    EXPECT_EQ(part.toTurned, done.toTurned) << n;
    EXPECT_EQ(part.fromCentre, way.fromCentre) << n;
  }
}

TEST_F(NearPairs, AWayThatIsClearedByWhatWasKnownIsClear) {
  int whole = 0, cut = 0;
  for (int i = 0; i < 1500; ++i) {
    const Solid a = box(Vec3::Zero()), b = box(vector(0.5));
    collision::FeatureCache cache;
    const auto bodyOf = [](const Solid& solid) { return partOf(solid, 0); };
    const collision::Decision start = collision::decide(bodyOf(a), bodyOf(b), cache);
    if (start.verdict != collision::Verdict::separated) continue;
    // Known from before: less than there is, and an axis that has gone by.
    const double apart = 0.5 * start.distance;
    cache.axis += 0.1 * cache.axis.norm() * vector(1);
    const PartShape part = shapeOf(a, 0);
    const Passage wayA = wayOf(a, 0.3), wayB = wayOf(b, 0.3);
    const double fraction = clearance(part, wayA, part, wayB, cache, apart).fraction;
    ++(fraction == 1 ? whole : cut);
    for (double at = 0x1p-6; at <= fraction; at += 0x1p-6)
      EXPECT_TRUE(separatedAtEnd(part, firstPart(wayA, at), part, firstPart(wayB, at), cache))
          << i << " at " << at << " of " << fraction;
  }
  EXPECT_GT(whole, 100);
  EXPECT_GT(cut, 100);
}

/// Boxes that fall on one another, on the floor, and on a turntable that goes along.
RigidScene boxesOnATurntable() {
  RigidScene scene;
  scene.addFloor();
  const auto table = scene.addStill(boxHull({0.6, 0.05, 0.6}), {0, 0.3, 0});
  scene.body(table).velocity = {0.3, 0, 0.1};
  scene.body(table).spin = {0, 0.8, 0};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int i = 0; i < 24; ++i) {
    const double x = 0.9 * number(random), z = 0.9 * number(random);
    const Quat turned = turnBy(Vec3::UnitX(), number(random));
    const auto box = scene.addFree(boxHull({0.05, 0.08, 0.06}), {x, 0.6 + 0.2 * i, z}, turned);
    scene.body(box).spin = {number(random), 2, number(random)};
  }
  scene.pairAll();
  return scene;
}

/// Rods that turn where they are, within reach of one another, and come near with their ends alone.
RigidScene rodsThatTurn() {
  RigidScene scene;
  scene.settings.solver.gravity = Vec3::Zero();
  for (int i = 0; i < 6; ++i) {
    const auto rod = scene.addFree(boxHull({1, 0.02, 0.02}), {0.3 * i, 0.9 * i, 0.06 * i});
    scene.body(rod).spin = {0, 0.1 * i, i % 2 == 0 ? 0.9 : -1.1};
  }
  scene.pairAll();
  return scene;
}

void expectKnownDistances(RigidScene scene) {
  const std::vector<NearPair>& pairs = scene.dynamics.pairs;
  std::size_t looks = 0, told = 0;
  constexpr std::size_t kSteps = 120;
  for (std::size_t i = 0; i < kSteps; ++i) {
    looks += scene.run(1).looks;
    for (const NearPair& pair : pairs) {
      const Solid &a = scene.dynamics.solids[pair.key.a], &b = scene.dynamics.solids[pair.key.b];
      const double known = apartNow(pair, a, b);
      if (known <= 0) continue;
      ++told;
      collision::FeatureCache cache;
      const auto truth = collision::decide(partOf(a, 0), partOf(b, 0), cache);
      ASSERT_LE(known, truth.distance + 1e-12) << pair.key.a << ", " << pair.key.b << " at " << i;
    }
  }
  EXPECT_GT(told, kSteps * pairs.size() / 2);
  EXPECT_LT(looks, kSteps * pairs.size() / 4);
}

TEST(KnownDistances, AreNeverMoreThanTheDistancesThoughFewPairsAreLookedAt) {
  expectKnownDistances(boxesOnATurntable());
  expectKnownDistances(rodsThatTurn());
}

}  // namespace
}  // namespace enfilade::scene
