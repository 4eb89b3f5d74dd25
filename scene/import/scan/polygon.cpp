// Ear clipping (Meisters 1975) in the plane of the polygon's area vector (Newell). A corner is an
// ear if it is convex and no other corner lies in its triangle. Where rounding leaves no ear, the
// next corner is cut, so that the number of triangles is always the number of corners less two.
#include "scene/import/scan/polygon.hpp"

#include <Eigen/Geometry>

namespace enfilade::scene {
namespace {

Vec3 computeNewellNormal(std::span<const std::uint32_t> corners, std::span<const Vec3> positions) {
  Vec3 normal = Vec3::Zero();
  const Vec3& origin = positions[corners[0]];
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    normal += (positions[corners[i]] - origin).cross(positions[corners[i + 1]] - origin);
  return normal;
}

/// Positive if a, b, c turn left as seen against `normal`.
double computeTurn(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal) {
  return (b - a).cross(c - b).dot(normal);
}

bool isEar(const std::vector<std::uint32_t>& left, std::size_t tip, std::span<const Vec3> positions,
           const Vec3& normal) {
  const std::size_t before = (tip + left.size() - 1) % left.size(), after = (tip + 1) % left.size();
  const Vec3 &a = positions[left[before]], &b = positions[left[tip]], &c = positions[left[after]];
  if (!(computeTurn(a, b, c, normal) > 0)) return false;
  for (std::size_t i = 0; i < left.size(); ++i) {
    if (i == before || i == tip || i == after) continue;
    const Vec3& p = positions[left[i]];
    if (p == a || p == b || p == c) continue;
    if (computeTurn(a, b, p, normal) >= 0 && computeTurn(b, c, p, normal) >= 0 &&
        computeTurn(c, a, p, normal) >= 0)
      return false;
  }
  return true;
}

}  // namespace

void triangulatePolygon(std::span<const std::uint32_t> corners, std::span<const Vec3> positions,
                        std::vector<std::uint32_t>& triangles) {
  if (corners.size() < 3) return;
  if (corners.size() == 3) {
    triangles.insert(triangles.end(), corners.begin(), corners.end());
    return;
  }
  std::vector<std::uint32_t> left(corners.begin(), corners.end());
  const Vec3 normal = computeNewellNormal(corners, positions);
  while (left.size() > 3) {
    std::size_t tip = left.size();
    for (std::size_t i = 1; i <= left.size() && tip == left.size(); ++i)
      if (isEar(left, i % left.size(), positions, normal)) tip = i % left.size();
    // A polygon that crosses itself may have no ear: the rest becomes a fan, in linear time.
    if (tip == left.size()) break;
    triangles.insert(triangles.end(), {left[(tip + left.size() - 1) % left.size()], left[tip],
                                       left[(tip + 1) % left.size()]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(tip));
  }
  for (std::size_t i = 2; i < left.size(); ++i)
    triangles.insert(triangles.end(), {left[0], left[i - 1], left[i]});
}

}  // namespace enfilade::scene
