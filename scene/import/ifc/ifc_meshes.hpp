// Triangles of IFC products as a reader delivers them, and how they pass through the pipe. Numbers
// are little-endian; u: 32-bit unsigned, f: float, d: double.
//
//   T trying    u index into the wanted products: what comes next is about this one
//   G geometry  u id, u vertices, u indices; a vertex is 3 f position, 3 f normal; u an index
//   O product   u express id, u parts; a part is u geometry, 4 d colour (RGBA, as the file says it:
//   sRGB),
//               16 d transform: column-major, to metres with Y up
//   F failure   u express id, text
//   D done      nothing
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

struct IfcGeometry {
  std::vector<Eigen::Vector3f> positions, normals;  ///< as many of one as of the other
  std::vector<std::uint32_t> indices;               ///< three a triangle
};

struct IfcPart {
  std::uint32_t geometry = 0;                                       ///< into IfcShapes::geometries
  Eigen::Vector4f colour{0.8f, 0.8f, 0.8f, 1};                      ///< sRGB, 0..1
  Eigen::Affine3d worldFromGeometry = Eigen::Affine3d::Identity();  ///< metres, Y up
};

struct IfcShapes {
  std::map<std::uint32_t, IfcGeometry> geometries;
  std::map<std::uint32_t, std::vector<IfcPart>> products;  ///< by express id
  std::map<std::uint32_t, std::string> failures;           ///< by express id

  std::size_t triangles(std::uint32_t product) const;
};

/// Adds what a frame holds; false when it makes no sense. Kinds that hold no shapes are refused.
bool takeShapes(ImportFrame kind, std::span<const std::byte> body, IfcShapes& shapes);

// ---- for the process that writes ----------------------------------------------------------------

void sendGeometry(std::uint32_t id, const IfcGeometry& geometry);
void sendProduct(std::uint32_t id, const std::vector<IfcPart>& parts);

}  // namespace enfilade::scene
