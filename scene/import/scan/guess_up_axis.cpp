#include "scene/import/scan/guess_up_axis.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace enfilade::scene {
namespace {

constexpr double kLevelCosine = 0.98480775;  // of 10 degrees
constexpr double kPreference = 1.05;         // another axis than z has this times its level
constexpr double kClearRatio = 1.5;          // of the levels of two axes
constexpr double kMinLevelShare = 0.1;       // of the surface, of level triangles
constexpr double kMostlyLevel = 0.75;        // share of the surface of a table, a lawn
constexpr double kMinSecondShare = 0.05;     // of the surface, of a second axis
constexpr double kFacingShare = 0.5;         // of a level, of its area up minus that down
// Heights are counted in this many bins; a level takes two adjacent ones.
constexpr std::size_t kBins = 32;

/// Areas by height along an axis.
struct Heights {
  std::array<double, kBins + 1> area{}, facing{};  ///< facing: up minus down

  double at(std::size_t bin) const { return area[bin] + area[bin + 1]; }
  double facingAt(std::size_t bin) const { return facing[bin] + facing[bin + 1]; }
};

LevelArea measureLevels(const Heights& heights) {
  LevelArea level;
  std::size_t largest = 0;
  double largestBelow = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    level.all += heights.area[bin];
    if (heights.at(bin) > heights.at(largest)) largest = bin;
    if (bin < kBins / 2) largestBelow = std::max(largestBelow, heights.at(bin));
  }
  level.all += heights.area[kBins];
  level.largest = heights.at(largest);
  level.hangs = heights.facingAt(largest) < -kFacingShare * level.largest && largest >= kBins / 2 &&
                largestBelow < kFacingShare * level.largest;
  return level;
}

}  // namespace

LevelAreas computeLevelAreas(std::span<const ScanMesh> meshes) {
  Eigen::AlignedBox3d bounds;
  for (const ScanMesh& mesh : meshes)
    for (const Vec3& position : mesh.positions) bounds.extend(position);
  std::array<Heights, 3> heights;  // by axis
  LevelAreas areas;
  for (const ScanMesh& mesh : meshes) {
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const Vec3& a = mesh.positions[mesh.indices[i]];
      const Vec3& b = mesh.positions[mesh.indices[i + 1]];
      const Vec3& c = mesh.positions[mesh.indices[i + 2]];
      const Vec3 area = (b - a).cross(c - a) / 2;
      const double size = area.norm();
      areas.surface += size;
      for (int axis = 0; axis < 3; ++axis) {
        if (!(std::abs(area[axis]) > kLevelCosine * size)) continue;
        const double low = bounds.min()[axis], range = bounds.sizes()[axis];
        const double height = ((a + b + c)[axis] / 3 - low) / std::max(range, 1e-300);
        const auto bin = static_cast<std::size_t>(std::clamp(height, 0.0, 1.0) * kBins);
        Heights& along = heights[static_cast<std::size_t>(axis)];
        along.area[bin] += size;
        along.facing[bin] += std::copysign(size, area[axis]);
      }
    }
  }
  std::ranges::transform(heights, areas.axes.begin(), measureLevels);
  return areas;
}

UpAxisGuess guessUpAxis(const LevelAreas& areas) {
  const auto& axes = areas.axes;
  const std::size_t other = axes[0].largest > axes[1].largest ? 0 : 1;
  const std::size_t chosen = axes[other].largest > kPreference * axes[2].largest ? other : 2;
  double second = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (axis != chosen) second = std::max(second, axes[axis].all);
  const double level = axes[chosen].all;
  const bool isSquare =
      level > kMostlyLevel * areas.surface ||
      (level > kMinLevelShare * areas.surface && second > kMinSecondShare * areas.surface);
  bool isClear = isSquare && !axes[chosen].hangs;
  for (std::size_t axis = 0; axis < 3; ++axis)
    isClear =
        isClear && (axis == chosen || axes[chosen].largest > kClearRatio * axes[axis].largest);
  return {static_cast<UpAxis>(chosen), isClear};
}

}  // namespace enfilade::scene
