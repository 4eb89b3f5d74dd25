// Steps
//  1. Once a hull: each face's normal from the widest of its corners' triangles (v0, vi, vi+1), the
//     plane through v0, lowered by its error bound.
//  2. A query turns the triangle into the body's frame with the transposed rotation, and clips it
//     there by the planes (Sutherland and Hodgman 1974). The mean of the corners left over is a
//     point of the triangle inside of the body, mostly far inside; its least height below a plane,
//     less the error bounds, is the answer.
//
// Rounding, u = 2^-53. Lengths of vertices are at most r.
//  - The edges e1, e2 of a face are off by u |e|, their cross product by 6u |e1||e2| more: together
//    less than 10u |e1||e2|. So the normal is off by eta = 10u |e1||e2| / |e1 x e2| + 4u (its
//    length), and heights above the plane of v0, for |x| <= 2r, by 3r eta + 8u r.
//  - The transpose for the inverse: q = R^-1 e has |q - R^T e| <= E |q| for E >= |R^T R - 1|; the
//    product itself is off by 8u |e|, with e the point less the translation.
//  - Each clip puts a corner within 4u L of the segment between two others, L their greatest
//    length: after k clips, corners are within 4u L k of the true triangle.
//  - In the world a length is at most (1 + 2E) times as long as in the body's frame, and the other
//    way round, while E is small; where it is not (kMostShear), nothing is claimed.
#include "collision/compound/hull_planes.hpp"

#include <cmath>

#include "collision/shapes/hull.hpp"

namespace enfilade::collision {
namespace {

constexpr double kUnit = 0x1p-53;
constexpr double kMostShear = 1e-3;       // of E; beyond, first order bounds are no bounds
constexpr std::size_t kMostCorners = 40;  // of a clipped triangle: a plane adds one at most

HullPlanes::Plane planeOf(const Hull& hull, const std::vector<std::uint32_t>& face) {
  const Vec3& origin = hull.vertices[face[0]];
  Vec3 widest = Vec3::Zero();
  double eta = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i + 1 < face.size(); ++i) {
    const Vec3 e1 = hull.vertices[face[i]] - origin, e2 = hull.vertices[face[i + 1]] - origin;
    const Vec3 cross = e1.cross(e2);
    const double error = 10 * kUnit * e1.norm() * e2.norm() / cross.norm() + 4 * kUnit;
    if (error < eta) eta = error, widest = cross;
  }
  HullPlanes::Plane plane{widest / widest.norm(), 0, 0};
  plane.height = plane.normal.dot(origin) - (3 * eta + 8 * kUnit) * hull.radius;
  plane.most = plane.normal.dot(origin);
  for (const Vec3& v : hull.vertices) plane.most = std::max(plane.most, plane.normal.dot(v));
  plane.most += 8 * kUnit * hull.radius;
  return plane;
}

/// At least |R^T R - 1|, in Frobenius' norm.
double shearOf(const Mat3& rotation) {
  return (rotation.transpose() * rotation - Mat3::Identity()).norm() + 16 * kUnit;
}

struct Polygon {
  std::array<Vec3, kMostCorners> corners;
  std::size_t size = 0;
};

/// Keeps what lies below the plane; false when nothing does, or when there are too many corners.
bool clip(Polygon& polygon, const HullPlanes::Plane& plane) {
  std::array<double, kMostCorners> above;
  bool cut = false;
  for (std::size_t i = 0; i < polygon.size; ++i) {
    above[i] = plane.normal.dot(polygon.corners[i]) - plane.height;
    cut |= above[i] > 0;
  }
  if (!cut) return true;
  Polygon below;
  for (std::size_t i = 0; i < polygon.size; ++i) {
    const std::size_t next = i + 1 == polygon.size ? 0 : i + 1;
    if (below.size + 2 > kMostCorners) return false;
    if (above[i] <= 0) below.corners[below.size++] = polygon.corners[i];
    if ((above[i] <= 0) == (above[next] <= 0)) continue;
    const double part = above[i] / (above[i] - above[next]);
    below.corners[below.size++] =
        polygon.corners[i] + part * (polygon.corners[next] - polygon.corners[i]);
  }
  polygon = below;
  return polygon.size > 0;
}

double leastDepth(const HullPlanes& planes, const Vec3& point) {
  double depth = std::numeric_limits<double>::infinity();
  for (const HullPlanes::Plane& plane : planes.planes)
    depth = std::min(depth, plane.height - plane.normal.dot(point));
  return depth;
}

}  // namespace

HullPlanes::HullPlanes(const Hull& hull) : radius(hull.radius), made(true) {
  if (hull.faces.size() < 4) return;
  planes.reserve(hull.faces.size());
  for (const auto& face : hull.faces) {
    planes.push_back(planeOf(hull, face));
    if (std::isfinite(planes.back().height)) continue;
    planes.clear();  // too thin to say
    return;
  }
}

double clearanceInside(const HullPlanes& planes, const ConvexBody& body, const Triangle& triangle) {
  if (planes.planes.empty()) return 0;
  const double shear = body.rotation ? shearOf(*body.rotation) : 0;
  if (!(shear < kMostShear)) return 0;
  Polygon polygon;
  double longest = planes.radius;
  for (const Vec3& corner : triangle) {
    Vec3 local = corner - body.translation;
    if (body.rotation) local = body.rotation->transpose() * local;
    longest = std::max(longest, local.norm());
    polygon.corners[polygon.size++] = local;
  }
  double clips = 2;
  for (const HullPlanes::Plane& plane : planes.planes) {
    if (!clip(polygon, plane)) return 0;
    ++clips;
  }
  Vec3 mean = Vec3::Zero();
  for (std::size_t i = 0; i < polygon.size; ++i) mean += polygon.corners[i];
  mean /= static_cast<double>(polygon.size);
  if (!(mean.squaredNorm() < 3 * planes.radius * planes.radius)) return 0;
  const double error = 2 * shear * planes.radius + (4 * clips + 64) * kUnit * longest;
  return std::max(0.0, (leastDepth(planes, mean) - error) * (1 - 4 * kMostShear));
}

}  // namespace enfilade::collision
