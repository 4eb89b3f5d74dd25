// Vertices and indices of a primitive for a GLB file, copied from meshes of the model.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::server {

struct PrimitiveData {
  bool hasNormals = false, hasUvs = false, hasColours = false;
  std::vector<float> positions, normals, uvs;
  std::vector<std::uint16_t> colours;  ///< linear RGBA, four per vertex, 65535 is 1
  std::vector<float> entities;         ///< entity id of each vertex; empty: not merged
  std::vector<std::uint32_t> indices;

  std::size_t vertexCount() const { return positions.size() / 3; }
};

/// Appends the mesh as it is stored, without a transform.
void appendMesh(PrimitiveData& into, const scene::Mesh& mesh);

/// Appends the mesh transformed. A transform that mirrors reverses the triangles, so that they stay
/// counter-clockwise from outside.
void appendTransformed(PrimitiveData& into, const scene::Mesh& mesh,
                       const Eigen::Affine3d& transform);

}  // namespace enfilade::server
