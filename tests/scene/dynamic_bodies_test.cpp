#include <gtest/gtest.h>

#include <array>
#include <map>

#include "scene/world/checkpoint/checkpoint.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Event = ContactEvent::Kind;

/// A floor, and free boxes.
Model makeLooseModel(const std::vector<NamedBox>& boxes, const std::vector<NamedBox>& still = {}) {
  std::vector<NamedBox> all{makeFloorBox()};
  all.insert(all.end(), still.begin(), still.end());
  const auto first = static_cast<std::uint32_t>(all.size());
  all.insert(all.end(), boxes.begin(), boxes.end());
  Model model = makeBoxModel(all);
  for (std::uint32_t i = 0; i < boxes.size(); ++i)
    model.bodies.push_back(makeBodySpec(boxes[i].path, BodyKind::rigid, {first + i}));
  return model;
}

bool arePenetrating(const collision::PlacedConvex& a, const collision::PlacedConvex& b) {
  collision::FeatureCache cache;
  return collision::computeSeparation(a, b, cache).verdict == collision::Verdict::penetrating;
}

/// Whether the body penetrates a triangle of a static object, by the exact verdict.
bool isIn(const World& world, const Body& body, std::uint32_t object) {
  for (const collision::Triangle& t : collectSolidTriangles(world.data().scene->model(), object))
    if (arePenetrating(makePlacedPart(body, 0), {std::span<const Vec3>(t), Vec3::Zero()}))
      return true;
  return false;
}

/// Whether any dynamic body penetrates a triangle or another body, kinematic or dynamic, by the
/// exact verdict.
bool isAnyBodyPenetrating(const World& world) {
  const WorldData& state = world.data();
  for (std::size_t i = 0; i < state.bodies.size(); ++i) {
    const Body& body = state.bodies[i];
    if (body.spec->kind != BodyKind::rigid) continue;
    for (const std::uint32_t object : state.scene->solidObjects())
      if (isIn(world, body, object)) return true;
    for (std::size_t k = 0; k < state.bodies.size(); ++k)
      if (k != i && arePenetrating(makePlacedPart(body, 0), makePlacedPart(state.bodies[k], 0)))
        return true;
  }
  return false;
}

TEST(DynamicBodies, ABoxFallsOntoTheFloorRestsThereAndCostsNothingAsleep) {
  BodyFixture t(makeLooseModel({{"box", {0, 1, 0}, {0.4, 1.4, 0.4}}}));
  t.runTicks(150);
  const Body& box = t.getBody("box");
  EXPECT_TRUE(box.asleep);
  EXPECT_NEAR(box.position.y(), 0.2, 0.5e-3);
  EXPECT_GT(box.position.y(), 0.2);
  const Vec3 rest = box.position;
  const TickReport report = t.step();
  EXPECT_TRUE(report.idle);
  EXPECT_EQ(report.narrowQueries, 0u);
  t.runTicks(100);
  EXPECT_EQ(t.getBody("box").position, rest);
}

TEST(DynamicBodies, ABoxThatRestsKeepsItsContactHoweverFarNearMissesAreLookedFor) {
  for (const double nearMiss : {0.0, 0.05, 0.3, 3.0}) {
    WorldSettings settings;
    settings.nearMissDistance = nearMiss;
    BodyFixture t(makeLooseModel({{"box", {-0.2, 0.7, -0.2}, {0.2, 1.1, 0.2}}}), settings);
    t.runUntilIdle();
    t.runTicks(10);
    EXPECT_TRUE(t.getBody("box").asleep);
    EXPECT_FALSE(t.getBody("box").moved) << nearMiss;
    EXPECT_EQ(t.countEvents(Event::begin, "box", "floor"), 1) << nearMiss;
    EXPECT_EQ(t.countEvents(Event::end, "box", "floor"), 0) << nearMiss;
  }
}

TEST(DynamicBodies, ATowerStaysAndSleepsWithoutPenetration) {
  std::vector<NamedBox> tower;
  for (int i = 0; i < 5; ++i) {
    const double low = 0.001 + 0.301 * i;
    tower.push_back({"b" + std::to_string(i), {0, low, 0}, {0.3, low + 0.3, 0.3}});
  }
  BodyFixture t(makeLooseModel(tower));
  for (int i = 0; i < 240; ++i) {
    t.step();
    ASSERT_FALSE(isAnyBodyPenetrating(t.world)) << i;
  }
  for (int i = 0; i < 5; ++i) {
    const Body& box = t.getBody("b" + std::to_string(i));
    EXPECT_TRUE(box.asleep) << i;
    EXPECT_NEAR(box.position.x(), 0.15, 2e-3) << i;
  }
}

