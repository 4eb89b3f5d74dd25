#include "scene/physics/physics_world.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/scene/physics_scene.hpp"

namespace enfilade::scene {
namespace {

constexpr double kGravity = 9.80665;
constexpr double kEpsilon = 0.5e-3;

TEST(PhysicsWorld, AFreeFallGoesAsGravityHasIt) {
  RigidScene scene;
  const auto box = scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {0, 100, 0});
  scene.pairAll();
  scene.run(60);
  EXPECT_NEAR(scene.getBody(box).velocity.y(), -kGravity, 1e-9);
  EXPECT_NEAR(scene.getBody(box).centre.y(), 100 - 0.5 * kGravity, 0.5 * kGravity / 240 + 1e-9);
}

TEST(PhysicsWorld, ABoxComesToRestWithinEpsilonAndSleepsWithoutCreeping) {
  RigidScene scene;
  scene.addFloor();
  const auto box = scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {0, 0.3, 0});
  scene.pairAll();
  scene.run(60);
  EXPECT_NEAR(scene.getBody(box).centre.y(), 0.2 + 0.75 * kEpsilon, 0.25 * kEpsilon);
  const Vec3 landed = scene.getBody(box).centre;
  scene.run(60);
  EXPECT_TRUE(scene.isAsleep(box));
  EXPECT_LT((scene.getBody(box).centre - landed).norm(), 1e-5);
  const Vec3 slept = scene.getBody(box).centre;
  const StepReport report = scene.run(600);
  EXPECT_EQ(scene.getBody(box).centre, slept);
  EXPECT_EQ(report.awake, 0u);
  EXPECT_EQ(report.narrowPhaseQueries, 0u);
}

TEST(PhysicsWorld, AStackOfFiveBoxesStaysAndSleeps) {
  RigidScene scene;
  scene.addFloor();
  std::vector<std::uint32_t> boxes;
  for (int i = 0; i < 5; ++i)
    boxes.push_back(scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {0.01 * i, 0.21 + 0.402 * i, 0}));
  scene.pairAll();
  for (int i = 0; i < 240; ++i) {
    scene.run(1);
    ASSERT_FALSE(scene.isAnyPenetrating()) << i;
  }
  for (int i = 0; i < 5; ++i) {
    const Vec3 centre = scene.getBody(boxes[i]).centre;
    EXPECT_NEAR(centre.y(), 0.2 + 0.4 * i + (i + 1) * 0.75 * kEpsilon, (i + 1) * 0.25 * kEpsilon)
        << i;
    EXPECT_NEAR(centre.x(), 0.01 * i, 2.5e-3) << i;  // the ball rocks when it lands
    EXPECT_TRUE(scene.isAsleep(boxes[i])) << i;
  }
}

/// The distance that a box slides down in a second on a plane tilted by 2 atan(half) about Z.
double measureSlide(double half, double friction) {
  RigidScene scene;
  const Quat tilt = turnBy(Vec3::UnitZ(), half);
  scene.addStill(makeBoxHull({20, 0.5, 20}), tilt * Vec3(0, -0.5, 0), tilt);
  const Vec3 start = tilt * Vec3(0, 0.1 + kEpsilon, 0);
  const auto box = scene.addFree(makeBoxHull({0.2, 0.1, 0.2}), start, tilt);
  for (PhysicsBody& solid : scene.dynamics.bodies) solid.motion.friction = friction;
  scene.pairAll();
  scene.run(60);
  return (scene.getBody(box).centre - start).dot(tilt * -Vec3::UnitX());
}

TEST(PhysicsWorld, ABoxOnASlopeHoldsBelowTheAngleOfFriction) {
  // tan(angle) = 2 half / (1 - half^2) = 0.4167 for half = 0.2.
  EXPECT_LT(std::abs(measureSlide(0.2, 0.43)), 1e-4);
}

