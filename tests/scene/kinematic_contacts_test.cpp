#include <gtest/gtest.h>

#include <map>
#include <random>

#include "collision/narrow_phase/refine.hpp"
#include "scene/world/checkpoint/checkpoint.hpp"
#include "scene/world/contacts/excluded_pairs.hpp"
#include "tests/scene/body_fixture.hpp"
#include "tests/scene/checkpoint_fixture.hpp"
#include "tests/support/sanitized.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Action = BodyCommand::Action;
using Event = ContactEvent::Kind;
using Phase = ContactEvent::Phase;

/// A leaf in the plane z = 0 with its tip at `tip` that rotates about `hinge`.
BodySpec makeLeafSpec(const std::string& name, std::uint32_t object, double hinge) {
  BodySpec spec = makeBodySpec(name, BodyKind::hinged, {object});
  spec.anchor = {hinge, 0, 0};
  spec.low = -kQuarter, spec.high = kQuarter, spec.speed = kQuarter;
  return spec;
}

/// A lift of 2 x 2 m that rises from the floor under it past a beam whose underside is at y = 2.
Model makeLiftUnderABeam() {
  Model model = makeBoxModel(
      {makeFloorBox(), {"car", {-1, 0, -1}, {1, 0.5, 1}}, {"beam", {0.9, 2, -1}, {3, 2.2, 1}}});
  BodySpec spec = makeBodySpec("lift", BodyKind::lift, {1});
  spec.high = 4, spec.stops = {0, 4}, spec.speed = 1;
  model.bodies.push_back(spec);
  return model;
}

std::vector<ContactEvent> findEventsBetween(const BodyFixture& t, const std::string& a,
                                            const std::string& b) {
  std::vector<ContactEvent> reported;
  for (const ContactEvent& e : t.events)
    if (findEntityName(t.world, e.a) == a && findEntityName(t.world, e.b) == b)
      reported.push_back(e);
  return reported;
}

TEST(KinematicContacts, ALiftReportsAGrazedBeamButNotItsFloor) {
  BodyFixture t(makeLiftUnderABeam());
  t.submit({"lift", Action::moveToLevel, 0, 1, {}});
  t.runUntilIdle();
  const auto up = findEventsBetween(t, "lift", "beam");
  ASSERT_EQ(up.size(), 2u);
  EXPECT_EQ(up[0].kind, Event::begin);
  EXPECT_EQ(up[0].tick, 90u);  // 1.5 m at 1 m/s
  EXPECT_EQ(up[1].kind, Event::end);
  EXPECT_GE(up[1].separation.distance, 2 * t.world.settings().contactOffset);
  EXPECT_EQ(up[1].separation.verdict, collision::Verdict::separated);
  EXPECT_LT(up[1].separation.normal.y(), -0.9) << "the lift is above";
  t.submit({"lift", Action::moveToLevel, 0, 0, {}});
  t.runUntilIdle();
  EXPECT_EQ(findEventsBetween(t, "lift", "beam").size(), 4u);
  EXPECT_EQ(t.events.size(), 4u) << "leaving the floor and returning are not reported";
}

TEST(KinematicContacts, AContactAtRestLastsAndIsReportedOnce) {
  BodyFixture t(makeLiftUnderABeam());
  t.submit({"lift", Action::moveTo, 1.6, 0, {}});
  t.runUntilIdle();
  EXPECT_EQ(t.step().activeContacts, 1u);
  t.runTicks(60);
  EXPECT_EQ(findEventsBetween(t, "lift", "beam").size(), 1u);
  const auto ends = endAllContacts(t.world, ContactEvent::Reason::shutdown);
  ASSERT_EQ(ends.size(), 1u);
  EXPECT_EQ(findEntityName(t.world, ends[0].b), "beam");
}

