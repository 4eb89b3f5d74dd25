// Converts assimp's scene to a Model. Runs only in the import worker.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/file/import_options.hpp"
#include "scene/import/file/model_format.hpp"
#include "scene/import/gltf/encoding/gltf_nodes.hpp"

namespace enfilade::scene {

/// The file, its metadata and the user's options, which override the metadata.
struct ConvertInput {
  std::filesystem::path file;
  ModelFormat format = ModelFormat::gltf;
  FileMetadata metadata;
  ImportOptions options;
  std::string gltfJson;                 ///< of a glTF file with bodies, with all nodes
  GltfNodeTree gltfNodes;               ///< of a glTF file
  std::vector<std::size_t> gltfMeshes;  ///< of a glTF file: PlainGltf::meshes
  bool joined = true;                   ///< see AssimpOutput::joined
  Vec3 shift = Vec3::Zero();  ///< subtracted before assimp read the file; file units and axes
};

/// Throws ImportError if no usable triangle remains. `input.metadata` must belong to the same file.
Model convertScene(const aiScene& scene, const std::vector<FileMaterial>& materials,
                   const ConvertInput& input, const ImportProgress& progress);

}  // namespace enfilade::scene
