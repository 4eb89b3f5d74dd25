// Checks on a busy room that no pair touches before the time that the query guarantees.
#include "scene/world/queries/time_to_contact_query.hpp"

#include <cmath>
#include <map>

#include "tests/scene/busy_room.hpp"
#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

using Action = BodyCommand::Action;

TimeToContact queryTimeToContact(const World& world, EntityIndex& index, EntityId a, EntityId b,
                                 MotionAssumption assume, double minWait = 0) {
  std::size_t work = kMaxQueryWork;
  const SceneAt then{index, *world.snapshot()};
  return std::get<TimeToContact>(
      computeTimeToContact(then, world.settings(), a, b, assume, minWait, work));
}

TEST(TimeToContact, AWalkerReachesTheWallWhenItWasSaid) {
  WorldFixture run({makeFloorBox(), {"wall", {5, 0, -4}, {5.2, 3, 4}}});
  EntityIndex index(borrowScene(run.world));
  run.order("ann", Spawn{Vec3(0, 0.001, 0), 0});
  run.order("ann", Walk{{Vec3(8, 0, 3)}, 2});
  run.runTicks(30);
  for (int i = 0; i < 60; ++i) {
    run.step();
    const EntityId ann = run.getView("ann").id;
    const TimeToContact now =
        queryTimeToContact(run.world, index, ann, 2, MotionAssumption::presentMotion);
    EXPECT_TRUE(now.nextCheck.proved);
    // The speed is 2 m/s towards (8, 3); this is its component towards the wall.
    const double speed = 2 * 8 / std::hypot(8, 3);
    EXPECT_NEAR(now.separatedUntil, now.proximity.separation.distance / speed, 0.02);
    EXPECT_LT(
        queryTimeToContact(run.world, index, ann, 2, MotionAssumption::anyCommand).separatedUntil,
        now.separatedUntil);
    EXPECT_FALSE(queryTimeToContact(run.world, index, ann, 2, MotionAssumption::presentMotion, 9)
                     .nextCheck.proved);
    if (run.open.contains({ann, 2})) break;
  }
}

TEST(TimeToContact, ARiderGoesWithTheLift) {
  BodyFixture t(makeBusyRoom());
  EntityIndex index(borrowScene(t.world));
  t.order("ann", Spawn{{-4, 0.11, -4}, 0});
  t.runTicks(30);
  t.submit({"lift", Action::moveToLevel, 0, 2, {}});
  t.runTicks(5);
  const EntityId ann = t.world.snapshot()->avatars[0].id, ceiling = 2;
  const TimeToContact said =
      queryTimeToContact(t.world, index, ann, ceiling, MotionAssumption::presentMotion);
  EXPECT_NEAR(said.separatedUntil, said.proximity.separation.distance / 1.0, 0.01) << "at 1 m/s";
  EXPECT_NEAR(said.closing.speed, 1, 1e-6);
}

TEST(TimeToContact, AnAvatarOnACrateMovesWithTheLift) {
  Model model = makeBoxModel({makeFloorBox(),
                              {"ceiling", {-3, 5, -3}, {3, 5.2, 3}},
                              {"car", {-2, 0.05, -2}, {2, 0.1, 2}},
                              {"crate", {-0.5, 0.101, -0.5}, {0.5, 1.5, 0.5}}});
  BodySpec lift = makeBodySpec("lift", BodyKind::lift, {2});
  lift.high = 3, lift.stops = {0, 3}, lift.speed = 1;
  BodySpec crate = makeBodySpec("crate", BodyKind::rigid, {3});
  model.bodies = {lift, crate};
  BodyFixture t(std::move(model));
  EntityIndex index(borrowScene(t.world));
  t.order("ann", Spawn{Vec3(0, 1.51, 0), 0});
  t.runTicks(120);
  t.submit({"lift", Action::moveToLevel, 0, 1, {}});
  t.runTicks(30);
  const EntityId ann = t.world.data().findAvatarByName("ann")->id, ceiling = 2;
  const double gap = 5 - 1.75 - t.getFeet("ann").y();
  for (const MotionAssumption assume :
       {MotionAssumption::presentMotion, MotionAssumption::anyCommand}) {
    const TimeToContact now = queryTimeToContact(t.world, index, ann, ceiling, assume);
    EXPECT_LE(now.separatedUntil, gap / lift.speed + 0.01);  // the lift keeps its speed
    EXPECT_GT(now.separatedUntil,
              assume == MotionAssumption::presentMotion ? 0.39 * gap / lift.speed : 0);
  }
}

