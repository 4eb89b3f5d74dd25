#include "scene/navigation/walk/stand.hpp"

#include <array>
#include <cmath>
#include <cstdint>

#include "collision/sine_cosine.hpp"

namespace enfilade::scene {

std::optional<Vec3> standAt(Walker& walker, const Vec3& point, double maxDrop) {
  if (walker.place(point, maxDrop)) return std::nullopt;
  return walker.footPosition();
}

std::optional<Vec3> standNear(Walker& walker, const Vec3& point) {
  constexpr std::array<double, 5> kRings{0.05, 0.1, 0.2, 0.3, 0.4};  // metres
  constexpr int kPlacesOfRing = 8;
  const auto place = [&](const Vec3& aside) {
    const Vec3 above = point + aside + Vec3(0, kHeightError, 0);
    auto found = standAt(walker, above, 2 * kHeightError);
    if (found && std::abs(found->y() - point.y()) > kHeightError) found.reset();
    return found;
  };
  if (const auto found = place(Vec3::Zero())) return found;
  for (const double ring : kRings) {
    for (int i = 0; i < kPlacesOfRing; ++i) {
      const auto [sine, cosine] = collision::computeSineCosineOfDegrees(360.0 / kPlacesOfRing * i);
      if (const auto found = place(ring * Vec3(cosine, 0, sine))) return found;
    }
  }
  return std::nullopt;
}

std::optional<std::uint32_t> findPolygonAt(const NavigationMesh& mesh, const Vec3& place) {
  constexpr double kReach = 0.05;  // metres
  const auto nearest = mesh.findNearest(place, {kReach, kHeightError, kReach});
  if (!nearest || std::abs(nearest->point.y() - place.y()) > kHeightError) return std::nullopt;
  return nearest->polygon;
}

}  // namespace enfilade::scene