TEST(DynamicBodies, AHeavyFallingBoxDoesNotPressAnAvatarIntoTheWall) {
  for (const double speed : {5.0, 50.0, 500.0}) {
    Model model = makeLooseModel({{"crate", {-0.4, 3, -0.4}, {0.7, 4, 0.6}}},
                                 {{"wall", {0.31, 0, -3}, {0.5, 2.9, 3}}});
    model.bodies[0].mass = 5000;
    BodyFixture t(std::move(model));
    t.order("ann", Spawn{.position = {0, 0.001, 0}});
    t.runTicks(2);
    auto& stage = t.world.data().dynamicBodies;
    stage.physicsWorld.bodies[0].motion.velocity = {0.3 * speed, -speed, 0};
    double low = 3.5;
    for (int i = 0; i < 120; ++i) {
      t.step();
      ASSERT_EQ(namePenetratingPairs(t.world), "") << speed << " tick " << i;
      low = std::min(low, t.getBody("crate").position.y());
    }
    EXPECT_LT(low, 3.45) << speed << ": it never came down onto the wall";
  }
}

TEST(DynamicBodies, AnAvatarPushesALightBoxAlongAndNotAHeavyOne) {
  for (const bool heavy : {false, true}) {
    Model model = makeLooseModel({{"box", {1, 0.0005, -0.3}, {1.6, 0.6, 0.3}}});
    model.bodies[0].mass = heavy ? 2000 : 20;
    BodyFixture t(std::move(model));
    t.order("ann", Spawn{.position = {0, 0.001, 0}});
    t.step();
    t.order("ann", Drive{{1, 0, 0}});
    for (int i = 0; i < 180; ++i) {
      t.step();
      ASSERT_EQ(namePenetratingPairs(t.world), "") << i;
    }
    const double moved = t.getBody("box").position.x() - 1.3;
    if (heavy) {
      EXPECT_LT(std::abs(moved), 1e-3);
    } else {
      EXPECT_GT(moved, 1.5);
      EXPECT_LT(moved, 3);
    }
    EXPECT_EQ(t.countEvents(Event::begin, "ann", "box"), 1) << heavy;
    EXPECT_EQ(t.countEvents(Event::end, "ann", "box"), 0)
        << "the body is pushed all the time; " << heavy;
  }
}

TEST(DynamicBodies, EachBounceIsReportedAtItsPlace) {
  std::vector<NamedBox> boxes{{"onto ann", {-0.15, 4, -0.15}, {0.15, 4.3, 0.15}}};
  for (int i = 1; i < 6; ++i)
    boxes.push_back(
        {"b" + std::to_string(i), {2.0 * i, 0.7 * i, 0}, {2.0 * i + 0.3, 0.7 * i + 0.3, 0.3}});
  Model model = makeLooseModel(boxes);
  for (BodySpec& body : model.bodies) body.restitution = 0.9, body.friction = 0;
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{.position = {0, 0.001, 0}});
  std::map<std::string, double> speeds;
  std::map<std::string, int> open;  // contacts
  int bounces = 0;
  for (int i = 0; i < 300; ++i) {
    const TickReport report = t.step();
    std::set<std::string> touched;
    for (const auto& [name, contacts] : open)
      if (contacts > 0) touched.insert(name);
    for (const ContactEvent& event : report.contacts) {
      const bool begins = event.kind == Event::begin;
      if (!begins && event.kind != Event::end) continue;
      for (const EntityId id : {event.a, event.b}) {
        open[findEntityName(t.world, id)] += begins ? 1 : -1;
        if (begins) touched.insert(findEntityName(t.world, id));
      }
    }
    for (const NamedBox& box : boxes) {
      const double speed = t.getBody(box.path).velocity.y();
      const bool bounced = std::exchange(speeds[box.path], speed) < -0.5 && speed > 0.5;
      if (!bounced) continue;
      ++bounces;
      EXPECT_TRUE(touched.contains(box.path)) << box.path << " in tick " << i;
    }
  }
  EXPECT_GT(bounces, 10);
}

