#include "collision/minkowski/minkowski.hpp"

#include <stdexcept>
#include <string>

namespace enfilade::collision {
namespace {

void requireFinite(const PlacedConvex& convex, const char* name) {
  const auto refuse = [&](const char* what) {
    throw std::invalid_argument(std::string("body ") + name + ": " + what + " is not finite");
  };
  if (!convex.translation.allFinite()) refuse("the translation");
  if (convex.rotation && !convex.rotation->allFinite()) refuse("the rotation");
  for (const Vec3& p : convex.vertices)
    if (!p.allFinite()) refuse("a vertex");
}

/// Finds the exact support vertex along a direction in the body's frame.
std::uint32_t findFarthestVertex(const BoundedConvex& convex, const LongVec3& direction,
                                 const SupportVertex& support) {
  std::uint32_t vertex = support.vertex;
  LongReal maxProjection = -std::numeric_limits<LongReal>::infinity();
  forEachSupportCandidate(convex, support, [&](std::uint32_t i) {
    const Vec3& p = convex.shape->vertices[i];
    const LongReal projection =
        direction.x() * p.x() + direction.y() * p.y() + direction.z() * p.z();
    if (!(projection > maxProjection)) return;
    vertex = i, maxProjection = projection;
  });
  return vertex;
}

/// Whether a direction of this length must be scaled, so that products neither over- nor underflow.
bool needsScaling(LongReal length) {
  return !(length > 1e-150L && length < 1e150L);
}

}  // namespace

double computeRadiusBound(const PlacedConvex& convex) {
  if (convex.vertices.empty()) throw std::invalid_argument("a body has no vertices");
  double maxCoordinate = 0, zero = 0;
  for (const Vec3& p : convex.vertices) {
    maxCoordinate = std::max(maxCoordinate, p.cwiseAbs().maxCoeff());
    zero += 0 * p.x() + 0 * p.y() + 0 * p.z();  // NaN if a coordinate is not finite
  }
  return maxCoordinate * 1.7320508075688774 + zero;  // sqrt(3); a norm might overflow
}

void requireFinite(const PlacedConvex& a, const PlacedConvex& b) {
  requireFinite(a, "A");  // finite coordinates beyond 1e308 are accepted
  requireFinite(b, "B");
}

void hillClimbPair(const MinkowskiDifference& difference, const Vec3& direction, double length,
                   VertexPair hint, double enough, SupportPair& supports) {
  const BoundedConvex &a = difference.a, &b = difference.b;
  supports.a.slack = computeSupportSlack(a, length);
  supports.b.slack = computeSupportSlack(b, length);
  supports.a.direction = a.bodyFromWorld<double>(direction);
  supports.b.direction = b.bodyFromWorld<double>(-direction);
  hillClimb(a, hint.a, enough, supports.a);
  hillClimb(b, hint.b, enough, supports.b);
}

CertifiedSupport RotatedDirection::certify(const SupportPair& supports) const {
  CertifiedSupport result{supports.pair()};
  if (!supports.a.unique) result.pair.a = findFarthestVertex(difference.a, inA, supports.a);
  if (!supports.b.unique) result.pair.b = findFarthestVertex(difference.b, -inB, supports.b);
  result.projection = project(result.pair);
  result.lowerBound = result.projection - errorBound();
  return result;
}

CertifiedSupport findCertifiedSupport(const MinkowskiDifference& difference,
                                      const LongVec3& direction, LongReal length,
                                      VertexPair& hint) {
  if (needsScaling(length)) {
    const LongReal scale = 1 / length;
    CertifiedSupport support =
        findCertifiedSupport(difference, LongVec3(direction * scale), LongReal{1}, hint);
    support.projection *= length;
    support.lowerBound =
        (support.lowerBound - std::abs(support.lowerBound) * 8 * kLongRoundoff) * length;
    return support;
  }
  const Vec3 rounded = direction.cast<double>();
  const double lengthBound = static_cast<double>(length) * (1 + 8 * kRoundoff);
  const RotatedDirection rotatedDirection(difference, direction, lengthBound);
  const CertifiedSupport support =
      rotatedDirection.certify(hillClimbPair(difference, rounded, lengthBound, hint));
  hint = support.pair;
  return support;
}

}  // namespace enfilade::collision
