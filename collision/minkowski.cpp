#include "collision/minkowski.hpp"

namespace enfilade::collision {
namespace {

double greatestRadius(const ConvexBody& body) {
  if (body.hull) return body.hull->radius;
  double greatest = 0;
  for (const Vec3& p : body.vertices) greatest = std::max(greatest, p.cwiseAbs().maxCoeff());
  return greatest * 1.7320508075688774;  // sqrt(3); a norm might overflow
}

/// The greatest coordinate of a body along a direction of its own frame.
struct Support {
  std::uint32_t vertex = 0;
  Wide along = 0;
};

Support farthest(const PlacedBody& placed, const WideVec& direction, std::uint32_t& hint) {
  Support support;
  bool first = true;
  const Vec3 rounded = direction.cast<double>();
  forEachFarthest(
      placed, rounded, supportSlack(placed, rounded.lpNorm<1>()), hint, [&](std::uint32_t i) {
        const Vec3& p = placed.body->vertices[i];
        const Wide along = direction.x() * p.x() + direction.y() * p.y() + direction.z() * p.z();
        if (!first && along <= support.along) return;
        support = {i, along};
        first = false;
      });
  hint = support.vertex;
  return support;
}

/// Into the range of doubles, where products neither over- nor underflow.
bool needsScaling(Wide length) {
  return !(length > 1e-150L && length < 1e150L);
}

}  // namespace

PlacedBody::PlacedBody(const ConvexBody& placed)
    : body(&placed),
      size(greatestRadius(placed) * (placed.rotation ? placed.rotation->norm() : 1) *
           (1 + 16 * kUnit)) {}

MinkowskiDifference::MinkowskiDifference(const ConvexBody& bodyA, const ConvexBody& bodyB)
    : a(bodyA),
      b(bodyB),
      shift(bodyB.translation.cast<Wide>() - bodyA.translation.cast<Wide>()),
      reach((a.size + b.size + static_cast<double>(shift.cwiseAbs().maxCoeff())) *
            (1 + 8 * kUnit)) {}

Least leastAlong(const MinkowskiDifference& difference, const WideVec& direction, Wide length,
                 VertexPair& hint) {
  if (needsScaling(length)) {
    const Wide scale = 1 / length;
    Least least = leastAlong(difference, direction * scale, 1, hint);
    least.along *= length;
    least.bound = (least.bound - std::abs(least.bound) * 8 * kWideUnit) * length;
    return least;
  }
  const Support ofA = farthest(difference.a, difference.a.bodyFromWorld<Wide>(direction), hint.a);
  const Support ofB = farthest(difference.b, difference.b.bodyFromWorld<Wide>(-direction), hint.b);
  Least least;
  least.pair = {ofA.vertex, ofB.vertex};
  least.along = direction.dot(difference.shift) - ofB.along - ofA.along;
  // Each of three products of a direction and a vector: the vector's own error, and 3 eta |d| reach
  // by Cauchy; |d|_1 <= sqrt(3) |d|; two differences of at most 3 |d| reach.
  least.bound = least.along - 16 * kWideUnit * length * difference.reach;
  return least;
}

}  // namespace enfilade::collision
