// Paths that jump down and ride lifts, and walks that open doors and call lifts.
#include <gtest/gtest.h>

#include "scene/navigation/doors.hpp"
#include "scene/navigation/navigation.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

constexpr double kGallery = 1.5;  // metres, height

/// A floor, and above a part of it a gallery that only a jump leaves, with a railing on its sides.
std::vector<NamedBox> makeGallery() {
  return {{"floor", {0, -0.2, -3}, {12, 0, 3}},
          {"gallery", {0, 0, -3}, {4, kGallery, 3}},
          {"rail", {3.9, kGallery, -3}, {4, kGallery + 1, 1.5}}};
}

/// A shaft between two floors with a lift that is open towards +x.
Model makeTowerModel() {
  Model model = makeBoxModel({{"ground", {4, -0.2, -3}, {10, 0, 3}},
                              {"upper", {4.01, 2.8, -3}, {10, 3, 3}},
                              {"platform", {2, -0.1, -1}, {4, 0, 1}}});
  BodySpec lift = makeBodySpec("lift", BodyKind::lift, {2});
  lift.axis = Vec3::UnitY();
  lift.low = 0;
  lift.high = 3;
  lift.stops = {0, 3};
  lift.speed = 1;
  model.bodies.push_back(lift);
  return model;
}

Model makeDoorModel(std::optional<double> autoClose, BodyKind kind = BodyKind::hinged) {
  Model model = makeBoxModel({{"floor", {0, -0.2, -3}, {12, 0, 3}},
                              {"wall/left", {5.9, 0, -3}, {6.1, 2.5, -0.5}},
                              {"wall/right", {5.9, 0, 0.5}, {6.1, 2.5, 3}},
                              {"leaf", {5.98, 0.01, -0.49}, {6.02, 2, 0.49}}});
  BodySpec door = makeBodySpec("door", kind, {3});
  door.anchor = {6, 0, -0.49};
  if (kind == BodyKind::sliding) door.axis = Vec3::UnitZ();
  door.low = 0;
  door.high = kind == BodyKind::hinged ? kQuarter : 0.95;
  door.autoCloseDelay = autoClose;
  model.bodies.push_back(door);
  return model;
}

Spawn spawnAt(const Vec3& position) {
  Spawn spawn;
  spawn.position = position;
  return spawn;
}

/// The walk along a path; `lift`: the name of the lift of its rides.
Walk makeWalk(const NavigationPath& path, const std::string& lift = "") {
  Walk walk;
  walk.waypoints.assign(path.points.begin() + 1, path.points.end());
  for (const PathLeg& leg : path.legs)
    if (leg.kind == PathLeg::Kind::lift) {
      const auto first = static_cast<std::uint32_t>(leg.first);
      walk.rides = {{first - 1, lift, leg.fromLevel},
                    {first, lift, leg.toLevel},
                    {first + 1, lift, leg.toLevel}};
    }
  return walk;
}

Notice runToNotice(BodyFixture& fixture, int maxTicks = 60 * 60) {
  for (int tick = 0; tick < maxTicks; ++tick)
    for (const Notice& notice : fixture.step().notices)
      if (notice.kind != Notice::Kind::spawned) return notice;
  return {};
}

/// An avatar walks the path unblocked, to its end, in about the time that the path states.
void expectWalkTakesItsTime(const Model& model, const NavigationPath& path,
                            const std::string& lift = "") {
  BodyFixture fixture(model);
  fixture.order("ann", spawnAt(path.points.front()));
  fixture.order("ann", makeWalk(path, lift));
  const Notice end = runToNotice(fixture);
  EXPECT_EQ(end.kind, Notice::Kind::arrived) << end.text;
  EXPECT_LT((end.position - path.points.back()).norm(), 0.01);
  EXPECT_NEAR(static_cast<double>(fixture.world.snapshot()->tick) / 60, path.seconds,
              0.05 * path.seconds);
}

