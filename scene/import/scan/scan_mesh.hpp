// Triangles of a scan or a printed part, as PLY and STL files contain them. Private to the import.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// One surface. Positions in the file's unit and axes; doubles, because scans have map coordinates.
struct ScanMesh {
  std::string name;  ///< empty: the file gives none
  std::vector<Vec3> positions;
  std::vector<Eigen::Vector3f> normals;  ///< empty, or one per position
  std::vector<VertexColour> colours;     ///< empty, or one per position
  std::vector<std::uint32_t> indices;    ///< three per triangle, each below positions.size()
  /// Empty, or one per triangle; never together with `colours`.
  std::vector<VertexColour> triangleColours;
  std::string textureFile;        ///< not read; empty: none
  std::string unusedColours;      ///< those of faces that are left out, and why; empty: none
  std::size_t brokenFaces = 0;    ///< left out: an index out of range or a vertex not finite
  std::size_t trailingBytes = 0;  ///< after the elements that the header announces; not read

  bool hasColours() const { return !colours.empty() || !triangleColours.empty(); }
};

}  // namespace enfilade::scene
