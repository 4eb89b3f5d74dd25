// Walks on a grid: around corners and low objects, out of somewhere, and out of the swing of a
// door.
#include "scene/navigation/walk/grid_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "scene/navigation/doors.hpp"
#include "scene/navigation/mesh_paths.hpp"
#include "scene/navigation/walk/shape_separation.hpp"
#include "scene/navigation/walk/shorter_parts.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

/// A wall of 4 m at x = 2, between z = -2 and z = 2, on a floor.
Model makeWallModel() {
  return makeBoxModel(
      {{"floor", {-3, -0.2, -5}, {7, 0, 5}}, {"wall", {1.9, 0, -2}, {2.1, 2.5, 2}}});
}

TEST(GridSearch, AWayAroundAWallIsPulledTight) {
  const World world(std::make_shared<const Scene>(makeWallModel()));
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
  const World world(std::make_shared<const Scene>(makeWallModel()));
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
  const World world(std::make_shared<const Scene>(makeWallModel()));
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

/// The bed is low enough to step onto it, between x = 2 and x = 4.
constexpr double kBedHeight = 0.25;

Model makeBedModel(double minZ) {
  return makeBoxModel(
      {{"floor", {-3, -0.2, -5}, {15, 0, 5}}, {"bed", {2, 0, minZ}, {4, kBedHeight, 5}}});
}

FeetTravel walkAlong(Walker& walker, const std::vector<Vec3>& places) {
  FeetTravel sum;
  for (std::size_t i = 1; i < places.size(); ++i) {
    EXPECT_TRUE(walks(walker, places[i - 1], places[i], 1e-3)) << i;
    sum.across += walker.travel().across;
    sum.climb += walker.travel().climb;
  }
  return sum;
}

TEST(LevelDetours, TheEdgeOfALowObjectIsWalkedAround) {
  const World world(std::make_shared<const Scene>(makeBedModel(0.2)));
  Walker walker(world.data(), {});
  const Vec3 from(0, 0, 0), to(6, 0, 0);
  std::vector<Vec3> places{from, to};
  ASSERT_GT(walkAlong(walker, places).climb, 0.45) << "the line leads over the edge of the bed";
  const auto bump = findBump(walker, places);
  ASSERT_TRUE(bump);
  EXPECT_GT(bump->y(), 0.5 * kBedHeight);
  BumpSearch search{20'000};
  EXPECT_EQ(goAroundBumps(walker, places, search).size(), 1U);
  EXPECT_TRUE(search.known.empty());
  EXPECT_LT(search.maxWalks, 20'000U);
  EXPECT_EQ(places.front(), from);
  EXPECT_EQ(places.back(), to);
  const FeetTravel around = walkAlong(walker, places);
  EXPECT_LT(around.climb, 0.01);
  EXPECT_LT(around.length(), 1.01 * (2 * std::hypot(1.9, 0.11) + 2.2));
  EXPECT_FALSE(findBump(walker, places));
}

TEST(LevelDetours, EachBumpOfALegIsWalkedAround) {
  Model model = makeBoxModel({{"floor", {-3, -0.2, -5}, {15, 0, 5}},
                              {"bed", {2, 0, 0.2}, {4, kBedHeight, 5}},
                              {"other", {7, 0, -5}, {9, kBedHeight, -0.2}}});
  const World world(std::make_shared<const Scene>(std::move(model)));
  Walker walker(world.data(), {});
  std::vector<Vec3> places{{0, 0, 0}, {12, 0, 0}};
  ASSERT_GT(walkAlong(walker, places).climb, 0.9);
  BumpSearch search{40'000};
  EXPECT_EQ(goAroundBumps(walker, places, search).size(), 2U);
  EXPECT_LT(walkAlong(walker, places).climb, 0.01);
  EXPECT_EQ(places.back(), Vec3(12, 0, 0));
}

/// Feet that go over the bed move 0.5 m up and down.
TEST(LevelDetours, AnObjectIsWalkedOverIfTheWayAroundItIsLonger) {
  const Vec3 from(0, 0, 0), to(6, 0, 0);
  // The prism is 0.3 m wide to each side, so the way around leads over z = minZ - 0.3.
  for (const double minZ : {-1.5, -0.95, 0.0}) {
    const World world(std::make_shared<const Scene>(makeBedModel(minZ)));
    Walker walker(world.data(), {});
    std::vector<Vec3> places{from, to};
    const double over = walkAlong(walker, places).length();
    const double around = 2 * std::hypot(1.75, minZ - 0.3) + 2.5;
    BumpSearch search{40'000};
    const bool isReplaced = !goAroundBumps(walker, places, search).empty();
    EXPECT_EQ(isReplaced, around < over) << minZ << ": " << over << " over it, " << around;
    EXPECT_EQ(search.known.size(), isReplaced ? 0U : 1U);
    const std::size_t left = search.maxWalks;
    EXPECT_TRUE(goAroundBumps(walker, places, search).empty());
    EXPECT_EQ(search.maxWalks, left) << "a known bump is searched again";
  }
}

TEST(LevelDetours, AnObjectOfTwoStepsIsWalkedAround) {
  const World world(std::make_shared<const Scene>(
      makeBoxModel({{"floor", {-3, -0.2, -5}, {15, 0, 5}},
                    {"podium", {2, 0, -0.65}, {5, 0.28, 5}},
                    {"upper step", {3, 0.28, -0.65}, {4, 0.52, 5}}})));
  Walker walker(world.data(), {});
  std::vector<Vec3> places{{-2, 0, 0}, {8, 0, 0}};
  const double over = walkAlong(walker, places).length();
  ASSERT_NEAR(over, 10 + 2 * 0.52, 0.01);
  BumpSearch search{40'000};
  EXPECT_EQ(goAroundBumps(walker, places, search).size(), 1U);
  EXPECT_LT(walkAlong(walker, places).length(), over - 0.6);
}

TEST(Bends, AreReplacedByShorterWays) {
  const World world(std::make_shared<const Scene>(
      makeBoxModel({{"floor", {-3, -0.2, -5}, {15, 0, 5}}, {"wall", {2, 0, 0}, {2.4, 2, 5}}})));
  Walker walker(world.data(), {});
  // The prism needs 0.3 m around the end of the wall. This path keeps 0.4 m more.
  std::vector<Vec3> places{{0.5, 0, 0.5}, {2.2, 0, -0.7}, {4, 0, 0.5}};
  const double before = walkAlong(walker, places).length();
  std::size_t maxWalks = 20'000;
  EXPECT_TRUE(shortenBends(walker, places, 0.05, maxWalks));
  EXPECT_LT(maxWalks, 20'000U);
  EXPECT_EQ(places.front(), Vec3(0.5, 0, 0.5));
  EXPECT_EQ(places.back(), Vec3(4, 0, 0.5));
  const double shortest = std::hypot(1.2, 0.8) + 1 + std::hypot(1.3, 0.8);
  EXPECT_GT(before, 1.05 * shortest);
  EXPECT_LT(walkAlong(walker, places).length(), 1.01 * shortest);
}

TEST(Bends, ThatAreNeededStay) {
  const World world(std::make_shared<const Scene>(
      makeBoxModel({{"floor", {-3, -0.2, -5}, {15, 0, 5}}, {"wall", {2, 0, 0}, {2.4, 2, 5}}})));
  Walker walker(world.data(), {});
  const std::vector<Vec3> around{{0.5, 0, 0.5}, {2, 0, -0.31}, {2.4, 0, -0.31}, {4, 0, 0.5}};
  std::vector<Vec3> places = around;
  std::size_t maxWalks = 20'000;
  EXPECT_FALSE(shortenBends(walker, places, 0.05, maxWalks));
  EXPECT_EQ(places, around);
  EXPECT_LT(maxWalks, 20'000U) << "no bend was searched";
  places = {{0, 0, -2}, {6, 0, -2}};
  std::size_t walksLeft = 20'000;
  EXPECT_FALSE(shortenBends(walker, places, 0.05, walksLeft));
  EXPECT_EQ(walksLeft, 20'000U) << "a straight path is searched";
}

TEST(LevelDetours, AVersionOfAPathThatLeadsAroundIsPreferred) {
  const World world(std::make_shared<const Scene>(makeBedModel(0.2)));
  Walker walker(world.data(), {});
  const std::vector<Vec3> over{{0, 0, 0}, {6, 0, 0}};
  const std::vector<Vec3> around{{0, 0, 0}, {2, 0, -0.15}, {4, 0, -0.15}, {6, 0, 0}};
  const std::vector<Vec3> far{{0, 0, 0}, {3, 0, -4.5}, {6, 0, 0}};
  Proof noSearch(0);
  NavigationPath path =
      proveVersions(walker, std::array{over, around}, Versions::untilLevel, noSearch);
  EXPECT_EQ(path.points, around);
  EXPECT_EQ(path.bumpClimb, 0);
  EXPECT_FALSE(noSearch.bump);
  EXPECT_NEAR(path.feetLength, path.length, 0.01);
  path = proveVersions(walker, std::array{over, far}, Versions::untilLevel, noSearch);
  EXPECT_EQ(path.points, over) << "the path of the feet around is longer";
  EXPECT_NEAR(path.bumpClimb, 2 * kBedHeight, 0.01);
  EXPECT_NEAR(path.feetLength, 6 + 2 * kBedHeight, 0.01);
  EXPECT_TRUE(noSearch.bump);
  path = proveVersions(walker, std::array{far, around}, Versions::untilLevel, noSearch);
  EXPECT_EQ(path.points, far) << "the first one is level";
  path = proveVersions(walker, std::array{far, around}, Versions::all, noSearch);
  EXPECT_EQ(path.points, around);
}

TEST(GridSearch, AShortcutOverALowObjectIsNotTakenIfTheFeetMoveFarther) {
  const World world(std::make_shared<const Scene>(makeBedModel(0.2)));
  Walker walker(world.data(), {});
  const std::vector<Vec3> around{{0, 0, 0}, {2, 0, -0.15}, {4, 0, -0.15}, {6, 0, 0}};
  const std::vector<Vec3> places = shortenPath(walker, around, Shortcuts::all);
  EXPECT_LT(walkAlong(walker, places).climb, 0.01);
  EXPECT_TRUE(walks(walker, around.front(), around.back(), 1e-3)) << "the shortcut can be walked";
}

/// The walker steps down from a box at x = 1.3. It does not stop at the third place, which is in
/// the air.
TEST(GridSearch, PlacesWithinAFallAreLeftOutOfATightPath) {
  const World world(makeBoxScene({makeFloorBox(), {"box", {-2, 0, -2}, {1, kBedHeight, 2}}}));
  Walker walker(world.data(), {});
  const double offset = world.settings().contactOffset, top = kBedHeight + offset;
  const std::vector<Vec3> bent{{0, top, 0}, {1.2, top, 0.2}, {1.32, 0.12, 0.22}, {3, offset, 0}};
  const std::vector<Vec3> straight{bent.front(), bent.back()};
  EXPECT_EQ(shortenPath(walker, bent, Shortcuts::tight), straight);
  EXPECT_GT(shortenPath(walker, bent, Shortcuts::all).size(), 2U) << "it may become shorter";
}

TEST(GridSearch, CornersAreCut) {
  // A pillar with eight sides, around which the shortest path has several corners.
  std::vector<NamedBox> boxes{{"floor", {-3, -0.2, -5}, {7, 0, 5}}};
  for (int i = 0; i < 8; ++i) {
    const double x = 2 + 0.4 * std::cos(0.785398 * i), z = 0.4 * std::sin(0.785398 * i);
    boxes.push_back({"pillar/" + std::to_string(i), {x - 0.1, 0, z - 0.1}, {x + 0.1, 2, z + 0.1}});
  }
  const World world(makeBoxScene(boxes));
  Walker walker(world.data(), {});
  std::vector<Vec3> places{{0, 0, 0}, {2, 0, -1}, {4, 0, 0}};
  pullTight(walker, places);
  EXPECT_GE(places.size(), 4U) << "one corner cannot be the shortest path around it";
  // The agent keeps 0.3 m from boxes within 0.55 m of the axis: tangents of 0.7 to 0.85 m.
  const auto measureAround = [](double radius) {
    return 2 * std::sqrt(4 - radius * radius) + 2 * radius * std::asin(radius / 2);
  };
  EXPECT_GT(measureLength(walker, places), measureAround(0.7));
  EXPECT_LT(measureLength(walker, places), 1.01 * measureAround(0.85));
}

TEST(DoorSwing, TouchesWhatTheDoorMeetsAtAnyAngle) {
  constexpr double kQuarter = 1.5707963267948966;
  Model model = makeBoxModel(
      {{"floor", {0, -0.2, -3}, {12, 0, 3}}, {"leaf", {5.98, 0.01, -0.49}, {6.02, 2, 0.49}}});
  BodySpec door = makeBodySpec("door", BodyKind::hinged, {1});
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
