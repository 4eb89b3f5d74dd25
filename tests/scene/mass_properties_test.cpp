#include "scene/model/shapes/mass_properties.hpp"

#include <gtest/gtest.h>

#include "tests/scene/physics_scene.hpp"

namespace enfilade::scene {
namespace {

TEST(MassProperties, OfABoxAreTheTextbooks) {
  const MassProperties box = computeHullMass(makeBoxHull({1, 2, 3}), 10);
  EXPECT_NEAR(box.mass, 10 * 48, 1e-10);
  EXPECT_LT(box.centre.norm(), 1e-13);
  const double twelfth = box.mass / 12;
  const Mat3 expected =
      Vec3(twelfth * (16 + 36), twelfth * (4 + 36), twelfth * (4 + 16)).asDiagonal();
  EXPECT_LT((box.inertia - expected).norm(), 1e-9);
}

TEST(MassProperties, OfATetrahedronAreTheTextbooks) {
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const MassProperties corner = computeHullMass(collision::buildHull(corners), 6);
  EXPECT_NEAR(corner.mass, 1, 1e-15);
  EXPECT_LT((corner.centre - Vec3::Constant(0.25)).norm(), 1e-15);
  EXPECT_NEAR(corner.inertia(0, 0), 3.0 / 40, 1e-15);
  EXPECT_NEAR(corner.inertia(0, 1), 1.0 / 80, 1e-15);
}

TEST(MassProperties, OfABallComeNearTheSpheresFromBelow) {
  const MassProperties ball = computeHullMass(makeBallHull(0.5, 12), 1);
  const double sphere = 4.0 / 3 * 3.14159265358979 * 0.125;
  EXPECT_LT(ball.mass, sphere);
  EXPECT_GT(ball.mass, 0.98 * sphere);
  EXPECT_NEAR(ball.inertia(1, 1), 0.4 * ball.mass * 0.25, 0.01 * ball.inertia(1, 1));
}

TEST(MassProperties, FarFromTheOriginNothingIsLost) {
  collision::Hull far = makeBoxHull({0.5, 0.5, 0.5});
  for (Vec3& v : far.vertices) v += Vec3(1e6, -1e6, 1e6);
  const MassProperties box = computeHullMass(far, 1);
  EXPECT_NEAR(box.mass, 1, 1e-9);
  EXPECT_LT((box.inertia - Mat3(Vec3::Constant(1.0 / 6).asDiagonal())).norm(), 1e-9);
}

TEST(MassProperties, TwoHalvesAreTheWhole) {
  const std::vector<MassProperties> halves = [] {
    std::vector<MassProperties> both;
    for (const double side : {-1.0, 1.0}) {
      collision::Hull half = makeBoxHull({0.5, 1, 1});
      for (Vec3& v : half.vertices) v.x() += 0.5 * side;
      both.push_back(computeHullMass(half, 7));
    }
    return both;
  }();
  const MassProperties whole = computeHullMass(makeBoxHull({1, 1, 1}), 7),
                       sum = combineMassProperties(halves);
  EXPECT_NEAR(sum.mass, whole.mass, 1e-12);
  EXPECT_LT((sum.inertia - whole.inertia).norm(), 1e-12);
}

TEST(MassProperties, AShapeWithoutVolumeIsRefused) {
  const std::vector<Vec3> sheet{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
  EXPECT_THROW(computeHullMass(collision::buildHull(sheet), 1), std::invalid_argument);
  collision::Hull insideOut = makeBoxHull({1, 1, 1});
  for (auto& face : insideOut.faces) std::reverse(face.begin(), face.end());
  EXPECT_THROW(computeHullMass(insideOut, 1), std::invalid_argument);
  EXPECT_THROW(computeHullMass(makeBoxHull({1, 1, 1}), 0), std::invalid_argument);
  EXPECT_THROW(computeHullMass(makeBoxHull({1, 1, 1}), std::nan("")), std::invalid_argument);
}

}  // namespace
}  // namespace enfilade::scene
