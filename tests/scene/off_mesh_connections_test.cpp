// Off-mesh connections: paths through gaps that an agent just passes, routes of several of them,
// and places of a mesh.
#include "scene/navigation/mesh/off_mesh_connections.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "scene/navigation/connection_search.hpp"
#include "scene/navigation/navigation.hpp"
#include "tests/scene/random_room.hpp"

namespace enfilade::scene::testing {
namespace {

TEST(NavigationMesh, TheNearestPointIsWithinTheExtent) {
  std::mt19937 random(5);
  const NavigationMesh mesh = makeRoomMesh(random);
  std::uniform_real_distribution<double> place(0, 12);
  const Vec3 extent(0.05, 0.3, 0.05);
  int found = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 point(place(random), 0, place(random));
    const auto nearest = mesh.findNearest(point, extent);
    if (!nearest) continue;
    ++found;
    const Vec3 aside = (nearest->point - point).cwiseAbs();
    EXPECT_TRUE((aside.array() <= extent.array()).all()) << point.transpose();
  }
  EXPECT_GT(found, 1000);
  EXPECT_LT(found, 3900) << "pillars stand there";
}

/// Two rooms with a thin wall in between, of which a far part has a gap of this width.
std::vector<NamedBox> makeRoomsWithFarGap(double gap, double at = 21) {
  return {{"floor", {0, -0.2, 0}, {8, 0, 24}},
          {"wall/near", {3.95, 0, 0}, {4.05, 2.5, 20}},
          {"wall/thick", {3.8, 0, 20}, {4.2, 2.5, at}},
          {"wall/end", {3.8, 0, at + gap}, {4.2, 2.5, 24}}};
}

/// The closest places of both rooms are anywhere along the wall; the gap is far from most of them.
TEST(OffMeshConnections, AGapFarFromTheClosestPlacesJoinsIslands) {
  for (const double gap : {0.62, 0.59}) {
    Navigation navigation(makeBoxScene(makeRoomsWithFarGap(gap)), {}, {});
    const Vec3 left(3, 0, 2), right(5, 0, 2);
    const NavigationPath path = navigation.findPath(left, right);
    EXPECT_EQ(path.found(), gap > 0.6);
    EXPECT_EQ(navigation.islands().size(), gap > 0.6 ? 1u : 2u);
    EXPECT_EQ(navigation.findPath(right, left).found(), gap > 0.6);
    EXPECT_NEAR(path.length, gap > 0.6 ? 2 * 19.5 : 0, 1);
  }
}

/// Grids miss some of these gaps, and voxels others.
TEST(OffMeshConnections, AGapIsFoundWhereverItLiesOnTheGrid) {
  for (int shift = 0; shift < 12; ++shift) {
    Navigation navigation(makeBoxScene(makeRoomsWithFarGap(0.62, 20.95 + 0.01 * shift)), {}, {});
    EXPECT_EQ(navigation.islands().size(), 1u) << shift;
  }
}

/// The scarce mesh has no gap here, and grids miss it: straight lines alone cross it.
TEST(OffMeshConnections, AGapIsFoundAsideOfThePlacesThatFaceEachOther) {
  const NamedBox floor{"floor", {0, -0.2, 0}, {12, 0, 12}};
  const NavigationAgent agent;
  NavigationMesh scarce =
      makeMesh(World(makeBoxScene({floor, {"wall", {5.97, 0, 0}, {6.03, 2.5, 12}}})), agent);
  for (int shift = 0; shift < 25; ++shift) {
    const double gap = 5 + 0.04 * shift;
    const World world(makeBoxScene({floor,
                                    {"wall/near", {5.97, 0, 0}, {6.03, 2.5, gap}},
                                    {"wall/far", {5.97, 0, gap + 0.62}, {6.03, 2.5, 12}}}));
    NavigationMesh ample = makeMesh(world, agent);
    Walker walker(world.data(), agent);
    const IslandList islands = collectIslands(ample, walker, world.scene().bounds());
    TriedGaps tried;
    const ConnectionList list = collectConnections(
        {world.data(), agent, walker, ample, scarce, nullptr}, islands, tried, 2, {});
    EXPECT_FALSE(list.connections.empty()) << shift;
  }
}

/// A wall of 15 cm at any angle to the grid, with a gap. Its sides face each other askew.
std::shared_ptr<const Scene> makeRoomWithTurnedWall(double angle, double at, double gap) {
  Model model = makeBoxModel({{"floor", {-5, -0.2, -5}, {5, 0, 5}},
                              {"wall/a", {-8, 0, -0.075}, {at - gap / 2, 2.5, 0.075}},
                              {"wall/b", {at + gap / 2, 0, -0.075}, {8, 2.5, 0.075}}});
  for (std::size_t wall = 1; wall < 3; ++wall)
    model.objects[wall].worldFromMesh.rotate(Eigen::AngleAxisd(angle, Vec3::UnitY()));
  return std::make_shared<const Scene>(std::move(model));
}

TEST(OffMeshConnections, AGapInATurnedWallIsFoundIfItIsACentimetreWiderThanTheAgent) {
  for (const double angle : {0.08, 0.35, 1.45}) {
    for (const double at : {-0.4, 1.31}) {
      const Vec3 side = Eigen::AngleAxisd(angle, Vec3::UnitY()) * Vec3(0, 0, 2.5);
      for (const double gap : {0.61, 0.58}) {  // across its flat sides an agent is narrower
        Navigation navigation(makeRoomWithTurnedWall(angle, at, gap), {}, {});
        EXPECT_EQ(navigation.findPath(side, -side).found(), gap > 0.6)
            << angle << " " << at << " " << gap;
      }
    }
  }
}

TEST(OffMeshConnections, AnAnswerDoesNotDependOnEarlierOnes) {
  Navigation navigation(makeBoxScene(makeRoomsWithFarGap(0.61)), {}, {});
  std::mt19937 random(9);
  std::uniform_real_distribution<double> x(0.5, 3.3), z(0.5, 18);
  for (int i = 0; i < 40; ++i) {
    const Vec3 left(x(random), 0, z(random)), right(8 - x(random), 0, z(random));
    EXPECT_TRUE(navigation.findPath(left, right).found()) << i;
  }
}

/// A narrow door at the end of an alcove in each storey. It is the only gap, and those of other
/// storeys lie above and below it.
TEST(OffMeshConnections, GapsOfEachStoreyAreTried) {
  constexpr double kDoor = 0.61;
  std::vector<NamedBox> boxes;
  for (int storey = 0; storey < 3; ++storey) {
    const double y = 4.0 * storey;
    const std::string number = "/" + std::to_string(storey);
    boxes.push_back({"floor" + number, {0, y - 0.2, 0}, {8, y, 12}});
    boxes.push_back({"fill/left" + number, {2.5, y, 0}, {5.5, y + 2.5, 5}});
    boxes.push_back({"fill/right" + number, {2.5, y, 6.2}, {5.5, y + 2.5, 12}});
    boxes.push_back({"wall/left" + number, {3.9, y, 5}, {4.1, y + 2.5, 5.6 - 0.5 * kDoor}});
    boxes.push_back({"wall/right" + number, {3.9, y, 5.6 + 0.5 * kDoor}, {4.1, y + 2.5, 6.2}});
  }
  Navigation navigation(makeBoxScene(boxes), {}, {});
  for (int storey = 0; storey < 3; ++storey) {
    const double y = 4.0 * storey;
    const auto left = navigation.findIsland({1.5, y, 2}),
               right = navigation.findIsland({6.5, y, 2});
    EXPECT_TRUE(left && left == right) << storey;
  }
}

/// The wall has another thickness every metre, so that the closest places are anywhere.
TEST(OffMeshConnections, AGapInAnIrregularWallIsFound) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> thickness(0.05, 0.3), shift(0, 1);
  for (int room = 0; room < 8; ++room) {
    const double gap = 3 + 5 * shift(random);
    std::vector<NamedBox> boxes{{"floor", {0, -0.2, 0}, {6, 0, 12}}};
    const auto addWall = [&](double from, double to) {
      for (double z = from; z < to; z += 1) {
        const double half = 0.5 * thickness(random);
        boxes.push_back({"wall/" + std::to_string(boxes.size()),
                         {3 - half, 0, z},
                         {3 + half, 2.5, std::min(to, z + 1)}});
      }
    };
    addWall(0, gap);
    addWall(gap + 0.62, 12);
    Navigation navigation(makeBoxScene(boxes), {}, {});
    EXPECT_TRUE(navigation.findPath({1.5, 0, 1}, {4.5, 0, 1}).found()) << gap;
    EXPECT_EQ(navigation.findIsland({1.5, 0, 1}), navigation.findIsland({4.5, 0, 1})) << gap;
  }
}