TEST(KinematicContacts, DoorsThatCollideAreReportedByTheLowerId) {
  // The leaves are 1.1 m long and the hinges 2 m apart: they meet when half open. Modelled open.
  Model model =
      makeBoxModel({{"right", {1, 0, -1.1}, {1.04, 2, 0}}, {"left", {-1.04, 0, -1.1}, {-1, 2, 0}}});
  model.bodies = {makeLeafSpec("right door", 0, 1.04), makeLeafSpec("left door", 1, -1.04)};
  BodyFixture t(std::move(model));
  t.submit({"left door", Action::moveTo, -kQuarter, 0, {}});
  t.runUntilIdle();
  EXPECT_TRUE(t.events.empty());
  t.submit({"right door", Action::moveTo, kQuarter, 0, {}});
  t.runUntilIdle();
  EXPECT_EQ(t.countEvents(Event::begin, "right door", "left door"), 1);
  EXPECT_EQ(t.countEvents(Event::end, "right door", "left door"), 0);
  t.submit({"left door", Action::moveTo, 0, 0, {}});
  t.runUntilIdle();
  EXPECT_EQ(t.countEvents(Event::end, "right door", "left door"), 1);
  EXPECT_EQ(t.events.size(), 2u);
}

TEST(KinematicContacts, APathBodyReportsAPenetratedShelf) {
  Model model = makeBoxModel({makeFloorBox(),
                              {"cart", {-4, 0, -0.5}, {-3, 1, 0.5}},
                              {"shelf", {-0.1, 0, -2}, {0.1, 2, 2}},
                              {"far", {-0.1, 0, 3}, {0.1, 2, 5}}});
  BodySpec cart = makeBodySpec("cart", BodyKind::path, {1});
  cart.keys = {{0, Vec3::Zero(), 0}, {4, {8, 0, 0}, 0}};
  model.bodies = {cart};
  WorldSettings settings;
  settings.nearMissDistance = 0.2;
  BodyFixture t(std::move(model), settings);
  t.runUntilIdle();
  std::vector<std::pair<Event, Phase>> reported;
  for (const ContactEvent& e : findEventsBetween(t, "cart", "shelf"))
    reported.emplace_back(e.kind, e.phase);
  const std::vector<std::pair<Event, Phase>> expected{{Event::nearMiss, Phase::begin},
                                                      {Event::begin, Phase::none},
                                                      {Event::nearMiss, Phase::end},
                                                      {Event::end, Phase::none}};
  EXPECT_EQ(reported, expected);
  EXPECT_EQ(t.events.size(), 4u);
}

TEST(KinematicContacts, AnObjectPassedBetweenTwoTicksBeginsAndEnds) {
  // The cart moves 1 m a tick; the sheet is 1 mm thick. A post 3 mm off the path is not met.
  Model model = makeBoxModel({{"cart", {-4.5, 0, -0.5}, {-4.4, 1, 0.5}},
                              {"sheet", {0.2, 0, -2}, {0.201, 2, 2}},
                              {"post", {-2, 0, 0.503}, {-1.9, 1, 0.6}}});
  BodySpec cart = makeBodySpec("cart", BodyKind::sliding, {0});
  cart.axis = Vec3::UnitX();
  cart.high = 8, cart.speed = 60;
  model.bodies = {cart};
  WorldSettings settings;
  settings.nearMissDistance = 0.05;
  BodyFixture t(std::move(model), settings);
  t.submit({"cart", Action::open, 0, 0, {}});
  t.runUntilIdle();
  ASSERT_EQ(t.events.size(), 2u);
  EXPECT_EQ(findEntityName(t.world, t.events[0].b), "sheet");
  EXPECT_EQ(t.events[0].kind, Event::begin);
  EXPECT_LT(t.events[0].separation.distance, 2 * settings.contactOffset);
  EXPECT_EQ(t.events[1].kind, Event::end);
  EXPECT_EQ(t.events[0].tick, t.events[1].tick);
}

TEST(KinematicContacts, ALeafThatTurnsPastAPostBetweenTwoTicksTouchesIt) {
  // 1.5 rad in one tick; the post stands half way, outside the boxes before and after.
  Model model = makeBoxModel({{"leaf", {0, 0, -0.01}, {1, 2, 0}},
                              {"post", {0.6, 0, -0.61}, {0.61, 2, -0.6}},
                              {"low", {0.6, -1, -0.61}, {0.61, -0.002, -0.6}}});
  BodySpec leaf = makeLeafSpec("door", 0, 0);
  leaf.speed = 90;
  model.bodies = {leaf};
  BodyFixture t(std::move(model));
  t.submit({"door", Action::moveTo, 1.5, 0, {}});
  t.step();
  ASSERT_EQ(t.events.size(), 2u);
  EXPECT_EQ(t.countEvents(Event::begin, "door", "post"), 1);
  EXPECT_EQ(t.countEvents(Event::end, "door", "post"), 1);
  t.runUntilIdle();
  EXPECT_EQ(t.events.size(), 2u);
}