TEST(LinkRoutes, ADropJoinsAGalleryWithTheFloorBelow) {
  const auto scene = makeBoxScene(makeGallery());
  Navigation navigation(scene, {}, {});
  const Vec3 from(1, kGallery + 0.1, -2), to(10, 0.1, -2);
  EXPECT_FALSE(navigation.findPath(from, to).found());
  for (const double drop : {1.2, kGallery - 0.2, kGallery - 0.15, kGallery - 0.1, kGallery - 0.05,
                            kGallery - 0.01})  // not that deep
    EXPECT_FALSE(navigation.findPath(from, to, {drop, false}).found()) << drop;
  const NavigationPath path = navigation.findPath(from, to, {2, false});
  ASSERT_TRUE(path.found()) << path.reason;
  ASSERT_EQ(path.legs.size(), 3u);
  EXPECT_EQ(path.legs[1].kind, PathLeg::Kind::drop);
  const Vec3 edge = path.points[path.legs[1].first], landing = path.points[path.legs[1].first + 1];
  EXPECT_NEAR(edge.y() - landing.y(), kGallery, 0.01);
  EXPECT_GT(edge.z(), 1.5) << "through the railing";
  double length = 0, seconds = 0;
  for (const PathLeg& leg : path.legs) length += leg.length, seconds += leg.seconds;
  EXPECT_NEAR(path.length, length, 1e-12);
  EXPECT_NEAR(path.seconds, seconds, 1e-12);
  EXPECT_NEAR(path.legs[1].length, std::hypot(landing.x() - edge.x(), landing.z() - edge.z()),
              1e-9);
  EXPECT_GT(path.legs[1].seconds, path.legs[1].length / 1.4 - 1e-9);
  EXPECT_FALSE(navigation.findPath(to, from, {2, false}).found());  // not up

  expectWalkTakesItsTime(makeBoxModel(makeGallery()), path);
}

TEST(LinkRoutes, AJumpIsChosenOverALongerWay) {
  auto boxes = makeGallery();
  for (int step = 0; step < 6; ++step)  // a stair at the far side, towards -z
    boxes.push_back({"stair/" + std::to_string(step),
                     {0, 0, -3.4 - 0.4 * step},
                     {1.5, kGallery - 0.25 * (step + 1), -3 - 0.4 * step}});
  boxes.push_back({"yard", {0, -0.2, -8}, {12, 0, -3}});
  const auto scene = makeBoxScene(boxes);
  Navigation navigation(scene, {}, {});
  const Vec3 from(3, kGallery + 0.1, 2), to(6, 0.1, 2);
  const NavigationPath walked = navigation.findPath(from, to);
  ASSERT_TRUE(walked.found()) << walked.reason;
  EXPECT_EQ(walked.legs.size(), 1u);
  const NavigationPath jumped = navigation.findPath(from, to, {2, false});
  ASSERT_TRUE(jumped.found()) << jumped.reason;
  EXPECT_LT(jumped.seconds, 0.5 * walked.seconds);
  EXPECT_EQ(navigation.findPath(to, from, {2, false}).length, navigation.findPath(to, from).length);
}

TEST(LinkRoutes, ALiftIsCalledAndRidden) {
  const auto scene = std::make_shared<const Scene>(makeTowerModel());
  Navigation navigation(scene, {}, {});
  const Vec3 from(9, 0.1, 2), to(9, 3.1, -2);
  EXPECT_FALSE(navigation.findPath(from, to).found());
  for (const auto& [start, goal] : {std::pair(from, to), std::pair(to, from)}) {
    const NavigationPath path = navigation.findPath(start, goal, {0, true});
    ASSERT_TRUE(path.found()) << path.reason;
    ASSERT_EQ(path.legs.size(), 3u);
    const PathLeg& ride = path.legs[1];
    EXPECT_EQ(ride.kind, PathLeg::Kind::lift);
    EXPECT_EQ(ride.length, 0);
    EXPECT_EQ(ride.fromLevel, start.y() < 1 ? 0u : 1u);
    EXPECT_NEAR(ride.seconds, start.y() < 1 ? 3 : 6, 0.1);  // it has to come up first
    expectWalkTakesItsTime(makeTowerModel(), path, "lift");
  }
}