TEST(PhysicsWorld, ABoxOnASlopeSlidesAboveTheAngleOfFrictionAsCoulombHasIt) {
  const double half = 0.2, sine = 2 * half / (1 + half * half);
  const double cosine = (1 - half * half) / (1 + half * half);
  for (const double friction : {0.0, 0.2, 0.35}) {
    const double slid = 0.5 * kGravity * (sine - friction * cosine);
    EXPECT_NEAR(measureSlide(half, friction), slid, 0.02 * slid + 2e-3) << friction;
  }
}

TEST(PhysicsWorld, ABallRollsDownASlopeAtFiveSeventhsOfSliding) {
  RigidScene scene;
  const double half = 0.1, sine = 2 * half / (1 + half * half);
  const Quat tilt = turnBy(Vec3::UnitZ(), half);
  scene.addStill(makeBoxHull({20, 0.5, 20}), tilt * Vec3(0, -0.5, 0), tilt);
  const auto ball = scene.addFree(makeBallHull(0.2, 20), tilt * Vec3(0, 0.2 + kEpsilon, 0), tilt);
  for (PhysicsBody& solid : scene.dynamics.bodies) solid.motion.friction = 0.8;
  scene.pairAll();
  const Vec3 start = scene.getBody(ball).centre;
  scene.run(60);
  const double rolled = (scene.getBody(ball).centre - start).norm();
  const double expected = 0.5 * 5.0 / 7.0 * kGravity * sine;
  EXPECT_NEAR(rolled, expected, 0.1 * expected);
  EXPECT_NEAR(scene.getBody(ball).angularVelocity.norm() * 0.2, scene.getBody(ball).velocity.norm(),
              0.05 * scene.getBody(ball).velocity.norm());
}

TEST(PhysicsWorld, EnergyOfBouncingAndTumblingBodiesNeverGrows) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int round = 0; round < 12; ++round) {
    RigidScene scene;
    scene.addFloor();
    const auto box = scene.addFree(
        makeBoxHull({0.1, 0.2, 0.4}), {0, 2, 0},
        turnBy(Vec3(number(random), number(random), number(random)).normalized(), 0.7));
    scene.getBody(box).angularVelocity = 10 * Vec3(number(random), number(random), number(random));
    scene.getBody(box).velocity = 3 * Vec3(number(random), number(random), number(random));
    scene.getBody(box).restitution = 0.1 * round;
    if (round > 9) scene.getBody(box).restitution = 0.9;
    scene.pairAll();
    const double start = scene.computeEnergy();
    double maxEnergy = start;
    for (int i = 0; i < 240; ++i) {
      scene.run(1);
      maxEnergy = std::max(maxEnergy, scene.computeEnergy());
      ASSERT_FALSE(scene.isAnyPenetrating());
    }
    EXPECT_LE(maxEnergy, start * 1.001) << round;
  }
}

TEST(PhysicsWorld, ABodyHitInTheMiddleOfAStepTakesTheMomentum) {
  constexpr int kPhases = 16;
  for (int phase = 0; phase < kPhases; ++phase) {
    RigidScene scene;
    scene.settings.solver.gravity = Vec3::Zero();
    const auto cube = makeBoxHull({0.2, 0.2, 0.2});
    const double way = 6 * scene.settings.solver.seconds;  // of a step
    const double gap = 2 * way + way * phase / kPhases;
    const auto moving = scene.addFree(cube, {0, 0, 0});
    const auto standing = scene.addFree(cube, {0.4 + gap, 0, 0});
    scene.getBody(moving).velocity = {6, 0, 0};
    scene.pairAll();
    scene.run(20);
    const double a = scene.getBody(moving).velocity.x(), b = scene.getBody(standing).velocity.x();
    EXPECT_NEAR(a + b, 6, 0.06) << phase;
    EXPECT_GT(b, 2.9) << phase << ": no contact";
  }
}