/// Walls that are 3 m thick, with a corridor.
std::shared_ptr<const Scene> makeRoomsWithCorridor(double width, double at) {
  return makeBoxScene({{"floor", {-1, -0.2, 0}, {11, 0, 6}},
                       {"wall/near", {3.5, 0, 0}, {6.5, 2.5, at}},
                       {"wall/far", {3.5, 0, at + width}, {6.5, 2.5, 6}}});
}

TEST(OffMeshConnections, ACorridorIsFoundIfItIsACentimetreWiderThanTheAgent) {
  const Vec3 left(1, 0, 3), right(9, 0, 3);
  for (const double at : {3.0, 3.017, 3.031})
    for (const double width : {0.611, 0.58, 0.62, 0.66}) {
      Navigation navigation(makeRoomsWithCorridor(width, at), {}, {});
      const bool isWide = width > 0.6;
      EXPECT_EQ(navigation.findPath(left, right).found(), isWide) << width << " " << at;
      EXPECT_EQ(navigation.findIsland(left) == navigation.findIsland(right), isWide) << width;
    }
}

/// The corridor of two arms of 7 m is the only way. It is longer than the straight line by more
/// than 3 m.
std::shared_ptr<const Scene> makeRoomsWithBentCorridor(double width) {
  return makeBoxScene({{"floor", {-4, -0.2, -4}, {11, 0, 11}},
                       {"wall/inside", {0, 0, 0}, {7 - width, 2.5, 7}},
                       {"wall/end", {-4, 0, 7}, {0, 2.5, 11}},
                       {"wall/left", {-4, 0, -4}, {0, 2.5, -width}},
                       {"wall/below", {0, 0, -4}, {7 - width, 2.5, -width}},
                       {"wall/corner", {7 - width, 0, -4}, {7, 2.5, -width}},
                       {"wall/right", {7, 0, -4}, {11, 2.5, 7}}});
}

