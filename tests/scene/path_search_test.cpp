// Paths over what is on no mesh of the agent: they are proved by a walk without a stop.
#include "scene/navigation/path_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "scene/navigation/mesh/tile_mesh.hpp"
#include "scene/navigation/navigation.hpp"
#include "scene/navigation/unreachable_reasons.hpp"
#include "scene/world/world.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene::testing {
namespace {

/// A room with pillars, from which narrow blocks of different heights lead to `farEnd`.
struct Rubble {
  std::vector<NamedBox> boxes{{"floor", {0, -0.2, 0}, {6, 0, 6}}};
  Vec3 room = Vec3::Zero(), farEnd = Vec3::Zero();
};

Rubble makeRubble(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto draw = [&] { return unit(random); };
  Rubble made;
  const auto add = [&](const Vec3& min, const Vec3& max) {
    made.boxes.push_back({"box/" + std::to_string(made.boxes.size()), min, max});
  };
  for (int i = 0; i < 4; ++i) {
    const double x = 1 + 4 * draw(), z = 1 + 4 * draw();
    const double width = 0.2 + draw(), depth = 0.2 + draw();
    add({x, 0, z}, {x + width, 2.5, z + depth});
  }
  double x = 6, top = 0;
  while (x < 11) {
    const double length = 0.15 + 0.5 * draw();
    if (draw() < 0.6) {
      const double side = draw() < 0.5 ? -1 : 1;
      top += side * (draw() < 0.5 ? 0.299 : 0.3 * draw());
    }
    const double z = 3 + 0.15 * (draw() - 0.5), half = 0.1 + 0.15 * draw();
    add({x, top - 3, z - half}, {x + length, top, z + half});
    if (draw() < 0.3) add({x, top - 3, z + 0.4}, {x + 0.1, top + 2.5, z + 0.5});
    x += length;
  }
  made.farEnd = {x - 0.1, top, 3};
  const double z = 0.5 + 5 * draw();
  made.room = {0.5 + draw(), 0, z};
  return made;
}

bool isWalked(const std::shared_ptr<const Scene>& scene, const std::vector<Vec3>& points) {
  World world(scene);
  Spawn spawn;
  spawn.position = points.front();
  Walk walk;
  walk.waypoints.assign(points.begin() + 1, points.end());
  submitAvatarCommand(world, {"walker", spawn, 0});
  submitAvatarCommand(world, {"walker", walk, 0});
  for (int tick = 0; tick < 60 * 60; ++tick)
    for (const Notice& notice : tickWorld(world).notices)
      if (notice.kind != Notice::Kind::spawned) return notice.kind == Notice::Kind::arrived;
  return false;
}

/// Each leg of the path is walked while it is sought. In one of these scenes the shortened path is
/// not walked at once, since a step succeeds or not by where the ticks begin.
TEST(PathFinder, PathsOverRubbleAreWalkedWithoutAStop) {
  int found = 0;
  for (unsigned seed = 18; seed < 21; ++seed) {
    const Rubble rubble = makeRubble(seed);
    const auto scene = makeBoxScene(rubble.boxes);
    Navigation navigation(scene, {}, {});
    for (const auto& [from, to] :
         {std::pair(rubble.room, rubble.farEnd), std::pair(rubble.farEnd, rubble.room)}) {
      const NavigationPath path = navigation.findPath(from, to);
      found += path.found() ? 1 : 0;
      EXPECT_TRUE(!path.found() || isWalked(scene, path.points)) << seed;
    }
  }
  EXPECT_GT(found, 2);
}

/// Searches of paths in a world whose meshes are those of a part of it.
class PartlyMeshed {
 public:
  PartlyMeshed(const std::vector<NamedBox>& whole, const std::vector<NamedBox>& meshed)
      : whole_(std::make_shared<const Scene>(makeBoxModel(whole))),
        meshed_(std::make_shared<const Scene>(makeBoxModel(meshed))),
        grid_(makeTileGrid(whole_.scene().bounds(), agent_)) {}

  NavigationPath find(const Vec3& from, const Vec3& to) {
    return findPath({whole_.data(), agent_, walker_, ample_, scarce_,
                     [&]() -> const UnobstructedMesh& { return unobstructed_; }},
                    from, to);
  }

 private:
  NavigationMesh makeMesh(Clearance clearance) const {
    std::vector<TileMesh> tiles;
    for (int z = 0; z < grid_.tilesZ; ++z)
      for (int x = 0; x < grid_.tilesX; ++x)
        tiles.push_back(buildTileMesh(meshed_.data(), agent_, grid_, x, z, clearance));
    return NavigationMesh(grid_, std::move(tiles));
  }

