// Builds the walkable polygons of one tile with Recast: solid triangles become voxels, voxels
// become polygons. The result is a proposal; walker.hpp proves paths.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/navigation/mesh/agent.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// The space that the polygons keep from obstacles.
enum class Clearance : std::uint8_t {
  ample,   ///< at least the agent's radius: nearly all paths can be walked
  scarce,  ///< less than it: contains the paths that can be walked, and some that cannot
  none     ///< for anything thinner and lower, and without bodies: shows what is in the way
};

/// The grid of tiles, scene frame, metres.
struct TileGrid {
  Vec3 origin = Vec3::Zero();  ///< lowest corner
  double height = 0;           ///< of all tiles
  double cell = 0, cellHeight = 0;
  int cellsPerTile = 0;
  int tilesX = 0, tilesZ = 0;

  double tileSize() const { return cell * cellsPerTile; }
};

TileGrid makeTileGrid(const Aabb& bounds, const NavigationAgent& agent);

/// Triangles of the solids in a box: three floats per vertex, three vertices per triangle.
std::vector<float> collectSolidTriangles(const WorldData& world, const Aabb& box, bool withBodies);

/// Flags of polygons in a tile.
inline constexpr std::uint16_t kWalkableFlag = 1;
inline constexpr std::uint16_t kUnderSkyFlag = 2;  ///< nothing solid is above most of it

/// A tile of a Detour navigation mesh, serialized; empty: nothing to walk on.
using TileMesh = std::vector<std::uint8_t>;

/// Builds a tile. Throws std::runtime_error, which names the tile, if Recast fails.
TileMesh buildTileMesh(const WorldData& world, const NavigationAgent& agent, const TileGrid& grid,
                       int tileX, int tileZ, Clearance clearance);

}  // namespace enfilade::scene
