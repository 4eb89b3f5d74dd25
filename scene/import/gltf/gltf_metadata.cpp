#include "scene/import/gltf/gltf_metadata.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "scene/import/gltf/encoding/gltf_json.hpp"

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

std::size_t countTrianglesOfMesh(const Json& gltf, const Json& mesh) {
  std::size_t triangles = 0;
  for (const Json& primitive : getArray(mesh, "primitives"))
    triangles += countTriangles(primitive, getArray(gltf, "accessors"));
  return triangles;
}

}  // namespace

std::vector<std::size_t> countTrianglesByMesh(const Json& gltf) {
  std::vector<std::size_t> triangles;
  for (const Json& mesh : getArray(gltf, "meshes"))
    triangles.push_back(countTrianglesOfMesh(gltf, mesh));
  return triangles;
}

}  // namespace enfilade::scene
