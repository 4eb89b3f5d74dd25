// From the nodes of a file to the objects of a Model.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// A node of the file before its meshes share one transform. Metres, Y up, offset not yet removed.
struct ImportedNode {
  struct MeshInstance {
    std::uint32_t mesh;  ///< index into the meshes that accompany the nodes
    Eigen::Affine3d worldFromMesh;
  };
  Object object;  ///< without meshes and their transform; worldFromPlacement in the same frame
  std::vector<MeshInstance> instances;
};

/// Converts imported nodes to objects with one transform each and appends their meshes. Drops far
/// objects and subtracts `offset`, or an offset near the median centre of the objects. The model's
/// materials must be complete. Throws ImportError, naming `file`, if no object remains.
void finishModel(std::vector<ImportedNode> importedNodes, std::vector<Mesh> meshes,
                 const std::filesystem::path& file, const std::optional<Vec3>& offset,
                 Model& model);

}  // namespace enfilade::scene