TEST(KinematicContacts, APathThatReversesWithinATickTouchesReachedObjects) {
  // Moves 0.2 m out and back in each tick and rotates as much: at rest before and after.
  Model model = makeBoxModel({{"arm", {0, 0, -0.05}, {1, 0.1, 0.05}},
                              {"post", {1.15, 0, -0.05}, {1.16, 2, 0.05}},
                              {"far post", {1.203, 0, -0.05}, {1.21, 2, 0.05}},
                              {"side post", {0.5, 0, 0.2}, {0.51, 2, 0.25}}});
  BodySpec arm = makeBodySpec("arm", BodyKind::path, {0});
  arm.keys = {{0, Vec3::Zero(), 0}, {1.0 / 120, {0.2, 0, 0}, 0}, {1.0 / 60, Vec3::Zero(), 0}};
  arm.loops = true;
  model.bodies = {arm};
  BodyFixture t(model);
  for (int i = 1; i <= 5; ++i) {
    t.step();
    EXPECT_EQ(t.countEvents(Event::begin, "arm", "post"), i);
    EXPECT_EQ(t.countEvents(Event::end, "arm", "post"), i);
    EXPECT_EQ(t.events.size(), 2u * static_cast<std::size_t>(i));
  }
  model.bodies[0].keys[1] = {1.0 / 120, Vec3::Zero(), -1};
  BodyFixture turning(std::move(model));
  turning.step();
  EXPECT_EQ(turning.countEvents(Event::begin, "arm", "side post"), 1);
  EXPECT_EQ(turning.events.size(), 2u);
}

/// Two blocks of 0.1 m. In one tick one moves 1 m along x from `x`. The other starts at `z` and
/// moves by `kind`: a slide of 1 m along z, or a path that returns after half a metre.
BodyFixture makeCrossing(double x, BodyKind kind, double z) {
  Model model = makeBoxModel({{"a", {x - 0.05, 0, -0.05}, {x + 0.05, 0.1, 0.05}},
                              {"b", {-0.05, 0, z - 0.05}, {0.05, 0.1, z + 0.05}}});
  BodySpec a = makeBodySpec("a", BodyKind::sliding, {0}), b = makeBodySpec("b", kind, {1});
  a.axis = Vec3::UnitX(), b.axis = Vec3::UnitZ();
  a.high = b.high = 1, a.speed = b.speed = 60;
  if (kind == BodyKind::path) {
    b.keys = {{0, Vec3::Zero(), 0}, {1.0 / 120, {0, 0, 0.5}, 0}, {1.0 / 60, Vec3::Zero(), 0}};
    b.loops = true, b.speed = 1;
  }
  model.bodies = {a, b};
  BodyFixture t(std::move(model));
  t.submit({"a", Action::moveTo, 1, 0, {}});
  if (kind == BodyKind::sliding) t.submit({"b", Action::moveTo, 1, 0, {}});
  t.step();
  return t;
}

TEST(KinematicContacts, TwoWhoseWaysCrossTouchIfTheyAreThereAtTheSameTime) {
  for (const BodyKind kind : {BodyKind::sliding, BodyKind::path}) {
    const BodyFixture meet = makeCrossing(-0.5, kind, -0.5);
    EXPECT_EQ(meet.countEvents(Event::begin, "a", "b"), 1);
    EXPECT_EQ(meet.countEvents(Event::end, "a", "b"), 1);
    EXPECT_EQ(meet.events.size(), 2u);
    EXPECT_EQ(makeCrossing(-0.75, kind, -0.5).events.size(), 0u) << "the second has passed already";
    EXPECT_EQ(makeCrossing(-0.25, kind, -0.5).events.size(), 0u) << "the first has passed already";
  }
}

TEST(KinematicContacts, TwoThatGoSideBySideCostAFewLooks) {
  // Two carts 1.3 mm apart, one behind the other, at 5 m/s.
  Model model = makeBoxModel({{"a", {0, 0, 0}, {1, 1, 1}}, {"b", {1.0013, 0, 0}, {2, 1, 1}}});
  for (std::uint32_t i = 0; i < 2; ++i) {
    BodySpec cart = makeBodySpec(i == 0 ? "a" : "b", BodyKind::sliding, {i});
    cart.axis = Vec3::UnitX();
    cart.high = 10, cart.speed = 5;
    model.bodies.push_back(cart);
  }
  BodyFixture t(std::move(model));
  for (const char* name : {"a", "b"}) t.submit({name, Action::open, 0, 0, {}});
  for (int i = 0; i < 60; ++i) {
    const TickReport report = t.step();
    EXPECT_LE(report.narrowQueries, 3u) << i;
    EXPECT_EQ(report.iterationLimitedCasts, 0u) << i;
  }
  EXPECT_TRUE(t.events.empty());
}