/// The first event of a cube that falls corner first onto a plate: the order of `a` and `b`, and
/// the features of both.
ContactEvent dropCornerOnPlate(std::optional<BodyKind> plateIs, std::uint32_t cube) {
  const NamedBox plate{"plate", {-1, 0.1, -2}, {2, 0.2, 1}};
  const NamedBox fallen{"cube", {-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}};
  Model model = makeBoxModel(cube == 1 ? std::vector{makeFloorBox(), fallen, plate}
                                       : std::vector{makeFloorBox(), plate, fallen});
  const Quat turn = Quat::FromTwoVectors(Vec3(1, 1, 1), Vec3::UnitY());
  model.objects[cube].worldFromMesh = Eigen::Translation3d(0, 0.6, 0) * turn;
  model.bodies = {makeBodySpec("cube", BodyKind::rigid, {cube})};
  if (plateIs) {
    model.bodies.push_back(makeBodySpec("plate", *plateIs, {3 - cube}));
    model.bodies.back().axis = Vec3::UnitX();
    if (*plateIs == BodyKind::sliding) model.bodies.back().high = 0.1;
  }
  BodyFixture t(std::move(model));
  const auto isOfBoth = [&](const ContactEvent& event) {
    return findEntityName(t.world, event.a) != "floor" &&
           findEntityName(t.world, event.b) != "floor";
  };
  while (t.world.data().tick < 60) {
    t.step();
    const auto met = std::ranges::find_if(t.events, isOfBoth);
    if (met != t.events.end()) return *met;
  }
  ADD_FAILURE() << "they do not touch";
  return {};
}

TEST(DynamicBodies, ACubeFallingOnItsCornerReportsTheCornerAndTheFace) {
  using collision::Feature;
  for (const std::uint32_t cube : {1u, 2u}) {
    for (const auto plateIs : {std::optional<BodyKind>(), std::optional(BodyKind::sliding),
                               std::optional(BodyKind::rigid)}) {
      const ContactEvent met = dropCornerOnPlate(plateIs, cube);
      // If both bodies are dynamic, the one with the lower id reports; otherwise the dynamic one
      // does.
      const bool cubeTells = plateIs != BodyKind::rigid || cube == 1;
      EXPECT_EQ(met.a, cubeTells ? cube + 1 : 4 - cube);
      EXPECT_EQ(met.separation.featureA, cubeTells ? Feature::vertex : Feature::face);
      EXPECT_EQ(met.separation.featureB, cubeTells ? Feature::face : Feature::vertex);
    }
  }
}

TEST(DynamicBodies, ASleepingBoxIsWokenByADoorOfAnySpeedThatPushesIt) {
  for (const double speed : {0.5, 1.0, 1.05, 5.0}) {
    Model model = makeLooseModel({{"box", {0.5, 0.0005, 0.1}, {0.8, 0.3, 0.4}}},
                                 {{"leaf", {0, 0.01, -0.02}, {1, 2.1, 0.02}}});
    BodySpec door = makeBodySpec("door", BodyKind::hinged, {1});
    door.low = -1.5, door.high = 1.5, door.speed = speed;
    model.bodies.push_back(door);
    BodyFixture t(std::move(model));
    t.runTicks(120);
    ASSERT_TRUE(t.getBody("box").asleep);
    const Vec3 before = t.getBody("box").position;
    t.submit({"door", BodyCommand::Action::moveTo, -1.2, 0, {}});
    for (int i = 0; i < 180; ++i) {
      const std::uint32_t crushed = t.step().crushedBodies;
      // The motion of a fast leaf is not proven clear of the bodies that it carries along, but it
      // is clear.
      if (speed < 2) {
        EXPECT_EQ(crushed, 0u) << speed << " tick " << i;
      }
      ASSERT_FALSE(isAnyBodyPenetrating(t.world)) << speed << " tick " << i;
    }
    EXPECT_GT((t.getBody("box").position - before).norm(), 0.2) << speed;
    // The box stays on the side of the leaf to which it was pushed.
    const Body& leaf = t.getBody("door");
    const Vec3 seen = leaf.rotation.transpose() * (t.getBody("box").position - leaf.position);
    EXPECT_GT(seen.z(), 0.02) << speed;
  }
}

/// A shuttle that moves back and forth along `way` and presses boxes against a post.
Model makePressingModel(const std::vector<NamedBox>& boxes, const Vec3& way, double seconds) {
  Model model = makeLooseModel(
      boxes, {{"post", {2, 0, -1}, {2.2, 2, 2}}, {"shuttle", {-1, 0.01, 0}, {0, 0.6, 1}}});
  BodySpec shuttle = makeBodySpec("shuttle", BodyKind::path, {2});
  shuttle.keys = {{0, Vec3::Zero(), 0}, {seconds, way, 0}, {2 * seconds, Vec3::Zero(), 0}};
  shuttle.loops = true;
  model.bodies.push_back(shuttle);
  return model;
}

