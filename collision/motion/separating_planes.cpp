// Rounding. Let n be a plane's rounded normal. Let M be the sum of the magnitudes |x| + |y| + |z|
// of all points that a sum below takes in. A product n . p of a point is off by less than 4u M, a
// rotated one by less than 8u M (minkowski.hpp). Each of the few sums adds u M. |n| differs from 1
// by less than 4u, which moves a distance of at most M by as much. kSlack M = 128u M covers A's
// share as well as B's.
#include "collision/motion/separating_planes.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/minkowski/minkowski.hpp"

namespace enfilade::collision {
namespace {

constexpr double kSlack = 128 * kRoundoff;
// A scan trades its own time for queries that the box alone does not spare. It is short for
// triangles and boxes, which have at most this many vertices.
constexpr std::size_t kMaxScannedVertices = 8;

double sumOfMagnitudes(const Vec3& p) {
  return std::abs(p.x()) + std::abs(p.y()) + std::abs(p.z());
}

double findMaxProjection(std::span<const Vec3> vertices, const Vec3& direction) {
  double best = dot(direction, vertices[0]);
  for (const Vec3& vertex : vertices.subspan(1)) best = std::max(best, dot(direction, vertex));
  return best;
}

/// The least height of the box above the plane through the origin across `n`, less the slack.
double findBoxHeight(const Aabb& box, const Vec3& n) {
  const Vec3 lowest(n.x() > 0 ? box.min.x() : box.max.x(), n.y() > 0 ? box.min.y() : box.max.y(),
                    n.z() > 0 ? box.min.z() : box.max.z());
  return dot(n, lowest) - kSlack * sumOfMagnitudes(lowest);
}

/// The same for a body of few vertices, which is not turned.
double findHeight(const PlacedConvex& b, const Vec3& n) {
  double lowest = dot(n, b.vertices[0]), magnitude = sumOfMagnitudes(b.vertices[0]);
  for (const Vec3& vertex : b.vertices.subspan(1)) {
    lowest = std::min(lowest, dot(n, vertex));
    magnitude = std::max(magnitude, sumOfMagnitudes(vertex));
  }
  return lowest + dot(n, b.translation) - kSlack * (magnitude + sumOfMagnitudes(b.translation));
}

/// Bodies of many vertices are tested by their boxes alone.
bool isAbove(const PlacedConvex& b, const Aabb& boxOfB, const Vec3& normal, double height) {
  return findBoxHeight(boxOfB, normal) > height || (b.vertices.size() <= kMaxScannedVertices &&
                                                    !b.rotation && findHeight(b, normal) > height);
}

}  // namespace

SeparatingPlanes::Plane SeparatingPlanes::makePlane(const Vec3& axis) const {
  Plane plane;
  const Vec3 scaled =
      axis / computeMaxAbsCoordinate(axis);  // its square neither overflows nor underflows
  plane.normal = scaled / computeNorm(scaled);
  const Vec3 direction = BoundedConvex(a_).bodyFromWorld<double>(plane.normal);
  plane.support = findMaxProjection(a_.vertices, direction);
  plane.height = computeHeight(plane);
  return plane;
}

double SeparatingPlanes::computeHeight(const Plane& plane) const {
  const double magnitude = 2 * BoundedConvex(a_).radius + sumOfMagnitudes(a_.translation) +
                           sumOfMagnitudes(displacement_) + distance_;
  return plane.support + dot(plane.normal, a_.translation) +
         std::max(0.0, dot(plane.normal, displacement_)) + distance_ + kSlack * magnitude;
}

void SeparatingPlanes::reduceTo(const Vec3& displacement, double distance) {
  displacement_ = displacement;
  distance_ = distance;
  for (std::size_t i = 0; i < size_; ++i) planes_[i].height = computeHeight(planes_[i]);
}

/// Starts with the plane of the last miss: neighbours come one after the other.
template <class Misses>
bool SeparatingPlanes::isAny(const Misses& misses) {
  for (std::size_t i = 0, at = last_; i < size_; ++i, at = at + 1 == size_ ? 0 : at + 1) {
    if (!misses(planes_[at])) continue;
    last_ = at;
    return true;
  }
  return false;
}

bool SeparatingPlanes::haveMissed(const Aabb& box) {
  return isAny([&](const Plane& plane) { return findBoxHeight(box, plane.normal) > plane.height; });
}

bool SeparatingPlanes::haveMissed(const PlacedConvex& b, const Aabb& boxOfB) {
  return isAny([&](const Plane& plane) { return isAbove(b, boxOfB, plane.normal, plane.height); });
}

bool SeparatingPlanes::tryAxis(const PlacedConvex& b, const Aabb& boxOfB, const Vec3& axis) {
  if (axis.isZero(0)) return false;
  const Plane plane = makePlane(axis);
  ENFILADE_ASSERT(std::abs(plane.normal.squaredNorm() - 1) < 1e-6);
  if (!isAbove(b, boxOfB, plane.normal, plane.height)) return false;
  last_ = size_ < kMaxPlanes ? size_++ : next_++ % kMaxPlanes;
  planes_[last_] = plane;
  return true;
}

}  // namespace enfilade::collision
