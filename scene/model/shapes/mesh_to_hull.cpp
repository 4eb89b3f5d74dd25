#include "scene/model/shapes/mesh_to_hull.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace enfilade::scene {
namespace {

using collision::Vec3;

// An inward-facing surface is an inside-out solid if no ball of this radius (metres) fits into it.
// Otherwise it may be a room seen from within, and stays triangles. A convex solid of volume V and
// area A contains no ball with a radius above 3 V / A.
constexpr double kRoomRadius = 0.3;

/// 3 V / A of the enclosed volume, metres.
double computeThickness(const PlacedShape& placed, const Shell& shell) {
  const Vec3 origin = placed.vertexPosition(placed.shape.triangles[shell.first][0]);
  double sixfoldVolume = 0, doubleArea = 0;
  for (std::size_t t = shell.first; t < shell.first + shell.count; ++t) {
    const auto [a, b, c] = placed.triangle(t);
    const Vec3 normal = (b - a).cross(c - a);
    sixfoldVolume += (a - origin).dot(normal);
    doubleArea += normal.norm();
  }
  return doubleArea > 0 ? std::abs(sixfoldVolume) / doubleArea : 0;
}

/// True if the shell faces into the solid of another shell of the shape.
bool isCavity(const Shape& shape, const Shell& shell) {
  return shell.inward && std::any_of(shape.shells.begin(), shape.shells.end(),
                                     [](const Shell& other) { return other.hollow; });
}

}  // namespace

bool isTreatedAsHull(const PlacedShape& placed, const Shell& shell) {
  if (!shell.isConvex() || shell.hollow) return false;
  if (!shell.inward) return true;
  return !isCavity(placed.shape, shell) && computeThickness(placed, shell) < kRoomRadius;
}

collision::Hull buildShellHull(const PlacedShape& placed, std::span<const Shell> shells,
                               const Vec3& origin) {
  std::vector<Vec3> points;
  for (const std::uint32_t v : collectVertices(placed.shape, shells))
    points.emplace_back(placed.vertexPosition(v) - origin);
  return collision::buildHull(points);
}

}  // namespace enfilade::scene
