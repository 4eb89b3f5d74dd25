// Rounding is as in minkowski.hpp. The dot product of the direction, rotated into a body's frame,
// with any vertex is off by less than 8u |d| S. The maximum product is therefore equally close to
// the true maximum. Both maxima, the shift and its product, and the two differences are together
// off by less than 40u |d| reach.
#include "collision/narrow_phase/axis_separation.hpp"

#include "collision/assert.hpp"
#include "collision/minkowski/minkowski.hpp"

namespace enfilade::collision {
namespace {

constexpr std::size_t kSmallHullThreshold =
    32;  // vertices; above it, hill climbing is cheaper than a scan

struct FarthestVertex {
  std::uint32_t vertex = 0;
  double projection = 0;
};

FarthestVertex findFarthestVertex(const PlacedConvex& convex, const Vec3& direction) {
  FarthestVertex best{0, direction.dot(convex.vertices[0])};
  for (std::uint32_t i = 1; i < convex.vertices.size(); ++i) {
    const double projection = direction.dot(convex.vertices[i]);
    best.vertex =
        projection > best.projection ? i : best.vertex;  // branchless: avoids mispredictions
    best.projection = std::max(best.projection, projection);
  }
  return best;
}

bool isSmallHull(const PlacedConvex& convex) {
  return convex.vertices.size() <= kSmallHullThreshold || !convex.hull;
}

AxisSeparation computeByHillClimbing(const PlacedConvex& a, const PlacedConvex& b,
                                     const Vec3& direction) {
  const MinkowskiDifference difference(a, b);
  VertexPair hint;
  const LongVec3 axis = direction.cast<LongReal>();
  const LongReal length = axis.norm();
  const CertifiedSupport support = findCertifiedSupport(difference, axis, length, hint);
  const LongReal lowerBound = support.lowerBound / length;
  return {static_cast<double>(support.projection / length),
          static_cast<double>(lowerBound - std::abs(lowerBound) * 2 * kRoundoff), support.pair};
}

}  // namespace

AxisSeparation computeAxisSeparation(const PlacedConvex& a, const PlacedConvex& b,
                                     const Vec3& direction) {
  ENFILADE_ASSERT(!(std::abs(direction.squaredNorm() - 1) > 1e-6));
  if (!isSmallHull(a) || !isSmallHull(b)) return computeByHillClimbing(a, b, direction);
  const BoundedConvex boundedA(a), boundedB(b);
  const Vec3 shift = b.translation - a.translation;
  const double reach =
      (boundedA.radius + boundedB.radius + shift.cwiseAbs().maxCoeff()) * kMaxUnitLength;
  const FarthestVertex onA = findFarthestVertex(a, boundedA.bodyFromWorld<double>(direction));
  const FarthestVertex onB = findFarthestVertex(b, boundedB.bodyFromWorld<double>(-direction));
  AxisSeparation separation{
      direction.dot(shift) - onB.projection - onA.projection, 0, {onA.vertex, onB.vertex}};
  separation.lowerBound = separation.value - 40 * kRoundoff * kMaxUnitLength * reach;
  separation.lowerBound -=
      std::abs(separation.lowerBound) * 64 * kRoundoff;  // the rounding of the direction's length
  if (!std::isfinite(separation.lowerBound))
    separation.lowerBound = -std::numeric_limits<double>::infinity();
  return separation;
}

}  // namespace enfilade::collision
