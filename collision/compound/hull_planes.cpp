// Steps
//  1. Once per hull: the normal of each face is that of its best-conditioned corner triangle (v0,
//     vi, vi+1). The plane goes through v0 and is lowered by its error bound.
//  2. A query transforms the triangle to the body frame with the transposed rotation and clips it
//     by the planes (Sutherland and Hodgman 1974). The mean of the remaining corners is a point of
//     the triangle inside the body, usually deep inside. The result is its minimum depth below a
//     plane minus the error bounds.
//
// Rounding, u = 2^-53. Lengths of vertices are at most r.
//  - The edges e1, e2 of a face have an error of u |e|, their cross product of 6u |e1||e2| more:
//    in total less than 10u |e1||e2|. The error of the normal is eta = 10u |e1||e2| / |e1 x e2| +
//    4u (its length). Heights above the plane of v0, for |x| <= 2r, have an error of 3r eta + 8u r.
//  - The transpose replaces the inverse: q = R^-1 e has |q - R^T e| <= E |q| for E >= |R^T R - 1|.
//    The product has an error of 8u |e|, with e the point minus the translation.
//  - Each clip places a corner within 4u L of the segment between two others, L their maximum
//    length. After k clips, corners are within 4u L k of the true triangle.
//  - A world length is at most (1 + 2E) times the body length, and vice versa, while E is small.
//    Above kMaxShear no depth is claimed.
#include "collision/compound/hull_planes.hpp"

#include <cmath>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"
#include "collision/shapes/hull.hpp"

namespace enfilade::collision {
namespace {

constexpr double kMaxShear = 1e-3;       // limit of E; first-order bounds are invalid above it
constexpr std::size_t kMaxCorners = 40;  // of a clipped triangle: a plane adds at most one

HullPlanes::Plane computeFacePlane(const Hull& hull, const std::vector<std::uint32_t>& face) {
  const Vec3& origin = hull.vertices[face[0]];
  Vec3 bestCross = Vec3::Zero();
  double eta = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i + 1 < face.size(); ++i) {
    const Vec3 e1 = hull.vertices[face[i]] - origin, e2 = hull.vertices[face[i + 1]] - origin;
    const Vec3 cross = e1.cross(e2);
    const double error = 10 * kRoundoff * e1.norm() * e2.norm() / cross.norm() + 4 * kRoundoff;
    if (error < eta) eta = error, bestCross = cross;
  }
  HullPlanes::Plane plane{bestCross / bestCross.norm(), 0, 0};
  plane.height = plane.normal.dot(origin) - (3 * eta + 8 * kRoundoff) * hull.radius;
  plane.support = plane.normal.dot(origin);
  for (const Vec3& v : hull.vertices) plane.support = std::max(plane.support, plane.normal.dot(v));
  plane.support += 8 * kRoundoff * hull.radius;
  return plane;
}

/// Upper bound of |R^T R - 1| in the Frobenius norm.
double computeShear(const Mat3& rotation) {
  return (rotation.transpose() * rotation - Mat3::Identity()).norm() + 16 * kRoundoff;
}

struct Polygon {
  std::array<Vec3, kMaxCorners> corners;
  std::size_t size = 0;
};

/// Clips the polygon to the half-space below the plane. False if the result is empty or has too
/// many corners.
bool clip(Polygon& polygon, const HullPlanes::Plane& plane) {
  ENFILADE_ASSERT(polygon.size > 0 && polygon.size <= kMaxCorners);
  std::array<double, kMaxCorners> above;
  bool cut = false;
  for (std::size_t i = 0; i < polygon.size; ++i) {
    above[i] = plane.normal.dot(polygon.corners[i]) - plane.height;
    cut |= above[i] > 0;
  }
  if (!cut) return true;
  Polygon below;
  for (std::size_t i = 0; i < polygon.size; ++i) {
    const std::size_t next = i + 1 == polygon.size ? 0 : i + 1;
    if (below.size + 2 > kMaxCorners) return false;
    if (above[i] <= 0) below.corners[below.size++] = polygon.corners[i];
    if ((above[i] <= 0) == (above[next] <= 0)) continue;
    const double fraction = above[i] / (above[i] - above[next]);
    below.corners[below.size++] =
        polygon.corners[i] + fraction * (polygon.corners[next] - polygon.corners[i]);
  }
  polygon = below;
  return polygon.size > 0;
}

double computeMinDepth(const HullPlanes& planes, const Vec3& point) {
  double depth = std::numeric_limits<double>::infinity();
  for (const HullPlanes::Plane& plane : planes.planes)
    depth = std::min(depth, plane.height - plane.normal.dot(point));
  return depth;
}

}  // namespace

HullPlanes::HullPlanes(const Hull& hull) : radius(hull.radius), initialized(true) {
  if (hull.faces.size() < 4) return;
  planes.reserve(hull.faces.size());
  for (const auto& face : hull.faces) {
    planes.push_back(computeFacePlane(hull, face));
    if (std::isfinite(planes.back().height)) continue;
    planes.clear();  // too thin for a valid bound
    return;
  }
}

double computeInteriorClearance(const HullPlanes& planes, const PlacedConvex& body,
                                const Triangle& triangle) {
  if (planes.planes.empty()) return 0;
  const double shear = body.rotation ? computeShear(*body.rotation) : 0;
  if (!(shear < kMaxShear)) return 0;
  Polygon polygon;
  double maxLength = planes.radius;
  for (const Vec3& corner : triangle) {
    Vec3 local = corner - body.translation;
    if (body.rotation) local = body.rotation->transpose() * local;
    maxLength = std::max(maxLength, local.norm());
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
  const double error = 2 * shear * planes.radius + (4 * clips + 64) * kRoundoff * maxLength;
  return std::max(0.0, (computeMinDepth(planes, mean) - error) * (1 - 4 * kMaxShear));
}

}  // namespace enfilade::collision
