// Avatars between an approaching body and an immovable obstacle. Whatever their shape and its
// speed, they end outside both, by the exact verdict on every part.
#include <gtest/gtest.h>

#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Action = BodyCommand::Action;
using Event = ContactEvent::Kind;

/// An avatar that is crushed: how it enters, and its orders before the body approaches.
struct Victim {
  const char* name;
  Spawn spawn;
  std::vector<Order> then;
  double height;     ///< metres, of the avatar's highest point
  double halfWidth;  ///< metres, across z
};

void PrintTo(const Victim& victim, std::ostream* to) {
  *to << victim.name;
}

/// A trolley: a plate with a post at its end.
Spawn makeTrolley() {
  Spawn spawn;
  spawn.parts = {makeBoxPoints({-0.25, 0.02, -0.2}, {0.25, 0.25, 0.2}),
                 makeBoxPoints({-0.25, 0.25, -0.05}, {-0.15, 1.1, 0.05})};
  return spawn;
}

/// A base with an arm that points forward and upward.
Spawn makeArm() {
  Spawn spawn;
  spawn.parts = {makeBoxPoints({-0.2, 0, -0.2}, {0.2, 0.5, 0.2})};
  spawn.links = {{-1,
                  {LinkJoint::Kind::revolute, {0, 0.6, 0}, {0, 0, 1}, -0.4, 1.8},
                  makeBoxPoints({-0.05, -0.05, -0.05}, {0.4, 0.05, 0.05}),
                  0.9},
                 {0,
                  {LinkJoint::Kind::revolute, {0.45, 0, 0}, {0, 0, 1}, -2, 2},
                  makeBoxPoints({0, -0.04, -0.04}, {0.35, 0.04, 0.04}),
                  -0.9}};
  return spawn;
}

const std::vector<Victim>& listVictims() {
  static const std::vector<Victim> all{{"prism", {}, {}, 1.75, 0.3},
                                       {"crouched", {}, {Crouch{0.7}}, 0.7, 0.3},
                                       {"trolley", makeTrolley(), {}, 1.1, 0.2},
                                       {"arm", makeArm(), {}, 1.05, 0.2}};
  return all;
}

class CrushedBodies : public ::testing::TestWithParam<Victim> {
 protected:
  void enter(BodyFixture& t, const Vec3& at) {
    Spawn spawn = GetParam().spawn;
    spawn.position = at;
    t.order("ann", spawn);
    for (const Order& order : GetParam().then) t.order("ann", order);
    t.runTicks(20);
    ASSERT_TRUE(t.world.data().findAvatarByName("ann"));
  }
  /// Runs ticks and checks every pair by the exact verdict after each of them.
  void watch(BodyFixture& t, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      t.step();
      ASSERT_EQ(namePenetratingPairs(t.world), "") << "tick " << i;
    }
  }
};

INSTANTIATE_TEST_SUITE_P(Shapes, CrushedBodies, ::testing::ValuesIn(listVictims()),
                         [](const auto& shape) { return std::string(shape.param.name); });

TEST_P(CrushedBodies, AFallingBoxDoesNotPressALeaningAvatarIntoTheWall) {
  for (const double speed : {0.0, 20.0, 400.0}) {
    SCOPED_TRACE(speed);
    Model model = makeBoxModel({makeFloorBox(),
                                {"wall", {0.9, 0, -3}, {1.0, 2.2, 3}},
                                {"crate", {-0.2, 5.5, -0.5}, {0.85, 6.4, 0.45}}});
    model.bodies.push_back(makeBodySpec("crate", BodyKind::rigid, {2}));
    model.bodies[0].mass = 3000;
    BodyFixture t(std::move(model));
    enter(t, {0, 0.001, 0});
    t.order("ann", Drive{{1.5, 0, 0}});  // pushes against the wall all the time
    watch(t, 20);
    auto& stage = t.world.data().dynamicBodies;
    auto& crate =
        stage.physicsWorld.bodies[stage.physicsBodyByPart.at({t.getBody("crate").id, 0})].motion;
    ASSERT_GT(crate.centre.y(), 3) << "it is still moving";
    crate.velocity.y() -= speed;
    double lowest = 6;
    for (int i = 0; i < 90; ++i) {
      watch(t, 1);
      lowest = std::min(lowest, t.getBody("crate").position.y());
    }
    EXPECT_LT(lowest, 2.6) << "it landed on nothing";
    const Body& body = t.getBody("crate");
    EXPECT_GT(std::abs(body.position.x() - 0.325) + body.orientation.vec().norm(), 0.01)
        << "it fell past all avatars";
  }
}

TEST_P(CrushedBodies, ADoorThatClosesOnSomeoneInItsFrameStaysOpenAsFarAsItMust) {
  for (const double speed : {0.5, 8.0, 200.0}) {
    SCOPED_TRACE(speed);
    // The leaf slides along z to the post; the victim stands between them.
    Model model = makeBoxModel({makeFloorBox(),
                                {"post", {-0.6, 0, 1.0}, {0.9, 3, 1.2}},
                                {"leaf", {-0.05, 0.01, -2.6}, {0.05, 2.4, -0.6}}});
    BodySpec door = makeBodySpec("door", BodyKind::sliding, {2});
    door.axis = Vec3::UnitZ();
    door.high = 1.6;
    door.speed = speed;
    model.bodies.push_back(door);
    BodyFixture t(std::move(model));
    enter(t, {0, 0.001, 0.2});
    t.submit({"door", Action::moveTo, 1.6, 0, {}});
    watch(t, 240);
    EXPECT_EQ(t.countEvents(Event::blocked, "door", "ann"), 1);
    EXPECT_NEAR(t.getBody("door").drive.jointPosition, 1.6 - 2 * GetParam().halfWidth, 0.02);
  }
}

