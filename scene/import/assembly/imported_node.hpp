// A node of a file before it becomes an object of a Model.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// The meshes of a node may have different transforms. Metres, Y up, offset not yet removed.
struct ImportedNode {
  struct MeshInstance {
    std::uint32_t mesh;  ///< index into the meshes that accompany the nodes
    Eigen::Affine3d worldFromMesh;
  };
  Object object;  ///< without meshes and their transform; worldFromPlacement in the same frame
  std::vector<MeshInstance> instances;
};

/// Places meshes at a node; `meshes` are indices into `all`. Meshes without triangles are left out.
/// A transform that is not finite, or so large that boxes could overflow, places none and is
/// reported.
void addMeshInstances(std::span<const unsigned> meshes, const Eigen::Affine3d& worldFromNode,
                      const std::vector<Mesh>& all, ImportedNode& imported,
                      std::vector<Diagnostic>& diagnostics);

}  // namespace enfilade::scene
