// Fuzz target of the glTF pre-pass. Input that begins with '{' is a .gltf file, all else a GLB
// file.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/plain_gltf.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/memory_file.hpp"

namespace enfilade::fuzz {
namespace {

/// assimp reads the rewritten file without further checks of ours.
void requirePlainFile(const scene::PlainGltf& plain) {
  require(plain.meshFile.start.starts_with("glTF"), "a rewritten file is a GLB file");
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
  for (const auto& node : json.value("nodes", nlohmann::json::array()))
    if (node.is_object() && node.contains("mesh"))
      require(node["mesh"].get<std::size_t>() < json.at("meshes").size(), "a node's mesh exists");
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
    if (node.mesh)
      require(std::ranges::find(tree.meshes, *node.mesh) != tree.meshes.end(), "a mesh is read");
  }
}

}  // namespace

void tryBytes(std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes);
  const bool text = !bytes.empty() && bytes[0] == '{';
  const bool ignoresAppearance = bytes.empty() || bytes.back() % 8 != 0;  // mostly, to read on
  try {
    const scene::PlainGltf plain =
        scene::makePlainGltf(file.path(), text ? scene::ModelFormat::gltf : scene::ModelFormat::glb,
                             {.ignoreAppearance = ignoresAppearance});
    if (plain.isRewritten) requirePlainFile(plain);
    requireTree(plain);
  } catch (const scene::ImportError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  }
}

}  // namespace enfilade::fuzz