TEST(LinkRoutes, ALiftThatWouldCarryItsPassengerAgainstSomethingIsNotRidden) {
  for (const double overlap : {-0.02, 0.02}) {  // metres, of a beam and the passenger's path
    Model model = makeBoxModel({{"ground", {4, -0.2, -3}, {10, 0, 3}},
                                {"upper", {4.01, 2.8, -3}, {10, 3, 3}},
                                {"platform", {2, -0.1, -1}, {4, 0, 1}},
                                {"beam", {1, 2.2, -3}, {2.7 + overlap, 2.4, 3}}});
    model.bodies = makeTowerModel().bodies;
    const auto scene = std::make_shared<const Scene>(std::move(model));
    Navigation navigation(scene, {}, {});  // the passenger stands in the middle, 0.3 m wide
    const NavigationPath path = navigation.findPath({9, 0.1, 2}, {9, 3.1, -2}, {0, true});
    EXPECT_EQ(path.found(), overlap < 0) << overlap << " " << path.reason;
  }
}

TEST(LinkRoutes, AWalkAfterTheRideDoesNotCrossWhereTheLiftWas) {
  // The only path from the exit to the goal leads over the platform when it is below.
  Model model = makeBoxModel({{"ground", {4.01, -0.2, -3}, {10, 0, 3}},
                              {"island", {-2, -0.2, -1}, {1.99, 0, 1}},
                              {"upper", {4.05, 2.8, -3}, {10, 3, 3}},
                              {"platform", {2, -0.1, -1}, {4, 0.002, 1}}});
  BodySpec lift = makeTowerModel().bodies.front();
  lift.objects = {3};
  model.bodies.push_back(lift);
  const auto scene = std::make_shared<const Scene>(std::move(model));
  Navigation navigation(scene, {}, {});
  EXPECT_TRUE(navigation.findPath({9, 0.1, 0}, {-1, 0.1, 0}).found());
  const NavigationPath down = navigation.findPath({9, 3.1, 0}, {-1, 0.1, 0}, {0, true});
  ASSERT_TRUE(down.found()) << down.reason;  // it leaves the lift on the side of the island
  EXPECT_LT(down.points[down.legs.back().first + 1].x(), 2);
}

TEST(WalkBodies, ADoorIsOpenedWhenTheAvatarComesToIt) {
  for (const BodyKind kind : {BodyKind::hinged, BodyKind::sliding}) {
    BodyFixture fixture(makeDoorModel({}, kind));
    fixture.order("ann", spawnAt({0.5, 0, 0}));
    fixture.order("ann", Walk{{{11, 0, 0}}, 1.4, {"door"}});
    fixture.runTicks(10);
    EXPECT_EQ(fixture.getBody("door").drive.jointPosition, 0) << "it is far away";
    const Notice end = runToNotice(fixture);
    EXPECT_EQ(end.kind, Notice::Kind::arrived) << end.text;
  }
}

TEST(WalkBodies, ADoorThatClosesBeforeTheAvatarIsThroughIsOpenedAgain) {
  BodyFixture fixture(makeDoorModel(0.1));
  fixture.submit({"door", BodyCommand::Action::open, 0, 0, std::nullopt});
  fixture.order("ann", spawnAt({1, 0, 0}));
  fixture.order("ann", Walk{{{11, 0, 0}}, 0.7, {"door"}});
  const Notice end = runToNotice(fixture);
  EXPECT_EQ(end.kind, Notice::Kind::arrived) << end.text;
  fixture.runTicks(3 * 60);
  EXPECT_EQ(fixture.getBody("door").drive.jointPosition, 0) << "no avatar holds it any more";
}