/// Runs six laps. No box penetrates the post or is flung away; after the first lap none is farther
/// than `astray` metres from its start. Returns the number of crushed pairs.
std::uint32_t pressSixTimes(BodyFixture& t, double seconds, double astray) {
  std::uint32_t crushed = 0;
  std::vector<Vec3> held;
  const int lap = static_cast<int>(120 * seconds);
  for (int i = 0; i < 6 * lap; ++i) {
    crushed += tickWorld(t.world).crushedBodies;
    for (std::size_t k = 0; k + 1 < t.world.data().bodies.size(); ++k) {
      const Body& box = t.world.data().bodies[k];
      EXPECT_FALSE(isIn(t.world, box, 1)) << box.spec->name << " in the post, tick " << i;
      EXPECT_LT(box.velocity.norm(), 1.5) << box.spec->name << " flung, tick " << i;
      if (i == lap) held.push_back(box.position);
      if (i > lap) {
        EXPECT_LT((box.position - held[k]).norm(), astray) << box.spec->name << ", " << i;
      }
      if (::testing::Test::HasFailure()) return crushed;
    }
  }
  return crushed;
}

TEST(DynamicBodies, AShuttleThatPressesABoxAgainstAPostGoesThroughItAndLeavesItThere) {
  // Travel of the shuttle in metres: a little into the box, past its middle, past the post.
  for (const double far : {1.6, 2.0, 2.3}) {
    BodyFixture t(
        makePressingModel({{"box", {0.5, 0.0005, 0.2}, {1.0, 0.5, 0.7}}}, {far, 0, 0}, far));
    EXPECT_GT(pressSixTimes(t, far, 0.02), 0u) << far;
    EXPECT_NEAR(t.getBody("box").position.x(), 1.75, 0.02) << far;
  }
}

TEST(DynamicBodies, AShuttleThatPressesARowOfBoxesEjectsNoBox) {
  for (const double far : {1.2, 1.6, 2.5}) {
    BodyFixture t(makePressingModel({{"first", {0.3, 0.0005, 0.2}, {0.7, 0.5, 0.7}},
                                     {"second", {0.9, 0.0005, 0.25}, {1.3, 0.4, 0.75}}},
                                    {far, 0, 0}, far));
    EXPECT_GT(pressSixTimes(t, far, 0.1), 0u) << far;
  }
}

TEST(DynamicBodies, AnObliqueShuttleCarriesNoPenetratedBox) {
  for (const double aside : {-0.4, 0.1, 0.4}) {
    BodyFixture t(
        makePressingModel({{"box", {0.5, 0.0005, 0.2}, {1.0, 0.5, 0.7}}}, {2.2, 0, aside}, 2.2));
    EXPECT_GT(pressSixTimes(t, 2.2, 0.1), 0u) << aside;
  }
}

TEST(DynamicBodies, AWorldRestoredWhileABoxIsPressedContinuesIdentically) {
  BodyFixture t(makePressingModel({{"box", {0.5, 0.0005, 0.2}, {1.0, 0.5, 0.7}}}, {2, 0, 0}, 2));
  while (t.world.snapshot()->tick < 115) tickWorld(t.world);
  World again = restoreWorld(t.world.data().scene, makeCheckpoint(t.world));
  for (int i = 0; i < 60; ++i)
    ASSERT_EQ(tickWorld(again).snapshot->stateHash, tickWorld(t.world).snapshot->stateHash) << i;
}

TEST(DynamicBodies, AStackThatSleepsOnALiftIsLiftedAsOne) {
  for (const int boxes : {1, 2, 5}) {
    std::vector<NamedBox> stack;
    for (int i = 0; i < boxes; ++i) {
      const double low = 0.101 + 0.501 * i;
      stack.push_back({"b" + std::to_string(i), {0, low, 0}, {0.5, low + 0.5, 0.5}});
    }
    Model model = makeLooseModel(stack, {{"lift", {-1, 0, -1}, {1, 0.1, 1}}});
    BodySpec lift = makeBodySpec("lift", BodyKind::lift, {1});
    lift.stops = {0, 2}, lift.high = 2;
    model.bodies.push_back(lift);
    BodyFixture t(std::move(model));
    t.runTicks(240);
    ASSERT_TRUE(t.getBody("b0").asleep);
    t.submit({"lift", BodyCommand::Action::moveTo, 2, 0, {}});
    t.runTicks(240);  // checks for penetration after each tick
    for (int i = 0; i < boxes; ++i)
      EXPECT_NEAR(t.getBody("b" + std::to_string(i)).position.y(), 2.35 + 0.5 * i, 0.01) << boxes;
  }
}

