#include <map>
#include <random>

#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Action = BodyCommand::Action;
using Event = ContactEvent::Kind;

/// A door leaf of 1 m in the plane z = 0, hinged at x = 0, that opens towards +z or -z.
Model makeHingedDoor(std::vector<NamedBox> others = {}) {
  others.insert(others.begin(), {makeFloorBox(), {"leaf", {0, 0.01, -0.02}, {1, 2.1, 0.02}}});
  Model model = makeBoxModel(others);
  BodySpec door = makeBodySpec("door", BodyKind::hinged, {1});
  door.low = -kQuarter, door.high = kQuarter;
  door.speed = kQuarter;  // a quarter turn a second
  model.bodies.push_back(door);
  return model;
}

/// A platform of 2 x 2 m whose top is y = 0.1 at the lowest of three stops.
Model makeLift(std::vector<NamedBox> others = {}) {
  others.insert(others.begin(), {makeFloorBox(), {"car", {-1, 0.05, -1}, {1, 0.1, 1}}});
  Model model = makeBoxModel(others);
  BodySpec spec = makeBodySpec("lift", BodyKind::lift, {1});
  spec.high = 6;
  spec.stops = {0, 3, 6};
  spec.speed = 1.5;
  spec.acceleration = 1;
  model.bodies.push_back(spec);
  return model;
}

TEST(KinematicBodies, ADoorOpensAtItsSpeedAndStandsThere) {
  BodyFixture t(makeHingedDoor());
  t.submit({"door", Action::open, 0, 0, {}});
  t.runTicks(30);
  EXPECT_NEAR(t.getBody("door").drive.jointPosition, kQuarter / 2, 1e-12);
  EXPECT_NEAR(t.getBody("door").angularVelocity.y(), kQuarter, 1e-9);
  t.runUntilIdle();
  EXPECT_EQ(t.getBody("door").drive.jointPosition, kQuarter);
  EXPECT_LE(t.world.data().tick, 61u);
  const Vec3 tip = t.getBody("door").rotation * Vec3(1, 0, 0) + t.getBody("door").position;
  EXPECT_NEAR((tip - Vec3(0, 0, -1)).norm(), 0, 1e-12);  // counter-clockwise from above
}

TEST(KinematicBodies, ACloserClosesTheDoorAfterItsDelay) {
  Model model = makeHingedDoor();
  model.bodies[0].autoCloseDelay = 0.5;
  BodyFixture t(std::move(model));
  t.submit({"door", Action::moveTo, 0.3, 0, {}});
  t.runTicks(12);
  EXPECT_EQ(t.getBody("door").drive.jointPosition, 0.3);
  t.runTicks(29);
  EXPECT_EQ(t.getBody("door").drive.jointPosition, 0.3);
  t.runUntilIdle();
  EXPECT_EQ(t.getBody("door").drive.jointPosition, 0);
}

TEST(KinematicBodies, ADoorPushesAnAvatarThatCanYield) {
  BodyFixture t(makeHingedDoor());
  t.order("ann", Spawn{{0.6, 0.01, -0.5}, 0, 0.3, 1.75});
  t.runTicks(30);
  t.submit({"door", Action::open, 0, 0, {}});
  t.runUntilIdle();
  EXPECT_EQ(t.getBody("door").drive.jointPosition, kQuarter);
  EXPECT_EQ(t.countEvents(Event::blocked, "door", "ann"), 0);
  EXPECT_GE(t.countEvents(Event::begin, "ann", "door"), 1);
  EXPECT_EQ(namePenetratingPairs(t.world), "");
  EXPECT_LT(t.getFeet("ann").x(), 0) << "pushed aside";
}

TEST(KinematicBodies, ADoorStopsAtAnAvatarAgainstAWallAndReportsItOnce) {
  // Walls behind and on both sides: the avatar cannot yield.
  BodyFixture t(makeHingedDoor({{"wall", {-2, 0, -1.2}, {2, 3, -1}},
                                {"left", {0.2, 0, -1}, {0.25, 3, -0.4}},
                                {"right", {0.9, 0, -1}, {0.95, 3, -0.4}}}));
  t.order("ann", Spawn{{0.575, 0.01, -0.68}, 0, 0.3, 1.75});
  t.runTicks(30);
  t.submit({"door", Action::open, 0, 0, {}});
  t.runTicks(90);
  EXPECT_EQ(t.countEvents(Event::blocked, "door", "ann"), 1);
  EXPECT_GT(t.getBody("door").drive.jointPosition, 0.05);
  EXPECT_LT(t.getBody("door").drive.jointPosition, 0.8);
  EXPECT_EQ(namePenetratingPairs(t.world), "");
  // When the avatar has left, the door continues.
  t.order("ann", Leave{});
  t.runUntilIdle();
  EXPECT_EQ(t.getBody("door").drive.jointPosition, kQuarter);
}

