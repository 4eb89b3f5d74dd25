#include "scene/import/scan/up_axis.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace enfilade::scene {
namespace {

constexpr double kLevelCosine = 0.98480775;  // of 10 degrees
constexpr double kMore = 1.05;
constexpr double kClearlyMore = 1.5;
// Heights are counted in this many bins; a level takes two adjacent ones.
constexpr std::size_t kBins = 32;

}  // namespace

LevelAreas computeLevelAreas(std::span<const ScanMesh> meshes) {
  Eigen::AlignedBox3d bounds;
  for (const ScanMesh& mesh : meshes)
    for (const Vec3& position : mesh.positions) bounds.extend(position);
  std::array<std::array<double, kBins + 1>, 3> heights{};  // by axis
  for (const ScanMesh& mesh : meshes) {
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const Vec3& a = mesh.positions[mesh.indices[i]];
      const Vec3& b = mesh.positions[mesh.indices[i + 1]];
      const Vec3& c = mesh.positions[mesh.indices[i + 2]];
      const Vec3 area = (b - a).cross(c - a) / 2;
      const double size = area.norm();
      for (int axis = 0; axis < 3; ++axis) {
        if (!(std::abs(area[axis]) > kLevelCosine * size)) continue;
        const double low = bounds.min()[axis], range = bounds.sizes()[axis];
        const double height = ((a + b + c)[axis] / 3 - low) / std::max(range, 1e-300);
        const auto bin = static_cast<std::size_t>(std::clamp(height, 0.0, 1.0) * kBins);
        heights[static_cast<std::size_t>(axis)][bin] += size;
      }
    }
  }
  LevelAreas areas{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t bin = 0; bin < kBins; ++bin)
      areas[axis] = std::max(areas[axis], heights[axis][bin] + heights[axis][bin + 1]);
  return areas;
}

UpAxisGuess guessUpAxis(const LevelAreas& areas) {
  const std::size_t other = areas[0] > areas[1] ? 0 : 1;
  const std::size_t chosen = areas[other] > kMore * areas[2] ? other : 2;
  bool isClear = true;
  for (std::size_t axis = 0; axis < 3; ++axis)
    isClear = isClear && (axis == chosen || areas[chosen] > kClearlyMore * areas[axis]);
  return {"xyz"[chosen], isClear};
}

}  // namespace enfilade::scene
