// Rounding, as in minkowski.hpp: a product of the direction, turned into a body's frame, with a
// vertex is off by less than 8u |d| S, whichever vertex it is, so the greatest product of all is as
// near to the greatest true one. Those of both bodies, the shift and its product, and the two
// differences together are off by less than 40u |d| reach.
#include "collision/narrow_phase/axis_separation.hpp"

#include "collision/minkowski/minkowski.hpp"

namespace enfilade::collision {
namespace {

constexpr std::size_t kFew = 32;  // vertices: from there on, climbing over edges costs less

struct Farthest {
  std::uint32_t vertex = 0;
  double along = 0;
};

Farthest farthestOfAll(const ConvexBody& body, const Vec3& direction) {
  Farthest best{0, direction.dot(body.vertices[0])};
  for (std::uint32_t i = 1; i < body.vertices.size(); ++i) {
    const double along = direction.dot(body.vertices[i]);
    best.vertex = along > best.along ? i : best.vertex;  // no branch: no guess of it to miss
    best.along = std::max(best.along, along);
  }
  return best;
}

bool hasFew(const ConvexBody& body) {
  return body.vertices.size() <= kFew || !body.hull;
}

Gap gapByClimbing(const ConvexBody& a, const ConvexBody& b, const Vec3& direction) {
  const MinkowskiDifference difference(a, b);
  VertexPair hint;
  const WideVec axis = direction.cast<Wide>();
  const Wide length = axis.norm();
  const Least least = leastAlong(difference, axis, length, hint);
  const Wide proved = least.bound / length;
  return {static_cast<double>(least.along / length),
          static_cast<double>(proved - std::abs(proved) * 2 * kUnit), least.pair};
}

}  // namespace

Gap gapAlong(const ConvexBody& a, const ConvexBody& b, const Vec3& direction) {
  if (!hasFew(a) || !hasFew(b)) return gapByClimbing(a, b, direction);
  const PlacedBody placedA(a), placedB(b);
  const Vec3 shift = b.translation - a.translation;
  const double reach = (placedA.size + placedB.size + shift.cwiseAbs().maxCoeff()) * kUnitLength;
  const Farthest onA = farthestOfAll(a, placedA.bodyFromWorld<double>(direction));
  const Farthest onB = farthestOfAll(b, placedB.bodyFromWorld<double>(-direction));
  Gap gap{direction.dot(shift) - onB.along - onA.along, 0, {onA.vertex, onB.vertex}};
  gap.proved = gap.value - 40 * kUnit * kUnitLength * reach;
  gap.proved -= std::abs(gap.proved) * 64 * kUnit;  // the direction's length
  if (!std::isfinite(gap.proved)) gap.proved = -std::numeric_limits<double>::infinity();
  return gap;
}

}  // namespace enfilade::collision