TEST(KinematicBodies, DoorsOfAnySpeedCrossNoAvatar) {
  std::mt19937 random(7);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
  };
  int touched = 0;
  for (int run = 0; run < 60; ++run) {
    Model model = makeHingedDoor({{"wall", {-2, 0, -1.6}, {2, 3, -1.5}}});
    // 0.01 to 100 m/s at the tip, log-uniform.
    const double tip = std::pow(10.0, uniform(-2, 2));
    model.bodies[0].speed = tip;
    BodyFixture t(std::move(model));
    const double radius = uniform(0.1, 0.45);
    t.order(
        "ann",
        Spawn{{uniform(-0.3, 1.2), 0.01, -uniform(radius + 0.05, 1.4 - radius)}, 0, radius, 1.75});
    t.runTicks(10);
    if (t.world.data().avatars.empty()) continue;
    const bool startsInTheWay = t.getFeet("ann").x() > 0 && t.getFeet("ann").norm() < 0.8;
    t.submit({"door", Action::open, 0, 0, {}});
    for (int i = 0; i < 40; ++i) {
      t.step();
      ASSERT_EQ(namePenetratingPairs(t.world), "") << "run " << run << ", tip " << tip;
    }
    // An avatar in front of the leaf, and not at its tip, must not end up behind it.
    const Vec3 local = t.getBody("door").rotation.transpose() * t.getFeet("ann");
    if (startsInTheWay && local.x() > 0 && local.x() < 1) {
      EXPECT_LT(local.z(), 0) << "run " << run;
    }
    touched += t.countEvents(Event::begin, "ann", "door") > 0;
  }
  EXPECT_GT(touched, 15);
}

TEST(KinematicBodies, ALiftCarriesItsRiderUpAndDown) {
  BodyFixture t(makeLift());
  t.order("ann", Spawn{{0, 0.1, 0}, 0, 0.3, 1.75});
  t.runTicks(30);
  t.submit({"lift", Action::moveToLevel, 0, 2, {}});
  for (int i = 0; i < 600; ++i) {
    if (t.step().idle) break;
    const double above = t.getFeet("ann").y() - (t.getBody("lift").position.y() + 0.1);
    ASSERT_GT(above, 0);
    ASSERT_LT(above, 2 * t.world.settings().contactOffset) << "tick " << i;
  }
  EXPECT_EQ(t.getBody("lift").drive.jointPosition, 6);
  EXPECT_NEAR(t.getFeet("ann").y(), 6.1, 1e-3);
  t.submit({"lift", Action::moveToLevel, 0, 0, {}});
  for (int i = 0; i < 600; ++i) {
    if (t.step().idle) break;
    ASSERT_LT(t.getFeet("ann").y() - (t.getBody("lift").position.y() + 0.1),
              2 * t.world.settings().contactOffset);
  }
  EXPECT_NEAR(t.getFeet("ann").y(), 0.1, 1e-3);
  EXPECT_EQ(t.countEvents(Event::begin, "ann", "lift"), 1) << "she never lost contact";
}

TEST(KinematicBodies, ALiftThatComesDownOnSomeoneStopsAtTheHead) {
  BodyFixture t(makeLift());
  t.submit({"lift", Action::moveToLevel, 0, 1, {}});
  t.runUntilIdle();
  t.order("ann", Spawn{{0.2, 0.01, 0}, 0, 0.3, 1.75});
  t.runTicks(30);
  t.submit({"lift", Action::moveToLevel, 0, 0, 30.0});
  t.runTicks(120);
  EXPECT_EQ(t.countEvents(Event::blocked, "lift", "ann"), 1);
  EXPECT_EQ(namePenetratingPairs(t.world), "");
  EXPECT_NEAR(t.getBody("lift").position.y() + 0.05, 1.75, 0.01);
  EXPECT_NEAR(t.getFeet("ann").y(), 0, 1e-3);
}

