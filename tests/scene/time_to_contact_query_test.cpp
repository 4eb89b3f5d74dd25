// What was said not to touch before a time does not: over a busy room, beside what really happens.
#include "scene/world/queries/time_to_contact_query.hpp"

#include <cmath>
#include <map>
#include <random>

#include "tests/scene/body_fixture.hpp"
#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

using Action = BodyCommand::Action;

TimeApart apartAt(const World& world, SceneIndex& index, EntityId a, EntityId b, Assume assume,
                  double least = 0) {
  std::size_t work = kMostWork;
  const SceneThen then{index, *world.snapshot()};
  return std::get<TimeApart>(timeApart(then, world.lengths(), a, b, assume, least, work));
}

TEST(TimeApart, AWalkerReachesTheWallWhenItWasSaid) {
  Trial trial({floorBox(), {"wall", {5, 0, -4}, {5.2, 3, 4}}});
  SceneIndex index(sharedScene(trial.world));
  trial.order("ann", Spawn{Vec3(0, 0.001, 0), 0});
  trial.order("ann", Walk{{Vec3(8, 0, 3)}, 2});
  trial.ticks(30);
  for (int i = 0; i < 60; ++i) {
    trial.step();
    const EntityId ann = trial.view("ann").id;
    const TimeApart now = apartAt(trial.world, index, ann, 2, Assume::presentMotion);
    EXPECT_TRUE(now.again.proved);
    // 2 m/s on the way to (8, 3), of which this is the part towards the wall.
    const double speed = 2 * 8 / std::hypot(8, 3);
    EXPECT_NEAR(now.contact, now.now.decision.distance / speed, 0.02);
    EXPECT_LT(apartAt(trial.world, index, ann, 2, Assume::anyCommand).contact, now.contact);
    EXPECT_FALSE(apartAt(trial.world, index, ann, 2, Assume::presentMotion, 9).again.proved);
    if (trial.open.contains({ann, 2})) break;
  }
}

/// A floor, a ceiling over a lift, a door in a wall, a thing that goes round, crates that fall.
Model busyRoom() {
  Model model = boxModel({floorBox(),
                          {"ceiling", {-6, 4, -6}, {-2, 4.2, -2}},
                          {"wall", {0, 0, 1}, {0.1, 3, 9}},
                          {"post", {3, 0, -3}, {3.2, 3, -2.8}},
                          {"car", {-5, 0.05, -5}, {-3, 0.1, -3}},
                          {"leaf", {0.02, 0.01, 0}, {0.08, 2.1, 0.95}},
                          {"plate", {4, 0.02, 4}, {6, 0.3, 5}},
                          {"crate", {2, 3, 0}, {2.5, 3.5, 0.5}},
                          {"plank", {-2, 3, 2}, {0.5, 3.1, 2.2}}});
  BodySpec lift = bodySpec("lift", BodyKind::lift, {4});
  lift.high = 4;
  lift.stops = {0, 2, 4};
  lift.speed = 1;
  BodySpec door = bodySpec("door", BodyKind::hinged, {5});
  door.low = -1.5, door.high = 1.5;
  door.anchor = {0.05, 0, 0};
  BodySpec ferry = bodySpec("ferry", BodyKind::path, {6});
  ferry.anchor = {5, 0, 4.5};
  ferry.keys = {{0, Vec3::Zero(), 0}, {2, {-2, 0, 0}, 1}, {4, {-2, 0, 2}, 3}, {6, Vec3::Zero(), 0}};
  ferry.loops = true;
  BodySpec crate = bodySpec("crate", BodyKind::rigid, {7});
  crate.velocity = {1, 2, 0};
  crate.spin = {1, 0.5, 2};
  BodySpec plank = bodySpec("plank", BodyKind::rigid, {8});
  plank.velocity = {0, 4, 0};
  plank.spin = {5, 0.1, 0.1};
  model.bodies = {lift, door, ferry, crate, plank};
  return model;
}

