// The pre-pass over glTF files: checks them, reads their nodes, and makes a file of their meshes
// for assimp. It rewrites data that assimp would not read, or not read right, to plain accessors.
// It decodes KHR_mesh_quantization, EXT_meshopt_compression, KHR_meshopt_compression,
// KHR_draco_mesh_compression, sparse accessors, strips, fans and data URIs, expands
// EXT_mesh_gpu_instancing and applies KHR_texture_transform. Nodes and meshes keep their indices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/file/model_format.hpp"
#include "scene/import/gltf/encoding/gltf_binary.hpp"
#include "scene/import/gltf/encoding/gltf_nodes.hpp"

namespace enfilade::scene {

/// A glTF file that was checked.
struct PlainGltf {
  std::string json;           ///< with all nodes
  nlohmann::json sections;    ///< of `json`, without the nodes
  bool isRewritten = false;   ///< then `json` is of a GLB file with `binary`
  GltfBinary binary;          ///< of a rewritten file
  GltfNodeTree tree;          ///< valid: validateNodeGraph()
  std::size_t triangles = 0;  ///< of the scene's meshes, each once
  /// The meshes of the scene, in the order in which assimp would come to them: those of a node's
  /// children before its own. The order of materials, and so the hash of the scene, depends on it.
  std::vector<std::size_t> meshes;
  std::vector<std::string> scenes;  ///< names of all scenes; some may be empty
  std::uint32_t scene = 0;          ///< the one that is read
  std::vector<Diagnostic> problems;
  std::vector<std::string> dependencies;  ///< files that were read or looked for
};

/// A glTF or GLB file with one node for each mesh of PlainGltf::meshes, in order, below one root
/// node. assimp takes 1.2 KB for a node, and a file may have a million.
struct GltfMeshFile {
  std::string start;          ///< its bytes, or the first of them
  std::size_t restAt = 0;     ///< offset in the original file of the bytes that follow
  std::size_t restBytes = 0;  ///< 0: none follow
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

/// Takes the sections and the binary data out of `plain`. Throws ImportError if they exceed the
/// four gigabytes of a GLB file.
GltfMeshFile takeMeshFile(PlainGltf& plain, const std::filesystem::path& file, ModelFormat format);

}  // namespace enfilade::scene