/// A world in which the first object slides along x by `high` metres; near misses begin at 0.3 m.
BodyFixture makeTrayThatSlid(Model model, double high) {
  BodySpec tray = makeBodySpec("tray", BodyKind::sliding, {0});
  tray.axis = Vec3::UnitX();
  tray.high = high;
  model.bodies = {tray};
  WorldSettings settings;
  settings.nearMissDistance = 0.3;
  BodyFixture t(std::move(model), settings);
  t.submit({"tray", Action::open, 0, 0, {}});
  t.runUntilIdle();
  return t;
}

TEST(KinematicContacts, ANearMissBeginsIsClosestAndEnds) {
  const BodyFixture t = makeTrayThatSlid(makeBoxModel({{"tray", {-2, 0, -0.5}, {-1, 0.1, 0.5}},
                                                       {"post", {-0.1, 0, 0.6}, {0.1, 2, 0.8}}}),
                                         4);
  const auto near = findEventsBetween(t, "tray", "post");
  ASSERT_EQ(near.size(), 3u);
  EXPECT_EQ(near[0].phase, Phase::begin);
  EXPECT_EQ(near[1].phase, Phase::min);
  EXPECT_EQ(near[2].phase, Phase::end);
  EXPECT_NEAR(near[1].separation.distance, 0.1, 1e-7);
  for (const ContactEvent& event : near) {
    EXPECT_NE(event.separation.featureA, collision::Feature::none);
    EXPECT_NE(event.separation.featureB, collision::Feature::none);
  }
  EXPECT_LT(near[0].tick, near[1].tick);
  EXPECT_GE(near[2].separation.distance, 0.3);
}

TEST(KinematicContacts, AnActiveNearMissEndsWithTheWorld) {
  BodyFixture t = makeTrayThatSlid(
      makeBoxModel({{"tray", {0, 0, 0}, {1, 0.1, 1}}, {"post", {1.5, 0, 0}, {1.6, 2, 1}}}), 0.4);
  ASSERT_EQ(t.events.size(), 1u);
  const auto ends = endAllContacts(t.world, ContactEvent::Reason::shutdown);
  ASSERT_EQ(ends.size(), 2u);
  EXPECT_EQ(ends[0].phase, Phase::min);
  EXPECT_EQ(ends[1].phase, Phase::end);
  EXPECT_EQ(ends[1].reason, ContactEvent::Reason::shutdown);
}

TEST(KinematicContacts, TheMountingOfABodyIsListedAndFollowsFromTheScene) {
  Model model = makeLiftUnderABeam();
  model.meshes.push_back(buildBoxMesh({1, 0, -1}, {1.2, 2.5, 1}));  // next to the car, touching it
  model.objects.push_back({"gate", "", {3}, Eigen::Affine3d::Identity()});
  BodySpec gate = makeBodySpec("gate", BodyKind::sliding, {3});
  gate.high = 1;
  model.bodies.push_back(gate);
  const Scene scene(std::move(model));
  const double contact = 2 * WorldSettings{}.contactOffset;
  EXPECT_EQ(findExcludedPartners(scene, 0, contact), (std::vector<EntityId>{1, 4}));
  EXPECT_EQ(findExcludedPartners(scene, 1, contact), (std::vector<EntityId>{1, 2, 3}));
  EXPECT_TRUE(isExcludedPair(scene, 0, 4, contact));
  EXPECT_FALSE(isExcludedPair(scene, 0, 3, contact));
}