TEST(TimeApart, ARiderGoesWithTheLift) {
  BodyTrial t(busyRoom());
  SceneIndex index(sharedScene(t.world));
  t.order("ann", Spawn{{-4, 0.11, -4}, 0});
  t.ticks(30);
  t.tell({"lift", Action::level, 0, 2, {}});
  t.ticks(5);
  const EntityId ann = t.world.snapshot()->avatars[0].id, ceiling = 2;
  const TimeApart said = apartAt(t.world, index, ann, ceiling, Assume::presentMotion);
  EXPECT_NEAR(said.contact, said.now.decision.distance / 1.0, 0.01) << "at 1 m/s";
  EXPECT_NEAR(said.closing.speed, 1, 1e-6);
}

TEST(TimeApart, WhoStandsOnACrateGoesWithTheLiftBelowIt) {
  Model model = boxModel({floorBox(),
                          {"ceiling", {-3, 5, -3}, {3, 5.2, 3}},
                          {"car", {-2, 0.05, -2}, {2, 0.1, 2}},
                          {"crate", {-0.5, 0.101, -0.5}, {0.5, 1.5, 0.5}}});
  BodySpec lift = bodySpec("lift", BodyKind::lift, {2});
  lift.high = 3, lift.stops = {0, 3}, lift.speed = 1;
  BodySpec crate = bodySpec("crate", BodyKind::rigid, {3});
  model.bodies = {lift, crate};
  BodyTrial t(std::move(model));
  SceneIndex index(sharedScene(t.world));
  t.order("ann", Spawn{Vec3(0, 1.51, 0), 0});
  t.ticks(120);
  t.tell({"lift", Action::level, 0, 1, {}});
  t.ticks(30);
  const EntityId ann = t.world.state().avatars.at("ann").id, ceiling = 2;
  const double gap = 5 - 1.75 - t.feet("ann").y();
  for (const Assume assume : {Assume::presentMotion, Assume::anyCommand}) {
    const TimeApart now = apartAt(t.world, index, ann, ceiling, assume);
    EXPECT_LE(now.contact, gap / lift.speed + 0.01);  // the lift goes on
    EXPECT_GT(now.contact, assume == Assume::presentMotion ? 0.4 * gap / lift.speed : 0);
  }
}

TEST(TimeApart, WhatSwingsOutAndBackWithinATickReachesAsFarAsItSwings) {
  // 0.2 m out and back in each tick; the post is 0.1 m away, the wall ten times as far as that.
  Model model = boxModel({floorBox(),
                          {"ram", {-1, 0.1, -0.5}, {0, 1.1, 0.5}},
                          {"post", {0.1, 0.05, 0}, {0.2, 1, 0.2}},
                          {"wall", {2, 0.05, -1}, {2.1, 1, 1}}});
  BodySpec ram = bodySpec("ram", BodyKind::path, {1});
  ram.keys = {{0, Vec3::Zero(), 0}, {1.0 / 120, {0.2, 0, 0}, 0}, {1.0 / 60, Vec3::Zero(), 0}};
  ram.loops = true;
  model.bodies = {ram};
  BodyTrial t(std::move(model));
  SceneIndex index(sharedScene(t.world));
  t.ticks(3);
  EXPECT_EQ(t.told(ContactEvent::Kind::begin, "ram", "post"), 3);
  const TimeApart said = apartAt(t.world, index, 2, 3, Assume::presentMotion);
  EXPECT_LE(said.contact, 1.0 / 120) << "it is there in the next tick, half way to its end";
  EXPECT_NEAR(said.closing.speed, 24, 1e-6);
  EXPECT_NEAR(apartAt(t.world, index, 2, 4, Assume::presentMotion).contact, 2.0 / 24, 1e-3);
}

