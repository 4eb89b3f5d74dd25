#include "scene/physics/joint.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/scene/physics_scene.hpp"

namespace enfilade::scene {
namespace {

constexpr double kGravity = 9.80665;

/// A plank of 1 m along X, fixed to a post in the air at the origin.
struct Plank : RigidScene {
  std::uint32_t post = addStill(boxHull({0.05, 0.05, 0.05}), {-0.2, 0, 0});
  std::uint32_t plank = addFree(boxHull({0.5, 0.05, 0.2}), {0.5, 0, 0});

  Joint& join(Joint::Kind kind, const Vec3& axis) {
    std::vector<BodyMotion> bodies;
    for (const PhysicsBody& solid : dynamics.bodies) bodies.push_back(solid.motion);
    dynamics.joints.push_back(makeJoint(kind, bodies, post, plank, Vec3::Zero(), axis));
    return dynamics.joints.back();
  }
  /// Position of the plank's end that the joint constrains.
  Vec3 held() { return body(plank).centre + body(plank).rotation * Vec3(-0.5, 0, 0); }
  /// Sine of the plank's angle above the horizontal.
  double lift() { return (body(plank).rotation * Vec3::UnitX()).y(); }
};

TEST(Joint, AHingeHoldsItsPointAndItsAxisWhileThePlankSwings) {
  Plank scene;
  scene.join(Joint::Kind::hinge, Vec3::UnitZ());
  double lowest = 0;
  const double start = scene.energy();
  for (int i = 0; i < 180; ++i) {
    scene.run(1);
    ASSERT_LT(scene.held().norm(), 2e-3) << i;
    ASSERT_LT((scene.body(scene.plank).rotation * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 2e-3) << i;
    ASSERT_LT(scene.energy(), start + 0.01 * kGravity / scene.body(scene.plank).inverseMass) << i;
    lowest = std::min(lowest, scene.lift());
  }
  EXPECT_LT(lowest, -0.95);
}

TEST(Joint, AHingesLimitsAreNotPassed) {
  Plank scene;
  Joint& hinge = scene.join(Joint::Kind::hinge, Vec3::UnitZ());
  hinge.hasLimits = true;
  hinge.lower = -0.5, hinge.upper = 0.25;
  scene.run(240);
  EXPECT_NEAR(scene.lift(), std::sin(-0.5), 0.01);
}

TEST(Joint, AMotorLiftsThePlankToTheOtherLimitWhenItIsStrongEnough) {
  for (const double strength : {0.5, 2.0}) {
    Plank scene;
    Joint& hinge = scene.join(Joint::Kind::hinge, Vec3::UnitZ());
    hinge.hasLimits = true;
    hinge.lower = -0.5, hinge.upper = 0.25;
    hinge.motorSpeed = 1;
    hinge.maxMotorForce = strength * 0.5 * kGravity / scene.body(scene.plank).inverseMass;
    scene.run(240);
    EXPECT_NEAR(scene.lift(), std::sin(strength < 1 ? -0.5 : 0.25), 0.01) << strength;
  }
}

TEST(Joint, ASliderFallsAlongItsAxisOnlyAndStopsAtItsLimit) {
  Plank scene;
  Joint& slider = scene.join(Joint::Kind::slider, Vec3(0, 1, 0));
  slider.hasLimits = true;
  slider.lower = -0.3, slider.upper = 0;
  scene.run(10);
  EXPECT_NEAR(scene.body(scene.plank).velocity.y(), -kGravity * 10 / 60, 1e-6);
  scene.run(170);
  EXPECT_NEAR(scene.body(scene.plank).centre.y(), -0.3, 1e-3);
  EXPECT_NEAR(scene.body(scene.plank).centre.x(), 0.5, 2e-3);
  EXPECT_LT((scene.body(scene.plank).rotation * Vec3::UnitX() - Vec3::UnitX()).norm(), 5e-3);
}

}  // namespace
}  // namespace enfilade::scene