TEST(KinematicContacts, BodiesThatStandAreNotLookedAt) {
  Model model = makeBoxModel({makeFloorBox(), {"wall", {-9, 0, 0.5}, {9, 3, 0.6}}});
  for (int i = 0; i < 16; ++i) {
    const double x = -8 + i;
    model.meshes.push_back(buildBoxMesh({x, 0.01, 0.55}, {x + 0.9, 2, 0.58}));
    model.objects.push_back({"leaf" + std::to_string(i),
                             "",
                             {static_cast<std::uint32_t>(i + 2)},
                             Eigen::Affine3d::Identity()});
    BodySpec leaf = makeLeafSpec("door" + std::to_string(i), static_cast<std::uint32_t>(i + 2), x);
    leaf.anchor.z() = 0.55;
    model.bodies.push_back(leaf);
  }
  WorldSettings settings;
  settings.nearMissDistance = 0.5;
  BodyFixture t(std::move(model), settings);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(t.step().narrowQueries, 0u);
  EXPECT_TRUE(t.world.data().excludedPairCache.empty());
  t.submit({"door3", Action::open, 0, 0, {}});
  const std::uint32_t ofOne = t.step().narrowQueries;
  EXPECT_GT(ofOne, 0u);
  EXPECT_LE(ofOne, 12u) << "the floor and its neighbours; the wall is its mounting";
}

TEST(KinematicContacts, ALeafThatGlidesAlongItsFrameIsLookedAtAFewTimes) {
  // The door's gap to jamb, head and floor is 2 mm; its edge moves 26 mm a tick.
  Model model = makeBoxModel({makeFloorBox(),
                              {"leaf", {0, 0.002, 0}, {1, 2, 0.04}},
                              {"jamb", {-0.1, 0, 0}, {-0.002, 2.2, 0.04}},
                              {"head", {-0.1, 2.002, -2}, {1.2, 2.2, 2}}});
  BodySpec leaf = makeLeafSpec("door", 1, 0);
  model.bodies = {leaf};
  BodyFixture t(std::move(model));
  t.submit({"door", Action::moveTo, kQuarter, 0, {}});
  int looks = 0;
  for (int i = 0; i < 55; ++i) looks += static_cast<int>(t.step().narrowQueries);
  EXPECT_TRUE(t.events.empty());
  EXPECT_GE(looks, 2 * 55);
  EXPECT_LT(looks, 4 * 55);
}

// ---- reference implementation
// --------------------------------------------------------------------

class Chance {
 public:
  explicit Chance(unsigned seed) : random_(seed) {}
  double drawUniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0);
  }
  std::uint32_t drawBelow(std::uint32_t count) {
    return static_cast<std::uint32_t>(random_() % count);
  }

 private:
  std::mt19937 random_;
};

Mesh makeShards(Chance& chance, const Vec3& at, int count) {
  Mesh mesh;
  for (int i = 0; i < 3 * count; ++i) {
    mesh.positions.emplace_back(
        (at + Vec3(chance.drawUniform(-0.7, 0.7), chance.drawUniform(-0.7, 0.7),
                   chance.drawUniform(-0.7, 0.7)))
            .cast<float>());
    mesh.indices.push_back(static_cast<std::uint32_t>(i));
  }
  return mesh;
}

/// Boxes and triangle meshes; every other one is kinematic.
Model makeBusyYard(Chance& chance) {
  Model model = makeBoxModel({{"floor", {-5, -0.2, -5}, {5, 0, 5}}});
  for (std::uint32_t i = 1; i <= 14; ++i) {
    const Vec3 at(chance.drawUniform(-2.5, 2.5), chance.drawUniform(0.8, 1.8),
                  chance.drawUniform(-2.5, 2.5));
    const Vec3 half(chance.drawUniform(0.05, 0.6), chance.drawUniform(0.05, 0.6),
                    chance.drawUniform(0.05, 0.6));
    model.meshes.push_back(i % 4 < 2 ? buildBoxMesh(at - half, at + half)
                                     : makeShards(chance, at, 12));
    model.objects.push_back({"thing" + std::to_string(i), "", {i}, Eigen::Affine3d::Identity()});
    if (i % 2 == 0) continue;
    const std::array kinds{BodyKind::hinged, BodyKind::sliding, BodyKind::lift, BodyKind::path};
    BodySpec spec = makeBodySpec("body" + std::to_string(i), kinds[i / 2 % 4], {i});
    spec.anchor = at + Vec3(chance.drawUniform(-0.5, 0.5), 0, 0);
    if (spec.kind == BodyKind::sliding) spec.axis = Vec3::UnitX();
    spec.low = -1.5, spec.high = 2.5, spec.stops = {-1.5, 0, 2.5};
    spec.speed = i % 4 == 1 ? chance.drawUniform(0.3, 3) : chance.drawUniform(10, 60);
    if (spec.kind == BodyKind::path) {
      spec.keys = {
          {0, Vec3::Zero(), 0}, {2, {chance.drawUniform(-3, 3), -0.3, 1}, 2}, {5, Vec3::Zero(), 0}};
      if (chance.drawBelow(2) == 0)  // the path reverses within a tick, at random times
        spec.keys = {
            {0, Vec3::Zero(), 0},
            {0.006, {chance.drawUniform(-1.5, 1.5), chance.drawUniform(-0.5, 0.5), 0.3}, 1},
            {chance.drawUniform(0.012, 0.03), Vec3::Zero(), 0}};
      spec.loops = true, spec.speed = 1;
    }
    model.bodies.push_back(spec);
  }
  return model;
}