TEST(TimeToContact, ASwingWithinATickCountsInFull) {
  // 0.2 m out and back in each tick; the post is 0.1 m away, the wall ten times as far.
  Model model = makeBoxModel({makeFloorBox(),
                              {"ram", {-1, 0.1, -0.5}, {0, 1.1, 0.5}},
                              {"post", {0.1, 0.05, 0}, {0.2, 1, 0.2}},
                              {"wall", {2, 0.05, -1}, {2.1, 1, 1}}});
  BodySpec ram = makeBodySpec("ram", BodyKind::path, {1});
  ram.keys = {{0, Vec3::Zero(), 0}, {1.0 / 120, {0.2, 0, 0}, 0}, {1.0 / 60, Vec3::Zero(), 0}};
  ram.loops = true;
  model.bodies = {ram};
  BodyFixture t(std::move(model));
  EntityIndex index(borrowScene(t.world));
  t.runTicks(3);
  EXPECT_EQ(t.countEvents(ContactEvent::Kind::begin, "ram", "post"), 3);
  const TimeToContact said =
      queryTimeToContact(t.world, index, 2, 3, MotionAssumption::presentMotion);
  EXPECT_LE(said.separatedUntil, 1.0 / 120) << "it arrives within the next tick";
  EXPECT_NEAR(said.closing.speed, 24, 1e-6);
  EXPECT_NEAR(
      queryTimeToContact(t.world, index, 2, 4, MotionAssumption::presentMotion).separatedUntil,
      2.0 / 24, 1e-3);
}

TEST(TimeToContact, FallingAvatarsAccelerate) {
  WorldFixture run({makeFloorBox()});
  EntityIndex index(borrowScene(run.world));
  run.order("ann", Spawn{Vec3(0, 5, 0), 0});
  run.runTicks(10);
  const EntityId ann = run.getView("ann").id;
  const TimeToContact said =
      queryTimeToContact(run.world, index, ann, 1, MotionAssumption::presentMotion);
  int ticks = 0;
  while (run.open.empty()) run.step(), ++ticks;
  const double landed = ticks * run.world.settings().tickDuration;
  EXPECT_LE(said.separatedUntil, landed);
  EXPECT_NEAR(said.separatedUntil, landed, 0.02) << "and not much before";
}

TEST(TimeToContact, APushedAvatarMovesAsFastAsItsPusher) {
  Model model = makeBoxModel(
      {makeFloorBox(), {"ram", {-2, 0.01, -1}, {-1, 2, 1}}, {"post", {3, 0, -1}, {4, 3, 1}}});
  BodySpec ram = makeBodySpec("ram", BodyKind::sliding, {1});
  ram.axis = {1, 0, 0};
  ram.high = 6;
  ram.speed = 1;
  model.bodies = {ram};
  BodyFixture t(std::move(model));
  EntityIndex index(borrowScene(t.world));
  t.order("ann", Spawn{{0, 0.001, 0}, 0});
  t.runTicks(10);
  t.submit({"ram", Action::moveTo, 6, 0, {}});
  t.runTicks(60);
  const EntityId ann = t.world.snapshot()->avatars[0].id, post = 3;
  const double before = t.getFeet("ann").x();
  const TimeToContact said =
      queryTimeToContact(t.world, index, ann, post, MotionAssumption::presentMotion);
  t.runTicks(30);
  EXPECT_NEAR(t.getFeet("ann").x() - before, 0.5, 0.01) << "it is pushed";
  EXPECT_GE(said.closing.speed, 1);
  EXPECT_LE(said.separatedUntil, said.proximity.separation.distance / 1);
  EXPECT_GT(said.separatedUntil, 0.3 * said.proximity.separation.distance);
}

TEST(TimeToContact, TipsOfRotatingBodiesCount) {
  BodyFixture t(makeBusyRoom());
  EntityIndex index(borrowScene(t.world));
  t.runTicks(1);
  const EntityId plank = 9, post = 4;
  const TimeToContact said =
      queryTimeToContact(t.world, index, plank, post, MotionAssumption::presentMotion);
  const double radius = t.world.scene().bodyShape(4)->radius;
  EXPECT_GE(said.closing.speed, t.getBody("plank").angularVelocity.norm() * radius);
  EXPECT_LT(said.separatedUntil, said.proximity.separation.distance / 5 / radius);
}