TEST(PhysicsWorld, AFastBodyIsStoppedByAThinSheet) {
  RigidScene scene;
  const std::vector<Vec3> sheet{{-20, 0, -20}, {20, 0, -20}, {20, 0, 20}, {-20, 0, 20}};
  scene.addStill(collision::buildHull(sheet), {0, 0, 0});
  const auto box = scene.addFree(makeBoxHull({0.05, 0.05, 0.05}), {0, 3, 0},
                                 turnBy(Vec3(1, 2, 3).normalized(), 0.3));
  scene.getBody(box).velocity = {0, -400, 0};
  scene.getBody(box).angularVelocity = {30, 10, 50};
  scene.pairAll();
  for (int i = 0; i < 60; ++i) {
    scene.run(1);
    ASSERT_FALSE(scene.isAnyPenetrating());
    ASSERT_GT(scene.getBody(box).centre.y(), 0);
  }
}

TEST(PhysicsWorld, ASleepingBodyWakesWhenAnotherFallsOnIt) {
  RigidScene scene;
  scene.addFloor();
  const auto low = scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {0, 0.2 + kEpsilon, 0});
  scene.dynamics.bodies[low].asleep = true;
  const auto high = scene.addFree(makeBoxHull({0.1, 0.1, 0.1}), {0.25, 0.9, 0});
  scene.pairAll();
  bool woke = false;
  for (int i = 0; i < 240; ++i) {
    scene.run(1);
    woke = woke || !scene.isAsleep(low);
    ASSERT_FALSE(scene.isAnyPenetrating());
  }
  EXPECT_TRUE(woke);
  EXPECT_TRUE(scene.isAsleep(low));
  EXPECT_TRUE(scene.isAsleep(high));
}

TEST(PhysicsWorld, ASleepingBodyFallsWhenItsSupportSinksSlowlyOrAtOnce) {
  for (const double step : {0.6e-3, 3e-3, 20e-3}) {  // metres; at the first the support is at rest
    RigidScene scene;
    const auto floor = scene.addFloor();
    const auto low = scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {0, 0.2 + kEpsilon, 0});
    const auto high = scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {0, 0.6 + 2 * kEpsilon, 0});
    scene.pairAll();
    scene.run(90);
    ASSERT_TRUE(scene.isAsleep(low) && scene.isAsleep(high)) << step;
    const auto place = [&](std::uint32_t id, double height) {
      PhysicsBody& body = scene.dynamics.bodies[id];
      body.teleportedDistance += std::abs(height - body.motion.centre.y());
      body.motion.centre.y() = height;
      body.motion.velocity = Vec3::Zero();
      updateTransform(body);
    };
    place(floor, scene.getBody(floor).centre.y() - 5);
    double height = scene.getBody(low).centre.y();
    for (int i = 0; i < 10; ++i) {
      scene.dynamics.bodies[low].asleep = false;
      scene.dynamics.bodies[low].sleepTimer = 0.3;  // it stays awake, and at rest
      scene.run(1);
      place(low, height -= step);  // as if something below held it
    }
    EXPECT_FALSE(scene.isAsleep(high)) << step;
    scene.run(480);
    EXPECT_LT(scene.getBody(high).centre.y(), -4.3) << step;
    EXPECT_TRUE(scene.isAsleep(low) && scene.isAsleep(high)) << step;
  }
}

TEST(PhysicsWorld, ASleepingBodyFallsWhenItsSupportIsFarAwayAfterAStep) {
  RigidScene scene;
  scene.addFloor();
  const auto low = scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {0, 0.2 + kEpsilon, 0});
  const auto high = scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {0, 0.6 + 2 * kEpsilon, 0});
  scene.pairAll();
  scene.run(90);
  ASSERT_TRUE(scene.isAsleep(low) && scene.isAsleep(high));
  PhysicsBody& support = scene.dynamics.bodies[low];
  support.asleep = false;
  support.motion.velocity = {200, 0, 0};
  scene.run(1);
  ASSERT_GT(scene.getBody(low).centre.x(), 1);
  std::erase_if(scene.dynamics.pairs, [&](const BodyPair& pair) {
    return pair.key.a == low && pair.key.b == high;  // a broad phase no longer finds it
  });
  scene.run(120);
  EXPECT_LT(scene.getBody(high).centre.y(), 0.25);
}

