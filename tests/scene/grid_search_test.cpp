// Walks on a grid: out of the swing of a door, around corners, and onto narrow places without mesh.
#include "scene/navigation/walk/grid_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "scene/navigation/doors.hpp"
#include "scene/navigation/ghost.hpp"
#include "scene/navigation/mesh/tile_mesh.hpp"
#include "scene/navigation/path_finder.hpp"
#include "scene/navigation/reasons.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

double measureLength(const std::vector<Vec3>& points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

/// A wall of 4 m at x = 2, between z = -2 and z = 2, on a floor.
Model wallModel() {
  return boxModel({{"floor", {-3, -0.2, -5}, {7, 0, 5}}, {"wall", {1.9, 0, -2}, {2.1, 2.5, 2}}});
}

TEST(GridSearch, AWayAroundAWallIsPulledTight) {
  const World world(std::make_shared<const Scene>(wallModel()));
  Walker walker(world.data(), {});
  const Vec3 from(0, 0, 0), to(4, 0, 0);
  GridSearch search{0.12, 3, 100'000};
  const auto way = findGridPath(walker, from, to, search);
  ASSERT_TRUE(way);
  EXPECT_LT(search.maxWalks, 100'000u);
  std::vector<Vec3> places = shortenPath(walker, *way, Shortcuts::all);
  const double before = measureLength(places);
  pullTight(walker, places);
  EXPECT_LT(measureLength(places), before);
  // Around corners at 0.3 m from the ends of the wall.
  const double shortest = 2 * std::hypot(1.9, 2.3) + 0.2;
  EXPECT_GE(measureLength(places), shortest - 0.4);
  EXPECT_LT(measureLength(places), 1.03 * shortest);
  for (std::size_t i = 1; i < places.size(); ++i) {
    walker.returnTo(places[i - 1]);
    EXPECT_EQ(walker.walkTo(places[i]).kind, WalkOutcome::Kind::arrived) << i;
  }
}

TEST(GridSearch, TheClosestWantedPlaceIsFound) {
  const World world(std::make_shared<const Scene>(wallModel()));
  Walker walker(world.data(), {});
  GridSearch search{0.1, 2, 10'000};
  const auto way = findGridPathOut(
      walker, {0, 0, 0}, {[](const Vec3& at) { return at.x() < -0.95 || at.z() > 1.45; }}, search);
  ASSERT_TRUE(way);
  EXPECT_NEAR(way->back().x(), -1, 1e-6);
  EXPECT_NEAR(measureLength(*way), 1, 1e-6);
  search.maxWalks = 10'000;
  EXPECT_FALSE(
      findGridPathOut(walker, {0, 0, 0}, {[](const Vec3& at) { return at.x() > 2; }}, search))
      << "the wall is in between, and its ends are farther than the margin";
}

TEST(GridSearch, AWayOutLeadsTowardsAPointAndOverOpenPlacesAlone) {
  const World world(std::make_shared<const Scene>(wallModel()));
  Walker walker(world.data(), {});
  const auto isAside = [](const Vec3& at) { return std::abs(at.z()) > 1.45; };
  for (const double side : {-1.0, 1.0}) {
    GridSearch search{0.1, 2, 10'000};
    const auto way =
        findGridPathOut(walker, {0, 0, 0}, {isAside, {}, Vec3(0, 0, side * 4)}, search);
    ASSERT_TRUE(way);
    EXPECT_NEAR(way->back().z(), 1.5 * side, 1e-6);
  }
  GridSearch search{0.1, 2, 10'000};
  const auto isOpen = [](const Vec3& at) { return at.z() > -0.35; };
  const auto way = findGridPathOut(walker, {0, 0, 0}, {isAside, isOpen, Vec3(0, 0, -4)}, search);
  ASSERT_TRUE(way);
  EXPECT_NEAR(way->back().z(), 1.5, 1e-6) << "the way to the other side is closed";
}

TEST(DoorSwing, TouchesWhatTheDoorMeetsAtAnyAngle) {
  constexpr double kQuarter = 1.5707963267948966;
  Model model = boxModel(
      {{"floor", {0, -0.2, -3}, {12, 0, 3}}, {"leaf", {5.98, 0.01, -0.49}, {6.02, 2, 0.49}}});
  BodySpec door = bodySpec("door", BodyKind::hinged, {1});
  door.anchor = {6, 0, -0.49};
  door.high = kQuarter;
  model.bodies.push_back(door);
  const auto scene = std::make_shared<const Scene>(std::move(model));
  const World world(scene);
  EntityIndex index(scene);
  const NavigationAgent agent;
  const Snapshot closed = *world.snapshot();
  DoorSwing swing(index, {}, closed, agent, 0);
  const auto prism = makePrismShape(agent.radius, agent.height, agent.height, {});
  int touched = 0, clear = 0;
  for (double x = 4.5; x <= 7.5; x += 0.15) {
    for (double z = -1.8; z <= 1.5; z += 0.15) {
      double closest = 1e9;
      for (int i = 0; i <= 90; ++i) {
        Snapshot at = closed;
        auto bodies = std::make_shared<std::vector<BodySnapshot>>(*closed.bodies);
        const BodySpec& spec = scene->model().bodies[0];
        (*bodies)[0].jointPosition = kQuarter * i / 90;
        (*bodies)[0].pose =
            computeBodyPose(spec, computeJointPose(spec, (*bodies)[0].jointPosition));
        at.bodies = bodies;
        const auto separation =
            computeSeparationFromShape(index, at, prism, {x, 0, z}, (*bodies)[0].id);
        ASSERT_TRUE(separation);
        closest = std::min(closest, separation->distance);
      }
      const bool isTouched = swing.touches({x, 0, z});
      EXPECT_TRUE(isTouched || closest >= 0.005) << x << " " << z;
      EXPECT_FALSE(isTouched && closest > 0.03) << x << " " << z;
      ++(isTouched ? touched : clear);
    }
  }
  EXPECT_GT(touched, 30);
  EXPECT_GT(clear, 100);
}

/// The mesh ends at x = 3 and the floor at x = 8.
TEST(PathFinder, PlacesWithoutAMeshAreConnectedWithIt) {
  const World whole(std::make_shared<const Scene>(boxModel({{"floor", {0, -0.2, 0}, {8, 0, 6}}})));
  const World part(std::make_shared<const Scene>(boxModel({{"floor", {0, -0.2, 0}, {3, 0, 6}}})));
  const NavigationAgent agent;
  const TileGrid grid = makeTileGrid(whole.scene().bounds(), agent);
  const auto makeMesh = [&](Clearance clearance) {
    std::vector<TileMesh> tiles;
    for (int z = 0; z < grid.tilesZ; ++z)
      for (int x = 0; x < grid.tilesX; ++x)
        tiles.push_back(std::move(buildTileMeshes(part.data(), agent, grid, x, z, {clearance})[0]));
    return NavigationMesh(grid, std::move(tiles));
  };
  NavigationMesh ample = makeMesh(Clearance::ample), scarce = makeMesh(Clearance::scarce);
  const UnobstructedMesh unobstructed =
      makeUnobstructedMesh(makeMesh(Clearance::none), makeMesh(Clearance::scarce));
  Walker walker(whole.data(), agent);
  const PathFinder finder{whole.data(), agent,
                          walker,       ample,
                          scarce,       [&]() -> const UnobstructedMesh& { return unobstructed; }};
  const Vec3 onMesh(1, 0, 1), offMesh(4, 0, 3);
  for (const auto& [from, to] : {std::pair(onMesh, offMesh), std::pair(offMesh, onMesh)}) {
    const NavigationPath path = findPath(finder, from, to);
    ASSERT_TRUE(path.found()) << path.reason;
    EXPECT_NEAR(path.length, (to - from).norm(), 0.05);
  }
  EXPECT_FALSE(findPath(finder, onMesh, {7, 0, 3}).found()) << "it is too far from the mesh";
}

}  // namespace
}  // namespace enfilade::scene::testing