TEST(TimeToContact, OfConvexShapesInUniformMotionItIsTheTimeOfImpact) {
  // The leaf turns about the origin towards -z and meets one post; the other is out of its reach,
  // though no farther from it.
  Model model = makeBoxModel({{"leaf", {0, 0.1, -0.02}, {1, 2, 0.02}},
                              {"post", {-0.05, 0, -0.9}, {0.05, 2.2, -0.8}},
                              {"pillar", {1.1, 0, -0.3}, {1.4, 2.2, 0.3}}});
  BodySpec leaf = makeBodySpec("leaf", BodyKind::hinged, {0});
  leaf.high = 3;
  leaf.speed = 0.5;
  model.bodies = {leaf};
  BodyFixture t(std::move(model));
  EntityIndex index(borrowScene(t.world));
  t.submit({"leaf", Action::open, 0, 0, {}});
  t.runTicks(10);
  const EntityId moving = 1, post = 2, pillar = 3;
  const TimeToContact now =
      queryTimeToContact(t.world, index, moving, post, MotionAssumption::presentMotion);
  EXPECT_GE(queryTimeToContact(t.world, index, moving, pillar, MotionAssumption::presentMotion)
                .separatedUntil,
            600);
  EXPECT_LT(queryTimeToContact(t.world, index, moving, pillar, MotionAssumption::anyCommand)
                .separatedUntil,
            1);
  int ticks = 0;
  while (t.countEvents(ContactEvent::Kind::begin, "leaf", "post") == 0 && ticks < 1000)
    t.step(), ++ticks;
  EXPECT_NEAR(now.separatedUntil, ticks / 60.0, 2.0 / 60);
  EXPECT_EQ(now.nextCheck.after, now.separatedUntil);
  EXPECT_TRUE(now.nextCheck.proved);
}

TEST(TimeToContact, OfDynamicBodiesNothingIsKnownUnderAnyCommand) {
  BodyFixture t(makeBusyRoom());
  EntityIndex index(borrowScene(t.world));
  t.runTicks(1);
  const EntityId crate = 8, floor = 1;
  const TimeToContact any =
      queryTimeToContact(t.world, index, crate, floor, MotionAssumption::anyCommand, 2);
  EXPECT_FALSE(any.bounded);
  EXPECT_EQ(any.separatedUntil, 0);
  EXPECT_EQ(any.nextCheck.after, 2);
  EXPECT_FALSE(any.nextCheck.proved);
  EXPECT_GT(queryTimeToContact(t.world, index, crate, floor, MotionAssumption::presentMotion)
                .separatedUntil,
            0.3);
}

/// Motion of every entity in one tick.
struct Motions {
  struct Motion {
    Vec3 moved;  ///< metres
    bool falls;
    double height;  ///< of an avatar
  };
  std::map<EntityId, Motion> avatars;
  std::shared_ptr<const std::vector<BodySnapshot>> bodies;
};

Motions computeMotions(const Snapshot& before, const Snapshot& after) {
  Motions motions;
  motions.bodies = after.bodies;
  for (const AvatarSnapshot& now : after.avatars)
    for (const AvatarSnapshot& then : before.avatars)
      if (then.id == now.id)
        motions.avatars[now.id] = {now.footPosition - then.footPosition,
                                   !now.grounded && !now.flying, now.height};
  return motions;
}

/// Whether an entity that moved as `first` describes still does so `ticks` later.
bool keepsMotion(EntityId id, const Motions& first, const Motions& now, int ticks,
                 const WorldSettings& settings) {
  constexpr double kSame = 1e-9;
  const double fallen = settings.gravity * settings.tickDuration * ticks;  // metres per second
  if (const auto was = first.avatars.find(id); was != first.avatars.end()) {
    const auto is = now.avatars.find(id);
    if (is == now.avatars.end() || is->second.falls != was->second.falls ||
        is->second.height != was->second.height)
      return false;
    const Vec3 due =
        was->second.moved - Vec3(0, was->second.falls ? fallen * settings.tickDuration : 0, 0);
    return (is->second.moved - due).norm() <= kSame;
  }
  for (std::size_t i = 0; i < now.bodies->size(); ++i) {
    const BodySnapshot &was = (*first.bodies)[i], &is = (*now.bodies)[i];
    if (was.id != id) continue;
    const bool stays = (is.velocity - was.velocity).norm() <= kSame &&
                       (is.angularVelocity - was.angularVelocity).norm() <= kSame &&
                       is.moving == was.moving;
    return stays || (is.velocity - was.velocity + Vec3(0, fallen, 0)).norm() <= kSame;
  }
  return true;
}

