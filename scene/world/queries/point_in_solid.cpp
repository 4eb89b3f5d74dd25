#include "scene/world/queries/point_in_solid.hpp"

#include <array>

namespace enfilade::scene {
namespace {

bool isInsideAnyHull(const CollisionGeometry& geometry, const Vec3& point) {
  const std::array<Vec3, 1> vertex{Vec3::Zero()};
  for (std::uint32_t i = 0; i < geometry.hullCount(); ++i) {
    if (!overlaps(geometry.hullBoxes[i], {point, point})) continue;
    collision::FeatureCache cache;
    const auto separation =
        collision::computeSeparation({vertex, point}, geometry.convex(i), cache);
    if (separation.verdict != collision::Verdict::separated) return true;
  }
  return false;
}

}  // namespace

bool containsPoint(const CollisionGeometry& geometry, const Vec3& point) {
  return isInsideAnyHull(geometry, point) || isInsideTriangleShells(geometry, point);
}

EntityId findObjectContaining(const Scene& scene, const Vec3& point) {
  const std::vector<std::uint32_t>& objects = scene.solidObjects();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!overlaps(scene.staticBoxes()[i], {point, point})) continue;
    if (containsPoint(scene.collisionGeometry(objects[i]), point)) return objects[i] + 1;
  }
  return 0;
}

}  // namespace enfilade::scene