TickCommands makeRandomCommand(Chance& chance, const Model& model) {
  TickCommands commands;
  const BodySpec& spec =
      model.bodies[chance.drawBelow(static_cast<std::uint32_t>(model.bodies.size()))];
  if (spec.kind != BodyKind::path)
    commands.bodies.push_back({spec.name, Action::moveTo, chance.drawUniform(-1.5, 2.5), 0, {}});
  else
    commands.bodies.push_back(
        {spec.name, chance.drawBelow(3) == 0 ? Action::stop : Action::run, 0, 0, {}});
  return commands;
}

JointPose interpolatePose(const JointPose& a, const JointPose& b, double s) {
  return {a.offset + s * (b.offset - a.offset), a.angle + s * (b.angle - a.angle)};
}

/// Pose on a looping path, found by a linear search over its keys.
JointPose findPoseOnPath(const BodySpec& spec, double time) {
  while (time < 0) time += spec.keys.back().time;
  while (time >= spec.keys.back().time) time -= spec.keys.back().time;
  std::size_t i = 1;
  while (spec.keys[i].time < time) ++i;
  const PathKey &a = spec.keys[i - 1], &b = spec.keys[i];
  return interpolatePose({a.offset, a.angle}, {b.offset, b.angle},
                         (time - a.time) / (b.time - a.time));
}

/// Pose of an unblocked body at fraction `part` of the tick. A path is followed in four segments.
JointPose placeAt(const Body& body, double part, double tick) {
  const JointPose now = body.drive.pose;
  if (part == 1 || !body.moved) return now;
  if (body.spec->kind != BodyKind::path) {
    const double back = (part - 1) * tick;
    return {now.offset + back * body.velocity,
            now.angle + back * body.angularVelocity.dot(body.spec->axis)};
  }
  const auto station = [&](double quarter) {
    return findPoseOnPath(*body.spec,
                          body.drive.jointPosition - (1 - quarter / 4) * tick * body.drive.speed);
  };
  const double quarter = std::floor(4 * part);
  return interpolatePose(station(quarter), station(quarter + 1), 4 * part - quarter);
}

/// Reference implementation: all pairs with a kinematic body, part by part, by the exact verdict at
/// every tick.
struct ReferenceEvents {
  struct Pair {
    bool touching = false, near = false;
    double distance = 0;
  };
  using Key = std::pair<EntityId, EntityId>;

  explicit ReferenceEvents(const World& w) : world(w) {
    for (const Key& key : listPairs()) mounted[key] = computeState(key).touching;
  }