TEST(KinematicBodies, ALiftStopsWhereItsRiderMeetsTheCeiling) {
  BodyFixture t(makeLift({{"ceiling", {-3, 4, -3}, {3, 4.2, 3}}}));
  t.order("ann", Spawn{{0, 0.1, 0}, 0, 0.3, 1.75});
  t.runTicks(30);
  t.submit({"lift", Action::moveToLevel, 0, 2, {}});
  t.runTicks(400);
  EXPECT_EQ(t.countEvents(Event::blocked, "lift", "ann"), 1);
  EXPECT_EQ(namePenetratingPairs(t.world), "");
  EXPECT_NEAR(t.getBody("lift").position.y() + 0.1 + 1.75, 4, 0.01);
}

TEST(KinematicBodies, OnABlockedLiftNoAvatarRises) {
  Model model = makeBoxModel({makeFloorBox(),
                              {"platform", {-1, 0.01, -1}, {1, 0.1, 1}},
                              {"beam", {-1, 2.6, -1}, {-0.2, 2.8, 1}}});
  BodySpec spec = makeBodySpec("lift", BodyKind::lift, {1});
  spec.high = 3, spec.speed = 1.5;
  spec.stops = {0, 3};
  model.bodies.push_back(spec);
  BodyFixture t(std::move(model));
  t.order("tall", Spawn{.position = {-0.5, 0.2, 0}});
  t.order("free", Spawn{.position = {0.5, 0.2, 0}});
  t.runUntilIdle();
  for (int again = 0; again < 3; ++again) {
    t.submit({"lift", Action::moveTo, 3, 0, {}});
    t.runTicks(120);
    const double top = t.getBody("lift").position.y() - t.getBody("lift").shape->origin.y() + 0.1;
    EXPECT_LT(t.getFeet("free").y() - top, 2 * t.world.settings().contactOffset) << again;
    EXPECT_EQ(namePenetratingPairs(t.world), "");
    t.submit({"lift", Action::stop, 0, 0, {}});
    t.runTicks(60);
  }
}

TEST(KinematicBodies, AnEntityInATriggerAtTheStartEntersIt) {
  Model model = makeBoxModel(
      {makeFloorBox(), {"door", {0, 0.01, 0}, {1, 2, 0.1}}, {"zone", {0, 0, -1}, {1, 1, 1}}});
  BodySpec door = makeBodySpec("door", BodyKind::hinged, {1});
  door.high = 1.5;
  model.bodies = {door, makeBodySpec("zone", BodyKind::trigger, {2})};
  BodyFixture t(std::move(model));
  t.runTicks(5);
  EXPECT_EQ(t.countEvents(ContactEvent::Kind::enter, "door", "zone"), 1);
}

TEST(KinematicBodies, APlatformCarriesSidewaysAndATurntableRound) {
  Model model =
      makeBoxModel({{"plate", {-2, 0, -2}, {2, 0.1, 2}}, {"ground", {-9, -1, -9}, {9, -0.9, 9}}});
  BodySpec spec = makeBodySpec("plate", BodyKind::path, {0});
  spec.keys = {{0, {0, 0, 0}, 0}, {2, {3, 0, 0}, 0}, {4, {3, 0, 0}, 4 * kQuarter}};
  model.bodies.push_back(spec);
  BodyFixture t(std::move(model));
  t.submit({"plate", Action::stop, 0, 0, {}});
  t.order("ann", Spawn{{1, 0.1, 0}, 0, 0.3, 1.75});
  t.runTicks(30);
  t.submit({"plate", Action::run, 0, 0, {}});
  t.runTicks(120);
  EXPECT_NEAR(t.getFeet("ann").x(), 4, 0.02);
  t.runTicks(60);
  EXPECT_NEAR(t.getFeet("ann").x(), 2, 0.1);
  t.runUntilIdle();
  EXPECT_NEAR(t.getFeet("ann").x(), 4, 0.1);
  EXPECT_EQ(namePenetratingPairs(t.world), "");
}

