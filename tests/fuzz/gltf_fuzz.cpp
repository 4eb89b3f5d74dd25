// Fuzz target of the glTF pre-pass. Input that begins with '{' is a .gltf file, all else a GLB
// file.
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/plain_gltf.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/memory_file.hpp"

namespace enfilade::fuzz {
namespace {

/// assimp reads the file without further checks of ours.
void requireMeshFile(const scene::GltfMeshFile& file, std::size_t meshCount,
                     std::size_t originalSize) {
  require(file.restAt + file.restBytes <= originalSize, "the rest is in the original");
  std::string json = file.start;
  if (json.starts_with("glTF")) {
    std::uint32_t size = 0, jsonSize = 0;
    std::memcpy(&size, file.start.data() + 8, sizeof size);
    std::memcpy(&jsonSize, file.start.data() + 12, sizeof jsonSize);
    require(size == file.start.size() + file.restBytes, "a GLB file is as long as it says");
    json = file.start.substr(20, jsonSize);
  }
  const auto parsed = nlohmann::json::parse(json, nullptr, false);
  require(parsed.is_object(), "the JSON of the meshes is valid");
  require(parsed.at("nodes").at(0).at("children").size() == meshCount, "each mesh has a node");
}

void requirePlainData(const scene::PlainGltf& plain) {
  const auto json = nlohmann::json::parse(plain.json, nullptr, false);
  require(json.is_object(), "the JSON of a rewritten file is valid");
  const std::size_t size = json.at("buffers").at(0).at("byteLength");
  for (const auto& view : json.at("bufferViews")) {
    const std::size_t first = view.at("byteOffset"), length = view.at("byteLength");
    require(first + length <= size, "views lie within the buffer");
  }
  for (const auto& accessor : json.at("accessors")) {
    const auto& view = json.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
    const std::size_t length = view.at("byteLength");
    const std::size_t count = accessor.at("count");
    require(count * 4 <= length, "accessors lie within their views");
    require(!accessor.contains("sparse"), "accessors are dense");
  }
}

/// The nodes of the scene are followed without further checks.
void requireTree(const scene::PlainGltf& plain) {
  const scene::GltfNodeTree& tree = plain.tree;
  for (const std::size_t root : tree.roots) require(root < tree.nodes.size(), "a root exists");
  for (const std::size_t index : scene::listSceneNodes(tree)) {
    const scene::PlainNode& node = tree.nodes[index];
    require(node.isObject, "a node is an object");
    for (const std::size_t child : node.children)
      require(child < tree.nodes.size(), "a child exists");
    if (node.mesh) require(*node.mesh < plain.sections.at("meshes").size(), "a node's mesh exists");
  }
}

}  // namespace

void tryBytes(std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes);
  const bool text = !bytes.empty() && bytes[0] == '{';
  const bool ignoresAppearance = bytes.empty() || bytes.back() % 8 != 0;  // mostly, to read on
  try {
    const auto format = text ? scene::ModelFormat::gltf : scene::ModelFormat::glb;
    scene::PlainGltf plain =
        scene::makePlainGltf(file.getPath(), format, {.ignoreAppearance = ignoresAppearance});
    if (plain.isRewritten) requirePlainData(plain);
    requireTree(plain);
    requireMeshFile(scene::takeMeshFile(plain, file.getPath(), format), plain.meshes.size(),
                    bytes.size());
  } catch (const scene::ImportError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  }
}

}  // namespace enfilade::fuzz