TEST(WalkBodies, ADoorThatIsShutInFrontOfTheAvatarIsOpenedAgain) {
  BodyFixture fixture(makeDoorModel({}));
  fixture.order("ann", spawnAt({1, 0, 0}));
  fixture.order("ann", Walk{{{11, 0, 0}}, 1.4, {"door"}});
  Notice end;
  bool isShut = false;
  for (int tick = 0; tick < 60 * 60 && end.kind != Notice::Kind::arrived; ++tick) {
    if (!isShut && fixture.getBody("door").drive.jointPosition == kQuarter) {
      fixture.submit({"door", BodyCommand::Action::close, 0, 0, std::nullopt});
      isShut = true;
    }
    for (const Notice& notice : fixture.step().notices) end = notice;
  }
  EXPECT_TRUE(isShut);
  EXPECT_EQ(end.kind, Notice::Kind::arrived) << end.text;
}

TEST(WalkBodies, ADoorThatIsClosedAgainAndAgainBlocksTheWalk) {
  BodyFixture fixture(makeDoorModel({}));
  fixture.order("ann", spawnAt({1, 0, 0}));
  fixture.order("ann", Walk{{{11, 0, 0}}, 1.4, {"door"}});
  Notice end;
  for (int tick = 0; tick < 60 * 60 && end.kind != Notice::Kind::blocked; ++tick) {
    if (fixture.getBody("door").drive.jointPosition > 0.3)
      fixture.submit({"door", BodyCommand::Action::close, 0, 0, std::nullopt});
    for (const Notice& notice : fixture.step().notices) end = notice;
  }
  ASSERT_EQ(end.kind, Notice::Kind::blocked);
  EXPECT_EQ(end.obstacle, fixture.getBody("door").id);
  EXPECT_NE(end.text.find("3 commands"), std::string::npos) << end.text;
  EXPECT_LT(fixture.getFeet("ann").x(), 6);
}

TEST(WalkBodies, UnknownDoorsAndStopsAreRefused) {
  BodyFixture fixture(makeTowerModel());
  const auto refuse = [&](Walk walk) {
    walk.waypoints = {{5, 0, 0}};
    return submitAvatarCommand(fixture.world, {"ann", walk, 0}).value_or("accepted");
  };
  EXPECT_NE(refuse({{}, 1, {"gate"}}).find("opens[0]: body: no body named 'gate'"),
            std::string::npos);
  EXPECT_NE(refuse({{}, 1, {"lift"}}).find("not a door"), std::string::npos);
  EXPECT_NE(refuse({{}, 1, {}, {{0, "lift", 2}}}).find("rides[0]: level is 2"), std::string::npos);
  EXPECT_NE(refuse({{}, 1, {}, {{1, "lift", 0}}}).find("rides[0].waypoint is 1"),
            std::string::npos);
  EXPECT_EQ(refuse({{}, 1, {}, {{0, "lift", 1}}}), "accepted");
}

/// Of an agent of the default size.
std::shared_ptr<const AvatarShape> makeAgentShape() {
  const NavigationAgent agent;
  return makePrismShape(agent.radius, agent.height, agent.height, {});
}

