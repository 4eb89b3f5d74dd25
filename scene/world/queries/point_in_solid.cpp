#include "scene/world/queries/point_in_solid.hpp"

#include <array>

namespace enfilade::scene {
namespace {

bool isInsideHull(const ObjectParts& parts, const Vec3& point) {
  const std::array<Vec3, 1> vertex{Vec3::Zero()};
  for (std::uint32_t i = 0; i < parts.hullCount(); ++i) {
    if (!overlaps(parts.hullBoxes[i], {point, point})) continue;
    collision::FeatureCache cache;
    const auto decision = collision::decide({vertex, point}, parts.body(i), cache);
    if (decision.verdict != collision::Verdict::separated) return true;
  }
  return false;
}

}  // namespace

bool holds(const ObjectParts& parts, const Vec3& point) {
  return isInsideHull(parts, point) || surrounds(parts, point);
}

EntityId solidAround(const Scene& scene, const Vec3& point) {
  const std::vector<std::uint32_t>& objects = scene.solidObjects();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!overlaps(scene.stillBoxes()[i], {point, point})) continue;
    if (holds(scene.parts(objects[i]), point)) return objects[i] + 1;
  }
  return 0;
}

}  // namespace enfilade::scene
