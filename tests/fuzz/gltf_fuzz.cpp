// Fuzz target of the glTF pre-pass. Input that begins with '{' is a .gltf file, all else a GLB
// file.
#include <nlohmann/json.hpp>

#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/plain_gltf.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/memory_file.hpp"

namespace enfilade::fuzz {
namespace {

/// The rewritten file is what assimp reads without further checks of ours.
void requirePlainFile(const scene::PlainGltf& plain) {
  require(plain.glb.starts_with("glTF"), "a rewritten file is a GLB file");
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

}  // namespace

void tryBytes(std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes);
  const bool text = !bytes.empty() && bytes[0] == '{';
  const bool ignoresAppearance = bytes.empty() || bytes.back() % 8 != 0;  // mostly, to read on
  try {
    const scene::PlainGltf plain =
        scene::makePlainGltf(file.path(), text ? scene::ModelFormat::gltf : scene::ModelFormat::glb,
                             {.ignoreAppearance = ignoresAppearance});
    if (!plain.glb.empty()) requirePlainFile(plain);
  } catch (const scene::ImportError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  }
}

}  // namespace enfilade::fuzz
