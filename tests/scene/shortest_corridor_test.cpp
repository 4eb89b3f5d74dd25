// Shortest corridors: no line through sampled points of the portals is shorter.
#include "scene/navigation/mesh/shortest_corridor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <random>
#include <utility>
#include <vector>

#include "scene/navigation/mesh/tile_mesh.hpp"
#include "scene/navigation/path_search.hpp"
#include "tests/scene/random_room.hpp"

namespace enfilade::scene::testing {
namespace {

double computeHorizontal(const Vec3& a, const Vec3& b) {
  return std::hypot(b.x() - a.x(), b.z() - a.z());
}

double measureLine(const std::vector<Vec3>& points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i)
    length += computeHorizontal(points[i - 1], points[i]);
  return length;
}

/// The shortest of all lines that bend at 17 points of each portal.
double measureShortestSampled(const NavigationMesh& mesh, const MeshPoint& from,
                              const MeshPoint& to) {
  struct Place {
    Vec3 point = Vec3::Zero();
    std::uint32_t polygon = 0;  ///< that a line enters here
  };
  std::vector<Place> places{{from.point, from.polygon}};
  std::vector<std::vector<std::size_t>> leaving(mesh.polygonCount());
  for (std::uint32_t polygon = 0; polygon < mesh.polygonCount(); ++polygon) {
    for (const Portal& portal : mesh.portals(polygon)) {
      for (int i = 0; i <= 16 && !portal.closed; ++i) {
        leaving[polygon].push_back(places.size());
        places.push_back({portal.low + i / 16.0 * (portal.high - portal.low), portal.to});
      }
    }
  }
  std::vector<double> length(places.size(), std::numeric_limits<double>::infinity());
  std::priority_queue<std::pair<double, std::size_t>, std::vector<std::pair<double, std::size_t>>,
                      std::greater<>>
      open;
  length[0] = 0;
  open.push({0, 0});
  double best = std::numeric_limits<double>::infinity();
  while (!open.empty()) {
    const auto [here, index] = open.top();
    open.pop();
    if (here > length[index]) continue;
    const Place place = places[index];
    if (place.polygon == to.polygon)
      best = std::min(best, here + computeHorizontal(place.point, to.point));
    for (const std::size_t next : leaving[place.polygon]) {
      const double through = here + computeHorizontal(place.point, places[next].point);
      if (!(through < length[next])) continue;
      length[next] = through;
      open.push({through, next});
    }
  }
  return best;
}

TEST(ShortestCorridor, NoSampledLineIsShorter) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0.5, 11.5);
  int found = 0, shorter = 0;
  for (int room = 0; room < 6; ++room) {
    const NavigationMesh mesh = makeRoomMesh(random);
    for (int pair = 0; pair < 40; ++pair) {
      const auto from = mesh.findNearest({place(random), 0, place(random)}, {0.3, 0.5, 0.3});
      const auto to = mesh.findNearest({place(random), 0, place(random)}, {0.3, 0.5, 0.3});
      if (!from || !to || from->polygon == to->polygon) continue;
      const auto corridor =
          findShortestCorridor(mesh, *from, *to, std::numeric_limits<double>::infinity());
      const auto proposed = mesh.findCorridor(*from, *to);
      ASSERT_EQ(corridor.has_value(), proposed.has_value());
      if (!corridor) continue;
      ++found;
      EXPECT_LE(corridor->cost, measureShortestSampled(mesh, *from, *to) + 1e-9);
      // Detour's line within the corridor has this length, but for its binary32.
      EXPECT_NEAR(corridor->cost, measureLine(mesh.straighten(*corridor, from->point, to->point)),
                  1e-3);
      EXPECT_FALSE(findShortestCorridor(mesh, *from, *to, 0.999 * corridor->cost));
      const double line = measureLine(mesh.straighten(*proposed, from->point, to->point));
      EXPECT_LE(corridor->cost, line + 1e-3);
      shorter += corridor->cost < 0.98 * line;
    }
  }
  EXPECT_GT(found, 100);
  EXPECT_GT(shorter, 3) << "A* through the middles found the shortest each time";
}

