#include "scene/import/assimp/meshes.hpp"

#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

constexpr float kMaxCoordinate = 1e9f;  // file units; a greater coordinate is invalid, like NaN

bool isValidVector(const aiVector3D& v) {
  // Comparisons with NaN are false.
  return std::abs(v.x) <= kMaxCoordinate && std::abs(v.y) <= kMaxCoordinate &&
         std::abs(v.z) <= kMaxCoordinate;
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

Mesh convertMesh(const aiMesh& from, std::vector<Diagnostic>& diagnostics) {
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
  addDiagnostic(diagnostics, "points_and_lines_dropped", to.name, counts.pointsAndLines);
  addDiagnostic(diagnostics, "broken_triangle_dropped",
                to.name + ": a vertex is NaN, infinite or beyond 1e9", counts.invalid);
  addDiagnostic(diagnostics, "degenerate_triangle", to.name, counts.degenerate);
  if (from.HasVertexColors(0)) addDiagnostic(diagnostics, "vertex_colours_ignored", to.name);
  return to;
}

}  // namespace

std::vector<Mesh> convertMeshes(const aiScene& scene, std::vector<Diagnostic>& diagnostics) {
  std::vector<Mesh> meshes;
  for (const aiMesh* mesh : std::span(scene.mMeshes, scene.mNumMeshes)) {
    meshes.push_back(convertMesh(*mesh, diagnostics));
  }
  return meshes;
}

}  // namespace enfilade::scene
