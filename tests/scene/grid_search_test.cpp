// Walks on a grid: around corners and low objects, out of somewhere, and out of the swing of a
// door.
#include "scene/navigation/walk/grid_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "scene/navigation/doors.hpp"
#include "scene/navigation/shape_separation.hpp"
#include "scene/navigation/walk/level_detours.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

/// A wall of 4 m at x = 2, between z = -2 and z = 2, on a floor.
Model wallModel() {
  return boxModel({{"floor", {-3, -0.2, -5}, {7, 0, 5}}, {"wall", {1.9, 0, -2}, {2.1, 2.5, 2}}});
}

TEST(GridSearch, AWayAroundAWallIsPulledTight) {
  const World world(std::make_shared<const Scene>(wallModel()));
  Walker walker(world.data(), {});
  const Vec3 from(0, 0, 0), to(4, 0, 0);
  GridSearch search{0.12, 3, 100'000};
  const auto path = findGridPath(walker, from, to, search);
  ASSERT_TRUE(path);
  EXPECT_LT(search.maxWalks, 100'000u);
  std::vector<Vec3> places = shortenPath(walker, *path, Shortcuts::all);
  const double before = computeLength(places);
  pullTight(walker, places);
  EXPECT_LT(computeLength(places), before);
  // Around corners at 0.3 m from the ends of the wall.
  const double shortest = 2 * std::hypot(1.9, 2.3) + 0.2;
  EXPECT_GE(computeLength(places), shortest - 0.4);
  EXPECT_LT(computeLength(places), 1.03 * shortest);
  for (std::size_t i = 1; i < places.size(); ++i) {
    walker.returnTo(places[i - 1]);
    EXPECT_EQ(walker.walkTo(places[i]).kind, WalkOutcome::Kind::arrived) << i;
  }
}

TEST(GridSearch, TheClosestWantedPlaceIsFound) {
  const World world(std::make_shared<const Scene>(wallModel()));
  Walker walker(world.data(), {});
  GridSearch search{0.1, 2, 10'000};
  const auto path = findGridPathOut(
      walker, {0, 0, 0}, {[](const Vec3& at) { return at.x() < -0.95 || at.z() > 1.45; }}, search);
  ASSERT_TRUE(path);
  EXPECT_NEAR(path->back().x(), -1, 1e-6);
  EXPECT_NEAR(computeLength(*path), 1, 1e-6);
  search.maxWalks = 10'000;
  EXPECT_FALSE(
      findGridPathOut(walker, {0, 0, 0}, {[](const Vec3& at) { return at.x() > 2; }}, search))
      << "the wall is in between, and its ends are farther than the margin";
}

TEST(GridSearch, APathOutLeadsTowardsAPointAndOverOpenPlacesAlone) {
  const World world(std::make_shared<const Scene>(wallModel()));
  Walker walker(world.data(), {});
  const auto isAside = [](const Vec3& at) { return std::abs(at.z()) > 1.45; };
  for (const double side : {-1.0, 1.0}) {
    GridSearch search{0.1, 2, 10'000};
    const auto path =
        findGridPathOut(walker, {0, 0, 0}, {isAside, {}, Vec3(0, 0, side * 4)}, search);
    ASSERT_TRUE(path);
    EXPECT_NEAR(path->back().z(), 1.5 * side, 1e-6);
  }
  GridSearch search{0.1, 2, 10'000};
  const auto isOpen = [](const Vec3& at) { return at.z() > -0.35; };
  const auto path = findGridPathOut(walker, {0, 0, 0}, {isAside, isOpen, Vec3(0, 0, -4)}, search);
  ASSERT_TRUE(path);
  EXPECT_NEAR(path->back().z(), 1.5, 1e-6) << "the path to the other side is closed";
}

/// A bed on a floor, low enough to step onto it, between x = 2 and x = 4.
Model bedModel(double minZ) {
  return boxModel({{"floor", {-3, -0.2, -5}, {9, 0, 5}}, {"bed", {2, 0, minZ}, {4, 0.25, 5}}});
}

TEST(LevelDetours, TheEdgeOfALowObjectIsWalkedAround) {
  const World world(std::make_shared<const Scene>(bedModel(0.2)));
  Walker walker(world.data(), {});
  const Vec3 from(0, 0, 0), to(6, 0, 0);
  const FeetTravel over = measureTravel(walker, from, to);
  ASSERT_GT(over.climb, 0.45) << "the line leads over the edge of the bed";
  std::vector<Vec3> places{from, to};
  BumpList bumps;
  ASSERT_TRUE(goAroundBumps(walker, places, bumps));
  EXPECT_TRUE(bumps.empty());
  EXPECT_EQ(places.front(), from);
  EXPECT_EQ(places.back(), to);
  FeetTravel around;
  for (std::size_t i = 1; i < places.size(); ++i) {
    ASSERT_TRUE(walks(walker, places[i - 1], places[i], 1e-3)) << i;
    around.length += walker.travel().length;
    around.climb += walker.travel().climb;
  }
  EXPECT_LT(around.climb, 0.01);
  EXPECT_LT(around.length, 1.01 * (2 * std::hypot(1.9, 0.11) + 2.2));
}

TEST(LevelDetours, AnObjectWithALongWayAroundItIsWalkedOver) {
  const World world(std::make_shared<const Scene>(bedModel(-1.5)));
  Walker walker(world.data(), {});
  const Vec3 from(0, 0, 0), to(6, 0, 0);
  std::vector<Vec3> places{from, to};
  BumpList bumps;
  EXPECT_FALSE(goAroundBumps(walker, places, bumps));
  EXPECT_EQ(bumps.size(), 1U);
  EXPECT_EQ(places, (std::vector<Vec3>{from, to}));
  const double around = 2 * std::hypot(1.7, 1.8) + 2.6;
  EXPECT_LT(measureTravel(walker, from, to).length, around);
}

TEST(GridSearch, AShortcutOverALowObjectIsNotTakenIfTheFeetMoveFarther) {
  const World world(std::make_shared<const Scene>(bedModel(0.2)));
  Walker walker(world.data(), {});
  const std::vector<Vec3> around{{0, 0, 0}, {2, 0, -0.15}, {4, 0, -0.15}, {6, 0, 0}};
  const std::vector<Vec3> places = shortenPath(walker, around, Shortcuts::all);
  double climb = 0;
  for (std::size_t i = 1; i < places.size(); ++i)
    climb += measureTravel(walker, places[i - 1], places[i]).climb;
  EXPECT_LT(climb, 0.01);
  EXPECT_TRUE(walks(walker, around.front(), around.back(), 1e-3)) << "the shortcut can be walked";
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

}  // namespace
}  // namespace enfilade::scene::testing
