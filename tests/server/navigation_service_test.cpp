// Replies of the navigation service: the reasons that separate islands, formats of maps, goals on
// the start's island. Meshes that the next start of the program finds in the cache.
#include "server/navigation/navigation_service.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "server/base/load_scene.hpp"
#include "server/messages/world_messages.hpp"
#include "server/navigation/go_order.hpp"
#include "tests/scene/body_fixture.hpp"
#include "tests/scene/roofed_rooms.hpp"
#include "tests/server/program_fixture.hpp"

namespace enfilade::server::testing {
namespace {

using scene::Vec3;

struct Answered {
  v1::NavigationReply reply;
  v1::Error error;
  std::vector<std::uint8_t> attachment;
};

Answered ask(const std::shared_ptr<const scene::Scene>& scene, const v1::NavigationQuery& query) {
  NavigationService service(scene);
  Answered answered;
  auto answer = service.answer(query, {scene::World(scene).snapshot(), {}}, answered.attachment);
  if (auto* error = std::get_if<v1::Error>(&answer))
    answered.error = *error;
  else
    answered.reply = std::get<v1::NavigationReply>(std::move(answer));
  return answered;
}

/// Roofed rooms with a gap, in which a door leaf may stand. `more`: further objects.
scene::Model makeRoomsWithDoor(double gap, bool hasDoor,
                               const std::vector<scene::testing::NamedBox>& more = {}) {
  std::vector<scene::testing::NamedBox> boxes = scene::testing::makeRoofedRooms(gap, 6);
  if (hasDoor)
    boxes.push_back({"leaf", {5.98, 0.01, -0.5 * gap + 0.01}, {6.02, 2.9, 0.5 * gap - 0.01}});
  boxes.insert(boxes.end(), more.begin(), more.end());
  scene::Model model = scene::testing::makeBoxModel(boxes);
  if (!hasDoor) return model;
  scene::BodySpec door = scene::testing::makeBodySpec("door", scene::BodyKind::hinged, {8});
  door.anchor = {6, 0, -0.5 * gap + 0.01};
  door.low = -1.5;
  model.bodies.push_back(door);
  return model;
}

v1::NavigationQuery makeIslandsQuery() {
  v1::NavigationQuery query;
  query.mutable_islands()->set_count(10);
  return query;
}

TEST(NavigationService, IslandsNameTheGapThatSeparatesThem) {
  const auto scene = std::make_shared<const scene::Scene>(makeRoomsWithDoor(0.58, false));
  const v1::NavigationReply reply = ask(scene, makeIslandsQuery()).reply;
  ASSERT_EQ(reply.islands_size(), 3);
  EXPECT_TRUE(reply.islands(0).roof());
  EXPECT_FALSE(reply.islands(0).drawn());
  EXPECT_FALSE(reply.islands(0).has_path());
  const std::uint32_t others[] = {0, 2, 1};
  for (int i = 1; i < 3; ++i) {
    const v1::NavigationIsland& room = reply.islands(i);
    EXPECT_TRUE(room.drawn());
    EXPECT_EQ(room.to(), others[i]);
    EXPECT_FALSE(room.path().found());
    EXPECT_TRUE(room.path().obstacle_name().starts_with("wall/")) << room.path().reason();
    EXPECT_NEAR(room.path().clear_width(), 0.58, 0.02) << room.path().reason();
  }
}

TEST(NavigationService, IslandsNameTheClosedDoorBetweenThem) {
  const auto scene = std::make_shared<const scene::Scene>(makeRoomsWithDoor(1, true));
  const v1::NavigationReply reply = ask(scene, makeIslandsQuery()).reply;
  ASSERT_EQ(reply.islands_size(), 3);
  for (int i = 1; i < 3; ++i) {
    EXPECT_EQ(reply.islands(i).path().obstacle_name(), "door") << reply.islands(i).path().reason();
    EXPECT_NE(reply.islands(i).path().reason().find("'door' is closed"), std::string::npos);
  }
}

/// A closed door is remembered as the reason, until something else stands in the doorway.
TEST(NavigationService, AClosedDoorIsTheReasonAsLongAsAWayLeadsThroughIt) {
  scene::Model model = makeRoomsWithDoor(1, true, {{"gate", {5.5, -3, -0.6}, {5.6, -1, 0.6}}});
  scene::BodySpec gate = scene::testing::makeBodySpec("gate", scene::BodyKind::lift, {9});
  gate.stops = {0, 3.01};
  gate.high = 3.01;
  model.bodies.push_back(gate);
  const auto scene = std::make_shared<const scene::Scene>(std::move(model));
  NavigationService service(scene);
  scene::World world(scene);
  v1::NavigationQuery query;
  query.mutable_path()->mutable_from()->mutable_point()->set_x(2);
  query.mutable_path()->add_to()->mutable_point()->set_x(9);
  const auto askReason = [&] {
    std::vector<std::uint8_t> attachment;
    const auto answer = service.answer(query, {world.snapshot(), world.settings()}, attachment);
    return std::get<v1::NavigationReply>(answer).paths(0).obstacle_name();
  };
  const auto moveGate = [&](std::uint32_t level) {
    scene::BodyCommand command;
    command.body = "gate";
    command.action = scene::BodyCommand::Action::moveToLevel;
    command.level = level;
    submitBodyCommand(world, std::move(command));
    for (int i = 0; i < 600; ++i) tickWorld(world);
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(askReason(), "door");
  moveGate(1);
  EXPECT_NE(askReason(), "door") << "the gate stands behind it";
  moveGate(0);
  EXPECT_EQ(askReason(), "door");
}

/// With doors as they are: closed, half open, open.
TEST(NavigationService, ADoorAsItIsIsAReasonOrALeg) {
  const auto scene = std::make_shared<const scene::Scene>(makeRoomsWithDoor(1, true));
  NavigationService service(scene);
  scene::World world(scene);
  v1::Command go;
  go.mutable_go();
  v1::NavigationQuery query;
  query.mutable_path()->mutable_from()->mutable_point()->set_x(2);
  query.mutable_path()->add_to()->mutable_point()->set_x(9);
  v1::NavigationReply reply;
  const auto askWithDoorAt = [&](double angle) {
    using Action = scene::BodyCommand::Action;
    submitBodyCommand(world, {"door", Action::moveTo, angle, 0, std::nullopt});
    for (int tick = 0; tick < 300; ++tick) tickWorld(world);
    std::vector<std::uint8_t> attachment;
    reply = std::get<v1::NavigationReply>(
        service.answer(query, {world.snapshot(), world.settings()}, attachment));
    return reply.paths(0);
  };
  const v1::NavigationPath closed = askWithDoorAt(0);
  EXPECT_EQ(closed.reason(),
            "the door 'door' is closed (clear width when open: 0.964 m): open it, or ask with open "
            "doors");
  EXPECT_NEAR(closed.obstacle_at().x(), 5.98 - 0.3, 0.03);
  EXPECT_NEAR(closed.clear_width(), 0.964, 1e-3);
  const v1::NavigationPath half = askWithDoorAt(-0.5);
  EXPECT_EQ(half.obstacle_name(), "door");
  EXPECT_GT(half.obstacle_at().x(), 4.5);
  EXPECT_LT(half.obstacle_at().x(), 5.98);
  EXPECT_EQ(
      half.reason(),
      "the door 'door' is not open far enough (clear width when open: 0.964 m): open it, or ask "
      "with open doors");
  const v1::NavigationPath open = askWithDoorAt(-1.5);
  ASSERT_EQ(open.legs_size(), 1) << open.reason();
  EXPECT_EQ(open.legs(0).kind(), v1::NavigationLeg::KIND_DOOR);
  EXPECT_EQ(open.legs(0).name(), "door");
  EXPECT_NEAR(open.seconds(), open.length() / scene::Walk().speed, 1e-9) << "it waits for no door";
  EXPECT_EQ(open.doors_size(), 0);
  for (const auto doors :
       {v1::NavigationQuery::DOORS_AS_THEY_ARE, v1::NavigationQuery::DOORS_OPEN}) {
    go.mutable_go()->set_doors(doors);
    const auto order = std::get<v1::Command>(makeGoOrder(go, reply));
    EXPECT_EQ(order.walk().opens_size(), doors == v1::NavigationQuery::DOORS_OPEN ? 1 : 0);
    EXPECT_TRUE(order.walk().from_floor());
  }
}

/// Paths that bend at the jamb, and one that begins at the leaf.
TEST(NavigationService, ADoorHasItsOpenWidthOnEachPath) {
  const auto scene = std::make_shared<const scene::Scene>(makeRoomsWithDoor(1, true));
  const scene::World world(scene);
  for (const auto& [from, to] : {std::pair(scene::Vec3(2, 0, 2.4), scene::Vec3(9, 0, 2.4)),
                                 std::pair(scene::Vec3(5.4, 0, 2.4), scene::Vec3(6.6, 0, -2.4)),
                                 std::pair(scene::Vec3(9, 0, -2.4), scene::Vec3(2, 0, 2.4)),
                                 std::pair(scene::Vec3(5.67, 0, 0), scene::Vec3(9, 0, 0))}) {
    NavigationService service(scene);
    v1::NavigationQuery query;
    *query.mutable_path()->mutable_from()->mutable_point() = toProto(from);
    *query.mutable_path()->add_to()->mutable_point() = toProto(to);
    std::vector<std::uint8_t> attachment;
    const auto reply = std::get<v1::NavigationReply>(
        service.answer(query, {world.snapshot(), world.settings()}, attachment));
    EXPECT_EQ(reply.paths(0).obstacle_name(), "door") << from.transpose();
    EXPECT_NEAR(reply.paths(0).clear_width(), 0.96, 0.03) << from.transpose();
  }
}

/// A share that falls begins the next meshes.
TEST(NavigationService, MeshesOfReasonsAndOfMovedBodiesReportProgress) {
  const auto scene = std::make_shared<const scene::Scene>(
      makeRoomsWithDoor(1, true, {{"yard", {12, -0.2, -3}, {50, 0, 3}}}));  // of several tiles
  NavigationService service(scene);
  scene::World world(scene);
  v1::NavigationQuery query;
  query.mutable_path()->mutable_from()->mutable_point()->set_x(2);
  query.mutable_path()->add_to()->mutable_point()->set_x(9);
  const auto countMeshes = [&] {
    std::vector<double> shares;
    std::vector<std::uint8_t> attachment;
    const auto report = [&](double share) { shares.push_back(share); };
    service.answer(query, {world.snapshot(), world.settings(), report}, attachment);
    int count = 0;
    for (std::size_t i = 0; i < shares.size(); ++i)
      if (i == 0 || shares[i] < shares[i - 1]) ++count;
    return count;
  };
  EXPECT_EQ(countMeshes(), 4)
      << "its own, for the reason, and with open doors: loaded and repaired";
  EXPECT_EQ(countMeshes(), 0);
  submitBodyCommand(world, {"door", scene::BodyCommand::Action::open, 0, 0, std::nullopt});
  for (int tick = 0; tick < 300; ++tick) tickWorld(world);
  EXPECT_EQ(countMeshes(), 1) << "around the door";
}

TEST(NavigationService, AStoreyIsReachedFromBothSidesOfAClosedDoor) {
  scene::Model model = makeRoomsWithDoor(1, true);
  model.storeys.push_back({"Ground", "", 0});
  const auto scene = std::make_shared<const scene::Scene>(std::move(model));
  for (const double x : {2.0, 8.0}) {
    v1::NavigationQuery query;
    query.mutable_path()->mutable_from()->mutable_point()->set_x(x);
    query.mutable_path()->add_to()->set_name("storey:Ground");
    const Answered answered = ask(scene, query);
    ASSERT_EQ(answered.reply.paths_size(), 1) << answered.error.message();
    EXPECT_TRUE(answered.reply.paths(0).found()) << answered.reply.paths(0).reason();
  }
}

/// Of two halls the closer one is outside, where no door leads.
TEST(NavigationService, ANamedGoalBehindAClosedDoorHasTheDoorAsReason) {
  scene::Model model = makeRoomsWithDoor(1, true, {{"terrace", {-6, -0.3, -2}, {-2, 0, 2}}});
  for (const double x : {-4.0, 8.5}) {
    scene::Space& hall = model.spaces.emplace_back();
    hall.name = "Hall";
    hall.box = {scene::Vec3(x - 1, 0, -1), scene::Vec3(x + 1, 2.5, 1)};
  }
  v1::NavigationQuery query;
  query.mutable_path()->mutable_from()->mutable_point()->set_x(2);
  query.mutable_path()->add_to()->set_name("room:Hall");
  const Answered answered = ask(std::make_shared<const scene::Scene>(std::move(model)), query);
  ASSERT_EQ(answered.reply.paths_size(), 1) << answered.error.message();
  EXPECT_EQ(answered.reply.paths(0).obstacle_name(), "door") << answered.reply.paths(0).reason();
}

TEST(NavigationService, StepsAreListedIfTheyAreAskedFor) {
  const auto scene = scene::testing::makeBoxScene(
      {{"floor", {0, -0.2, 0}, {4, 0, 4}}, {"kerb", {4, -0.2, 0}, {8, 0.15, 4}}});
  v1::NavigationQuery query;
  *query.mutable_path()->mutable_from()->mutable_point() = toProto(scene::Vec3(1, 0, 2));
  *query.mutable_path()->add_to()->mutable_point() = toProto(scene::Vec3(7, 0.15, 2));
  EXPECT_EQ(ask(scene, query).reply.paths(0).steps_size(), 0);
  query.mutable_path()->set_steps(true);
  const v1::NavigationPath path = ask(scene, query).reply.paths(0);
  ASSERT_TRUE(path.found()) << path.reason();
  ASSERT_EQ(path.steps_size(), 1);
  EXPECT_NEAR(path.steps(0).rise(), 0.15, 2e-3);
  EXPECT_NEAR(path.steps(0).at().x(), 4, 0.4);
  EXPECT_FALSE(path.has_narrowest_at());
}

TEST(NavigationService, APathIsKeptForAnAvatarOfItsWorld) {
  const auto scene = std::make_shared<const scene::Scene>(makeRoomsWithDoor(1, false));
  scene::World world(scene);
  scene::Spawn spawn;
  spawn.position = {2, 0.1, 1};
  submitAvatarCommand(world, {"ann", spawn, 0});
  scene::Walk walk;
  walk.waypoints = {{4, 0, 1}};
  submitAvatarCommand(world, {"ann", walk, 0});
  for (int tick = 0; tick < 30; ++tick) tickWorld(world);
  v1::NavigationQuery query;
  query.mutable_path()->mutable_from()->set_avatar("ann");
  *query.mutable_path()->add_to()->mutable_point() = toProto(scene::Vec3(9, 0, -1));
  query.mutable_path()->set_keep(true);
  NavigationService service(scene);
  NavigationState state{world.snapshot(), {}, {}, std::make_shared<KeptPaths>()};
  std::vector<std::uint8_t> attachment;
  const auto askPath = [&] {
    return std::get<v1::NavigationReply>(service.answer(query, state, attachment)).paths(0);
  };
  const v1::NavigationPath first = askPath();
  ASSERT_TRUE(first.found()) << first.reason();
  ASSERT_TRUE(state.keptPaths->at("ann"));
  const Vec3 searchedFrom = state.keptPaths->at("ann")->searchedFrom;
  for (int tick = 0; tick < 20; ++tick) tickWorld(world);
  state.snapshot = world.snapshot();
  const v1::NavigationPath second = askPath();
  EXPECT_EQ(state.keptPaths->at("ann")->searchedFrom, searchedFrom);
  EXPECT_LT(second.length(), first.length() - 0.3);
  query.mutable_path()->set_keep(false);
  EXPECT_NEAR(askPath().length(), second.length(), 0.02);
}

TEST(NavigationService, OnlyAWalkOfAnAvatarToOneGoalIsKept) {
  const auto scene = std::make_shared<const scene::Scene>(makeRoomsWithDoor(1, false));
  v1::NavigationQuery query;
  v1::NavigationQuery::Path& path = *query.mutable_path();
  path.set_keep(true);
  *path.mutable_from()->mutable_point() = toProto(scene::Vec3(1, 0, 2));
  *path.add_to()->mutable_point() = toProto(scene::Vec3(9, 0, -1));
  EXPECT_EQ(ask(scene, query).error.field(), "navigation.path.keep");
  path.mutable_from()->set_avatar("ann");
  EXPECT_NE(ask(scene, query).error.field(), "navigation.path.keep");
  path.set_lifts(true);
  EXPECT_EQ(ask(scene, query).error.field(), "navigation.path.keep");
  path.set_lifts(false);
  path.set_max_drop(1);
  EXPECT_EQ(ask(scene, query).error.field(), "navigation.path.keep");
  path.set_max_drop(0);
  *path.add_to() = path.to(0);
  EXPECT_EQ(ask(scene, query).error.field(), "navigation.path.keep");
}

TEST(NavigationService, MapsAreBytesBitsOrAPicture) {
  const auto scene = std::make_shared<const scene::Scene>(makeRoomsWithDoor(1, false));
  v1::NavigationQuery query;
  query.mutable_map()->set_cell(0.3);
  const Answered bytes = ask(scene, query);
  const std::size_t width = bytes.reply.map_width(), height = bytes.reply.map_height();
  ASSERT_EQ(bytes.attachment.size(), width * height);
  ASSERT_NE(width % 8, 0u) << "the last byte of a row is not full";
  query.mutable_map()->set_format(v1::NavigationQuery::Map::FORMAT_BITS);
  const std::vector<std::uint8_t> bits = ask(scene, query).attachment;
  ASSERT_EQ(bits.size(), (width + 7) / 8 * height);
  std::size_t walkable = 0;
  for (std::size_t row = 0; row < height; ++row)
    for (std::size_t column = 0; column < width; ++column) {
      const int bit = bits[row * ((width + 7) / 8) + column / 8] >> (7 - column % 8) & 1;
      EXPECT_EQ(bit, bytes.attachment[row * width + column]);
      walkable += static_cast<std::size_t>(bit);
    }
  EXPECT_GT(walkable, 100u);
  query.mutable_map()->set_format(v1::NavigationQuery::Map::FORMAT_PNG);
  const std::vector<std::uint8_t> png = ask(scene, query).attachment;
  ASSERT_GT(png.size(), 24u);
  EXPECT_EQ(std::string(png.begin() + 1, png.begin() + 4), "PNG");
  EXPECT_EQ(png[19], width);  // low bytes of the sizes in the header
  EXPECT_EQ(png[23], height);
  query.mutable_map()->set_format(static_cast<v1::NavigationQuery::Map::Format>(9));
  EXPECT_EQ(ask(scene, query).error.field(), "navigation.map.format");
  query.mutable_map()->set_tolerance(-1);
  EXPECT_EQ(ask(scene, query).error.field(), "navigation.map.tolerance");
}

/// Starts of the program that share a cache folder.
class MeshCache : public ProgramFixture {
 protected:
  void SetUp() override {
    ProgramFixture::SetUp();
    setenv("ENFILADE_CACHE", getPath("cache").c_str(), 1);
  }
  void TearDown() override { setenv("ENFILADE_CACHE", "off", 1); }

  Ended runRoute(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{"route", getPath("room.obj"), "2,0,0", "8,0,0", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Ended ended = run(arguments);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return ended;
  }
  static bool hasBuilt(const Ended& ended) {
    return ended.err.find("built in") != std::string::npos;
  }
  std::vector<std::filesystem::path> listMeshFiles() const {
    std::vector<std::filesystem::path> files;
    for (const auto& file : std::filesystem::directory_iterator(getPath("cache")))
      if (file.path().extension() == ".text") files.push_back(file.path());
    return files;
  }
  static nlohmann::json parsePoints(const Ended& ended) {
    return nlohmann::json::parse(ended.out).at("points");
  }
};

TEST_F(MeshCache, TheNextStartReadsTheMeshes) {
  const Ended first = runRoute();
  EXPECT_TRUE(hasBuilt(first)) << first.err;
  const Ended second = runRoute();
  EXPECT_FALSE(hasBuilt(second)) << second.err;
  EXPECT_EQ(parsePoints(second), parsePoints(first));
  EXPECT_TRUE(hasBuilt(runRoute({"--radius", "0.2"}))) << "another size";
  EXPECT_TRUE(hasBuilt(runRoute({"--no-cache"})));
  setenv("ENFILADE_CACHE", "off", 1);
  EXPECT_TRUE(hasBuilt(runRoute()));
}

TEST_F(MeshCache, ADamagedFileIsReportedAndBuiltAgain) {
  const Ended first = runRoute();
  ASSERT_EQ(listMeshFiles().size(), 1u);
  std::string bytes = readText(listMeshFiles()[0]);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  write(listMeshFiles()[0], bytes);
  const Ended second = runRoute();
  EXPECT_TRUE(hasBuilt(second));
  EXPECT_NE(second.err.find("damaged"), std::string::npos) << second.err;
  EXPECT_EQ(parsePoints(second), parsePoints(first));
  EXPECT_FALSE(hasBuilt(runRoute())) << "it was written again";
}

TEST_F(MeshCache, OpenDoorsHaveMeshesOfTheirOwnAndThePolicyOfSizeHolds) {
  runRoute();
  runRoute({"--doors-as-they-are"});
  EXPECT_EQ(listMeshFiles().size(), 2u);
  setenv("ENFILADE_CACHE_MB", "0", 1);
  const Ended full = runRoute({"--radius", "0.25"});
  unsetenv("ENFILADE_CACHE_MB");
  EXPECT_NE(full.err.find("the navigation meshes are not kept"), std::string::npos) << full.err;
}

}  // namespace
}  // namespace enfilade::server::testing
