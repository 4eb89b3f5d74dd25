// Tests of kinematic chains: joint motion, blocking, and that no obstacle is crossed.
#include <cmath>
#include <random>

#include "scene/world/data/avatar_shape.hpp"
#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Kind = Notice::Kind;

/// A turntable on a low base, an upper and a lower arm of 0.8 m, and a hand that slides out.
Spawn makeArmAt(const Vec3& at) {
  Spawn spawn;
  spawn.position = at;
  spawn.parts = {makeBoxPoints({-0.2, 0, -0.2}, {0.2, 0.5, 0.2})};
  Link table{-1,
             {LinkJoint::Kind::revolute, {0, 0.51, 0}, {0, 1, 0}, -3, 3},
             makeBoxPoints({-0.15, 0, -0.15}, {0.15, 0.1, 0.15})};
  Link upper{0,
             {LinkJoint::Kind::revolute, {0, 0.2, 0}, {0, 0, 1}, -0.5, 3.2},
             makeBoxPoints({0, -0.05, -0.05}, {0.8, 0.05, 0.05}),
             1.5};
  Link lower{1,
             {LinkJoint::Kind::revolute, {0.85, 0, 0}, {0, 0, 1}, -2.8, 2.8},
             makeBoxPoints({0, -0.04, -0.04}, {0.8, 0.04, 0.04})};
  Link hand{2,
            {LinkJoint::Kind::prismatic, {0.82, 0, 0}, {1, 0, 0}, 0, 0.4},
            makeBoxPoints({0, -0.1, -0.1}, {0.05, 0.1, 0.1})};
  spawn.links = {table, upper, lower, hand};
  return spawn;
}

DriveJoints makeDriveJoints(std::vector<std::optional<double>> to, double speed = 1) {
  return {std::move(to), speed};
}

TEST(Chain, JointsComeExactlyToTheirTargets) {
  WorldFixture run({makeFloorBox()});
  run.order("arm", makeArmAt({0, 0, 0}));
  run.order("arm", makeDriveJoints({1.0, 0.7, {}, 0.25}));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::done), 1);
  const auto view = run.getView("arm");
  ASSERT_EQ(view.joints.size(), 4u);
  EXPECT_EQ(view.joints[0].value, 1.0);
  EXPECT_EQ(view.joints[1].value, 0.7);
  EXPECT_EQ(view.joints[2].value, 0.0);
  EXPECT_EQ(view.joints[3].value, 0.25);
  // The hand is 0.85 + 0.82 + 0.25 m along the arm, raised by 0.7 rad, rotated by 1 rad about +Y.
  const double along = 1.92, up = 0.71 + along * std::sin(0.7), out = along * std::cos(0.7);
  const Vec3 hand = view.shape->parts.back().offset;
  EXPECT_NEAR((hand - Vec3(out * std::cos(1.0), up, -out * std::sin(1.0))).norm(), 0, 1e-9);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Chain, TheDurationOfARotationFollowsFromItsSpeed) {
  WorldFixture run({makeFloorBox()});
  run.order("arm", makeArmAt({0, 0, 0}));
  run.runUntilIdle();
  run.order("arm", makeDriveJoints({1.5}, 3));
  run.runTicks(29);
  EXPECT_NEAR(run.getView("arm").joints[0].value, 1.45, 1e-9);
  EXPECT_EQ(run.count(Kind::done), 0);
}

