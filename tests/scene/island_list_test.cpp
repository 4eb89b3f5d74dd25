// Islands of navigation: those inside of solids do not count, and roofs are found but not drawn.
// Places by name lie on the island of the start. Neighbours are found across a gap.
#include "scene/navigation/island_list.hpp"

#include <gtest/gtest.h>

#include <random>

#include "scene/navigation/navigation.hpp"
#include "tests/scene/body_fixture.hpp"
#include "tests/scene/roofed_rooms.hpp"

namespace enfilade::scene::testing {
namespace {

TEST(Islands, ARoofIsFoundAndNoPlacesAreDrawnOnIt) {
  Navigation navigation(makeBoxScene(makeRoofedRooms(0.5)), {}, {});
  const std::vector<Island> islands = navigation.islands();
  ASSERT_EQ(islands.size(), 3u);
  EXPECT_TRUE(islands[0].isRoof);
  EXPECT_NEAR(islands[0].place.y(), 3.2, 0.01);
  for (const std::size_t room : {1, 2}) {
    EXPECT_FALSE(islands[room].isRoof);
    EXPECT_TRUE(islands[room].isDrawn);
  }
  std::mt19937_64 random(3);
  int left = 0;
  for (int i = 0; i < 100; ++i) {
    const auto place = navigation.findRandomPlace(random, {});
    ASSERT_TRUE(place);
    EXPECT_LT(place->y(), 1);
    left += place->x() < 5 ? 1 : 0;
  }
  EXPECT_GT(left, 25) << "both rooms";
  EXPECT_LT(left, 75);
  EXPECT_GT(navigation.findRandomPlace(random, {.island = 0}).value_or(Vec3::Zero()).y(), 3);
}

TEST(Islands, TheGroundIsNoRoofAndAloneARoofIsDrawn) {
  auto boxes = makeRoofedRooms(1);
  boxes.push_back({"ground", {-10, -0.4, -10}, {20, -0.2, 10}});
  boxes.push_back({"terrace", {14, -0.2, -5}, {19, 2, 5}});  // nothing below it
  Navigation house(makeBoxScene(boxes), {}, {});
  for (const Island& island : house.islands())
    EXPECT_EQ(island.isRoof, island.place.y() > 3) << island.place.transpose();
  Navigation plate(makeBoxScene({{"plate", {0, 0, 0}, {0.9, 0.2, 0.9}}}), {}, {.radius = 0.1});
  ASSERT_EQ(plate.islands().size(), 1u);
  EXPECT_LT(plate.islands()[0].area, 1);
  EXPECT_TRUE(plate.islands()[0].isDrawn) << "there is no other";
}

TEST(Islands, TheInsideOfASolidDoesNotCount) {
  Navigation navigation(makeBoxScene({makeFloorBox(), {"block", {-9, 0, -9}, {9, 3, 0}}}), {}, {});
  const NavigationReport report = navigation.report();
  ASSERT_EQ(report.islandAreas.size(), 2u) << "the floor, and the top of the block";
  EXPECT_NEAR(report.area, report.islandAreas[0] + report.islandAreas[1], 1e-9);
  EXPECT_FALSE(navigation.findIsland({0, 0.1, -5}));
  std::mt19937_64 random(3);
  EXPECT_FALSE(navigation.findRandomPlace(random, {.near = Vec3(0, 0, -5), .maxDistance = 2}));
  const NavigationMap map = navigation.drawMap(0.5, 0);
  const auto column = static_cast<std::size_t>((0 - map.corner.x()) / map.cell);
  const auto row = [&](double z) { return static_cast<std::size_t>((z - map.corner.z()) / 0.5); };
  EXPECT_EQ(map.cells[row(-5) * map.width + column], 0);
  EXPECT_EQ(map.cells[row(5) * map.width + column], 1);
}

TEST(Islands, NeighboursAreFoundAcrossTheGap) {
  Navigation navigation(makeBoxScene(makeRoofedRooms(0.58)), {}, {});
  const auto neighbours = navigation.findIslandNeighbours(2);
  ASSERT_EQ(neighbours.size(), 1u) << "the roof is too high";
  EXPECT_EQ(neighbours[0].number, 1u);
  EXPECT_LT(neighbours[0].distance, 1.2);
  EXPECT_LT((neighbours[0].from.x() - 5) * (neighbours[0].to.x() - 5), 0) << "on both sides";
  EXPECT_TRUE(navigation.snap(neighbours[0].from, 0.01));
  EXPECT_TRUE(navigation.snap(neighbours[0].to, 0.01));
}

TEST(Islands, AStoreyAsAGoalIsOnTheIslandOfTheStart) {
  Model model = makeBoxModel(makeRoofedRooms(0.5));
  model.storeys.push_back({"Ground", "", 0});
  const auto scene = std::make_shared<const Scene>(std::move(model));
  Navigation navigation(scene, {}, {});
  const auto storey = findNamedPlaces(*scene, "storey:Ground", 1);
  ASSERT_EQ(storey.size(), 1u);
  for (const Vec3& start : {Vec3(2, 0, 1), Vec3(8, 0, -1)}) {
    const auto place = navigation.findPlaceIn(storey, start);
    ASSERT_TRUE(place);
    EXPECT_EQ(navigation.findIsland(*place), navigation.findIsland(start));
    EXPECT_TRUE(navigation.findPath(start, *place).found());
  }
  EXPECT_TRUE(navigation.findPlaceIn(storey, Vec3(5, 3.2, 0))) << "elsewhere, if not there";
}

TEST(Islands, OfRoomsWithOneNameTheOneOnTheIslandOfTheStartIsMeant) {
  Model model = makeBoxModel(makeRoofedRooms(0.5));
  for (const double x : {2.0, 8.0}) {
    Space room;
    room.name = "Bath";
    room.box = {{x - 1, 0, -1}, {x + 1, 2.4, 1}};
    model.spaces.push_back(room);
  }
  const auto scene = std::make_shared<const Scene>(std::move(model));
  Navigation navigation(scene, {}, {});
  const auto baths = findNamedPlaces(*scene, "Bath", 1);
  ASSERT_EQ(baths.size(), 2u);
  for (const Vec3& start : {Vec3(1.5, 0, 1.5), Vec3(8.5, 0, -1.5)}) {
    const auto place = navigation.findPlaceIn(baths, start);
    ASSERT_TRUE(place);
    EXPECT_NEAR(place->x(), start.x() < 5 ? 2 : 8, 0.2);
    EXPECT_TRUE(navigation.findPath(start, *place).found());
  }
  const auto onRoof = navigation.findPlaceIn(baths, Vec3(7, 3.2, 0));
  ASSERT_TRUE(onRoof);
  EXPECT_NEAR(onRoof->x(), 8, 0.2) << "none is on that island: the closest";
  const auto first = navigation.findPlaceIn(baths);
  ASSERT_TRUE(first);
  EXPECT_NEAR(first->x(), 2, 0.2);
}

TEST(Islands, ABodyIsAPlaceWhereItStandsNow) {
  Model model = makeBoxModel({makeFloorBox(), {"crates/mesh7", {-9, 0, -0.5}, {-8, 1, 0.5}}});
  BodySpec crate = makeBodySpec("yard/crate", BodyKind::sliding, {1});
  crate.axis = Vec3::UnitX();
  crate.high = 14;
  model.bodies.push_back(crate);
  const auto scene = std::make_shared<const Scene>(std::move(model));
  Navigation navigation(scene, {}, {});
  EXPECT_TRUE(findNamedPlaces(*scene, "object:yard/crate", 1).empty());
  for (const char* name : {"yard/crate", "body:yard/crate", "crates/mesh7"}) {
    const auto named = findNamedPlaces(*scene, name, 1);
    ASSERT_EQ(named.size(), 1u) << name;
    const auto place = navigation.findPlaceIn(named);
    ASSERT_TRUE(place) << name;
    EXPECT_LT(place->x(), -6.5);
  }
  World world(scene);
  submitBodyCommand(world, {"yard/crate", BodyCommand::Action::open, 0, 0, std::nullopt});
  for (int tick = 0; tick < 60 * 60; ++tick) tickWorld(world);
  navigation.update(*world.snapshot());
  const auto moved = navigation.findPlaceIn(findNamedPlaces(*scene, "yard/crate", 1));
  ASSERT_TRUE(moved);
  EXPECT_GT(moved->x(), 3.5) << "the crate ends at x = 5";
}

}  // namespace
}  // namespace enfilade::scene::testing