TEST(ShortestCorridor, AClosedPortalIsNotPassed) {
  std::mt19937 random(3);
  NavigationMesh mesh = makeRoomMesh(random);
  const auto from = mesh.findNearest({0.6, 0, 0.6}, {1, 0.5, 1});
  const auto to = mesh.findNearest({11.4, 0, 11.4}, {1, 0.5, 1});
  ASSERT_TRUE(from && to);
  double before = 0;
  for (int closed = 0;; ++closed) {
    ASSERT_LT(closed, 1000) << "closed portals are passed";
    const auto corridor =
        findShortestCorridor(mesh, *from, *to, std::numeric_limits<double>::infinity());
    ASSERT_EQ(corridor.has_value(), mesh.findCorridor(*from, *to).has_value());
    if (!corridor) {
      EXPECT_GT(closed, 0);
      break;
    }
    EXPECT_GE(corridor->cost, before - 1e-9);
    EXPECT_LE(corridor->cost, measureShortestSampled(mesh, *from, *to) + 1e-9) << closed;
    before = corridor->cost;
    const auto& polygons = corridor->polygons;
    for (std::size_t i = 1; i < polygons.size(); ++i) {
      for (const Portal& portal : mesh.portals(polygons[i - 1]))
        EXPECT_FALSE(portal.closed && portal.to == polygons[i]);
    }
    const std::size_t middle = polygons.size() / 2;
    mesh.closePortal(polygons[middle - 1], polygons[middle]);
    EXPECT_EQ(mesh.countFailure(polygons[middle - 1], polygons[middle]), 1);
    EXPECT_EQ(mesh.countFailure(polygons[middle], polygons[middle - 1]), 2);
    mesh.forgetFailures(polygons[middle - 1], polygons[middle]);
    EXPECT_EQ(mesh.countFailure(polygons[middle - 1], polygons[middle]), 1);
  }
}

TEST(ShortestCorridor, PortalsAcrossAnOpenFloorEndOnItsBoundaryAlone) {
  NavigationMesh mesh = makeMesh(World(makeBoxScene({{"floor", {0, -0.2, 0}, {12, 0, 12}}})), {});
  const auto isOnBoundary = [](const Vec3& end) {
    return std::min({end.x(), end.z(), 12 - end.x(), 12 - end.z()}) < 0.5;
  };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> within;
  for (std::uint32_t polygon = 0; polygon < mesh.polygonCount(); ++polygon)
    for (const Portal& portal : mesh.portals(polygon)) {
      EXPECT_EQ(portal.lowIsOnBoundary, isOnBoundary(portal.low)) << portal.low.transpose();
      EXPECT_EQ(portal.highIsOnBoundary, isOnBoundary(portal.high)) << portal.high.transpose();
      if (!portal.lowIsOnBoundary) within.emplace_back(polygon, portal.to);
    }
  ASSERT_FALSE(within.empty()) << "the floor has several tiles";
  const auto [from, to] = within.front();
  mesh.closePortal(from, to);
  for (const Portal& portal : mesh.portals(from))
    EXPECT_TRUE(portal.to != to || (portal.lowIsOnBoundary && portal.highIsOnBoundary));
}

TEST(ShortestCorridor, AProvedPathForgetsTheFailuresOfItsPortals) {
  std::mt19937 random(3);
  const World world(makeBoxScene(makeRoom(random)));
  const NavigationAgent agent;
  NavigationMesh mesh = makeMesh(world, agent), scarce = makeMesh(world, agent);
  const Vec3 from(0.6, 0.01, 0.6), to(11.4, 0.01, 11.4);
  const auto start = mesh.findNearest(from, {1, 0.5, 1}), goal = mesh.findNearest(to, {1, 0.5, 1});
  ASSERT_TRUE(start && goal);
  const auto corridor =
      findShortestCorridor(mesh, *start, *goal, std::numeric_limits<double>::infinity());
  ASSERT_TRUE(corridor && corridor->polygons.size() > 2);
  const auto& polygons = corridor->polygons;
  for (std::size_t i = 1; i < polygons.size(); ++i)
    for (int failures = 1; failures < 4; ++failures)
      mesh.countFailure(polygons[i - 1], polygons[i]);
  Walker walker(world.data(), agent);
  const PathFinder finder{world.data(), agent, walker, mesh, scarce, nullptr};
  ASSERT_TRUE(findPath(finder, from, to).found());
  int forgotten = 0;
  for (std::size_t i = 1; i < polygons.size(); ++i)
    forgotten += mesh.countFailure(polygons[i - 1], polygons[i]) == 1;
  EXPECT_GT(forgotten, 0);
}

}  // namespace
}  // namespace enfilade::scene::testing