TEST(Chain, AWallStopsTheArmAtEpsilonAndIsNamed) {
  WorldFixture run({makeFloorBox(), {"wall", {-5, 0, -1.2}, {5, 3, -1.1}}});
  run.order("arm", makeArmAt({0, 0, 0}));
  run.order("arm", makeDriveJoints({0, 0}));
  run.order("arm", makeDriveJoints({1.5}, 2));  // towards -Z
  run.runUntilIdle();
  ASSERT_EQ(run.count(Kind::blocked), 1);
  EXPECT_EQ(findEntityName(run.world, run.notices.back().obstacle), "wall");
  const double value = run.getView("arm").joints[0].value;
  EXPECT_GT(value, 0.5);
  EXPECT_LT(value, 0.8);
  EXPECT_NE(run.notices.back().text.find("joints at ["), std::string::npos);
  EXPECT_TRUE(run.hasTouched("wall"));
  EXPECT_EQ(run.worstPenetration, 0);
  double nearest = 1;
  for (const ContactEvent& e : run.events)
    if (e.kind == ContactEvent::Kind::blocked) nearest = e.separation.distance;
  EXPECT_GT(nearest, 0.85 * run.world.settings().contactOffset);
  EXPECT_LT(nearest, 1.1 * run.world.settings().contactOffset);
}

TEST(Chain, AtAnySpeedAPaneOfNoThicknessIsNotCrossed) {
  Model model = makeBoxModel({makeFloorBox()});
  Mesh pane;
  pane.positions = {{-5, 0, -1.2F}, {5, 0, -1.2F}, {5, 3, -1.2F}, {-5, 3, -1.2F}};
  pane.indices = {0, 1, 2, 0, 2, 3};
  model.meshes.push_back(pane);
  model.objects.push_back({"pane", "", {1}, Eigen::Affine3d::Identity()});
  const auto scene = std::make_shared<const Scene>(model);
  for (const double speed : {0.3, 5.0, 20.0}) {
    WorldFixture run(scene);
    run.order("arm", makeArmAt({0, 0, 0}));
    run.order("arm", makeDriveJoints({0, 0}, speed));
    run.order("arm", makeDriveJoints({3}, speed));
    run.runUntilIdle();
    EXPECT_EQ(run.count(Kind::blocked), 1) << speed;
    EXPECT_NEAR(run.getView("arm").joints[0].value, 0.69, 0.05) << speed;
    EXPECT_EQ(run.worstPenetration, 0);
  }
}

TEST(Chain, AnArmThatSwingsWhileItsBaseSlidesOffARoofCrossesNoPane) {
  // The base falls as far as it can and then slides sideways, while the arm swings fast.
  Model model = makeBoxModel({{"ground", {-20, -0.2, -20}, {20, 0, 20}}});
  Mesh roof;
  roof.positions = {{-1, 2.4F, -3}, {-1, 2.4F, 3}, {0.4F, 0, 3}, {0.4F, 0, -3}};
  roof.indices = {0, 1, 2, 0, 2, 3};
  Mesh pane;
  pane.positions = {{2.2F, 0, -6}, {2.2F, 0, 6}, {2.2F, 60, 6}, {2.2F, 60, -6}};
  pane.indices = {0, 1, 2, 0, 2, 3};
  model.meshes.insert(model.meshes.end(), {roof, pane});
  model.objects.push_back({"roof", "", {1}, Eigen::Affine3d::Identity()});
  model.objects.push_back({"pane", "", {2}, Eigen::Affine3d::Identity()});
  const auto scene = std::make_shared<const Scene>(model);
  for (double height = 20; height < 21; height += 0.13) {
    WorldFixture run(scene);
    run.order("arm", makeArmAt({0, height, 0}));
    run.order("arm", makeDriveJoints({{}, 0.0}, 20));
    run.runTicks(10);
    for (int i = 0; i < 240; ++i) {
      if (i % 20 == 0) {
        DriveJoints swing = makeDriveJoints({i % 40 == 0 ? 2.9 : -2.9, 0.0}, 20);
        swing.immediate = true;
        run.order("arm", swing);
      }
      run.step();
      const AvatarSnapshot arm = run.getView("arm");
      for (const AvatarPart& part : arm.shape->parts)
        ASSERT_LT(placeBox(part.box, arm.footPosition).max.x(), 2.2001)
            << height << " m, tick " << i;
    }
  }
}

