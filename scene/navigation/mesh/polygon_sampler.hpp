// Random points on some polygons of a navigation mesh, uniform in area.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "scene/navigation/mesh/navigation_mesh.hpp"

namespace enfilade::scene {

class PolygonSampler {
 public:
  void add(const NavigationMesh& mesh, std::uint32_t polygon);
  bool empty() const { return polygons_.empty(); }
  /// Scene frame, metres. The mesh is that of add(); there must be a polygon. Equal generators give
  /// equal points on every platform.
  Vec3 draw(const NavigationMesh& mesh, std::mt19937_64& random) const;

 private:
  std::vector<std::uint32_t> polygons_;
  std::vector<double> areaUpTo_;  // square metres, cumulative
};

}  // namespace enfilade::scene