struct Watch {
  EntityId a, b;
  MotionAssumption assume;
  std::uint64_t since;
  TimeToContact said;
  Motions motions;
};

/// Counts of the results of all watches.
struct Tally {
  int looks = 0;
  int close = 0;  ///< watches whose pair came closer by half of the allowed distance and 1 cm
  int late = 0;   ///< watches that lasted until their guaranteed time
};

/// Checks one watch; false if the watch is over.
bool checkWatch(const Watch& watch, const Motions& now, const World& world, EntityIndex& index,
                Tally& tally) {
  const WorldSettings& settings = world.settings();
  const int ticks = static_cast<int>(world.snapshot()->tick - watch.since);
  if (watch.assume == MotionAssumption::presentMotion) {
    for (const EntityId id : {watch.a, watch.b})
      if (!keepsMotion(id, watch.motions, now, ticks, settings)) return false;
  }
  std::size_t work = kMaxQueryWork;
  const auto state = std::get<PairProximity>(
      computePairProximity({index, *world.snapshot()}, watch.a, watch.b, false, work));
  const double time = ticks * settings.tickDuration,
               distance = watch.said.proximity.separation.distance;
  const auto& [speed, acceleration] = watch.said.closing;
  const double allowed = speed * time + 0.5 * acceleration * time * time;
  const double closed = distance - state.separation.distance;
  const bool touches = state.separation.verdict != collision::Verdict::separated;
  EXPECT_FALSE(touches && time < watch.said.separatedUntil)
      << findEntityName(world, watch.a) << " and " << findEntityName(world, watch.b)
      << " touch after " << time << " s, not " << watch.said.separatedUntil;
  ++tally.looks;
  if (watch.assume == MotionAssumption::presentMotion) {
    EXPECT_LE(closed, allowed + 1e-9)
        << findEntityName(world, watch.a) << " and " << findEntityName(world, watch.b) << " after "
        << ticks << " ticks";
    tally.close += closed > 0.01 && closed >= 0.5 * allowed ? 1 : 0;
  }
  const bool late = time >= watch.said.separatedUntil;
  tally.late += late ? 1 : 0;
  return !late;
}

TEST(TimeToContact, InABusyRoomNoPairTouchesBeforeTheReportedTime) {
  Tally tally;
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    BusyRoom room(seed);
    EntityIndex index(borrowScene(room.world));
    std::vector<Watch> watches;
    auto before = room.world.snapshot();
    for (int i = 0; i < 400; ++i) {
      if (i % 40 == 5) room.sendRandomCommand();
      tickWorld(room.world);
      const auto after = room.world.snapshot();
      const Motions motions = computeMotions(*before, *after);
      std::erase_if(watches, [&](const Watch& watch) {
        return !checkWatch(watch, motions, room.world, index, tally);
      });
      before = after;
      for (int k = 0; k < 4; ++k) {
        const EntityId last = after->avatars.empty() ? 9 : after->avatars.back().id;
        const SceneAt then{index, *after};
        const auto any = [&] {
          return resolveEntity(then, static_cast<EntityId>(room.drawNumber(1, last + 0.999)));
        };
        const EntityId a = any(), b = any();
        if (a == 0 || b == 0 || a == b) continue;
        const MotionAssumption assume =
            k % 2 == 0 ? MotionAssumption::presentMotion : MotionAssumption::anyCommand;
        const TimeToContact said = queryTimeToContact(room.world, index, a, b, assume);
        if (said.bounded) watches.push_back({a, b, assume, after->tick, said, motions});
      }
    }
  }
  EXPECT_GT(tally.looks, 20'000);
  EXPECT_GT(tally.close, 300);
  EXPECT_GT(tally.late, 300);
}

}  // namespace
}  // namespace enfilade::scene::testing