TEST(Chain, TheOtherJointsContinueIfOneIsStopped) {
  WorldFixture run({makeFloorBox(), {"wall", {-5, 0, -1.2}, {5, 3, -1.1}}});
  run.order("arm", makeArmAt({0, 0, 0}));
  run.order("arm", makeDriveJoints({0, 0}));
  run.order("arm", makeDriveJoints({1.5, 0.4, {}, 0.1}));
  run.runUntilIdle();
  EXPECT_EQ(run.getView("arm").joints[1].value, 0.4);
  EXPECT_LT(run.getView("arm").joints[0].value, 1.5);
}

TEST(Chain, AHandSlidesAlongATableAndPushesOntoIt) {
  WorldFixture run({makeFloorBox(), {"table", {0.9, 0, -2}, {2.4, 0.6, 2}}});
  run.order("arm", makeArmAt({0, 0, 0}));
  run.order("arm", makeDriveJoints({-0.5, 0.3}));
  run.order("arm", makeDriveJoints({{}, -0.5}));  // down onto the table
  run.runUntilIdle();
  ASSERT_EQ(run.count(Kind::blocked), 1);
  EXPECT_TRUE(run.hasTouched("table"));
  run.order("arm", makeDriveJoints({0.5}));  // along the table
  run.runUntilIdle();
  EXPECT_EQ(run.getView("arm").joints[0].value, 0.5);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Chain, AnAvatarStopsTheArmAndTheArmStopsAnAvatar) {
  WorldFixture run({makeFloorBox()});
  run.order("arm", makeArmAt({0, 0, 0}));
  run.order("arm", makeDriveJoints({-1.2, 0.2}));
  run.order("bob", Spawn{{1.2, 0, 0}});
  run.runUntilIdle();
  run.order("arm", makeDriveJoints({1.2}));
  run.runUntilIdle();
  ASSERT_EQ(run.count(Kind::blocked), 1);
  EXPECT_EQ(findEntityName(run.world, run.notices.back().obstacle), "bob");
  run.order("ann", Spawn{{-2, 0, 1.2}});
  run.order("ann", makeWalkTo(4, 1.2));
  run.order("ann", makeWalkTo(4, 0.5));
  run.runUntilIdle();
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Chain, NonNeighbourLinksStopEachOtherIfRequested) {
  for (const bool selfContact : {false, true}) {
    WorldFixture run({makeFloorBox()});
    Spawn arm = makeArmAt({0, 0, 0});
    arm.selfContact = selfContact;
    run.order("arm", arm);
    run.order("arm", makeDriveJoints({{}, 2.6}));
    run.order("arm", makeDriveJoints({{}, {}, 2.8}));  // would move the hand down into the base
    run.runUntilIdle();
    EXPECT_EQ(run.count(Kind::blocked) > 0, selfContact);
  }
}

TEST(Chain, AnArmOnABaseThatWalksIsSweptWhole) {
  WorldFixture run({makeFloorBox(), {"post", {3, 0, 0.9}, {3.1, 3, 1.0}}});
  run.order("arm", makeArmAt({0, 0, 0}));
  run.order("arm", makeDriveJoints({-1.5, 0}));  // the arm points towards +Z
  run.order("arm", makeWalkTo(6, 0));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 1);
  EXPECT_EQ(findEntityName(run.world, run.notices.back().obstacle), "post");
  EXPECT_LT(run.getFeet("arm").x(), 3);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Chain, RandomDrivesThroughClutterNeverPenetrate) {
  std::mt19937_64 random(9);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<NamedBox> boxes{makeFloorBox()};
  for (int i = 0; i < 30; ++i) {
    const double angle = uniform(0, 6.28), far = uniform(0.8, 2), y = uniform(0, 1.8);
    const double x = far * std::cos(angle), z = far * std::sin(angle);
    const double size = uniform(0.02, 0.2);
    boxes.push_back({"box" + std::to_string(i), {x, y, z}, {x + size, y + 0.5 * size, z + 0.05}});
  }
  WorldFixture run(boxes);
  run.order("arm", makeArmAt({0, 0, 0}));
  run.step();
  if (run.count(Kind::spawned) == 0) GTEST_FAIL() << run.getText(Kind::refused);
  for (int k = 0; k < 60; ++k) {
    const double turn = uniform(-3, 3), up = uniform(-0.5, 3.2), bend = uniform(-2.8, 2.8);
    run.order("arm", DriveJoints{{turn, up, bend, uniform(0, 0.4)}, uniform(0.5, 20), true});
    run.runTicks(30);
  }
  EXPECT_EQ(run.worstPenetration, 0);
  EXPECT_GT(run.events.size(), 15u);
}

