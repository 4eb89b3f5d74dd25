#include "scene/world/queries/space_query.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/model/shapes/collision_geometry.hpp"
#include "scene/model/shapes/space_solid.hpp"

namespace enfilade::scene {
namespace {

template <class Visit>
void visitSpaceTriangles(const Space& space, const Visit& visit) {
  for (std::size_t i = 0; i + 2 < space.surface.size(); i += 3)
    visit(collision::Triangle{space.surface[i], space.surface[i + 1], space.surface[i + 2]});
}

/// Metres from the point to the solid, 0 inside; nullopt beyond `reach`.
std::optional<double> computeSpaceDistance(const Space& space, const Vec3& point, double reach) {
  const Aabb reached = collision::inflate({point, point}, reach);
  if (space.box.empty() || !overlaps(space.box, reached)) return std::nullopt;
  if (space.surface.empty())
    return (point.cwiseMax(space.box.min).cwiseMin(space.box.max) - point).norm();
  if (isInSpace(space, point)) return 0;
  std::optional<double> nearest;
  const std::array<Vec3, 1> vertex{Vec3::Zero()};
  visitSpaceTriangles(space, [&](const collision::Triangle& t) {
    if (!overlaps(collision::computeAabb(t), reached)) return;
    collision::FeatureCache cache;
    const auto found = collision::computeSeparationWithin({vertex, point}, {t}, reach, cache);
    if (found && (!nearest || found->distance < *nearest)) nearest = found->distance;
  });
  return nearest;
}

/// Square metres: half of the surface's projection to the ground, which is that of floor and
/// ceiling.
double computeFloorArea(const Space& space) {
  if (space.surface.empty()) return space.box.size().x() * space.box.size().z();
  double doubled = 0;
  visitSpaceTriangles(space, [&](const collision::Triangle& t) {
    doubled += std::abs((t[1] - t[0]).cross(t[2] - t[0]).y()) / 2;
  });
  return doubled / 2;
}

}  // namespace

const Space* findSpace(const Model& model, const Vec3& point, double reach) {
  const Space* best = nullptr;
  std::pair<double, double> bestRank;  // distance, floor area
  for (const Space& space : model.spaces) {
    const auto distance = computeSpaceDistance(space, point, reach);
    if (!distance || *distance > reach) continue;
    const std::pair rank{*distance, computeFloorArea(space)};
    if (best == nullptr || rank < bestRank) best = &space, bestRank = rank;
  }
  return best;
}

}  // namespace enfilade::scene