TEST(TimeApart, WhoFallsFallsFasterThanInTheLastTick) {
  Trial trial({floorBox()});
  SceneIndex index(sharedScene(trial.world));
  trial.order("ann", Spawn{Vec3(0, 5, 0), 0});
  trial.ticks(10);
  const EntityId ann = trial.view("ann").id;
  const TimeApart said = apartAt(trial.world, index, ann, 1, Assume::presentMotion);
  int ticks = 0;
  while (trial.open.empty()) trial.step(), ++ticks;
  const double landed = ticks * trial.world.lengths().tick;
  EXPECT_LE(said.contact, landed);
  EXPECT_NEAR(said.contact, landed, 0.02) << "and not much before";
}

TEST(TimeApart, WhoIsPushedComesNearerAsFastAsWhatPushes) {
  Model model =
      boxModel({floorBox(), {"ram", {-2, 0.01, -1}, {-1, 2, 1}}, {"post", {3, 0, -1}, {4, 3, 1}}});
  BodySpec ram = bodySpec("ram", BodyKind::sliding, {1});
  ram.axis = {1, 0, 0};
  ram.high = 6;
  ram.speed = 1;
  model.bodies = {ram};
  BodyTrial t(std::move(model));
  SceneIndex index(sharedScene(t.world));
  t.order("ann", Spawn{{0, 0.001, 0}, 0});
  t.ticks(10);
  t.tell({"ram", Action::to, 6, 0, {}});
  t.ticks(60);
  const EntityId ann = t.world.snapshot()->avatars[0].id, post = 3;
  const double before = t.feet("ann").x();
  const TimeApart said = apartAt(t.world, index, ann, post, Assume::presentMotion);
  t.ticks(30);
  EXPECT_NEAR(t.feet("ann").x() - before, 0.5, 0.01) << "it is pushed";
  EXPECT_GE(said.closing.speed, 1);
  EXPECT_LE(said.contact, said.now.decision.distance / 1);
  EXPECT_GT(said.contact, 0.3 * said.now.decision.distance);
}

TEST(TimeApart, TheTipsOfWhatSpinsCount) {
  BodyTrial t(busyRoom());
  SceneIndex index(sharedScene(t.world));
  t.ticks(1);
  const EntityId plank = 9, post = 4;
  const TimeApart said = apartAt(t.world, index, plank, post, Assume::presentMotion);
  const double radius = t.world.scene().shapeOfBody(4)->radius;
  EXPECT_GE(said.closing.speed, t.body("plank").spin.norm() * radius);
  EXPECT_LT(said.contact, said.now.decision.distance / 5 / radius);
}

TEST(TimeApart, OfFreeBodiesNothingIsKnownUnderAnyCommand) {
  BodyTrial t(busyRoom());
  SceneIndex index(sharedScene(t.world));
  t.ticks(1);
  const EntityId crate = 8, floor = 1;
  const TimeApart any = apartAt(t.world, index, crate, floor, Assume::anyCommand, 2);
  EXPECT_FALSE(any.bounded);
  EXPECT_EQ(any.contact, 0);
  EXPECT_EQ(any.again.after, 2);
  EXPECT_FALSE(any.again.proved);
  EXPECT_GT(apartAt(t.world, index, crate, floor, Assume::presentMotion).contact, 0.3);
}

/// Three arms, folded on one another: stretched out they are three times as long.
Spawn foldedArm(const Vec3& at) {
  Spawn spawn;
  spawn.at = at;
  spawn.flying = true;
  spawn.parts = {boxPoints({-0.2, 0, -0.2}, {0.2, 0.5, 0.2})};
  for (int i = 0; i < 3; ++i) {
    Link link;
    link.parent = i - 1;
    link.joint = {LinkJoint::Kind::revolute, {i == 0 ? 0 : 0.8, i == 0 ? 0.7 : 0.12, 0}, {0, 1, 0}};
    link.points = boxPoints({0, -0.05, -0.05}, {0.8, 0.05, 0.05});
    link.value = i == 0 ? 0 : 3;
    spawn.links.push_back(link);
  }
  return spawn;
}

