// A room with pillars and walls at random places, and its navigation mesh.
#pragma once

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "scene/navigation/mesh/navigation_mesh.hpp"
#include "scene/navigation/mesh/tile_mesh.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {

/// A floor of 12 x 12 m with pillars and walls.
inline std::vector<NamedBox> makeRoom(std::mt19937& random) {
  std::uniform_real_distribution<double> place(0, 12), size(0.2, 3);
  std::vector<NamedBox> boxes{{"floor", {0, -0.2, 0}, {12, 0, 12}}};
  for (int i = 0; i < 14; ++i) {
    const double x = place(random), z = place(random);
    boxes.push_back({"pillar/" + std::to_string(i),
                     {x, 0, z},
                     {x + size(random) / (i % 3 + 1), 2.5, z + size(random) / (3 - i % 3)}});
  }
  return boxes;
}

inline NavigationMesh makeMesh(const World& world, const NavigationAgent& agent) {
  const TileGrid grid = makeTileGrid(Aabb{{0, -0.2, 0}, {12, 2.5, 12}}, agent);
  std::vector<TileMesh> tiles;
  for (int z = 0; z < grid.tilesZ; ++z)
    for (int x = 0; x < grid.tilesX; ++x)
      tiles.push_back(buildTileMesh(world.data(), agent, grid, x, z, Clearance::ample));
  return {grid, std::move(tiles)};
}

inline NavigationMesh makeRoomMesh(std::mt19937& random) {
  return makeMesh(World(makeBoxScene(makeRoom(random))), {});
}

}  // namespace enfilade::scene::testing
