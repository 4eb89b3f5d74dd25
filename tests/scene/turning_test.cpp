// Orders that turn, teleport and look: views, parts and links.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "scene/world/checkpoint/checkpoint.hpp"
#include "scene/world/queries/contact_horizon.hpp"
#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Kind = Notice::Kind;

NamedBox makeFloor(double half) {
  return {"floor", {-half, -0.2, -half}, {half, 0, half}};
}

/// A plank of 2 m along +X, 0.2 m wide.
Spawn makePlank(const Vec3& at, double facing = 0) {
  Spawn spawn{at, facing};
  spawn.parts = {makeBoxPoints({-1, 0, -0.1}, {1, 1, 0.1})};
  return spawn;
}

TEST(Turning, AViewTurnsWithTheRateAndKeepsItsElevation) {
  WorldFixture run({makeFloor(20)});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runTicks(5);
  const Vec3 eyes = run.getFeet("ann") + Vec3(0, run.getView("ann").eyeHeight, 0);
  run.order("ann", Look{eyes + Vec3(3, -4, 0)});
  run.order("ann", Turn{90, true, 90});
  run.runTicks(30);
  const double half = std::sqrt(0.5) * 0.6;
  EXPECT_LT((run.getView("ann").viewDirection - Vec3(half, -0.8, -half)).norm(), 1e-12);
  EXPECT_EQ(run.count(Kind::done), 1) << "of the Look";
  run.runUntilIdle();
  EXPECT_LT((run.getView("ann").viewDirection - Vec3(0, -0.8, -0.6)).norm(), 1e-12);
  EXPECT_EQ(run.count(Kind::done), 2);
  EXPECT_NEAR(static_cast<double>(run.world.snapshot()->tick), 5 + 60 + 2, 2);
  EXPECT_EQ(run.getView("ann").facing, 0) << "a prism does not turn";
}

TEST(Turning, AFacingIsReachedByTheShorterWay) {
  WorldFixture run({makeFloor(20)});
  run.order("ann", Spawn{{0, 0, 0}, 170});
  run.order("ann", Turn{-170, false, 60});
  run.runTicks(5);
  run.runTicks(20);
  EXPECT_EQ(run.count(Kind::done), 1) << "20 degrees take a third of a second";
  const double angle = -170 * std::numbers::pi / 180;
  EXPECT_LT((run.getView("ann").viewDirection - Vec3(std::cos(angle), 0, -std::sin(angle))).norm(),
            1e-12);
  for (const double facing : {0.0, 90.0, 180.0, -90.0, 33.3}) {
    run.order("ann", Turn{facing, false, 1000});
    run.runUntilIdle();
    const double radians = facing * std::numbers::pi / 180;
    EXPECT_LT(
        (run.getView("ann").viewDirection - Vec3(std::cos(radians), 0, -std::sin(radians))).norm(),
        1e-12)
        << facing;
  }
}

TEST(Turning, PartsTurnUpToTheFirstObstacleAndBack) {
  WorldFixture run({makeFloor(20), {"post", {-0.05, 0, -0.95}, {0.05, 2, -0.85}}});
  run.order("bar", makePlank({0, 0.002, 0}));
  run.order("bar", Turn{180, true, 90});
  run.runUntilIdle();
  const AvatarSnapshot stopped = run.getView("bar");
  EXPECT_EQ(run.count(Kind::blocked), 1);
  EXPECT_EQ(findEntityName(run.world, run.notices.back().obstacle), "post");
  // The plank's side, 0.1 m off its axis, meets the post's corner at (0.05, -0.85).
  const double reach = std::hypot(0.05, 0.85);
  const double expected =
      (std::atan2(0.85, 0.05) - std::asin(0.1 / reach)) * 180 / std::numbers::pi;
  EXPECT_LT(stopped.facing, expected);
  EXPECT_GT(stopped.facing, expected - 0.2);
  EXPECT_TRUE(run.hasTouched("post"));
  run.order("bar", Turn{0, false, 90});
  run.runUntilIdle();
  EXPECT_NEAR(run.getView("bar").facing, 0, 1e-12);
  EXPECT_EQ(run.worstPenetration, 0);
  EXPECT_EQ(run.open.size(), 1u) << "the floor alone";
}

