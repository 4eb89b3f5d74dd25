// A room with all kinds of moving entities at once, with seeded commands. Walkers, a rider, a
// flyer, a chain, a lift, a door, a path body and dynamic bodies.
#pragma once

#include <random>

#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {

/// A floor, a ceiling over a lift, a door in a wall, a body on a loop, falling crates.
inline Model makeBusyRoom() {
  Model model = makeBoxModel({makeFloorBox(),
                              {"ceiling", {-6, 4, -6}, {-2, 4.2, -2}},
                              {"wall", {0, 0, 1}, {0.1, 3, 9}},
                              {"post", {3, 0, -3}, {3.2, 3, -2.8}},
                              {"car", {-5, 0.05, -5}, {-3, 0.1, -3}},
                              {"leaf", {0.02, 0.01, 0}, {0.08, 2.1, 0.95}},
                              {"plate", {4, 0.02, 4}, {6, 0.3, 5}},
                              {"crate", {2, 3, 0}, {2.5, 3.5, 0.5}},
                              {"plank", {-2, 3, 2}, {0.5, 3.1, 2.2}}});
  BodySpec lift = makeBodySpec("lift", BodyKind::lift, {4});
  lift.high = 4;
  lift.stops = {0, 2, 4};
  lift.speed = 1;
  BodySpec door = makeBodySpec("door", BodyKind::hinged, {5});
  door.low = -1.5, door.high = 1.5;
  door.anchor = {0.05, 0, 0};
  BodySpec ferry = makeBodySpec("ferry", BodyKind::path, {6});
  ferry.anchor = {5, 0, 4.5};
  ferry.keys = {{0, Vec3::Zero(), 0}, {2, {-2, 0, 0}, 1}, {4, {-2, 0, 2}, 3}, {6, Vec3::Zero(), 0}};
  ferry.loops = true;
  BodySpec crate = makeBodySpec("crate", BodyKind::rigid, {7});
  crate.velocity = {1, 2, 0};
  crate.angularVelocity = {1, 0.5, 2};
  BodySpec plank = makeBodySpec("plank", BodyKind::rigid, {8});
  plank.velocity = {0, 4, 0};
  plank.angularVelocity = {5, 0.1, 0.1};
  model.bodies = {lift, door, ferry, crate, plank};
  return model;
}

/// Three folded arms; stretched out they are three times as long.
inline Spawn makeFoldedArm(const Vec3& at) {
  Spawn spawn;
  spawn.position = at;
  spawn.flying = true;
  spawn.parts = {makeBoxPoints({-0.2, 0, -0.2}, {0.2, 0.5, 0.2})};
  for (int i = 0; i < 3; ++i) {
    Link link;
    link.parent = i - 1;
    link.joint = {LinkJoint::Kind::revolute, {i == 0 ? 0 : 0.8, i == 0 ? 0.7 : 0.12, 0}, {0, 1, 0}};
    link.points = makeBoxPoints({0, -0.05, -0.05}, {0.8, 0.05, 0.05});
    link.value = i == 0 ? 0 : 3;
    spawn.links.push_back(link);
  }
  return spawn;
}

inline WorldSettings makeBusySettings() {
  WorldSettings settings;
  settings.maxSpeed = 4;  // so that bounds over all possible orders are finite and useful
  settings.maxJointSpeed = 2;
  return settings;
}

/// All kinds of moving entities at once, with new orders now and then.
struct BusyRoom {
  explicit BusyRoom(std::uint32_t seed)
      : random(seed), world(std::make_shared<const Scene>(makeBusyRoom()), makeBusySettings()) {
    order("rider", Spawn{Vec3(-4, 0.11, -4), 0});
    order("walker", Spawn{Vec3(-2, 0.001, -1), 0});
    order("pushed", Spawn{Vec3(0.5, 0.001, 0.4), 0});
    order("jumper", Spawn{Vec3(6, 2, -6), 0});
    Spawn flyer{Vec3(2, 2, -2), 0};
    flyer.flying = true;
    order("flyer", flyer);
    order("arm", makeFoldedArm({-2, 0.5, 5}));
  }

  void order(const std::string& who, Order what) {
    EXPECT_FALSE(submitAvatarCommand(world, {who, std::move(what), 0}));
  }
  double drawNumber(double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  }
  void sendRandomCommand() {
    const auto velocity = [this] {
      return Vec3(drawNumber(-2, 2), drawNumber(-1, 1), drawNumber(-2, 2));
    };
    order("walker", Drive{velocity()});
    order("flyer", Drive{velocity()});
    order("rider", Drive{drawNumber(0, 1) < 0.7 ? Vec3(Vec3::Zero()) : Vec3(0.3 * velocity())});
    order("jumper", Jump{drawNumber(0.2, 1), velocity()});
    order("pushed", Crouch{drawNumber(0, 1) < 0.5 ? 0.0 : 1.0});
    order("arm", DriveJoints{{drawNumber(-3, 3), drawNumber(-3, 3), drawNumber(-3, 3)}, 2, true});
    order("arm", Turn{drawNumber(-120, 120), true, 90});
    order("walker", Look{Vec3(drawNumber(-5, 5), 1, drawNumber(-5, 5))});
    const auto submit = [this](BodyCommand command) {
      EXPECT_FALSE(submitBodyCommand(world, command));
    };
    submit({"lift",
            BodyCommand::Action::moveToLevel,
            0,
            static_cast<std::uint32_t>(drawNumber(0, 2.999)),
            {}});
    submit({"door", BodyCommand::Action::moveTo, drawNumber(-1.5, 1.5), 0, drawNumber(0.5, 1.5)});
    submit({"ferry", BodyCommand::Action::run, 0, 0, drawNumber(0.2, 0.8)});
  }

  std::mt19937 random;
  World world;
};

}  // namespace enfilade::scene::testing
