// Rounding. Body vertices are rotated and translated by t - origin, triangle vertices by -origin.
// All values are below L = extent + |t - origin| + 2r. The error of a vertex is less than 8u L, the
// error of a gap between boxes, between spheres or along a unit axis is less than 16u L. Each bound
// is reduced by kRoundingPad L = 64u L. Results stay exact: computeSeparation() decides them.
#include "collision/compound/query_bounds.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::collision {
namespace {

constexpr double kRoundingPad = 64 * 0x1p-53;  // see the head of this file

double computeAabbDistance(const QueryBounds& bounds, const Vec3& min, const Vec3& max) {
  const Vec3 gap = (min - bounds.box.max).cwiseMax(bounds.box.min - max).cwiseMax(0.0);
  const Vec3 out = (min - bounds.centre).cwiseMax(bounds.centre - max).cwiseMax(0.0);
  return std::max(std::sqrt(gap.squaredNorm()), std::sqrt(out.squaredNorm()) - bounds.radius);
}

double minProjection(const Vec3& axis, const Triangle& t) {
  return std::min({axis.dot(t[0]), axis.dot(t[1]), axis.dot(t[2])});
}

double maxProjection(const Vec3& axis, const Eigen::ArrayX3d& vertices) {
  return (axis.x() * vertices.col(0) + axis.y() * vertices.col(1) + axis.z() * vertices.col(2))
      .maxCoeff();
}

}  // namespace

void computeQueryBounds(const PlacedConvex& body, double bodyRadius, const BoxTree& tree,
                        const Vec3& axis, QueryBounds& bounds) {
  const Vec3 shift = body.translation - tree.origin;
  const auto count = static_cast<Eigen::Index>(body.vertices.size());
  bounds.vertices.resize(count, 3);
  bounds.box = {};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Vec3& v = body.vertices[static_cast<std::size_t>(i)];
    const Vec3 placed = (body.rotation ? Vec3(*body.rotation * v) : v) + shift;
    bounds.box.include(placed);
    bounds.vertices.row(i) = placed.transpose().array();
  }
  bounds.centre = bounds.box.centre();
  double squared = 0;
  for (Eigen::Index i = 0; i < count; ++i)
    squared = std::max(
        squared,
        (bounds.vertices.row(i) - bounds.centre.transpose().array()).matrix().squaredNorm());
  bounds.radius = std::sqrt(squared);
  const double length = axis.norm();
  bounds.axis = length > 0 && std::isfinite(length) ? Vec3(axis / length) : Vec3(Vec3::Zero());
  bounds.support = maxProjection(bounds.axis, bounds.vertices);
  bounds.pad = kRoundingPad * (tree.extent + shift.cwiseAbs().sum() + 2 * bodyRadius);
}

double computeLowerBound(const QueryBounds& bounds, const FloatAabb& box) {
  const Vec3 min(box.min[0], box.min[1], box.min[2]), max(box.max[0], box.max[1], box.max[2]);
  double axisGap = -bounds.support;
  for (int i = 0; i < 3; ++i) axisGap += bounds.axis[i] * (bounds.axis[i] > 0 ? min[i] : max[i]);
  return std::max(computeAabbDistance(bounds, min, max), axisGap) - bounds.pad;
}

double computeLowerBound(const QueryBounds& bounds, const Triangle& inTree) {
  const Aabb box = computeAabb(inTree);
  const double axisGap = minProjection(bounds.axis, inTree) - bounds.support;
  return std::max(computeAabbDistance(bounds, box.min, box.max), axisGap) - bounds.pad;
}

double computeLowerBoundAlong(const QueryBounds& bounds, const Vec3& axis, const Triangle& inTree) {
  const double gap = minProjection(axis, inTree) - maxProjection(axis, bounds.vertices);
  const double length = axis.norm();
  return length > 0 && std::isfinite(gap) ? gap / length - bounds.pad : -1;
}

}  // namespace enfilade::collision