  World whole_, meshed_;
  NavigationAgent agent_;
  TileGrid grid_;
  NavigationMesh ample_ = makeMesh(Clearance::ample), scarce_ = makeMesh(Clearance::scarce);
  UnobstructedMesh unobstructed_ =
      makeUnobstructedMesh(std::make_shared<const NavigationMesh>(makeMesh(Clearance::none)),
                           makeMesh(Clearance::scarce));
  Walker walker_{whole_.data(), agent_};
};

/// The mesh ends at x = 3 and the floor at x = 13. The pillar is in the straight way.
TEST(PathSearch, PlacesWithoutAMeshAreConnectedWithIt) {
  PartlyMeshed scene({{"floor", {0, -0.2, 0}, {13, 0, 6}}, {"pillar", {3.5, 0, 1.4}, {4, 2, 2.1}}},
                     {{"floor", {0, -0.2, 0}, {3, 0, 6}}});
  const Vec3 onMesh(1, 0, 1), offMesh(4, 0, 3);
  const Vec3 behindPillar(7, 0, 3), straightOn(12, 0, 1);
  for (const Vec3& place : {offMesh, behindPillar, straightOn})
    for (const auto& [from, to] : {std::pair(onMesh, place), std::pair(place, onMesh)}) {
      const NavigationPath path = scene.find(from, to);
      ASSERT_TRUE(path.found()) << path.reason;
      const double detour = path.length - (to - from).norm();
      EXPECT_GT(detour, place == behindPillar ? 0.05 : -1e-9);  // not through the pillar
      EXPECT_LT(detour, place == behindPillar ? 0.4 : 0.05);
    }
  EXPECT_FALSE(scene.find(onMesh, {12, 0, 3}).found()) << "it is too far from the mesh";
}

/// The floor is a U. One leg has no mesh but at its end, and is wide. A search from there towards
/// the goal in the other leg uses up its walks before it turns back.
TEST(PathSearch, FromTheMiddleOfAFloorWithoutAMeshAPathLeadsToTheClosestPlaceOfTheMesh) {
  const NamedBox bottom{"bottom", {0, -0.2, -6}, {3, 0, 9}}, mesh{"leg", {3, -0.2, 6}, {14, 0, 9}};
  PartlyMeshed scene({bottom, mesh, {"other leg", {3, -0.2, -6}, {14, 0, 3}}}, {bottom, mesh});
  const Vec3 offMesh(5, 0, 0), goal(13, 0, 7.5);
  for (const auto& [from, to] : {std::pair(offMesh, goal), std::pair(goal, offMesh)}) {
    const NavigationPath path = scene.find(from, to);
    ASSERT_TRUE(path.found()) << path.reason;
    // Around the corners at (3, 3) and (3, 6), which the agent's axis passes at its radius.
    EXPECT_GT(path.length, 2.7 + 3 + 10);
    EXPECT_LT(path.length, 18);
  }
}

/// The mesh is on the floor alone. The shortest path leaves the bed obliquely, and bends at the
/// pillar.
TEST(PathSearch, FromFurnitureThePathIsShortByFeet) {
  PartlyMeshed scene({{"floor", {0, -0.2, 0}, {10, 0, 8}},
                      {"mattress", {5.5, 0, 2}, {8, 0.5, 4}},
                      {"frame", {5.3, 0, 1.8}, {8.2, 0.24, 4.2}},
                      {"pillar", {3.5, 0, 3.5}, {4, 2, 4.2}}},
                     {{"floor", {0, -0.2, 0}, {10, 0, 8}}});
  const Vec3 goal(1, 0, 5);
  for (const Vec3& start : {Vec3(7, 0.5, 3), Vec3(6.3, 0.5, 2.6), Vec3(7.5, 0.5, 3.4)})
    for (const auto& [from, to] : {std::pair(start, goal), std::pair(goal, start)}) {
      const NavigationPath path = scene.find(from, to);
      ASSERT_TRUE(path.found()) << path.reason;
      const double around = std::hypot(start.x() - 4, 4.5 - start.z()) + 0.5 + std::hypot(2.5, 0.5);
      const double below = std::hypot(start.x() - 4, 3.2 - start.z()) + 0.5 + std::hypot(2.5, 1.8);
      EXPECT_GT(path.feetLength, 0.98 * std::min(around, below) + 0.5);
      EXPECT_LT(path.feetLength, 1.01 * std::min(around, below) + 0.51) << start << " " << from;
    }
}

}  // namespace
}  // namespace enfilade::scene::testing