Lengths busyLengths() {
  Lengths lengths;
  lengths.speedLimit = 4;  // so that bounds on all that may be told say something
  lengths.jointSpeedLimit = 2;
  return lengths;
}

/// Everybody at once, told something new now and then.
struct BusyRoom {
  explicit BusyRoom(std::uint32_t seed)
      : random(seed), world(std::make_shared<const Scene>(busyRoom()), busyLengths()) {
    order("rider", Spawn{Vec3(-4, 0.11, -4), 0});
    order("walker", Spawn{Vec3(-2, 0.001, -1), 0});
    order("pushed", Spawn{Vec3(0.5, 0.001, 0.4), 0});
    order("jumper", Spawn{Vec3(6, 2, -6), 0});
    Spawn flyer{Vec3(2, 2, -2), 0};
    flyer.flying = true;
    order("flyer", flyer);
    order("arm", foldedArm({-2, 0.5, 5}));
  }

  void order(const std::string& who, Order what) {
    EXPECT_FALSE(submit(world, {who, std::move(what), 0}));
  }
  double number(double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  }
  void tellSomebody() {
    const auto velocity = [this] { return Vec3(number(-2, 2), number(-1, 1), number(-2, 2)); };
    order("walker", Drive{velocity()});
    order("flyer", Drive{velocity()});
    order("rider", Drive{number(0, 1) < 0.7 ? Vec3(Vec3::Zero()) : Vec3(0.3 * velocity())});
    order("jumper", Jump{number(0.2, 1), velocity()});
    order("pushed", Crouch{number(0, 1) < 0.5 ? 0.0 : 1.0});
    order("arm", DriveJoints{{number(-3, 3), number(-3, 3), number(-3, 3)}, 2, true});
    const auto tell = [this](BodyCommand command) { EXPECT_FALSE(submit(world, command)); };
    tell({"lift", Action::level, 0, static_cast<std::uint32_t>(number(0, 2.999)), {}});
    tell({"door", Action::to, number(-1.5, 1.5), 0, number(0.5, 1.5)});
    tell({"ferry", Action::run, 0, 0, number(0.2, 0.8)});
  }

  std::mt19937 random;
  World world;
};

/// How everything went in one tick.
struct Ways {
  struct Way {
    Vec3 moved;  ///< metres
    bool falls;
    double height;  ///< of an avatar
  };
  std::map<EntityId, Way> avatars;
  std::shared_ptr<const std::vector<BodyView>> bodies;
};

Ways waysBetween(const Snapshot& before, const Snapshot& after) {
  Ways ways;
  ways.bodies = after.bodies;
  for (const AvatarView& now : after.avatars)
    for (const AvatarView& then : before.avatars)
      if (then.id == now.id)
        ways.avatars[now.id] = {now.feet - then.feet, !now.grounded && !now.flying, now.height};
  return ways;
}

/// Whether what was moving as `first` says still does so `ticks` later.
bool goesOnAsBefore(EntityId id, const Ways& first, const Ways& now, int ticks,
                    const Lengths& lengths) {
  constexpr double kSame = 1e-9;
  const double fallen = lengths.gravity * lengths.tick * ticks;  // metres a second
  if (const auto was = first.avatars.find(id); was != first.avatars.end()) {
    const auto is = now.avatars.find(id);
    if (is == now.avatars.end() || is->second.falls != was->second.falls ||
        is->second.height != was->second.height)
      return false;
    const Vec3 due = was->second.moved - Vec3(0, was->second.falls ? fallen * lengths.tick : 0, 0);
    return (is->second.moved - due).norm() <= kSame;
  }
  for (std::size_t i = 0; i < now.bodies->size(); ++i) {
    const BodyView &was = (*first.bodies)[i], &is = (*now.bodies)[i];
    if (was.id != id) continue;
    const bool stays = (is.velocity - was.velocity).norm() <= kSame &&
                       (is.spin - was.spin).norm() <= kSame && is.moving == was.moving;
    return stays || (is.velocity - was.velocity + Vec3(0, fallen, 0)).norm() <= kSame;
  }
  return true;
}