TEST(Turning, AnArmOnAPrismTurnsWithTheView) {
  WorldFixture run({makeFloor(20), {"wall", {-5, 0, -1.2}, {5, 2, -1}}});
  Spawn spawn{{0, 0, 0}};
  Link arm;
  arm.joint.anchor = {0.35, 1, 0};
  arm.points = makeBoxPoints({0, -0.05, -0.05}, {0.8, 0.05, 0.05});
  spawn.links = {arm};
  run.order("ann", spawn);
  run.order("ann", Turn{150, true, 90});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 1);
  EXPECT_EQ(findEntityName(run.world, run.notices.back().obstacle), "wall");
  const AvatarSnapshot ann = run.getView("ann");
  EXPECT_GT(ann.facing, 45);
  EXPECT_LT(ann.facing, 65);
  const double radians = ann.facing * std::numbers::pi / 180;
  EXPECT_LT((ann.viewDirection - Vec3(std::cos(radians), 0, -std::sin(radians))).norm(), 1e-9);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Turning, CrowdsOfTurningPlanksNeverPenetrate) {
  std::mt19937 random(5);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  std::vector<NamedBox> boxes{makeFloor(8)};
  for (int i = 0; i < 12; ++i) {
    const Vec3 at(uniform(-6, 6), 0, uniform(-6, 6));
    boxes.push_back({"box " + std::to_string(i), at, at + Vec3(0.4, 2, 0.4)});
  }
  WorldFixture run(boxes);
  for (int i = 0; i < 12; ++i)
    run.order("bar" + std::to_string(i),
              makePlank({uniform(-6, 6), 0.002, uniform(-6, 6)}, uniform(0, 360)));
  run.step();
  const std::size_t spawned = run.world.snapshot()->avatars.size();
  ASSERT_GT(spawned, 5u);
  for (int i = 0; i < 900; ++i) {
    if (i % 30 == 0)
      for (const AvatarSnapshot& avatar : run.world.snapshot()->avatars) {
        run.order(avatar.name, Drive{{uniform(-1.5, 1.5), 0, uniform(-1.5, 1.5)}});
        run.order(avatar.name, Turn{uniform(-200, 200), true, uniform(30, 400)});
      }
    run.step();
  }
  EXPECT_EQ(run.worstPenetration, 0);
  double turned = 0;
  for (const AvatarSnapshot& avatar : run.world.snapshot()->avatars)
    turned += std::abs(avatar.facing);
  EXPECT_GT(turned, 100);
}

TEST(Turning, ADriveEndsATurnAndTheViewFollowsItAgain) {
  WorldFixture run({makeFloor(20)});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runTicks(5);
  run.order("ann", Drive{{1, 0, 0}});
  run.order("ann", Turn{90, true, 180});
  run.runTicks(40);
  EXPECT_LT((run.getView("ann").viewDirection - Vec3(0, 0, -1)).norm(), 1e-12)
      << "held while driven";
  EXPECT_GT(run.getFeet("ann").x(), 0.5);
  run.order("ann", Look{{0, 1.6, 100}});
  run.runTicks(20);
  EXPECT_GT(run.getView("ann").viewDirection.z(), 0.99) << "P16: a Look while driven";
  run.order("ann", Drive{{0, 0, -1}});
  run.runTicks(2);
  EXPECT_EQ(run.getView("ann").viewDirection, Vec3(0, 0, -1));
}

