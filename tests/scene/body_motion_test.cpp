#include "scene/physics/body_motion.hpp"

#include <gtest/gtest.h>

#include "tests/scene/physics_scene.hpp"

namespace enfilade::scene {
namespace {

BodyMotion makeTumbler() {
  BodyMotion body = makeDynamicMotion(computeHullMass(makeBoxHull({0.1, 0.3, 0.7}), 500), {});
  body.angularVelocity = {0.1, 12, 0.2};  // about the intermediate axis, which is unstable
                                          // (Dzhanibekov effect)
  return body;
}

TEST(BodyMotion, AdvancingKeepsTheRotationUnit) {
  BodyMotion body = makeTumbler();
  for (int i = 0; i < 10000; ++i) integratePose(body, 1.0 / 60);
  EXPECT_NEAR(body.rotation.squaredNorm(), 1, 1e-14);
}

TEST(BodyMotion, AQuarterTurnIsAQuarterTurn) {
  BodyMotion body;
  body.angularVelocity = {0, 1.5707963267948966, 0};
  for (int i = 0; i < 1000; ++i) integratePose(body, 1e-3);
  EXPECT_LT((body.rotation * Vec3::UnitX() - Vec3(0, 0, -1)).norm(), 1e-5);
}

TEST(BodyMotion, BendingTheSpinNeverAddsEnergyAtAnySpeed) {
  for (const double speed : {1.0, 10.0, 100.0, 1e4, 1e8}) {
    BodyMotion body = makeTumbler();
    body.angularVelocity *= speed;
    double energy = computeKineticEnergy(body);
    for (int i = 0; i < 1000; ++i) {
      applyGyroscopicTorque(body, 1.0 / 60);
      integratePose(body, 1.0 / 60);
      const double now = computeKineticEnergy(body);
      ASSERT_LE(now, energy * (1 + 1e-12)) << speed;
      energy = now;
    }
    EXPECT_TRUE(body.angularVelocity.allFinite());
  }
}

TEST(BodyMotion, ASpinAboutTheMiddleAxisFlipsOver) {
  BodyMotion body = makeTumbler();
  bool flipped = false;
  for (int i = 0; i < 2000; ++i) {
    applyGyroscopicTorque(body, 1.0 / 1000);
    integratePose(body, 1.0 / 1000);
    flipped = flipped || (body.rotation * Vec3::UnitY()).y() < -0.9;
  }
  EXPECT_TRUE(flipped);
}

}  // namespace
}  // namespace enfilade::scene
