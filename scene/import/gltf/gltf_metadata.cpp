#include "scene/import/gltf/gltf_metadata.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "scene/import/import_model.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

/// "" where a GLB does not hold what its lengths say.
std::string jsonText(const std::filesystem::path& file, ModelFormat format) {
  std::ifstream in(file, std::ios::binary);
  if (format == ModelFormat::gltf) return {std::istreambuf_iterator<char>(in), {}};
  std::array<char, 20> headers{};  // of the file and of its first chunk
  in.read(headers.data(), headers.size());
  std::uint32_t length = 0;
  std::memcpy(&length, headers.data() + 12, sizeof length);
  std::error_code error;
  if (!in || length > file_size(file, error)) return {};
  std::string text(length, '\0');
  in.read(text.data(), length);
  return text;
}

/// What is asked of it below; nodes, which may be a million, are passed over.
Json parsed(const std::string& text) {
  const auto wanted = [](int depth, Json::parse_event_t event, Json& value) {
    if (event != Json::parse_event_t::key || depth != 1) return true;
    return value == "extensionsRequired" || value == "meshes" || value == "accessors";
  };
  return Json::parse(text, wanted, false);
}

/// Whether a file that requires this extension has the same shapes without it, or we read it.
bool canBeRead(const std::string& extension) {
  constexpr std::array<std::string_view, 9> kKnown{
      "KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_xmp",     "KHR_physics_",
      "KHR_implicit_",  "EXT_texture_", "EXT_lights_", "MSFT_texture"};
  return std::any_of(kKnown.begin(), kKnown.end(),
                     [&](std::string_view start) { return extension.starts_with(start); });
}

/// assimp does not look at what a file requires, and shows something else, or nothing.
void requireKnownExtensions(const Json& gltf, const std::filesystem::path& file) {
  for (const Json& extension : gltf.value("extensionsRequired", Json::array())) {
    if (!extension.is_string() || canBeRead(extension.get<std::string>())) continue;
    throw ImportError(file.string() + ": requires the glTF extension " +
                      extension.get<std::string>() +
                      ", which is not read; export it without (meshes uncompressed) (open)");
  }
}

std::size_t numberAt(const Json& object, const char* key, std::size_t otherwise) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_unsigned() ? found->get<std::size_t>()
                                                              : otherwise;
}

/// Corners of a primitive: its indices, else its vertices. 0 where the JSON makes no sense.
std::size_t cornersOf(const Json& primitive, const Json& accessors) {
  constexpr std::size_t kNone = ~std::size_t{0};
  const auto attributes = primitive.find("attributes");
  const bool placed = attributes != primitive.end() && attributes->is_object();
  const std::size_t vertices = placed ? numberAt(*attributes, "POSITION", kNone) : kNone;
  const std::size_t accessor = numberAt(primitive, "indices", vertices);
  if (accessor >= accessors.size() || !accessors[accessor].is_object()) return 0;
  return numberAt(accessors[accessor], "count", 0);
}

std::size_t trianglesOf(const Json& primitive, const Json& accessors) {
  constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;  // glTF 2.0, 5.24.4
  if (!primitive.is_object()) return 0;
  const std::size_t corners = cornersOf(primitive, accessors);
  const std::size_t mode = numberAt(primitive, "mode", kTriangles);
  if (mode == kTriangles) return corners / 3;
  return mode == kStrip || mode == kFan ? std::max<std::size_t>(corners, 2) - 2 : 0;
}

}  // namespace

std::optional<std::size_t> gltfTriangles(const std::filesystem::path& file, ModelFormat format) {
  const Json gltf = parsed(jsonText(file, format));
  if (!gltf.is_object()) return std::nullopt;
  requireKnownExtensions(gltf, file);
  const Json accessors = gltf.value("accessors", Json::array());
  std::size_t triangles = 0;
  for (const Json& mesh : gltf.value("meshes", Json::array())) {
    if (!mesh.is_object()) continue;
    for (const Json& primitive : mesh.value("primitives", Json::array()))
      triangles += trianglesOf(primitive, accessors);
  }
  return triangles;
}

}  // namespace enfilade::scene