TEST_P(CrushedBodies, ALiftThatComesDownOnSomeoneStopsAtTheirHighestPoint) {
  for (const double speed : {0.5, 30.0, 300.0}) {
    SCOPED_TRACE(speed);
    Model model = makeBoxModel({makeFloorBox(), {"car", {-1.5, 3, -1.5}, {1.5, 3.1, 1.5}}});
    BodySpec lift = makeBodySpec("lift", BodyKind::lift, {1});
    lift.low = -2.9;
    lift.stops = {-2.9, 0};
    lift.speed = speed;
    model.bodies.push_back(lift);
    BodyFixture t(std::move(model));
    enter(t, {0, 0.001, 0});
    t.submit({"lift", Action::moveToLevel, 0, 0, {}});
    watch(t, speed < 1 ? 360 : 60);
    EXPECT_EQ(t.countEvents(Event::blocked, "lift", "ann"), 1);
    EXPECT_NEAR(3 + t.getBody("lift").drive.jointPosition, GetParam().height, 0.08);
  }
}

/// The arm stands next to a lift and holds its hand over the platform.
TEST(ArmAndLift, ALiftThatComesUpUnderAnArmMeetsNothingButItsUnderside) {
  for (const double speed : {0.4, 3.0, 60.0}) {
    SCOPED_TRACE(speed);
    Model model = makeBoxModel({{"floor", {-10, -0.2, -10}, {0.25, 0, 10}},
                                {"ceiling", {-3, 2, -3}, {3, 2.1, 3}},
                                {"car", {0.3, -1.2, -1}, {2.3, -1.1, 1}}});
    BodySpec lift = makeBodySpec("lift", BodyKind::lift, {2});
    lift.high = 3;
    lift.stops = {0, 3};
    lift.speed = speed;
    model.bodies.push_back(lift);
    BodyFixture t(std::move(model));
    Spawn spawn = makeArm();
    spawn.position = {0, 0.001, 0};
    spawn.links[0].value = 0;  // straight out, over the platform
    spawn.links[1].value = 0;
    t.order("ann", spawn);
    t.runTicks(10);
    t.submit({"lift", Action::moveToLevel, 0, 1, {}});
    for (int i = 0; i < (speed < 1 ? 500 : 200); ++i) {
      t.step();
      ASSERT_EQ(namePenetratingPairs(t.world), "") << "tick " << i;
    }
    EXPECT_GE(t.countEvents(Event::begin, "ann", "lift"), 1);
    EXPECT_EQ(t.countEvents(Event::blocked, "lift", "ann"), 1) << "the ceiling holds the arm down";
    // The platform's top is at y = coordinate - 1.1; the arm is between it and the ceiling.
    EXPECT_LT(t.getBody("lift").drive.jointPosition, 3.1);
    EXPECT_GT(t.getBody("lift").drive.jointPosition, 1.5);
  }
}

/// The arm rides on the lift; its part beyond the platform meets the edge of the next storey.
TEST(ArmAndLift, AnArmThatRidesALiftAndReachesOutIsHeldByTheEdgeOfTheNextFloor) {
  Model model = makeBoxModel({{"ground", {-10, -1, -10}, {10, -0.8, 10}},
                              {"car", {-0.6, -0.1, -0.6}, {0.6, 0, 0.6}},
                              {"storey", {0.65, 2.5, -3}, {5, 2.7, 3}}});
  BodySpec lift = makeBodySpec("lift", BodyKind::lift, {1});
  lift.high = 3;
  lift.stops = {0, 3};
  lift.speed = 2;
  model.bodies.push_back(lift);
  BodyFixture t(std::move(model));
  Spawn spawn = makeArm();
  spawn.position = {0.2, 0.001, 0};
  spawn.links[0].value = 0;
  spawn.links[1].value = 0;
  t.order("ann", spawn);
  t.runTicks(20);
  ASSERT_EQ(t.countEvents(Event::begin, "ann", "lift"), 1);
  t.submit({"lift", Action::moveToLevel, 0, 1, {}});
  for (int i = 0; i < 200; ++i) {
    t.step();
    ASSERT_EQ(namePenetratingPairs(t.world), "") << "tick " << i;
  }
  EXPECT_EQ(t.countEvents(Event::blocked, "lift", "ann"), 1);
  EXPECT_NEAR(t.getBody("lift").drive.jointPosition, 2.5 - 0.65, 0.02);
  // When the arm has stepped back, the lift continues and carries it up.
  t.order("ann", Drive{{-0.5, 0, 0}});
  t.runTicks(66);
  t.order("ann", Drive{});
  for (int i = 0; i < 240; ++i) {
    t.step();
    ASSERT_EQ(namePenetratingPairs(t.world), "") << "tick " << i;
  }
  EXPECT_EQ(t.getBody("lift").drive.jointPosition, 3);
  EXPECT_NEAR(t.getFeet("ann").y(), 3, 2e-3);
}

}  // namespace
}  // namespace enfilade::scene