  /// Parts of a body at fraction `part` of the tick; `turned` owns the rotations that they point
  /// at.
  std::vector<collision::PlacedConvex> placePartsAt(EntityId id, double part,
                                                    collision::Mat3& turned) const {
    const WorldData& state = world.data();
    std::vector<collision::PlacedConvex> parts;
    if (const auto body = state.bodyIndexById.find(id); body != state.bodyIndexById.end()) {
      const Body& b = state.bodies[body->second];
      const JointPose place = placeAt(b, part, world.settings().tickDuration);
      turned = Eigen::AngleAxisd(place.angle, b.spec->axis);
      for (std::uint32_t i = 0; i < b.shape->parts.size(); ++i) {
        parts.push_back(makePlacedPart(b, i));
        if (part == 1) continue;
        parts.back().translation = b.spec->anchor + place.offset;
        parts.back().rotation = &turned;
      }
    } else {
      const CollisionGeometry& still = state.scene->collisionGeometry(id - 1);
      for (std::uint32_t i = 0; i < still.size(); ++i) parts.push_back(still.convex(i));
    }
    return parts;
  }
  std::vector<Key> listPairs() const {
    std::vector<Key> all;
    const WorldData& state = world.data();
    for (const Body& a : state.bodies) {
      for (const std::uint32_t still : state.scene->solidObjects())
        all.emplace_back(a.id, still + 1);
      for (const Body& b : state.bodies)
        if (a.id < b.id) all.emplace_back(a.id, b.id);
    }
    return all;
  }
  Pair computeState(const Key& key, double part = 1) const {
    const double contact = 2 * world.settings().contactOffset;
    Pair state;
    state.distance = std::numeric_limits<double>::infinity();
    collision::Mat3 turnedA, turnedB;
    for (const auto& a : placePartsAt(key.first, part, turnedA)) {
      for (const auto& b : placePartsAt(key.second, part, turnedB)) {
        collision::FeatureCache cache;
        const collision::SeparationResult decision = collision::computeSeparation(a, b, cache);
        state.distance = std::min(state.distance, decision.distance);
        state.touching = state.touching || collision::isCloserThan(a, b, contact, cache);
      }
    }
    state.near = !state.touching && state.distance < world.settings().nearMissDistance;
    return state;
  }
  /// Upper bound on the displacement of any point of the body, metres; a fraction of the tick has
  /// that fraction of it.
  double computeDisplacementBound(EntityId id) const {
    const auto at = world.data().bodyIndexById.find(id);
    if (at == world.data().bodyIndexById.end()) return 0;
    const Body& body = world.data().bodies[at->second];
    if (!body.moved) return 0;
    double fastest = 0;
    for (int i = 0; i < 4; ++i) {
      const JointPose a = placeAt(body, i / 4.0, world.settings().tickDuration),
                      b = placeAt(body, (i + 1) / 4.0, world.settings().tickDuration);
      fastest = std::max(
          fastest, (a.offset - b.offset).norm() + std::abs(a.angle - b.angle) * body.shape->radius);
    }
    return 4 * fastest;
  }
  /// Smallest sampled distance within the tick that ends at the distance `apart`.
  double findNearestOnTheWay(const Key& key, double apart) const {
    const double contact = 2 * world.settings().contactOffset;
    if (apart >
        contact + computeDisplacementBound(key.first) + computeDisplacementBound(key.second))
      return apart;
    for (int i = 0; i < kSamples; ++i)
      apart = std::min(apart, computeState(key, static_cast<double>(i) / kSamples).distance);
    return apart;
  }
  /// Consumes the transient contact events. They are required if the sampled distance is small
  /// enough, and allowed if the lower bound permits a contact.
  template <class Events>
  bool haveMetOnTheWay(const Key& key, double apart, Events& reported) {
    const auto begin = reported.find({key.first, key.second, Event::begin, Phase::none});
    const auto end = reported.find({key.first, key.second, Event::end, Phase::none});
    const bool met = begin != reported.end() && end != reported.end();
    const double nearest = findNearestOnTheWay(key, apart);
    const double contact = 2 * world.settings().contactOffset;
    if (!met) {
      EXPECT_GE(nearest, 0.75 * contact)
          << findEntityName(world, key.first) << ", " << findEntityName(world, key.second);
      return false;
    }
    EXPECT_LT(nearest, contact + (computeDisplacementBound(key.first) +
                                  computeDisplacementBound(key.second)) /
                                     kSamples);
    reported.erase(begin), reported.erase(end);
    ++onTheWay;
    return true;
  }
  bool hasMoved(EntityId id) const {
    const auto body = world.data().bodyIndexById.find(id);
    return body != world.data().bodyIndexById.end() && world.data().bodies[body->second].moved;
  }

