// Navigation meshes as bytes: the tiles of an agent's size in a scene, where its bodies stood, and
// the gaps that were tried.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "scene/navigation/mesh/tile_mesh.hpp"

namespace enfilade::scene {

struct MeshFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The paths across a gap of the boundary that was tried: a TriedGaps entry.
struct SavedGap {
  std::array<double, 6> key{};  ///< coordinates of both places
  std::vector<Vec3> there, back;
  double reach = 0;  ///< metres
};

struct SavedMeshes {
  std::vector<TileMesh> ample, scarce;  ///< by tile of the grid
  std::vector<collision::Pose>
      bodies;  ///< in the order of Model::bodies: where the tiles have them
  std::vector<SavedGap> gaps;
};

/// `world`: what the meshes belong to. The bytes depend on the machine's byte order alone.
std::vector<std::uint8_t> saveMeshes(const WorldData& world, const NavigationAgent& agent,
                                     const SavedMeshes& meshes);

/// Reads meshes of this scene, these settings and this size. Throws MeshFileError if they belong to
/// others, or are damaged. A tile that was read is safe to use, whatever the bytes are. Loaded gap
/// paths may be unwalkable; they are proved before use.
SavedMeshes loadMeshes(const WorldData& world, const NavigationAgent& agent, const TileGrid& grid,
                       std::span<const std::uint8_t> bytes);

}  // namespace enfilade::scene