/// An avatar on a stack of crates on a lift that rises by two metres.
BodyFixture standOnCratesOnALift(int crates, const std::vector<NamedBox>& still = {}) {
  std::vector<NamedBox> stack;
  for (int i = 0; i < crates; ++i) {
    const double low = 0.101 + 0.501 * i;
    stack.push_back({"b" + std::to_string(i), {-0.5, low, -0.5}, {0.5, low + 0.5, 0.5}});
  }
  std::vector<NamedBox> others{{"lift", {-1, 0, -1}, {1, 0.1, 1}}};
  others.insert(others.end(), still.begin(), still.end());
  Model model = makeLooseModel(stack, others);
  BodySpec lift = makeBodySpec("lift", BodyKind::lift, {1});
  lift.stops = {0, 2}, lift.high = 2, lift.speed = 1.5;
  model.bodies.push_back(lift);
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{.position = {0, 0.102 + 0.501 * crates, 0}});
  t.runTicks(200);
  t.submit({"lift", BodyCommand::Action::moveTo, 2, 0, {}});
  return t;
}

TEST(DynamicBodies, AvatarOnCratesOnALiftIsLifted) {
  for (const int crates : {1, 3}) {
    BodyFixture t = standOnCratesOnALift(crates);
    const double above = t.getFeet("ann").y() - t.getBody("b0").position.y();
    for (int i = 0; i < 240; ++i) {
      t.step();
      ASSERT_EQ(namePenetratingPairs(t.world), "") << crates << " in tick " << i;
      ASSERT_FALSE(isAnyBodyPenetrating(t.world)) << crates << " in tick " << i;
      ASSERT_NEAR(t.getFeet("ann").y() - t.getBody("b0").position.y(), above, 0.01) << i;
    }
    EXPECT_NEAR(t.getBody("lift").position.y(), 2, 0.1);
    EXPECT_NEAR(t.getBody("b0").position.y(), 2.35, 0.01) << crates;
    t.submit({"lift", BodyCommand::Action::moveTo, 0, 0, {}});
    t.runTicks(240);
    EXPECT_NEAR(t.getBody("b0").position.y(), 0.35, 0.01) << crates;
    EXPECT_EQ(t.world.data().findAvatarByName("ann")->groundEntity,
              t.getBody("b" + std::to_string(crates - 1)).id);
    EXPECT_EQ(namePenetratingPairs(t.world), "");
  }
}

TEST(DynamicBodies, AvatarOnRisingCratesPenetratesNoCrate) {
  // The avatar steps from the lift onto low crates, then a higher one, and over the gap between two
  // lifts.
  const std::vector<NamedBox> crates{{"c0", {-1.5, 0.101, -1.2}, {-0.5, 0.35, 1.2}},
                                     {"c1", {-0.49, 0.101, -1.2}, {0.5, 0.35, 1.2}},
                                     {"c2", {0.51, 0.101, -1.2}, {1.5, 0.6, 1.2}},
                                     {"bridge", {2, 0.101, -0.5}, {4, 0.3, 0.5}}};
  Model model = makeLooseModel(
      crates, {{"lift", {-4, 0, -1.5}, {2.5, 0.1, 1.5}}, {"cart", {3, 0, -1}, {5, 0.1, 1}}});
  for (std::uint32_t object = 1; object <= 2; ++object) {
    BodySpec lift = makeBodySpec(object == 1 ? "lift" : "cart", BodyKind::lift, {object});
    lift.stops = {0, 6}, lift.high = 6, lift.speed = object == 1 ? 1.5 : 1.4;
    model.bodies.push_back(lift);
  }
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{.position = {-3, 0.102, -0.5}});
  t.order("bob", Spawn{.position = {0, 0.352, 0.7}});
  t.order("cid", Spawn{.position = {3, 0.302, 0}});
  t.runTicks(60);
  t.order("ann", Drive{{1.4, 0, 0}});
  for (int i = 0; i < 5; ++i) t.order("bob", Jump{0.3, Vec3(0, 0, 0)});
  for (const char* lift : {"lift", "cart"}) t.submit({lift, BodyCommand::Action::moveTo, 6, 0, {}});
  double highest = 0;
  std::optional<World> again;
  for (int i = 0; i < 200; ++i) {
    const TickReport report = t.step();
    ASSERT_EQ(report.crushedBodies, 0u) << i;
    ASSERT_EQ(namePenetratingPairs(t.world), "") << i;
    ASSERT_FALSE(isAnyBodyPenetrating(t.world)) << i;
    if (again) {
      ASSERT_EQ(tickWorld(*again).snapshot->stateHash, report.snapshot->stateHash) << i;
    }
    if (i == 50) again.emplace(restoreWorld(t.world.data().scene, makeCheckpoint(t.world)));
    highest = std::max(highest, t.getFeet("ann").y() - t.getBody("lift").position.y());
  }
  EXPECT_GT(highest, 0.5) << "ann came onto the higher crate";
  EXPECT_GT(t.getBody("lift").position.y(), 4);
}

