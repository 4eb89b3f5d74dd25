// The pre-pass over glTF files: checks them, and rewrites those that assimp would not read, or not
// read right, to a GLB file of plain accessors. It decodes KHR_mesh_quantization,
// EXT_meshopt_compression, KHR_meshopt_compression, KHR_draco_mesh_compression, sparse accessors,
// strips, fans and data URIs, expands EXT_mesh_gpu_instancing and applies KHR_texture_transform.
// Nodes and meshes keep their indices. All other files stay as they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/import/file/model_format.hpp"
#include "scene/import/gltf/gltf_nodes.hpp"

namespace enfilade::scene {

/// A glTF file for assimp.
struct PlainGltf {
  std::string json;                      ///< as assimp reads it
  std::string glb;                       ///< the rewritten file; empty: the file itself is plain
  std::optional<std::size_t> triangles;  ///< in all meshes, each once; nullopt: unknown
  std::vector<std::string> scenes;       ///< names of all scenes; some may be empty
  std::uint32_t scene = 0;               ///< the one that is read
  std::vector<PlainNode> nodes;          ///< all, by index, in doubles
  std::vector<std::size_t> roots;        ///< of the scene that is read; indices of nodes
  std::vector<Diagnostic> problems;
  std::vector<std::string> dependencies;  ///< files that were read or looked for
};

struct GltfChoice {
  std::string scene = {};  ///< name or number; empty: the file's default
  bool rewrite = false;    ///< rewrite the file also if assimp should read it right
  /// Reads files that require extensions that change the appearance alone and are not read.
  bool ignoreAppearance = false;
};

/// Throws ImportError for damaged JSON, for missing buffers, for glTF 1.0, for required extensions
/// that are not read, and if no mesh can be read. Of several meshes, one that cannot be read is
/// reported.
PlainGltf makePlainGltf(const std::filesystem::path& file, ModelFormat format,
                        const GltfChoice& choice = {});

}  // namespace enfilade::scene