TEST(Chain, AbsurdLinksAndTargetsAreRefusedAndChangeNothing) {
  WorldFixture run({makeFloorBox()});
  const auto refused = [&](Spawn spawn) {
    return submitAvatarCommand(run.world, {"x", spawn, 0}).value_or("");
  };
  Spawn bad = makeArmAt({0, 0, 0});
  bad.links[1].parent = 1;
  EXPECT_NE(refused(bad).find("links[1].parent"), std::string::npos);
  bad = makeArmAt({0, 0, 0});
  bad.links[2].joint.axis = Vec3::Zero();
  EXPECT_NE(refused(bad).find("links[2].axis"), std::string::npos);
  bad = makeArmAt({0, 0, 0});
  bad.links[0].points[3].y() = std::nan("");
  EXPECT_NE(refused(bad).find("links[0].points[3].y"), std::string::npos);
  bad = makeArmAt({0, 0, 0});
  bad.links[3].value = 0.5;
  EXPECT_NE(refused(bad).find("links[3].value"), std::string::npos);
  bad = makeArmAt({0, 0, 0});
  bad.parts.resize(kMaxParts + 1, bad.parts[0]);
  EXPECT_NE(refused(bad).find("parts"), std::string::npos);
  EXPECT_TRUE(submitAvatarCommand(run.world, {"x", makeDriveJoints({std::nan("")}), 0}));
  EXPECT_TRUE(submitAvatarCommand(run.world, {"x", makeDriveJoints({1.0}, 0), 0}));
  EXPECT_TRUE(submitAvatarCommand(run.world, {"x", makeDriveJoints({1.0}, 21), 0}));
  EXPECT_TRUE(submitAvatarCommand(run.world, {"x", makeDriveJoints({}), 0}));
  run.order("arm", makeArmAt({0, 0, 0}));
  run.order("arm", makeDriveJoints({3.5}));
  run.order("arm", makeDriveJoints({0, 0, 0, 0, 0}));
  run.order("arm", Crouch{1});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::refused), 3);
}

TEST(Chain, PartsTurnAsTheSpawnFaces) {
  WorldFixture run({makeFloorBox()});
  Spawn spawn;
  spawn.facing = 90;
  spawn.parts = {makeBoxPoints({0, 0, -0.1}, {1, 1, 0.1})};
  run.order("box", spawn);
  run.runUntilIdle();
  const Aabb box = run.getView("box").shape->box;
  EXPECT_NEAR(box.min.z(), -1, 1e-12);
  EXPECT_NEAR(box.max.z(), 0, 1e-12);
  EXPECT_NEAR(box.max.x(), 0.1, 1e-12);
}

TEST(Chain, TheSameDrivesGiveTheSameHash) {
  const auto computeHash = [](double turn) {
    WorldFixture run({makeFloorBox(), {"wall", {-5, 0, -1.2}, {5, 3, -1.1}}});
    run.order("arm", makeArmAt({0, 0, 0}));
    run.order("arm", makeDriveJoints({turn, 0.3, -0.4}, 3));
    run.runTicks(200);
    return run.world.snapshot()->stateHash;
  };
  EXPECT_EQ(computeHash(1.5), computeHash(1.5));
  EXPECT_NE(computeHash(0.5), computeHash(0.5000000001));
}

}  // namespace
}  // namespace enfilade::scene