  /// Compares the events of a tick with the state after it.
  void follow(const TickReport& report) {
    std::map<std::tuple<EntityId, EntityId, Event, Phase>, double> reported;
    for (const ContactEvent& e : report.contacts)
      EXPECT_TRUE(reported.try_emplace({e.a, e.b, e.kind, e.phase}, e.separation.distance).second);
    std::uint32_t live = 0;
    for (const Key& key : listPairs()) {
      Pair& last = now[key];
      if (mounted[key]) continue;
      if (hasMoved(key.first) || hasMoved(key.second)) {
        Pair before = last;
        last = computeState(key);
        if (!before.touching && !last.touching && haveMetOnTheWay(key, last.distance, reported)) {
          if (before.near) {
            EXPECT_EQ(reported.erase({key.first, key.second, Event::nearMiss, Phase::end}), 1u);
          }
          parting[key] = true, before.near = false;
        }
        const auto take = [&](Event kind, Phase phase, bool expected) {
          const auto at = reported.find({key.first, key.second, kind, phase});
          EXPECT_EQ(at != reported.end(), expected)
              << findEntityName(world, key.first) << ", " << findEntityName(world, key.second)
              << ", tick " << report.snapshot->tick << ": " << static_cast<int>(kind);
          if (at == reported.end()) return;
          if (phase != Phase::min) {
            EXPECT_NEAR(at->second, last.distance, 1e-12);
          }
          reported.erase(at);
        };
        const bool wasAway = !before.touching && !before.near;
        // After a contact ends, the pair is not reported as near until it has been away once.
        last.near = last.near && !before.touching && (wasAway ? !parting[key] : true);
        parting[key] = !last.touching && (before.touching || parting[key]) &&
                       last.distance < world.settings().nearMissDistance;
        take(Event::begin, Phase::none, last.touching && !before.touching);
        take(Event::end, Phase::none, !last.touching && before.touching);
        take(Event::nearMiss, Phase::begin, last.near && wasAway);
        take(Event::nearMiss, Phase::min, before.near && !last.near && !last.touching);
        take(Event::nearMiss, Phase::end, before.near && !last.near);
        begun += last.touching && !before.touching ? 1 : 0;
        begunNear += last.near && wasAway ? 1 : 0;
      }
      live += last.touching ? 1 : 0;
    }
    EXPECT_TRUE(reported.empty()) << "events without a cause:" << reported.size();
    EXPECT_EQ(report.activeContacts, live);
  }

  const World& world;
  std::map<Key, bool> mounted, parting;
  std::map<Key, Pair> now;
  int begun = 0, begunNear = 0, onTheWay = 0;
  static constexpr int kSamples = 24;
};

TEST(KinematicContacts, AreThoseThatBruteForceFindsInBusyYards) {
  int begun = 0, begunNear = 0, onTheWay = 0, mounted = 0;
  constexpr int kYards = tests::kSanitized ? 3 : 12;
  for (unsigned seed = 1; seed <= kYards; ++seed) {
    Chance chance(seed);
    WorldSettings settings;
    settings.nearMissDistance = seed % 2 == 0 ? 0.15 : 0;
    World world(std::make_shared<const Scene>(makeBusyYard(chance)), settings);
    ReferenceEvents reference(world);
    for (int i = 0; i < 200 && !::testing::Test::HasFailure(); ++i) {
      if (i % 3 == 0) give(world, makeRandomCommand(chance, world.scene().model()));
      reference.follow(tickWorld(world));
    }
    begun += reference.begun, begunNear += reference.begunNear, onTheWay += reference.onTheWay;
    for (const auto& [key, is] : reference.mounted) mounted += is ? 1 : 0;
    for (const auto& [key, is] : world.data().excludedPairCache)
      EXPECT_EQ(reference.mounted.at(key), is);
  }
  EXPECT_GT(begun, 5 * kYards);
  EXPECT_GT(begunNear, 2 * kYards);
  EXPECT_GT(onTheWay, kYards);
  EXPECT_GT(mounted, kYards);
}

TEST(KinematicContacts, ARestoredWorldContinuesIdentically) {
  Chance chance(22);
  WorldSettings settings;
  settings.nearMissDistance = 0.15;
  const auto scene = std::make_shared<const Scene>(makeBusyYard(chance));
  World world(scene, settings);
  std::optional<World> copy;
  std::size_t reported = 0;
  for (int i = 0; i < 240; ++i) {
    if (i % 30 == 0) copy.emplace(restoreWorld(scene, makeCheckpoint(world)));
    const TickCommands commands =
        i % 3 == 0 ? makeRandomCommand(chance, scene->model()) : TickCommands{};
    give(world, commands), give(*copy, commands);
    const TickReport one = tickWorld(world), other = tickWorld(*copy);
    ASSERT_TRUE(areListsSame(one.contacts, other.contacts)) << "tick " << i;
    ASSERT_EQ(one.snapshot->stateHash, other.snapshot->stateHash) << "tick " << i;
    reported += one.contacts.size();
  }
  EXPECT_GT(reported, 20u);
}

}  // namespace
}  // namespace enfilade::scene
