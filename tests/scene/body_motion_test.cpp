#include "scene/physics/body_motion.hpp"

#include <gtest/gtest.h>

#include "tests/scene/physics_scene.hpp"

namespace enfilade::scene {
namespace {

RigidBody tumbler() {
  RigidBody body = freeBody(massOfHull(boxHull({0.1, 0.3, 0.7}), 500), {});
  body.spin = {0.1, 12, 0.2};  // about the middle axis: it flips over again and again
  return body;
}

TEST(RigidBody, AdvancingKeepsTheRotationUnit) {
  RigidBody body = tumbler();
  for (int i = 0; i < 10000; ++i) advance(body, 1.0 / 60);
  EXPECT_NEAR(body.rotation.squaredNorm(), 1, 1e-14);
}

TEST(RigidBody, AQuarterTurnIsAQuarterTurn) {
  RigidBody body;
  body.spin = {0, 1.5707963267948966, 0};
  for (int i = 0; i < 1000; ++i) advance(body, 1e-3);
  EXPECT_LT((body.rotation * Vec3::UnitX() - Vec3(0, 0, -1)).norm(), 1e-5);
}

TEST(RigidBody, BendingTheSpinNeverAddsEnergyAtAnySpeed) {
  for (const double speed : {1.0, 10.0, 100.0, 1e4, 1e8}) {
    RigidBody body = tumbler();
    body.spin *= speed;
    double energy = kineticEnergy(body);
    for (int i = 0; i < 1000; ++i) {
      bendSpin(body, 1.0 / 60);
      advance(body, 1.0 / 60);
      const double now = kineticEnergy(body);
      ASSERT_LE(now, energy * (1 + 1e-12)) << speed;
      energy = now;
    }
    EXPECT_TRUE(body.spin.allFinite());
  }
}

TEST(RigidBody, ASpinAboutTheMiddleAxisFlipsOver) {
  RigidBody body = tumbler();
  bool flipped = false;
  for (int i = 0; i < 2000; ++i) {
    bendSpin(body, 1.0 / 1000);
    advance(body, 1.0 / 1000);
    flipped = flipped || (body.rotation * Vec3::UnitY()).y() < -0.9;
  }
  EXPECT_TRUE(flipped);
}

}  // namespace
}  // namespace enfilade::scene