TEST(KinematicBodies, ALoopingTurntableRotatesEvenlyAndCarriesAvatars) {
  Model model =
      makeBoxModel({{"plate", {-2, 0, -2}, {2, 0.1, 2}}, {"ground", {-9, -1, -9}, {9, -0.9, 9}}});
  BodySpec spec = makeBodySpec("plate", BodyKind::path, {0});
  const double round = 8 * std::atan(1.0);
  spec.keys = {{0, Vec3::Zero(), 0}, {2, Vec3::Zero(), round}};
  spec.loops = true;
  model.bodies.push_back(spec);
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{.position = {1, 0.1, 0}});
  t.runTicks(30);
  for (int i = 0; i < 300; ++i) {
    t.step();
    EXPECT_NEAR(t.getBody("plate").angularVelocity.y(), round / 2, 1e-9) << i;
    EXPECT_NEAR(t.getFeet("ann").norm(), 1, 0.2) << i;
  }
  EXPECT_TRUE(t.countEvents(ContactEvent::Kind::blocked, "plate", "ann") == 0);
}

/// A block of 1 m that moves to `offset` and back within each tick, so its net displacement is
/// zero.
Model makeBlockShaker(const Vec3& offset) {
  Model model = makeBoxModel({makeFloorBox(), {"block", {-0.5, 0.1, -0.5}, {0.5, 1.1, 0.5}}});
  BodySpec spec = makeBodySpec("block", BodyKind::path, {1});
  spec.keys = {{0, Vec3::Zero(), 0}, {1.0 / 120, offset, 0}, {1.0 / 60, Vec3::Zero(), 0}};
  spec.loops = true;
  spec.autoStart = false;
  model.bodies.push_back(spec);
  return model;
}

TEST(KinematicBodies, AvatarInTheWayOfAReversingPathIsPushed) {
  BodyFixture t(makeBlockShaker({0.2, 0, 0}));
  t.order("ann", Spawn{.position = {0.9, 0.01, 0}});  // the avatar's radius is 0.3 m: its gap to
                                                      // the block is 0.1 m
  t.runTicks(10);
  EXPECT_NEAR(t.getFeet("ann").x(), 0.9, 1e-6);
  t.submit({"block", Action::run, 0, 0, {}});
  t.runTicks(10);
  EXPECT_NEAR(t.getFeet("ann").x(), 1, 2e-3);
  EXPECT_NEAR(t.getBody("block").position.x(), 0, 1e-9);
  EXPECT_EQ(namePenetratingPairs(t.world), "");
}

TEST(KinematicBodies, AvatarThatCannotYieldStopsAReversingPath) {
  Model model = makeBlockShaker({0.2, 0, 0});
  model.meshes.push_back(buildBoxMesh({1.21, 0, -2}, {1.3, 3, 2}));
  model.objects.push_back({"wall", "", {2}, Eigen::Affine3d::Identity()});
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{.position = {0.9, 0.01, 0}});
  t.submit({"block", Action::run, 0, 0, {}});
  t.runTicks(20);
  EXPECT_EQ(t.countEvents(Event::blocked, "block", "ann"), 1);
  EXPECT_NEAR(t.getBody("block").position.x(), 0.11, 5e-3) << "until she blocks it";
  EXPECT_EQ(namePenetratingPairs(t.world), "");
  t.order("ann", Leave{});
  for (int i = 0; i < 10; ++i) {
    const double before = t.getBody("block").drive.jointPosition;
    t.step();
    EXPECT_EQ(t.getBody("block").blockedBy, 0u);
    EXPECT_TRUE(t.getBody("block").moved);
    EXPECT_NEAR(std::remainder(t.getBody("block").drive.jointPosition - before, 1.0 / 60), 0, 1e-9);
  }
}

