#include "scene/import/scan/up_axis.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace enfilade::scene {
namespace {

constexpr double kLevelCosine = 0.98480775;  // of 10 degrees
constexpr double kClearlyMore = 1.05;

}  // namespace

LevelAreas computeLevelAreas(std::span<const ScanMesh> meshes) {
  LevelAreas areas{};
  for (const ScanMesh& mesh : meshes) {
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const Vec3& a = mesh.positions[mesh.indices[i]];
      const Vec3 area =
          (mesh.positions[mesh.indices[i + 1]] - a).cross(mesh.positions[mesh.indices[i + 2]] - a) /
          2;
      const double size = area.norm();
      for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(area[axis]) > kLevelCosine * size)
          areas[static_cast<std::size_t>(axis)] += size;
      }
    }
  }
  return areas;
}

char guessUpAxis(const LevelAreas& areas) {
  const std::size_t other = areas[0] > areas[1] ? 0 : 1;
  if (areas[other] > kClearlyMore * areas[2]) return other == 0 ? 'x' : 'y';
  return 'z';
}

}  // namespace enfilade::scene
