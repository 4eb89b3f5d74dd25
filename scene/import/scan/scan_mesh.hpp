// Triangles of a scan or a printed part, as PLY and STL files contain them. Private to the import.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::scene {

using collision::Vec3;

/// One surface. Positions in the file's unit and axes; doubles, because scans have map coordinates.
struct ScanMesh {
  std::string name;  ///< empty: the file gives none
  std::vector<Vec3> positions;
  std::vector<Eigen::Vector3f> normals;  ///< empty, or one per position
  std::vector<std::uint32_t> indices;    ///< three per triangle, each below positions.size()
  /// Mean of the colours of the vertices, sRGB 0..1; nullopt: the file has none.
  std::optional<Eigen::Vector3f> colour;
  std::string textureFile;      ///< not read; empty: none
  std::size_t brokenFaces = 0;  ///< left out: an index out of range or a vertex not finite
};

}  // namespace enfilade::scene