TEST(Doors, ThoseOnAPathAreFoundOpenOrClosed) {
  const auto scene = std::make_shared<const Scene>(makeDoorModel({}));
  const auto open = makeSnapshotWithOpenDoors(scene, {});
  EntityIndex index(scene);
  const std::vector<Vec3> points{{1, 0, 0}, {4, 0, 0}, {8, 0, 0}, {11, 0, 0}};
  for (const auto& [snapshot, isClosed] :
       {std::pair(open, false), std::pair(World(scene).snapshot(), true)}) {
    const auto doors = findDoorsOnPath(index, {}, *snapshot, *makeAgentShape(), points);
    ASSERT_EQ(doors.size(), 1u);
    EXPECT_EQ(doors[0].point, 1u);
    EXPECT_NEAR(doors[0].distance, 5.98 - 0.3 - 1, 0.02);
    EXPECT_EQ(doors[0].isInTheWay, isClosed);
    EXPECT_NEAR(doors[0].secondsToOpen, isClosed ? kQuarter : 0, 1e-9);
  }
  EXPECT_TRUE(findDoorsOnPath(index, {}, *open, *makeAgentShape(), {{1, 0, 0}, {4, 0, 2}}).empty());
  // After a fall of 5 m, 1 m of it across, the distance counts the metre.
  const std::vector<Vec3> fall{{0, 5, 0}, {1, 0, 0}, {4, 0, 0}, {8, 0, 0}};
  const std::vector<PathLeg> legs{{PathLeg::Kind::drop, 0, 1, 1, kNoBody},
                                  {PathLeg::Kind::walk, 1, 7, 5, kNoBody}};
  const auto doors = findDoorsOnPath(index, {}, *open, *makeAgentShape(), fall, legs);
  ASSERT_EQ(doors.size(), 1u);
  EXPECT_NEAR(doors[0].distance, 1 + 5.98 - 0.3 - 1, 0.02);
}

TEST(Doors, LeavesOnOneLineOpenTogether) {
  const std::vector<DoorOnPath> doors{{0, 1, 2, 1.5, true}, {1, 1, 2, 2, true}, {2, 3, 5, 4, true}};
  EXPECT_FALSE(isLastOnLine(doors, 0));
  EXPECT_TRUE(isLastOnLine(doors, 1));
  EXPECT_TRUE(isLastOnLine(doors, 2));
}

TEST(Doors, OfOneLineAreListedAsTheyAreMet) {
  // The second leaf of the model stands 2 m before the first one.
  Model model = makeDoorModel({});
  const Model other = makeBoxModel({{"gate", {3.98, 0.01, -2.9}, {4.02, 2, 2.9}}});
  model.meshes.push_back(other.meshes[0]);
  model.objects.push_back(other.objects[0]);
  model.objects.back().meshes = {static_cast<std::uint32_t>(model.meshes.size() - 1)};
  BodySpec gate = makeBodySpec("gate", BodyKind::sliding, {4});
  gate.axis = Vec3::UnitY();
  gate.high = 2.1;
  model.bodies.push_back(gate);
  const auto scene = std::make_shared<const Scene>(std::move(model));
  EntityIndex index(scene);
  const auto doors = findDoorsOnPath(index, {}, *World(scene).snapshot(), *makeAgentShape(),
                                     {{1, 0, 0}, {11, 0, 0}});
  ASSERT_EQ(doors.size(), 2u);
  EXPECT_EQ(doors[0].body, 1u);
  EXPECT_NEAR(doors[0].distance, 3.98 - 0.3 - 1, 0.02);
  EXPECT_NEAR(doors[1].distance, 5.98 - 0.3 - 1, 0.02);
}

TEST(Doors, ADoorAjarIsWhereItStands) {
  // It has opened by a quarter turn less than half: its closed pose is met before its leaf.
  Model model = makeDoorModel({});
  const auto scene = std::make_shared<const Scene>(std::move(model));
  World world(scene);
  submitBodyCommand(world, {"door", BodyCommand::Action::open, 0, 0, std::nullopt});
  EntityIndex index(scene);
  // Walks along the wall, past the closed leaf's hinge side, and then through the open leaf's arc.
  for (int tick = 0; tick < 600; ++tick) tickWorld(world);
  const std::vector<Vec3> points{{5, 0, 0}, {6.2, 0, 0}, {8, 0, -0.49}};
  const auto doors = findDoorsOnPath(index, {}, *world.snapshot(), *makeAgentShape(), points);
  ASSERT_EQ(doors.size(), 1u);
  EXPECT_TRUE(doors[0].isInTheWay);
  EXPECT_EQ(doors[0].point, 1u) << "on the second line, though its closed pose is on the first";
  EXPECT_GT(doors[0].distance, 1.2);
}

}  // namespace
}  // namespace enfilade::scene::testing