TEST(DynamicBodies, ALiftStopsIfAnAvatarOnItsCrateHasNoRoom) {
  BodyFixture t = standOnCratesOnALift(1, {{"ceiling", {-1, 2.9, -1}, {1, 3, 1}}});
  for (int i = 0; i < 240; ++i) {
    t.step();
    ASSERT_EQ(namePenetratingPairs(t.world), "") << i;
    ASSERT_FALSE(isAnyBodyPenetrating(t.world)) << i;
  }
  const double room = 2.9 - 1.75 - 0.601;  // over the crate
  EXPECT_NEAR(t.getBody("b0").position.y(), 0.351 + room, 0.02);
  EXPECT_EQ(t.countEvents(Event::blocked, "lift", "ann"), 1);
}

TEST(DynamicBodies, ARowOfBoxesAtRestIsPushedAsOneByAShuttle) {
  for (const double gap : {0.0004, 0.001, 0.01, 0.1})
    for (const double speed : {0.5, 2.0, 5.0}) {
      std::vector<NamedBox> row;
      for (int i = 0; i < 3; ++i) {
        const double x = i * (0.5 + gap);
        row.push_back({"b" + std::to_string(i), {x, 0.001, -0.25}, {x + 0.5, 0.5, 0.25}});
      }
      Model model = makeLooseModel(row, {{"shuttle", {-3, 0.05, -1}, {-2, 1, 1}}});
      BodySpec shuttle = makeBodySpec("shuttle", BodyKind::path, {1});
      const double begins = 1.5;
      shuttle.keys = {
          {0, Vec3::Zero(), 0}, {begins, Vec3::Zero(), 0}, {begins + 5 / speed, {5, 0, 0}, 0}};
      model.bodies.push_back(shuttle);
      BodyFixture t(std::move(model));
      t.runTicks(static_cast<int>(60 * (begins + 5 / speed)) + 2);
      for (int i = 0; i < 3; ++i)
        EXPECT_GT(t.getBody("b" + std::to_string(i)).position.x(), 3.25 + 0.5 * i)
            << gap << " m, " << speed << " m/s";
    }
}

TEST(DynamicBodies, BodiesThatALoopingPathShakesDoNotDelayIdle) {
  Model model = makeLooseModel(
      {{"box", {-0.2, 0.5006, -0.2}, {0.2, 0.9, 0.2}}, {"far", {5, 1, 5}, {5.4, 1.4, 5.4}}},
      {{"tray", {-1, 0.4, -1}, {1, 0.5, 1}}});
  BodySpec tray = makeBodySpec("tray", BodyKind::path, {1});
  tray.keys = {{0, Vec3::Zero(), 0}, {0.05, {0, 0.01, 0}, 0}, {0.1, Vec3::Zero(), 0}};
  tray.loops = true;
  model.bodies.push_back(tray);
  BodyFixture t(std::move(model));
  EXPECT_FALSE(t.step().idle) << "one box falls";
  t.runTicks(200);
  EXPECT_TRUE(t.step().idle);
  EXPECT_FALSE(t.getBody("box").asleep);
  t.submit({"tray", BodyCommand::Action::stop, 0, 0, {}});
  EXPECT_FALSE(t.step().idle);
  t.runUntilIdle();
  EXPECT_TRUE(t.getBody("box").asleep);
}

TEST(DynamicBodies, AFastPlateCarriesASleepingBox) {
  Model model = makeLooseModel({{"box", {0.5, 0.0005, -0.2}, {0.9, 0.4, 0.2}}},
                               {{"plate", {0.43, 0.01, -1}, {0.48, 1, 1}}});
  BodySpec plate = makeBodySpec("plate", BodyKind::sliding, {1});
  plate.axis = Vec3::UnitX(), plate.low = 0, plate.high = 3, plate.speed = 10;
  model.bodies.push_back(plate);
  BodyFixture t(std::move(model));
  t.runTicks(120);
  ASSERT_TRUE(t.getBody("box").asleep);
  t.submit({"plate", BodyCommand::Action::open, 0, 0, {}});
  for (int i = 0; i < 60; ++i) {
    t.step();
    ASSERT_FALSE(isAnyBodyPenetrating(t.world)) << i;
  }
  EXPECT_GT(t.getBody("box").position.x(), 3.48 + 0.2);
}