TEST(Turning, ATurnIsInTheHashAndInCheckpoints) {
  const auto scene = makeBoxScene({makeFloor(20), {"post", {-0.05, 0, -0.95}, {0.05, 2, -0.85}}});
  WorldFixture run(scene), other(scene);
  for (WorldFixture* one : {&run, &other}) {
    one->order("bar", makePlank({0, 0.002, 0}, 20));
    one->order("bar", Turn{one == &run ? 100.0 : 100.5, true, 90});
    one->runTicks(12);
  }
  EXPECT_NE(run.world.snapshot()->stateHash, other.world.snapshot()->stateHash);
  World copy = restoreWorld(scene, makeCheckpoint(run.world));
  EXPECT_EQ(makeCheckpoint(copy), makeCheckpoint(run.world));
  for (int i = 0; i < 300; ++i) {
    run.step();
    ASSERT_EQ(tickWorld(copy).snapshot->stateHash, run.world.snapshot()->stateHash) << i;
  }
  EXPECT_EQ(run.count(Kind::blocked), 1);
}

TEST(Teleport, PlacesAnAvatarWhereThereIsRoomAndRefusesElsewhere) {
  WorldFixture run({makeFloor(20), {"wall", {5, 0, -5}, {5.2, 3, 5}}});
  run.order("ann", Spawn{{4.699, 0, 0}});
  run.order("ann", Walk{{{4.9, 0, 0}}, 1.0});
  run.runUntilIdle();
  EXPECT_TRUE(run.hasTouched("wall"));
  run.order("ann", Teleport{{5.1, 0, 0}, {}});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::refused), 1);
  EXPECT_NE(run.getText(Kind::refused).find("wall"), std::string::npos)
      << run.getText(Kind::refused);
  EXPECT_NE(run.getText(Kind::refused).find("there is room at"), std::string::npos);
  run.order("ann", Teleport{{-3, 0.5, 2}, 180.0});
  run.step();
  EXPECT_EQ(run.count(Kind::done), 1);
  EXPECT_LT((run.getView("ann").viewDirection - Vec3(-1, 0, 0)).norm(), 1e-12);
  run.runUntilIdle();
  EXPECT_LT((run.getFeet("ann") - Vec3(-3, 0, 2)).norm(), 0.002);
  EXPECT_TRUE(run.getView("ann").grounded);
  EXPECT_EQ(run.open.size(), 1u) << "the contact with the wall ended";
  EXPECT_EQ(run.worstPenetration, 0);
  run.order("ann", Teleport{{60, 0, 0}, {}});
  run.runUntilIdle();
  EXPECT_NE(run.getText(Kind::refused).find("no floor"), std::string::npos);
}

TEST(Teleport, IntoTheAvatarsOwnPlaceIsNoOverlapAndIntoAnotherIs) {
  WorldFixture run({makeFloor(20)});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("bob", Spawn{{2, 0, 0}});
  run.runTicks(5);
  run.order("ann", Teleport{{0.05, 0, 0}, {}});
  run.order("bob", Teleport{{0.3, 0, 0}, {}});
  run.runTicks(3);
  EXPECT_EQ(run.count(Kind::done), 1);
  EXPECT_NE(run.getText(Kind::refused).find("overlap ann"), std::string::npos);
}

TEST(Teleport, StartsTheContactHorizonsOfTheAvatarAgain) {
  WorldSettings settings;
  settings.maxSpeed = 2;
  WorldFixture run({makeFloor(200)}, settings);
  run.order("ann", Spawn{{-100, 0, 0}});
  run.order("bob", Spawn{{100, 0, 0}});
  run.runTicks(5);
  ContactHorizons horizons(borrowScene(run.world), settings, {});
  horizons.select(std::nullopt);
  const auto provedUntil = [&] {
    const ContactHorizon& ann = horizons.horizons().at(run.getView("ann").id);
    return ann.approaches.empty() ? 1e9 : ann.approaches.front().notBefore;
  };
  horizons.update(run.world.snapshot());
  EXPECT_GT(provedUntil(), run.world.snapshot()->time + 0.1);
  run.order("bob", Teleport{{-99, 0, 0}, {}});
  run.runTicks(1);
  horizons.update(run.world.snapshot());
  horizons.validate();
  EXPECT_LT(provedUntil(), run.world.snapshot()->time + 0.05);
}

}  // namespace
}  // namespace enfilade::scene
