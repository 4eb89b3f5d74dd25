#include "scene/navigation/mesh/polygon_sampler.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::scene {

void PolygonSampler::add(const NavigationMesh& mesh, std::uint32_t polygon) {
  const double before = areaUpTo_.empty() ? 0 : areaUpTo_.back();
  polygons_.push_back(polygon);
  areaUpTo_.push_back(before + mesh.polygonArea(polygon));
}

Vec3 PolygonSampler::draw(const NavigationMesh& mesh, std::mt19937_64& random) const {
  ENFILADE_ASSERT(!empty());
  // 53 bits: the same numbers on every platform, unlike std::uniform_real_distribution.
  const auto number = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto at =
      std::ranges::upper_bound(areaUpTo_, number() * areaUpTo_.back()) - areaUpTo_.begin();
  const auto index = std::min(static_cast<std::size_t>(at), polygons_.size() - 1);
  const double s = number(), t = number();
  return mesh.pointInPolygon(polygons_[index], s, t);
}

}  // namespace enfilade::scene