TEST(PhysicsWorld, ABodyThatCreepsLeavesAHeapAsleep) {
  RigidScene scene;
  scene.addFloor();
  std::vector<std::uint32_t> boxes;
  for (int i = 0; i < 5; ++i)
    boxes.push_back(
        scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {0, 0.2 + 0.4005 * i + kEpsilon, 0}));
  const auto top = scene.addFree(makeBoxHull({0.05, 0.05, 0.05}), {-0.1, 2.055 + 3 * kEpsilon, 0});
  scene.pairAll();
  scene.run(120);
  for (const auto box : boxes) ASSERT_TRUE(scene.isAsleep(box));
  PhysicsBody& creeper = scene.dynamics.bodies[top];
  for (int i = 0; i < 60; ++i) {
    creeper.asleep = false;
    creeper.motion.velocity = {0.15, 0, 0};
    scene.run(1);
    for (std::size_t k = 0; k + 1 < boxes.size(); ++k) ASSERT_TRUE(scene.isAsleep(boxes[k])) << i;
    ASSERT_FALSE(scene.isAnyPenetrating());
  }
  EXPECT_GT(creeper.motion.centre.x(), -0.05) << "it moved";
}

TEST(PhysicsWorld, APileIsEqualInTwoRunsAndNextToSleepers) {
  const auto pile = [](int sleepers) {
    RigidScene scene;
    scene.addFloor();
    for (int i = 0; i < sleepers; ++i) {
      const auto id = scene.addFree(makeBoxHull({0.2, 0.2, 0.2}), {5.0 + i, 0.2005, 0});
      scene.dynamics.bodies[id].asleep = true;
    }
    const auto first = static_cast<std::uint32_t>(scene.dynamics.bodies.size());
    for (int i = 0; i < 12; ++i)
      scene.addFree(makeBoxHull({0.1 + 0.01 * i, 0.1, 0.15}), {0.05 * (i % 3), 0.3 + 0.4 * i, 0},
                    turnBy(Vec3::UnitX(), 0.05 * i));
    scene.pairAll();
    scene.run(120);
    std::vector<double> state;
    for (std::uint32_t i = first; i < scene.dynamics.bodies.size(); ++i) {
      const BodyMotion& body = scene.getBody(i);
      for (int k = 0; k < 3; ++k)
        state.push_back(body.centre[k]), state.push_back(body.angularVelocity[k]);
    }
    return state;
  };
  const auto once = pile(0);
  EXPECT_EQ(once, pile(0));
  EXPECT_EQ(once, pile(3));
}

// Motion by rotation is predicted only while it is small: a tip that swings at a ball reaches it at
// full speed.
TEST(PhysicsWorld, ARodThatSwingsAtABallLosesNothingBeforeItHits) {
  for (const double early : {0.2, 0.25, 0.3, 0.35, 0.4}) {
    RigidScene scene;
    scene.settings.solver.gravity = Vec3::Zero();
    const auto rod = scene.addFree(makeBoxHull({0.5, 0.01, 0.01}), Vec3::Zero(),
                                   turnBy(Vec3::UnitZ(), -0.5 * early));
    const auto ball = scene.addFree(makeBallHull(0.03), {0.47, 0.05, 0});
    scene.getBody(rod).angularVelocity = {0, 0, 10};
    scene.pairAll();
    int ticks = 0;
    while (scene.getBody(ball).velocity.isZero(0) && ticks < 20) {
      EXPECT_GT(scene.getBody(rod).angularVelocity.z(), 9.9) << early << ", " << ticks;
      scene.run(1), ++ticks;
    }
    EXPECT_GE(ticks, 2);
    EXPECT_GT(scene.getBody(ball).velocity.y(), 0.4) << early;
  }
}

}  // namespace
}  // namespace enfilade::scene