TEST(KinematicBodies, ABlockedLoopingPathWaitsAndContinues) {
  // A lap of 0.5 s with the seam of the loop mid-path; ann stands there between two walls.
  Model model = makeBoxModel({makeFloorBox(),
                              {"cart", {-0.2, 0.1, -0.2}, {0.2, 1, 0.2}},
                              {"wall", {1.21, 0, -2}, {1.3, 3, 2}}});
  BodySpec spec = makeBodySpec("cart", BodyKind::path, {1});
  spec.keys = {{0, Vec3::Zero(), 0}, {0.25, {0.7, 0, 0}, 0}, {0.5, Vec3::Zero(), 0}};
  spec.loops = true;
  model.bodies.push_back(spec);
  BodyFixture t(std::move(model));
  t.runTicks(4);  // on the outward half
  t.order("ann", Spawn{.position = {0.9, 0.01, 0}});
  t.runTicks(30);
  EXPECT_EQ(t.countEvents(Event::blocked, "cart", "ann"), 1);
  const double held = t.getBody("cart").position.x();
  EXPECT_NEAR(held, 0.41, 5e-3);
  EXPECT_NEAR(t.getBody("cart").drive.jointPosition, held / 0.7 * 0.25, 1e-3);
  t.order("ann", Leave{});
  for (int i = 0; i < 90; ++i) {
    const Vec3 before = t.getBody("cart").position;
    t.step();
    EXPECT_NEAR((t.getBody("cart").position - before).norm(), 0.7 / 0.25 / 60, 0.7 / 0.25 / 60)
        << i;
    EXPECT_EQ(t.getBody("cart").blockedBy, 0u) << i;
  }
}

TEST(KinematicBodies, APathThatTurnsFastTurnsTheWayThatItsKeysSay) {
  // The arm rotates by 4 radians in the first 4 ms: the shortest rotation would be the wrong way.
  Model model = makeBoxModel({makeFloorBox(), {"arm", {0, 0.1, -0.05}, {1, 0.2, 0.05}}});
  BodySpec spec = makeBodySpec("arm", BodyKind::path, {1});
  spec.anchor = {0, 0.1, 0};
  spec.keys = {{0, Vec3::Zero(), 0}, {1.0 / 240, Vec3::Zero(), 4}, {1, Vec3::Zero(), 4 * kQuarter}};
  spec.loops = true;
  model.bodies.push_back(spec);
  BodyFixture t(std::move(model));
  for (int lap = 0; lap < 3; ++lap) {
    t.step();
    const auto& places = t.getBody("arm").kinematicTarget.keyPoses;
    EXPECT_NEAR(places[1].angle - places[0].angle, 4, 1e-9) << lap;
    EXPECT_NEAR(places[0].angle, 0, 1e-9) << lap;
    t.runTicks(59);
  }
}

TEST(KinematicBodies, AvatarOnAReversingPathIsLiftedAndLowered) {
  BodyFixture t(makeBlockShaker({0, 0.01, 0}));
  t.order("ann", Spawn{.position = {0, 1.11, 0}});
  t.runTicks(10);
  t.submit({"block", Action::run, 0, 0, {}});
  for (int i = 0; i < 60; ++i) {
    t.step();
    EXPECT_NEAR(t.getFeet("ann").y(), 1.1, 2e-3) << i;
    EXPECT_EQ(t.getBody("block").blockedBy, 0u) << i;
  }
  EXPECT_EQ(namePenetratingPairs(t.world), "");
}

TEST(KinematicBodies, AvatarOnARotatingBodyKeepsItsPlace) {
  Model model =
      makeBoxModel({{"plate", {-2, 0, -2}, {2, 0.1, 2}}, {"ground", {-9, -1, -9}, {9, -0.9, 9}}});
  BodySpec spec = makeBodySpec("plate", BodyKind::path, {0});
  spec.keys = {{0, Vec3::Zero(), 0}, {8, Vec3::Zero(), 4 * kQuarter}};
  spec.loops = true;
  model.bodies.push_back(spec);
  BodyFixture t(std::move(model));
  const std::map<std::string, Vec3> at{{"mid", {0, 0.1, 0}},
                                       {"inner", {0.5, 0.1, 0.5}},
                                       {"outer", {1.2, 0.1, 0}},
                                       {"edge", {0, 0.1, -1.9}}};  // half of it next to the plate
  for (const auto& [name, place] : at) t.order(name, Spawn{.position = place});
  t.runTicks(10);
  std::map<std::string, Vec3> start;
  const auto onPlate = [&](const std::string& name) {
    const Body& plate = t.getBody("plate");
    return Vec3(plate.rotation.transpose() * (t.getFeet(name) - plate.position));
  };
  for (const auto& [name, place] : at) start[name] = onPlate(name);
  t.runTicks(480);
  for (const auto& [name, place] : at)
    EXPECT_LT((onPlate(name) - start[name]).norm(), name == "edge" ? 0.05 : 2e-3) << name;
}

