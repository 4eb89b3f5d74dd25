#include "scene/import/gltf/gltf_metadata.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/gltf_json.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

/// Parses only the sections needed here and skips the nodes, of which there may be a million.
Json parseMeshSections(const std::string& text) {
  const auto wanted = [](int depth, Json::parse_event_t event, Json& value) {
    if (event != Json::parse_event_t::key || depth != 1) return true;
    return value == "extensionsRequired" || value == "meshes" || value == "accessors";
  };
  return Json::parse(text, wanted, false);
}

/// Whether the extension is read, or does not affect the meshes.
bool isSupportedExtension(const std::string& extension) {
  constexpr std::array<std::string_view, 9> kKnown{
      "KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_xmp",     "KHR_physics_",
      "KHR_implicit_",  "EXT_texture_", "EXT_lights_", "MSFT_texture"};
  return std::any_of(kKnown.begin(), kKnown.end(),
                     [&](std::string_view start) { return extension.starts_with(start); });
}

/// Throws for required extensions that are not supported. assimp ignores extensionsRequired and
/// would deliver wrong or missing meshes.
void requireKnownExtensions(const Json& gltf, const std::filesystem::path& file) {
  for (const Json& extension : gltf.value("extensionsRequired", Json::array())) {
    if (!extension.is_string() || isSupportedExtension(extension.get<std::string>())) continue;
    throw ImportError(file.string() + ": requires the glTF extension " +
                      extension.get<std::string>() +
                      ", which is not supported; export without it (uncompressed meshes) (open)");
  }
}

std::size_t getNumber(const Json& object, const char* key, std::size_t fallback) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_unsigned() ? found->get<std::size_t>()
                                                              : fallback;
}

/// Corners of a primitive: its index count, otherwise its vertex count. 0 for invalid JSON.
std::size_t countCorners(const Json& primitive, const Json& accessors) {
  const auto attributes = primitive.find("attributes");
  const bool hasAttributes = attributes != primitive.end() && attributes->is_object();
  const std::size_t vertices =
      hasAttributes ? getNumber(*attributes, "POSITION", kNoIndex) : kNoIndex;
  const std::size_t accessor = getNumber(primitive, "indices", vertices);
  if (accessor >= accessors.size() || !accessors[accessor].is_object()) return 0;
  return getNumber(accessors[accessor], "count", 0);
}

std::size_t countTriangles(const Json& primitive, const Json& accessors) {
  constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;  // glTF 2.0, 5.24.4
  if (!primitive.is_object()) return 0;
  const std::size_t corners = countCorners(primitive, accessors);
  const std::size_t mode = getNumber(primitive, "mode", kTriangles);
  if (mode == kTriangles) return corners / 3;
  return mode == kStrip || mode == kFan ? std::max<std::size_t>(corners, 2) - 2 : 0;
}

}  // namespace

std::optional<std::size_t> countGltfTriangles(const std::filesystem::path& file,
                                              ModelFormat format) {
  const Json gltf = parseMeshSections(readGltfJson(file, format));
  if (!gltf.is_object()) return std::nullopt;
  requireKnownExtensions(gltf, file);
  const Json accessors = gltf.value("accessors", Json::array());
  std::size_t triangles = 0;
  for (const Json& mesh : gltf.value("meshes", Json::array())) {
    if (!mesh.is_object()) continue;
    for (const Json& primitive : mesh.value("primitives", Json::array()))
      triangles += countTriangles(primitive, accessors);
  }
  return triangles;
}

}  // namespace enfilade::scene
