// Triangles of assimp's meshes.
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>

#include "scene/import/assimp/convert_scene.hpp"

namespace enfilade::scene {
namespace {

constexpr float kGreatest = 1e9f;  // a greater coordinate is as broken as NaN, whatever the unit

bool isSane(const aiVector3D& v) {
  // Comparisons with NaN are false.
  return std::abs(v.x) <= kGreatest && std::abs(v.y) <= kGreatest && std::abs(v.z) <= kGreatest;
}

Vec3 areaVector(const Mesh& mesh, std::size_t triangle) {
  const Vec3 a = mesh.positions[mesh.indices[3 * triangle]].cast<double>();
  const Vec3 b = mesh.positions[mesh.indices[3 * triangle + 1]].cast<double>();
  const Vec3 c = mesh.positions[mesh.indices[3 * triangle + 2]].cast<double>();
  return (b - a).cross(c - a);
}

/// What was left out of one mesh, and what is odd in the rest.
struct FaceCounts {
  std::size_t pointsAndLines = 0, broken = 0, degenerate = 0;
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
      return i < vertices.size() && isSane(vertices[i]);
    });
    if (!whole) {
      ++counts.broken;
      continue;
    }
    to.indices.insert(to.indices.end(), corners.begin(), corners.end());
    if (areaVector(to, to.indices.size() / 3 - 1).isZero(0.0)) ++counts.degenerate;
  }
  return counts;
}

/// Unit length; a normal that is none is replaced by that of a triangle at the vertex.
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
    const Vec3 area = areaVector(to, i / 3);
    if (!bad[to.indices[i]] || !(area.norm() > 0)) continue;
    to.normals[to.indices[i]] = area.normalized().cast<float>();
    bad[to.indices[i]] = false;
  }
}

void copyUvs(const aiMesh& from, Mesh& to) {
  if (!from.HasTextureCoords(0)) return;
  for (const aiVector3D& uv : std::span(from.mTextureCoords[0], from.mNumVertices)) {
    // assimp counts v from the bottom.
    to.uvs.push_back(isSane(uv) ? Eigen::Vector2f(uv.x, 1 - uv.y) : Eigen::Vector2f::Zero());
  }
}

Mesh convertMesh(const aiMesh& from, ProblemLog& problems) {
  Mesh to;
  to.name.assign(from.mName.C_Str(), from.mName.length);
  to.material = from.mMaterialIndex;
  for (const aiVector3D& v : std::span(from.mVertices, from.mNumVertices)) {
    to.positions.push_back(isSane(v) ? Eigen::Vector3f(v.x, v.y, v.z) : Eigen::Vector3f::Zero());
  }
  const FaceCounts counts = copyTriangles(from, to);
  copyNormals(from, to);
  copyUvs(from, to);
  problems.add("points_and_lines_dropped", to.name, counts.pointsAndLines);
  problems.add("broken_triangle_dropped", to.name + ": a vertex is NaN, infinite or beyond 1e9",
               counts.broken);
  problems.add("degenerate_triangle", to.name, counts.degenerate);
  if (from.HasVertexColors(0)) problems.add("vertex_colours_ignored", to.name);
  return to;
}

}  // namespace

std::vector<Mesh> convertMeshes(const aiScene& scene, ProblemLog& problems) {
  std::vector<Mesh> meshes;
  for (const aiMesh* mesh : std::span(scene.mMeshes, scene.mNumMeshes)) {
    meshes.push_back(convertMesh(*mesh, problems));
  }
  return meshes;
}

Mesh transformed(const Mesh& mesh, const Eigen::Affine3d& transform) {
  Mesh result = mesh;
  for (Eigen::Vector3f& p : result.positions) p = (transform * p.cast<double>()).cast<float>();
  const double determinant = transform.linear().determinant();
  // The cofactors are the inverse transpose times the determinant: no division, and flat
  // transforms keep a normal.
  const Eigen::Matrix3d& m = transform.linear();
  Eigen::Matrix3d cofactors;
  cofactors.col(0) = m.col(1).cross(m.col(2));
  cofactors.col(1) = m.col(2).cross(m.col(0));
  cofactors.col(2) = m.col(0).cross(m.col(1));
  if (determinant < 0) cofactors = -cofactors;
  for (Eigen::Vector3f& n : result.normals) {
    const Vec3 normal = cofactors * n.cast<double>();
    if (normal.norm() > 0) n = normal.normalized().cast<float>();
  }
  if (determinant < 0) {
    for (std::size_t i = 0; i + 2 < result.indices.size(); i += 3) {
      std::swap(result.indices[i + 1], result.indices[i + 2]);
    }
  }
  return result;
}

}  // namespace enfilade::scene
