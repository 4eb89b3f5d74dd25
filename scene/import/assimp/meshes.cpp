#include "scene/import/assimp/meshes.hpp"

#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <unordered_map>

#include "scene/model/add_diagnostic.hpp"
#include "scene/model/hasher.hpp"
#include "scene/model/srgb.hpp"

namespace enfilade::scene {
namespace {

constexpr float kMaxFileCoordinate = 1e9f;  // file units; a greater coordinate is invalid, like NaN

bool isValidVector(const aiVector3D& v) {
  // Comparisons with NaN are false.
  return std::abs(v.x) <= kMaxFileCoordinate && std::abs(v.y) <= kMaxFileCoordinate &&
         std::abs(v.z) <= kMaxFileCoordinate;
}

Vec3 computeAreaVector(const Mesh& mesh, std::size_t triangle) {
  const Vec3 a = mesh.positions[mesh.indices[3 * triangle]].cast<double>();
  const Vec3 b = mesh.positions[mesh.indices[3 * triangle + 1]].cast<double>();
  const Vec3 c = mesh.positions[mesh.indices[3 * triangle + 2]].cast<double>();
  return (b - a).cross(c - a);
}

/// Faces of one mesh that were dropped (pointsAndLines, invalid) or are degenerate.
struct FaceCounts {
  std::size_t pointsAndLines = 0, invalid = 0, degenerate = 0;
};

FaceCounts copyTriangles(const aiMesh& from, Mesh& to) {
  FaceCounts counts;
  const std::span vertices(from.mVertices, from.mNumVertices);
  for (const aiFace& face : std::span(from.mFaces, from.mNumFaces)) {
    if (face.mNumIndices != 3) {
      ++counts.pointsAndLines;
      continue;
    }
    const std::span corners(face.mIndices, 3);
    const bool whole = std::all_of(corners.begin(), corners.end(), [&](unsigned i) {
      return i < vertices.size() && isValidVector(vertices[i]);
    });
    if (!whole) {
      ++counts.invalid;
      continue;
    }
    to.indices.insert(to.indices.end(), corners.begin(), corners.end());
    if (computeAreaVector(to, to.triangleCount() - 1).isZero(0.0)) ++counts.degenerate;
  }
  return counts;
}

/// Normalises the normals; an invalid one is replaced by the normal of a triangle at the vertex.
void copyNormals(const aiMesh& from, Mesh& to) {
  if (!from.HasNormals()) return;
  std::vector<bool> bad(from.mNumVertices, false);
  bool anyBad = false;
  for (unsigned i = 0; i < from.mNumVertices; ++i) {
    const aiVector3D& n = from.mNormals[i];
    const Vec3 normal(n.x, n.y, n.z);
    const double length = normal.norm();
    bad[i] = !(length > 1e-12 && length < 1e12);
    anyBad = anyBad || bad[i];
    to.normals.push_back(bad[i] ? Eigen::Vector3f::UnitY()
                                : Eigen::Vector3f((normal / length).cast<float>()));
  }
  if (!anyBad) return;
  for (std::size_t i = 0; i < to.indices.size(); ++i) {
    const Vec3 area = computeAreaVector(to, i / 3);
    if (!bad[to.indices[i]] || !(area.norm() > 0)) continue;
    to.normals[to.indices[i]] = area.normalized().cast<float>();
    bad[to.indices[i]] = false;
  }
}

void copyUvs(const aiMesh& from, Mesh& to) {
  if (!from.HasTextureCoords(0)) return;
  for (const aiVector3D& uv : std::span(from.mTextureCoords[0], from.mNumVertices)) {
    // assimp's v axis points up.
    to.uvs.push_back(isValidVector(uv) ? Eigen::Vector2f(uv.x, 1 - uv.y) : Eigen::Vector2f::Zero());
  }
}

/// Copies the vertex colours unless all are white. Some writers of text formats count to 255.
void copyColours(const aiMesh& from, bool gltf, Mesh& to) {
  if (!from.HasVertexColors(0)) return;
  const std::span colours(from.mColors[0], from.mNumVertices);
  const bool bytes = !gltf && std::any_of(colours.begin(), colours.end(), [](const aiColor4D& c) {
    return std::max({c.r, c.g, c.b}) > 1.001f;  // rounded ones stay ones
  });
  const auto encode = [&](float channel) {
    const double c = static_cast<double>(channel);
    return toByte(gltf ? linearToSrgb(c) : bytes ? c / 255 : c);
  };
  bool white = true;
  to.colours.reserve(colours.size());
  for (const aiColor4D& c : colours) {
    // Only glTF defines that the alpha of a vertex is opacity.
    const std::uint8_t alpha = gltf ? toByte(static_cast<double>(c.a)) : std::uint8_t{255};
    to.colours.push_back({encode(c.r), encode(c.g), encode(c.b), alpha});
    white = white && to.colours.back() == VertexColour{255, 255, 255, 255};
  }
  if (white) to.colours = {};
}

/// The words of a vertex, bit by bit: position, normal, texture coordinates, colour.
using VertexWords = std::array<std::uint32_t, 9>;

VertexWords listWords(const Mesh& mesh, std::uint32_t vertex) {
  VertexWords words{};
  std::memcpy(words.data(), mesh.positions[vertex].data(), 12);
  if (!mesh.normals.empty()) std::memcpy(words.data() + 3, mesh.normals[vertex].data(), 12);
  if (!mesh.uvs.empty()) std::memcpy(words.data() + 6, mesh.uvs[vertex].data(), 8);
  if (!mesh.colours.empty()) std::memcpy(words.data() + 8, mesh.colours[vertex].data(), 4);
  return words;
}

/// Makes equal vertices one. Files without shared vertices have three per triangle.
void joinVertices(Mesh& mesh) {
  const auto hash = [&](std::uint32_t vertex) {
    Hasher hasher;
    for (const std::uint32_t word : listWords(mesh, vertex)) hasher.add(std::uint64_t{word});
    return static_cast<std::size_t>(hasher.value());
  };
  const auto equal = [&](std::uint32_t a, std::uint32_t b) {
    return listWords(mesh, a) == listWords(mesh, b);
  };
  std::unordered_map<std::uint32_t, std::uint32_t, decltype(hash), decltype(equal)> newIndex(
      mesh.positions.size(), hash, equal);
  std::vector<std::uint32_t> kept;
  for (std::uint32_t& index : mesh.indices) {
    const auto [known, isNew] =
        newIndex.try_emplace(index, static_cast<std::uint32_t>(kept.size()));
    if (isNew) kept.push_back(index);
    index = known->second;
  }
  newIndex.clear();  // it reads the vertices, which move now
  const auto gather = [&](auto& values) {
    if (values.empty()) return;
    std::remove_reference_t<decltype(values)> joined;
    joined.reserve(kept.size());
    for (const std::uint32_t vertex : kept) joined.push_back(values[vertex]);
    values = std::move(joined);
  };
  gather(mesh.positions);
  gather(mesh.normals);
  gather(mesh.uvs);
  gather(mesh.colours);
}

Mesh convertMesh(const aiMesh& from, bool gltf, bool join, std::vector<Diagnostic>& diagnostics) {
  Mesh to;
  to.name.assign(from.mName.C_Str(), from.mName.length);
  to.material = from.mMaterialIndex;
  for (const aiVector3D& v : std::span(from.mVertices, from.mNumVertices)) {
    to.positions.push_back(isValidVector(v) ? Eigen::Vector3f(v.x, v.y, v.z)
                                            : Eigen::Vector3f::Zero());
  }
  const FaceCounts counts = copyTriangles(from, to);
  copyNormals(from, to);
  copyUvs(from, to);
  copyColours(from, gltf, to);
  if (join) joinVertices(to);
  addDiagnostic(diagnostics, "points_and_lines_dropped", to.name, counts.pointsAndLines);
  addDiagnostic(diagnostics, "broken_triangle_dropped",
                to.name + ": a vertex is NaN, infinite or beyond 1e9", counts.invalid);
  addDiagnostic(diagnostics, "degenerate_triangle", to.name, counts.degenerate);
  return to;
}

}  // namespace

std::vector<Mesh> convertMeshes(const aiScene& scene, bool gltf, bool join,
                                std::vector<Diagnostic>& diagnostics) {
  std::vector<Mesh> meshes;
  for (const aiMesh* mesh : std::span(scene.mMeshes, scene.mNumMeshes)) {
    meshes.push_back(convertMesh(*mesh, gltf, join, diagnostics));
  }
  return meshes;
}

}  // namespace enfilade::scene