TEST(DynamicBodies, ABoxBetweenAnAvatarAndAWallComesToRestInContact) {
  Model model = makeLooseModel({{"box", {1, 0.0005, -0.2}, {1.4, 0.4, 0.2}}},
                               {{"wall", {2, 0, -3}, {2.2, 3, 3}}});
  model.bodies[0].mass = 10;
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{.position = {0, 0.001, 0}});
  t.order("ann", Walk{{{3, 0, 0}}, 1.3});
  t.runUntilIdle();
  EXPECT_TRUE(t.getBody("box").asleep);
  ASSERT_GE(t.countEvents(Event::begin, "ann", "box"), 1);
  const auto hit = std::find_if(t.events.begin(), t.events.end(), [&](const ContactEvent& e) {
    return e.kind == Event::begin && findEntityName(t.world, e.b) == "box" &&
           findEntityName(t.world, e.a) == "ann";
  });
  EXPECT_LT(hit->time, 0.8) << "reported only after the box was stuck";
  EXPECT_LT(hit->separation.distance, 2 * t.world.settings().contactOffset);
}

TEST(DynamicBodies, ABoxThatSleepsOnSomeonesHeadFallsWhenHeGoesOrLeavesOrCrouches) {
  for (int how = 0; how < 3; ++how) {
    Model model = makeLooseModel({{"box", {-0.4, 1.76, -0.4}, {0.4, 2.0, 0.4}}});
    BodyFixture t(std::move(model));
    t.order("ann", Spawn{.position = {0, 0.001, 0}});
    t.runUntilIdle();
    const double height = t.getBody("box").position.y();
    ASSERT_TRUE(t.getBody("box").asleep) << how << " " << t.getBody("box").position.transpose();
    ASSERT_GT(height, 1.7) << how;
    if (how == 0) t.order("ann", Drive{{3, 0, 0}});
    if (how == 1) t.order("ann", Leave{});
    if (how == 2) t.order("ann", Crouch{.height = 1});
    for (int i = 0; i < 90; ++i) {
      t.step();
      ASSERT_EQ(namePenetratingPairs(t.world), "") << how << " tick " << i;
    }
    EXPECT_LT(t.getBody("box").position.y(), height - 0.5) << how;
  }
}

TEST(DynamicBodies, AvatarsThatLeaveFreeTheirMemory) {
  BodyFixture t(makeLooseModel({{"box", {0.5, 0.0005, -0.2}, {0.9, 0.4, 0.2}}}));
  std::size_t maxSolids = 0;
  for (int i = 0; i < 30; ++i) {
    t.order("ann", Spawn{.position = {0, 0.001, 0}});
    t.order("ann", Walk{{{0.3, 0, 0}}, 1});
    t.runTicks(20);
    t.order("ann", Leave{});
    t.runTicks(3);
    const std::size_t solids = t.world.data().dynamicBodies.physicsWorld.bodies.size();
    if (i == 0) maxSolids = solids;
    EXPECT_LE(solids, maxSolids) << i;
  }
}

TEST(DynamicBodies, ABodyThatFallsOutOfTheWorldIsReportedAndRemoved) {
  BodyFixture t(makeLooseModel({{"box", {12, 1, 0}, {12.4, 1.4, 0.4}}}));
  t.runTicks(400);
  EXPECT_EQ(t.countEvents(Event::leftWorld, "box", ""), 1);
  const Body& box = t.getBody("box");
  EXPECT_TRUE(box.outOfWorld);
  const Vec3 caught = box.position;
  EXPECT_TRUE(t.step().idle);
  EXPECT_EQ(t.getBody("box").position, caught);
}

/// A tray that returns to its start within every tick, with a box on it.
Model makeTrayShaker(double amplitude) {
  Model model = makeBoxModel({makeFloorBox(),
                              {"tray", {-0.5, 0.2, -0.5}, {0.5, 0.25, 0.5}},
                              {"box", {-0.1, 0.2505, -0.1}, {0.1, 0.35, 0.1}}});
  BodySpec tray = makeBodySpec("tray", BodyKind::path, {1});
  tray.loops = true;
  const std::array<double, 5> heights{0, amplitude, 0, -amplitude, 0};
  for (std::size_t i = 0; i < heights.size(); ++i)
    tray.keys.push_back({static_cast<double>(i) / 240, {0, heights[i], 0}, 0});
  model.bodies = {tray, makeBodySpec("box", BodyKind::rigid, {2})};
  return model;
}

TEST(DynamicBodies, ATrayThatShakesWithinATickThrowsItsLoad) {
  BodyFixture still(makeTrayShaker(0)), shaken(makeTrayShaker(1e-3));
  double highest = 0;
  for (int i = 0; i < 200; ++i) {
    still.step();
    shaken.step();
    highest = std::max(highest, shaken.getBody("box").position.y());
    ASSERT_EQ(shaken.getBody("tray").position, still.getBody("tray").position) << i;
    ASSERT_FALSE(isAnyBodyPenetrating(shaken.world)) << i;
  }
  EXPECT_TRUE(still.getBody("box").asleep);
  EXPECT_FALSE(shaken.getBody("box").asleep);
  EXPECT_GT(highest, still.getBody("box").position.y() + 0.5e-3);
}

