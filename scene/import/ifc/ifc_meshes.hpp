// Triangle meshes of IFC products as a reader delivers them, and their wire format in the pipe.
// Numbers are little-endian; u: 32-bit unsigned, f: float, d: double.
//
//   T trying    u index into the requested products; the next messages concern this product
//   G geometry  u id, u vertices, u indices; a vertex is 3 f position, 3 f normal; an index is u
//   O product   u express id, u parts; a part is u geometry, 4 d colour (RGBA, sRGB), 16 d
//               transform: column-major, to metres with Y up
//   F failure   u express id, text
//   D done      no content
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "scene/import/worker/ipc_messages.hpp"

namespace enfilade::scene {

/// A triangle mesh in its own frame.
struct IfcGeometry {
  std::vector<Eigen::Vector3f> positions, normals;  ///< equal counts
  std::vector<std::uint32_t> indices;               ///< three per triangle
};

/// A geometry with its colour and transform.
struct IfcPlacedGeometry {
  std::uint32_t geometry = 0;                                       ///< into IfcMeshes::geometries
  Eigen::Vector4f colour{0.8f, 0.8f, 0.8f, 1};                      ///< sRGB, 0..1
  Eigen::Affine3d worldFromGeometry = Eigen::Affine3d::Identity();  ///< metres, Y up
};

/// All meshes that a reader delivered.
struct IfcMeshes {
  std::map<std::uint32_t, IfcGeometry> geometries;
  std::map<std::uint32_t, std::vector<IfcPlacedGeometry>> products;  ///< by express id
  std::map<std::uint32_t, std::string> failures;                     ///< by express id

  std::size_t countTriangles(std::uint32_t product) const;
};

/// Adds a message's contents to `meshes`. False if the message is malformed or not about meshes.
bool readIfcMessage(ImportMessage kind, std::span<const std::byte> body, IfcMeshes& meshes);

// ---- for the sending process --------------------------------------------------------------------

void sendGeometry(std::uint32_t id, const IfcGeometry& geometry);
void sendProduct(std::uint32_t id, const std::vector<IfcPlacedGeometry>& placedGeometries);

}  // namespace enfilade::scene