struct Watch {
  EntityId a, b;
  Assume assume;
  std::uint64_t since;
  TimeApart said;
  Ways ways;
};

/// What the watches came to.
struct Tally {
  int looks = 0;
  int close = 0;  ///< of those, that came nearer by at least half of what was allowed, and 1 cm
  int late = 0;   ///< watches that lasted until the time that was told
};

/// False when the watch is over.
bool look(const Watch& watch, const Ways& now, const World& world, SceneIndex& index,
          Tally& tally) {
  const Lengths& lengths = world.lengths();
  const int ticks = static_cast<int>(world.snapshot()->tick - watch.since);
  if (watch.assume == Assume::presentMotion) {
    for (const EntityId id : {watch.a, watch.b})
      if (!goesOnAsBefore(id, watch.ways, now, ticks, lengths)) return false;
  }
  std::size_t work = kMostWork;
  const auto state =
      std::get<PairState>(stateOfPair({index, *world.snapshot()}, watch.a, watch.b, false, work));
  const double time = ticks * lengths.tick, distance = watch.said.now.decision.distance;
  const auto& [speed, acceleration] = watch.said.closing;
  const double allowed = speed * time + 0.5 * acceleration * time * time;
  const double closed = distance - state.decision.distance;
  const bool touches = state.decision.verdict != collision::Verdict::separated;
  EXPECT_FALSE(touches && time < watch.said.contact)
      << nameOf(world, watch.a) << " and " << nameOf(world, watch.b) << " touch after " << time
      << " s, not " << watch.said.contact;
  ++tally.looks;
  if (watch.assume == Assume::presentMotion) {
    EXPECT_LE(closed, allowed + 1e-9) << nameOf(world, watch.a) << " and " << nameOf(world, watch.b)
                                      << " after " << ticks << " ticks";
    tally.close += closed > 0.01 && closed >= 0.5 * allowed ? 1 : 0;
  }
  const bool told = time >= watch.said.contact;
  tally.late += told ? 1 : 0;
  return !told;
}

TEST(TimeApart, InABusyRoomNobodyTouchesBeforeTheTimeThatWasTold) {
  Tally tally;
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    BusyRoom room(seed);
    SceneIndex index(sharedScene(room.world));
    std::vector<Watch> watches;
    auto before = room.world.snapshot();
    for (int i = 0; i < 400; ++i) {
      if (i % 40 == 5) room.tellSomebody();
      tick(room.world);
      const auto after = room.world.snapshot();
      const Ways ways = waysBetween(*before, *after);
      std::erase_if(watches, [&](const Watch& watch) {
        return !look(watch, ways, room.world, index, tally);
      });
      before = after;
      for (int k = 0; k < 4; ++k) {
        const EntityId last = after->avatars.empty() ? 9 : after->avatars.back().id;
        const SceneThen then{index, *after};
        const auto any = [&] {
          return entityWith(then, static_cast<EntityId>(room.number(1, last + 0.999)));
        };
        const EntityId a = any(), b = any();
        if (a == 0 || b == 0 || a == b) continue;
        const Assume assume = k % 2 == 0 ? Assume::presentMotion : Assume::anyCommand;
        const TimeApart said = apartAt(room.world, index, a, b, assume);
        if (said.bounded) watches.push_back({a, b, assume, after->tick, said, ways});
      }
    }
  }
  EXPECT_GT(tally.looks, 20'000);
  EXPECT_GT(tally.close, 300);
  EXPECT_GT(tally.late, 300);
}

}  // namespace
}  // namespace enfilade::scene::testing