TEST(KinematicBodies, ASpeedIsRefusedByHowFastItMakesAPoint) {
  Model model = makeBlockShaker({0.2, 0, 0});  // 24 m/s at a drive speed of 1
  BodyFixture t(std::move(model));
  const auto refusal = [&](double speed) {
    return submitBodyCommand(t.world, {"block", Action::run, 0, 0, speed}).value_or("");
  };
  EXPECT_EQ(refusal(41), "");
  EXPECT_NE(refusal(42).find("1008"), std::string::npos) << refusal(42);
  EXPECT_NE(refusal(0).find("above 0"), std::string::npos);
  EXPECT_NE(refusal(1e300), "");
  EXPECT_NE(refusal(std::nan("")), "");
}

TEST(KinematicBodies, APathThatLoopsEndsTurnedAsItBegan) {
  Model model = makeBoxModel({makeFloorBox(), {"plate", {0, 1, 0}, {1, 2, 1}}});
  BodySpec spec = makeBodySpec("plate", BodyKind::path, {1});
  spec.keys = {{0, Vec3::Zero(), 0}, {2, Vec3::Zero(), 1}};
  spec.loops = true;
  model.bodies.push_back(spec);
  const auto why = validateBodies(model);
  ASSERT_TRUE(why);
  EXPECT_NE(why->find("with its initial rotation"), std::string::npos) << *why;
}

TEST(KinematicBodies, ADoorOpensAwayFromAWalkingAvatar) {
  Model model = makeHingedDoor(
      {{"left", {-4, 0, -0.1}, {-0.01, 3, 0.1}}, {"right", {1.01, 0, -0.1}, {4, 3, 0.1}}});
  model.bodies[0].openedBy = OpenedBy::touch;
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{{0.6, 0.01, 2}, 0, 0.2, 1.75});
  t.order("ann", Walk{{{0.6, 0, -2}}, 1.4});
  t.runUntilIdle();
  EXPECT_NEAR(t.getFeet("ann").z(), -2, 0.01);
  EXPECT_GT(t.getBody("door").drive.jointPosition, 0.5);
}

TEST(KinematicBodies, TriggersReportEnterAndLeave) {
  Model model = makeBoxModel({makeFloorBox(), {"zone", {1, 0, -1}, {2, 2, 1}}});
  model.bodies.push_back(makeBodySpec("zone", BodyKind::trigger, {1}));
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{{-1, 0.01, 0}, 0, 0.3, 1.75});
  t.order("ann", Walk{{{4, 0, 0}}, 2});
  t.runUntilIdle();
  EXPECT_NEAR(t.getFeet("ann").x(), 4, 0.01) << "not solid";
  ASSERT_EQ(t.countEvents(Event::enter, "ann", "zone"), 1);
  ASSERT_EQ(t.countEvents(Event::leave, "ann", "zone"), 1);
  for (const ContactEvent& e : t.events) {
    const bool apart = e.separation.verdict == collision::Verdict::separated;
    if (e.kind == Event::enter || e.kind == Event::leave) {
      EXPECT_EQ(apart, e.kind == Event::leave);
    }
  }
}

TEST(KinematicBodies, AvatarThatLeavesTheWorldLeavesItsTriggers) {
  Model model = makeBoxModel({makeFloorBox(), {"zone", {1, 0, -1}, {2, 2, 1}}});
  model.bodies.push_back(makeBodySpec("zone", BodyKind::trigger, {1}));
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{{1.5, 0.01, 0}, 0, 0.3, 1.75});
  t.runTicks(5);
  EXPECT_EQ(t.countEvents(Event::enter, "ann", "zone"), 1);
  t.order("ann", Leave{});
  t.runTicks(2);
  EXPECT_EQ(t.countEvents(Event::leave, "ann", "zone"), 1);
}