TEST(OffMeshConnections, ABentCorridorJoinsTheRoomsAtItsEnds) {
  const Vec3 left(-2, 0, 1.5), right(9, 0, 9);
  Navigation navigation(makeRoomsWithBentCorridor(0.62), {}, {});
  EXPECT_TRUE(navigation.findPath(left, right).found());
  EXPECT_EQ(navigation.findIsland(left), navigation.findIsland(right));
}

TEST(OffMeshConnections, GapsNearAMovedBodyAreTriedAgain) {
  TriedGaps tried;
  tried[{0, 0, 0, 1.2, 0, 0}].reach = 3;
  tried[{20, 0, 0, 20, 0, 0}].reach = 6;
  const auto boxAt = [](double x, double z) { return Aabb{{x, 0, z}, {x + 0.1, 2, z + 0.1}}; };
  const NavigationAgent agent;
  forgetGaps(tried, boxAt(0.5, 3 + agent.radius + 0.6), agent);
  forgetGaps(tried, boxAt(1.2 + 3 + agent.radius + 0.6, 0), agent);
  EXPECT_EQ(tried.size(), 2u) << "these are too far away";
  forgetGaps(tried, boxAt(0.5, 3 + agent.radius), agent);
  EXPECT_EQ(tried.size(), 1u);
  forgetGaps(tried, boxAt(20 - 6 - agent.radius, 0), agent);
  EXPECT_TRUE(tried.empty());
}

