// Navigation meshes as bytes: the tiles of an agent's size in a scene, and where its bodies stood.
#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "scene/navigation/mesh/tile_mesh.hpp"

namespace enfilade::scene {

struct MeshFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct SavedMeshes {
  std::vector<TileMesh> ample, scarce;  ///< by tile of the grid
  std::vector<collision::Pose>
      bodies;  ///< in the order of Model::bodies: where the tiles have them
};

/// `world`: what the meshes belong to. The bytes depend on the machine's byte order alone.
std::vector<std::uint8_t> saveMeshes(const WorldData& world, const NavigationAgent& agent,
                                     const SavedMeshes& meshes);

/// Reads meshes of this scene, these settings and this size. Throws MeshFileError if they belong to
/// others, or are damaged. A tile that was read is safe to use, whatever the bytes are.
SavedMeshes loadMeshes(const WorldData& world, const NavigationAgent& agent, const TileGrid& grid,
                       std::span<const std::uint8_t> bytes);

}  // namespace enfilade::scene