TEST(KinematicBodies, ANearMissBeginsIsClosestAndEnds) {
  WorldSettings settings;
  settings.nearMissDistance = 0.2;
  BodyFixture t(makeBoxModel({makeFloorBox(), {"pillar", {-0.1, 0, 0.4}, {0.1, 2, 0.6}}}),
                settings);
  t.order("ann", Spawn{{-2, 0.01, 0}, 0, 0.3, 1.75});
  t.order("ann", Walk{{{2, 0, 0}}, 1.5});
  t.runUntilIdle();
  std::vector<ContactEvent> near;
  for (const ContactEvent& e : t.events)
    if (e.kind == Event::nearMiss && findEntityName(t.world, e.b) == "pillar") near.push_back(e);
  ASSERT_EQ(near.size(), 3u);
  EXPECT_EQ(near[0].phase, ContactEvent::Phase::begin);
  EXPECT_EQ(near[1].phase, ContactEvent::Phase::min);
  EXPECT_EQ(near[2].phase, ContactEvent::Phase::end);
  EXPECT_NEAR(near[1].separation.distance, 0.1, 1e-6);
  EXPECT_LT(near[0].tick, near[1].tick);
  EXPECT_LT(near[1].tick, near[2].tick);
  EXPECT_GE(near[2].separation.distance, 0.2);
}

TEST(KinematicBodies, ADynamicBodyReportsBeginAndEndOfItsContacts) {
  Model model = makeBoxModel({makeFloorBox(),
                              {"crate", {0, 0.5, 0}, {0.5, 1, 0.5}},
                              {"slab", {-1, 0.2, -1}, {1, 0.3, 1}}});
  model.bodies.push_back(makeBodySpec("crate", BodyKind::rigid, {1}));
  BodySpec slab = makeBodySpec("slab", BodyKind::sliding, {2});
  slab.axis = Vec3::UnitX();
  slab.low = -4;
  slab.speed = 100;
  model.bodies.push_back(slab);
  BodyFixture t(std::move(model));
  t.runTicks(90);
  EXPECT_EQ(t.countEvents(Event::begin, "crate", "slab"), 1);
  EXPECT_EQ(t.countEvents(Event::begin, "crate", "floor"), 0);
  t.submit({"slab", Action::open, 0, 0, {}});
  t.runTicks(120);
  EXPECT_EQ(t.countEvents(Event::end, "crate", "slab"), 1);
  EXPECT_EQ(t.countEvents(Event::begin, "crate", "floor"), 1);
}

TEST(KinematicBodies, AbsurdCommandsAreRefusedAndChangeNothing) {
  BodyFixture t(makeHingedDoor()), other(makeHingedDoor());
  const double nan = std::nan("");
  for (const BodyCommand& command :
       {BodyCommand{"door", Action::moveTo, nan, 0, {}},
        BodyCommand{"door", Action::moveTo, 7, 0, {}},
        BodyCommand{"door", Action::moveToLevel, 0, 1, {}},
        BodyCommand{"door", Action::run, 0, 0, {}}, BodyCommand{"door", Action::open, 0, 0, nan},
        BodyCommand{"door", Action::open, 0, 0, -1}, BodyCommand{"door", Action::open, 0, 0, 1e9},
        BodyCommand{"gate", Action::open, 0, 0, {}}}) {
    EXPECT_TRUE(submitBodyCommand(t.world, command));
    t.step();
    other.step();
  }
  EXPECT_EQ(t.world.snapshot()->stateHash, other.world.snapshot()->stateHash);
}

TEST(KinematicBodies, TheSameCommandsGiveTheSameBits) {
  const auto run = [] {
    BodyFixture t(makeHingedDoor({{"wall", {-2, 0, -1.6}, {2, 3, -1.5}}}));
    t.order("ann", Spawn{{0.6, 0.01, -0.5}, 0, 0.3, 1.75});
    t.runTicks(10);
    t.submit({"door", Action::open, 0, 0, {}});
    t.runTicks(100);
    return t.world.snapshot()->stateHash;
  };
  EXPECT_EQ(run(), run());
}

TEST(KinematicBodies, AnInvalidFieldOfASpecIsNamed) {
  Model model = makeHingedDoor();
  model.bodies[0].axis = {0, 2, 0};
  EXPECT_NE(validateBodies(model).value_or("").find("axis"), std::string::npos);
  model = makeHingedDoor();
  model.bodies.push_back(model.bodies[0]);
  EXPECT_NE(validateBodies(model).value_or("").find("two bodies"), std::string::npos);
  model = makeHingedDoor();
  model.bodies[0].low = std::nan("");
  EXPECT_NE(validateBodies(model).value_or("").find("limits"), std::string::npos);
  EXPECT_THROW(Scene{model}, std::invalid_argument);
}

}  // namespace
}  // namespace enfilade::scene
