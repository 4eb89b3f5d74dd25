// Rounding. The body's vertices are turned and moved by t - origin, those of triangles by -origin.
// All is smaller than L = extent + |t - origin| + 2r; a vertex is off by less than 8u L, and a gap
// of boxes, of balls, or along a unit axis by less than 16u L: kPad L = 64u L is subtracted from
// each bound. That weakens the search by a hair; its answers are decide()'s.
#include "collision/compound/query_bounds.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::collision {
namespace {

constexpr double kPad = 64 * 0x1p-53;  // see the file's head

double boxesApart(const MeshProbe& probe, const Vec3& min, const Vec3& max) {
  const Vec3 gap = (min - probe.box.max).cwiseMax(probe.box.min - max).cwiseMax(0.0);
  const Vec3 out = (min - probe.centre).cwiseMax(probe.centre - max).cwiseMax(0.0);
  return std::max(std::sqrt(gap.squaredNorm()), std::sqrt(out.squaredNorm()) - probe.radius);
}

double leastAlong(const Vec3& axis, const Triangle& t) {
  return std::min({axis.dot(t[0]), axis.dot(t[1]), axis.dot(t[2])});
}

double mostAlong(const Vec3& axis, const Eigen::ArrayX3d& vertices) {
  return (axis.x() * vertices.col(0) + axis.y() * vertices.col(1) + axis.z() * vertices.col(2))
      .maxCoeff();
}

}  // namespace

void placeProbe(const ConvexBody& body, double bodyRadius, const BoxTree& tree, const Vec3& axis,
                MeshProbe& probe) {
  const Vec3 shift = body.translation - tree.origin;
  const auto count = static_cast<Eigen::Index>(body.vertices.size());
  probe.vertices.resize(count, 3);
  probe.box = {};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Vec3& v = body.vertices[static_cast<std::size_t>(i)];
    const Vec3 placed = (body.rotation ? Vec3(*body.rotation * v) : v) + shift;
    probe.box.include(placed);
    probe.vertices.row(i) = placed.transpose().array();
  }
  probe.centre = probe.box.centre();
  double squared = 0;
  for (Eigen::Index i = 0; i < count; ++i)
    squared = std::max(
        squared, (probe.vertices.row(i) - probe.centre.transpose().array()).matrix().squaredNorm());
  probe.radius = std::sqrt(squared);
  const double length = axis.norm();
  probe.axis = length > 0 && std::isfinite(length) ? Vec3(axis / length) : Vec3(Vec3::Zero());
  probe.support = mostAlong(probe.axis, probe.vertices);
  probe.pad = kPad * (tree.extent + shift.cwiseAbs().sum() + 2 * bodyRadius);
}

double lowerBound(const MeshProbe& probe, const NarrowBox& box) {
  const Vec3 min(box.min[0], box.min[1], box.min[2]), max(box.max[0], box.max[1], box.max[2]);
  double along = -probe.support;
  for (int i = 0; i < 3; ++i) along += probe.axis[i] * (probe.axis[i] > 0 ? min[i] : max[i]);
  return std::max(boxesApart(probe, min, max), along) - probe.pad;
}

double lowerBound(const MeshProbe& probe, const Triangle& inTree) {
  const Box box = boxOf(inTree);
  const double along = leastAlong(probe.axis, inTree) - probe.support;
  return std::max(boxesApart(probe, box.min, box.max), along) - probe.pad;
}

double lowerBoundAlong(const MeshProbe& probe, const Vec3& axis, const Triangle& inTree) {
  const double gap = leastAlong(axis, inTree) - mostAlong(axis, probe.vertices);
  const double length = axis.norm();
  return length > 0 && std::isfinite(gap) ? gap / length - probe.pad : -1;
}

}  // namespace enfilade::collision
