// The pre-pass over glTF files: checks them, and rewrites those that assimp would not read, or not
// read right, to a GLB file of plain accessors. It decodes KHR_mesh_quantization,
// EXT_meshopt_compression, KHR_meshopt_compression, KHR_draco_mesh_compression, sparse accessors,
// strips, fans and data URIs, expands EXT_mesh_gpu_instancing and applies KHR_texture_transform.
// Nodes and meshes keep their indices. All other files stay as they are.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

/// A glTF file for assimp.
struct PlainGltf {
  std::string json;                      ///< as assimp reads it; empty or invalid if the file is
  std::string glb;                       ///< the rewritten file; empty: the file itself is plain
  std::optional<std::size_t> triangles;  ///< in all meshes, each once; nullopt: unknown
  std::vector<Diagnostic> problems;
  std::vector<std::string> dependencies;  ///< files that were read or looked for
};

/// Throws ImportError for damaged data, for glTF 1.0, and for required extensions that are not
/// read.
PlainGltf makePlainGltf(const std::filesystem::path& file, ModelFormat format);

}  // namespace enfilade::scene