/// A block of 1 m that moves 0.2 m along x and back within each tick, and a dynamic box.
Model makeRam(const NamedBox& box) {
  Model model = makeBoxModel({makeFloorBox(), {"ram", {-1, 0.1, -0.5}, {0, 1.1, 0.5}}, box});
  BodySpec spec = makeBodySpec("ram", BodyKind::path, {1});
  spec.keys = {{0, Vec3::Zero(), 0}, {1.0 / 120, {0.2, 0, 0}, 0}, {1.0 / 60, Vec3::Zero(), 0}};
  spec.loops = true;
  spec.autoStart = false;
  model.bodies = {spec, makeBodySpec(box.path, BodyKind::rigid, {2})};
  return model;
}

TEST(DynamicBodies, ABodyThatReachesASleepingBoxWithinATickWakesIt) {
  BodyFixture t(makeRam({"box", {0.1, 0, -0.2}, {0.5, 0.4, 0.2}}));
  t.runTicks(120);
  ASSERT_TRUE(t.getBody("box").asleep);
  t.submit({"ram", BodyCommand::Action::run, 0, 0, {}});
  t.runTicks(30);
  EXPECT_GT(t.getBody("box").position.x(), 0.4) << "0.1 m farther than it was at least";
  EXPECT_FALSE(isAnyBodyPenetrating(t.world));
}

TEST(DynamicBodies, ABoxSleepsOnABlockedPathBody) {
  Model model = makeRam({"box", {-0.7, 1.1, -0.2}, {-0.3, 1.5, 0.2}});
  model.bodies[0].keys[1].offset = {0.2, 0, 0};
  model.bodies[0].keys[1].time = 1, model.bodies[0].keys[2].time = 2;
  model.meshes.push_back(buildBoxMesh({0.7, 0, -2}, {0.8, 3, 2}));
  model.objects.push_back({"wall", "", {3}, Eigen::Affine3d::Identity()});
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{.position = {0.35, 0.01, 0}});
  t.runTicks(60);
  t.submit({"ram", BodyCommand::Action::run, 0, 0, {}});
  t.runTicks(240);
  EXPECT_NE(t.getBody("ram").blockedBy, 0u);
  EXPECT_TRUE(t.getBody("box").asleep);
  t.runTicks(60);
  EXPECT_TRUE(t.getBody("box").asleep);
}

TEST(DynamicBodies, TwoRunsHaveOneHash) {
  const auto run = [] {
    BodyFixture t(
        makeLooseModel({{"a", {0, 1, 0}, {0.4, 1.4, 0.4}}, {"b", {0.1, 2, 0.1}, {0.5, 2.3, 0.6}}}));
    t.order("ann", Spawn{.position = {2, 0.001, 0}});
    t.step();
    t.order("ann", Drive{{-1, 0, 0}});
    t.runTicks(200);
    return t.world.data().hash;
  };
  EXPECT_EQ(run(), run());
}

TEST(DynamicBodies, EventsDoNotDependOnTheNumberOfThreads) {
  std::vector<NamedBox> boxes;
  for (int i = 0; i < 90; ++i) {
    const double x = 0.35 * (i % 5) + 0.02 * (i / 25), y = 0.1 + 0.4 * (i / 25);
    const double z = 0.35 * (i / 5 % 5) + 0.01 * (i % 7);
    boxes.push_back({"box" + std::to_string(i), {x, y, z}, {x + 0.3, y + 0.3, z + 0.3}});
  }
  struct Run {
    std::vector<std::tuple<std::uint64_t, Event, EntityId, EntityId, double>> events;
    std::vector<std::uint8_t> state;
    bool operator==(const Run&) const = default;
  };
  const auto run = [&](int threads) {
    BodyFixture t(makeLooseModel(boxes));
    setThreadCount(t.world, threads);
    Run result;
    for (int i = 0; i < 90; ++i)
      for (const ContactEvent& e : tickWorld(t.world).contacts)
        result.events.emplace_back(e.tick, e.kind, e.a, e.b, e.separation.distance);
    result.state = makeCheckpoint(t.world);
    return result;
  };
  const Run alone = run(1);
  EXPECT_GT(alone.events.size(), 150u);
  EXPECT_EQ(alone, run(2));
  EXPECT_EQ(alone, run(8));
}

}  // namespace
}  // namespace enfilade::scene
