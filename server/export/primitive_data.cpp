#include "server/export/primitive_data.hpp"

#include <algorithm>
#include <cmath>

#include "scene/model/srgb.hpp"

namespace enfilade::server {
namespace {

using scene::Vec3;

void appendVector(std::vector<float>& into, const Eigen::Vector3f& v) {
  into.insert(into.end(), {v.x(), v.y(), v.z()});
}

/// Maps normals: the cofactors of the linear part, with the sign of its determinant. Unlike the
/// inverse transpose, which is parallel to them, they exist for flat transforms too.
collision::Mat3 computeNormalMatrix(const collision::Mat3& linear) {
  collision::Mat3 cofactors;
  for (int i = 0; i < 3; ++i)
    cofactors.col(i) = linear.col((i + 1) % 3).cross(linear.col((i + 2) % 3));
  return linear.determinant() < 0 ? collision::Mat3(-cofactors) : cofactors;
}

Vec3 loadVector(const std::vector<float>& numbers, std::size_t index) {
  return Eigen::Map<const Eigen::Vector3f>(numbers.data() + 3 * index).cast<double>();
}

/// glTF requires unit normals. A vertex whose normal has no direction gets that of a triangle that
/// it belongs to. If these have no area, nothing of them is visible, and +Y serves.
void replaceZeroNormals(PrimitiveData& data, std::size_t firstVertex, std::size_t firstIndex) {
  const auto isZero = [&](std::size_t vertex) {
    return loadVector(data.normals, vertex).isZero(0);
  };
  bool found = false;
  for (std::size_t i = firstVertex; i < data.vertexCount() && !found; ++i) found = isZero(i);
  if (!found) return;
  const auto store = [&](std::size_t vertex, const Vec3& normal) {
    for (int axis = 0; axis < 3; ++axis)
      data.normals[3 * vertex + static_cast<std::size_t>(axis)] = static_cast<float>(normal[axis]);
  };
  for (std::size_t i = firstIndex; i + 2 < data.indices.size(); i += 3) {
    const Vec3 a = loadVector(data.positions, data.indices[i]);
    const Vec3 normal = (loadVector(data.positions, data.indices[i + 1]) - a)
                            .cross(loadVector(data.positions, data.indices[i + 2]) - a);
    if (!(normal.norm() > 0)) continue;
    for (std::size_t corner = i; corner < i + 3; ++corner)
      if (isZero(data.indices[corner])) store(data.indices[corner], normal.normalized());
  }
  for (std::size_t i = firstVertex; i < data.vertexCount(); ++i)
    if (isZero(i)) store(i, Vec3::UnitY());
}

void appendNormals(PrimitiveData& into, const scene::Mesh& mesh, const collision::Mat3& matrix) {
  for (const Eigen::Vector3f& normal : mesh.normals) {
    const Vec3 mapped = matrix * normal.cast<double>();
    const double length = mapped.norm();
    appendVector(into.normals, length > 0 ? Eigen::Vector3f((mapped / length).cast<float>())
                                          : Eigen::Vector3f(Eigen::Vector3f::Zero()));
  }
}

/// Meshes without texture coordinates show the texture's first texel, as the renderer does.
void appendUvs(PrimitiveData& into, const scene::Mesh& mesh) {
  const bool hasUvs = mesh.uvs.size() == mesh.positions.size();
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    into.uvs.push_back(hasUvs ? mesh.uvs[i].x() : 0);
    into.uvs.push_back(hasUvs ? mesh.uvs[i].y() : 0);
  }
}

/// 16 bits, because glTF's colours are linear: 8 of them would show steps in the dark.
std::uint16_t toLinear16(std::uint8_t srgb) {
  return static_cast<std::uint16_t>(std::lround(scene::srgbByteToLinear(srgb) * 65535));
}

void appendColours(PrimitiveData& into, const scene::Mesh& mesh) {
  for (const scene::VertexColour& colour : mesh.colours) {
    for (std::size_t c = 0; c < 3; ++c) into.colours.push_back(toLinear16(colour[c]));
    into.colours.push_back(static_cast<std::uint16_t>(colour[3] * 257));
  }
}

/// Appends all but the positions, which are already there.
void appendRest(PrimitiveData& into, const scene::Mesh& mesh, const collision::Mat3& linear) {
  const std::size_t firstVertex = into.vertexCount() - mesh.positions.size();
  const std::size_t firstIndex = into.indices.size();
  const bool mirrors = linear.determinant() < 0;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::size_t second = mirrors ? i + 2 : i + 1, third = mirrors ? i + 1 : i + 2;
    for (const std::size_t corner : {i, second, third})
      into.indices.push_back(static_cast<std::uint32_t>(firstVertex + mesh.indices[corner]));
  }
  if (into.hasUvs) appendUvs(into, mesh);
  if (into.hasColours) appendColours(into, mesh);
  if (!into.hasNormals) return;
  appendNormals(into, mesh, computeNormalMatrix(linear));
  replaceZeroNormals(into, firstVertex, firstIndex);
}

}  // namespace

void appendMesh(PrimitiveData& into, const scene::Mesh& mesh) {
  for (const Eigen::Vector3f& position : mesh.positions) appendVector(into.positions, position);
  appendRest(into, mesh, collision::Mat3::Identity());
}

void appendTransformed(PrimitiveData& into, const scene::Mesh& mesh,
                       const Eigen::Affine3d& transform) {
  for (const Eigen::Vector3f& position : mesh.positions) {
    const Vec3 mapped = transform * position.cast<double>();
    appendVector(into.positions, mapped.cast<float>());
  }
  appendRest(into, mesh, transform.linear());
}

}  // namespace enfilade::server
