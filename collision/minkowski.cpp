#include "collision/minkowski.hpp"

namespace enfilade::collision {
namespace {

double greatestRadius(const ConvexBody& body) {
  if (body.hull) return body.hull->radius;
  double greatest = 0;
  for (const Vec3& p : body.vertices) greatest = std::max(greatest, p.cwiseAbs().maxCoeff());
  return greatest * 1.7320508075688774;  // sqrt(3); a norm might overflow
}

/// The greatest norm of a row or a column: 1 up to rounding for a rotation, but any matrix will do.
double greatestNorm(const Mat3* rotation) {
  if (!rotation) return 1;
  return std::sqrt(std::max(rotation->rowwise().squaredNorm().maxCoeff(),
                            rotation->colwise().squaredNorm().maxCoeff()));
}

/// The least value of sign * direction . point over one body, and the vertex.
BodySupport farthest(const PlacedBody& placed, const WideVec& direction, const Vec3& rounded,
                     std::uint32_t& hint) {
  BodySupport support;
  bool first = true;
  const Vec3 local = placed.bodyFromWorld(rounded);
  forEachFarthest(placed, local, supportSlack(placed), hint, [&](std::uint32_t i) {
    const Wide along = direction.dot(placed.turned(i));
    if (!first && along <= support.most) return;
    support = {i, along};
    first = false;
  });
  hint = support.best;
  return support;
}

}  // namespace

PlacedBody::PlacedBody(const ConvexBody& placed)
    : body(&placed),
      size(greatestRadius(placed) * greatestNorm(placed.rotation) * (1 + 16 * kUnit)) {}

WideVec PlacedBody::turned(std::uint32_t i) const {
  const Vec3& p = body->vertices[i];
  const Wide x = p.x(), y = p.y(), z = p.z();
  if (!body->rotation) return {x, y, z};
  const Mat3& r = *body->rotation;
  return {r(0, 0) * x + r(0, 1) * y + r(0, 2) * z, r(1, 0) * x + r(1, 1) * y + r(1, 2) * z,
          r(2, 0) * x + r(2, 1) * y + r(2, 2) * z};
}

Vec3 PlacedBody::bodyFromWorld(const Vec3& direction) const {
  return body->rotation ? Vec3(body->rotation->transpose() * direction) : direction;
}

MinkowskiDifference::MinkowskiDifference(const ConvexBody& bodyA, const ConvexBody& bodyB)
    : a(bodyA),
      b(bodyB),
      shift(bodyB.translation.cast<Wide>() - bodyA.translation.cast<Wide>()),
      reach((a.size + b.size + static_cast<double>(shift.cwiseAbs().maxCoeff())) *
            (1 + 8 * kUnit)) {}

Vec3 directionInDoubles(const WideVec& direction) {
  int exponent = 0;
  std::frexp(direction.cwiseAbs().maxCoeff(), &exponent);
  return (direction * std::ldexp(Wide{1}, -exponent)).cast<double>();
}

Least leastAlong(const MinkowskiDifference& difference, const WideVec& direction,
                 VertexPair& hint) {
  const Vec3 rounded = directionInDoubles(direction);
  const BodySupport ofA = farthest(difference.a, direction, rounded, hint.a);
  const BodySupport ofB = farthest(difference.b, -direction, -rounded, hint.b);
  Least least;
  least.pair = {ofA.best, ofB.best};
  least.along = direction.dot(difference.shift) - ofB.most - ofA.most;
  // Each of three products of a direction and a vector: the vector's own error, and 3 eta |d| reach
  // by Cauchy; |d|_1 <= sqrt(3) |d|; two differences of at most 3 |d| reach.
  least.bound = least.along - 16 * kWideUnit * direction.norm() * difference.reach;
  return least;
}

}  // namespace enfilade::collision