/// The bytes have the meshes and the paths across all gaps that were tried.
TEST(OffMeshConnections, ThreadsChangeNoResult) {
  for (const auto& scene :
       {makeRoomWithTurnedWall(0.35, -0.4, 0.61), makeBoxScene(makeRoomsWithFarGap(0.62)),
        makeRoomsWithCorridor(0.62, 3), makeRoomsWithBentCorridor(0.62)}) {
    Navigation built(scene, {}, {}, nullptr, 1);
    const std::vector<std::uint8_t> bytes = built.save();
    EXPECT_EQ(Navigation(scene, {}, {}, nullptr, 3).save(), bytes);
    Navigation loaded(scene, {}, {}, bytes, 3);
    EXPECT_EQ(loaded.save(), bytes);
    EXPECT_EQ(loaded.report().islandAreas, built.report().islandAreas);
  }
}

/// The tiles are the first part of the work, and the connections most of the rest.
TEST(OffMeshConnections, TheirSearchReportsProgress) {
  const auto scene = makeBoxScene(makeRoomsWithFarGap(0.61));
  std::vector<double> built, loaded;
  Navigation navigation(scene, {}, {}, nullptr, 2, [&](double share) { built.push_back(share); });
  EXPECT_TRUE(std::ranges::is_sorted(built));
  EXPECT_EQ(built.front(), 0);
  EXPECT_GT(std::ranges::count_if(built, [](double share) { return share > 0.81 && share < 0.99; }),
            10);
  EXPECT_EQ(built.back(), 1);
  Navigation(scene, {}, {}, navigation.save(), 2, [&](double share) { loaded.push_back(share); });
  EXPECT_TRUE(std::ranges::is_sorted(loaded));
  EXPECT_EQ(loaded.front(), Navigation::kTileShare);
  EXPECT_GT(loaded.size(), 10u);
  EXPECT_EQ(loaded.back(), 1);
}

OffMeshConnection makeConnection(std::uint32_t from, std::uint32_t to, const Vec3& start,
                                 const Vec3& end) {
  return {from, to, {start, end}, (end - start).norm()};
}

/// Each polygon is a part of its own.
TEST(OffMeshConnections, TheShortestRouteAvoidsExcludedConnections) {
  const ConnectionList list{
      {0, 1, 2},
      {10, 10, 10},
      {makeConnection(0, 1, {1, 0, 0}, {2, 0, 0}), makeConnection(1, 2, {3, 0, 0}, {4, 0, 0}),
       makeConnection(0, 2, {0, 0, 9}, {4, 0, 9}), makeConnection(2, 0, {4, 0, 0}, {1, 0, 0})}};
  const MeshPoint from{0, {0, 0, 0}}, to{2, {5, 0, 0}};
  std::vector<bool> excluded(4, false);
  const ConnectionRoute straight = findConnectionRoute(list, from, to, excluded);
  EXPECT_EQ(straight.connections, (std::vector<std::size_t>{0, 1}));
  EXPECT_NEAR(straight.length, 5, 1e-12);
  excluded[1] = true;
  const ConnectionRoute around = findConnectionRoute(list, from, to, excluded);
  EXPECT_EQ(around.connections, (std::vector<std::size_t>{2}));
  EXPECT_NEAR(around.length, 9 + 4 + (Vec3(5, 0, 0) - Vec3(4, 0, 9)).norm(), 1e-12);
  excluded[2] = true;
  EXPECT_TRUE(findConnectionRoute(list, from, to, excluded).connections.empty());
  EXPECT_EQ(findConnectionRoute(list, to, from, excluded).connections,
            (std::vector<std::size_t>{3}))
      << "one direction alone";
}

}  // namespace
}  // namespace enfilade::scene::testing
