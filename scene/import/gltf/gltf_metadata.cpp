#include "scene/import/gltf/gltf_metadata.hpp"

#include <algorithm>
#include <optional>

#include "scene/import/gltf/gltf_json.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

/// Corners of a primitive: its index count, otherwise its vertex count. 0 for invalid JSON.
std::size_t countCorners(const Json& primitive, const Json& accessors) {
  auto accessor = readIndexMember(&primitive, "indices");
  if (!accessor) accessor = readIndexMember(findMember(&primitive, "attributes"), "POSITION");
  if (!accessor || *accessor >= accessors.size()) return 0;
  return readIndexMember(&accessors[*accessor], "count").value_or(0);
}

std::size_t countTriangles(const Json& primitive, const Json& accessors) {
  constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;  // glTF 2.0, 5.24.4
  if (!primitive.is_object()) return 0;
  const std::size_t corners = countCorners(primitive, accessors);
  const std::size_t mode = readIndexMember(&primitive, "mode").value_or(kTriangles);
  if (mode == kTriangles) return corners / 3;
  return mode == kStrip || mode == kFan ? std::max<std::size_t>(corners, 2) - 2 : 0;
}

}  // namespace

std::size_t countGltfTriangles(const Json& gltf) {
  const Json none = Json::array();
  const auto getList = [&](const Json& object, const char* key) -> const Json& {
    const Json* list = findMember(&object, key);
    return list != nullptr && list->is_array() ? *list : none;
  };
  std::size_t triangles = 0;
  for (const Json& mesh : getList(gltf, "meshes")) {
    for (const Json& primitive : getList(mesh, "primitives"))
      triangles += countTriangles(primitive, getList(gltf, "accessors"));
  }
  return triangles;
}

}  // namespace enfilade::scene
