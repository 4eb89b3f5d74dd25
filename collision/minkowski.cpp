#include "collision/minkowski.hpp"

#include <stdexcept>
#include <string>

namespace enfilade::collision {
namespace {

void requireFinite(const ConvexBody& body, const char* name) {
  const auto refuse = [&](const char* what) {
    throw std::invalid_argument(std::string("body ") + name + ": " + what + " is not finite");
  };
  if (!body.translation.allFinite()) refuse("the translation");
  if (body.rotation && !body.rotation->allFinite()) refuse("the rotation");
  for (const Vec3& p : body.vertices)
    if (!p.allFinite()) refuse("a vertex");
}

/// The greatest coordinate of a body along a direction of its own frame.
struct Support {
  std::uint32_t vertex = 0;
  Wide along = 0;
};

Support farthest(const PlacedBody& placed, const WideVec& direction, const Vec3& rounded,
                 double length, const Summit& summit) {
  Support support;
  bool first = true;
  forEachFarthest(placed, rounded, supportSlack(placed, length), summit, [&](std::uint32_t i) {
    const Vec3& p = placed.body->vertices[i];
    const Wide along = direction.x() * p.x() + direction.y() * p.y() + direction.z() * p.z();
    if (!first && along <= support.along) return;
    support = {i, along};
    first = false;
  });
  return support;
}

/// `rounded`: `direction` in doubles, `length` at least that of both.
Least leastFrom(const MinkowskiDifference& difference, const WideVec& direction,
                const Vec3& rounded, double length, const Summits& summits) {
  const PlacedBody &a = difference.a, &b = difference.b;
  Least least;
  if (summits.alone()) {
    least.pair = summits.pair();
    least.along = direction.dot(difference(least.pair));
  } else {
    const Support ofA = farthest(a, a.bodyFromWorld<Wide>(direction),
                                 a.bodyFromWorld<double>(rounded), length, summits.a);
    const Support ofB = farthest(b, b.bodyFromWorld<Wide>(-direction),
                                 b.bodyFromWorld<double>(-rounded), length, summits.b);
    least.pair = {ofA.vertex, ofB.vertex};
    least.along = direction.dot(difference.shift()) - ofB.along - ofA.along;
  }
  // The point is off by 6 eta reach a coordinate, so by 6 sqrt(3) eta reach along the direction;
  // the product of two vectors rounds by 3 eta |d| |w|, |w| <= sqrt(3) reach. Turning the direction
  // instead of the vertices loses less.
  least.bound = least.along - 16 * kWideUnit * Wide{length} * difference.reach;
  return least;
}

/// Into the range of doubles, where products neither over- nor underflow.
bool needsScaling(Wide length) {
  return !(length > 1e-150L && length < 1e150L);
}

}  // namespace

double greatestRadius(const ConvexBody& body) {
  if (body.vertices.empty()) throw std::invalid_argument("a body has no vertices");
  double greatest = 0, zero = 0;
  for (const Vec3& p : body.vertices) {
    greatest = std::max(greatest, p.cwiseAbs().maxCoeff());
    zero += 0 * p.x() + 0 * p.y() + 0 * p.z();  // none, if a coordinate is none
  }
  return greatest * 1.7320508075688774 + zero;  // sqrt(3); a norm might overflow
}

void requireFinite(const ConvexBody& a, const ConvexBody& b) {
  requireFinite(a, "A");  // coordinates beyond 1e308 alone are no fault
  requireFinite(b, "B");
}

void climb(const MinkowskiDifference& difference, const Vec3& direction, double length,
           VertexPair hint, double enough, Summits& summits) {
  const PlacedBody &a = difference.a, &b = difference.b;
  summits.a = climb(a, a.bodyFromWorld<double>(direction), supportSlack(a, length), hint.a, enough);
  summits.b =
      climb(b, b.bodyFromWorld<double>(-direction), supportSlack(b, length), hint.b, enough);
}

Least leastAlong(const MinkowskiDifference& difference, const WideVec& direction, Wide length,
                 VertexPair& hint) {
  if (needsScaling(length)) {
    const Wide scale = 1 / length;
    Least least = leastAlong(difference, WideVec(direction * scale), Wide{1}, hint);
    least.along *= length;
    least.bound = (least.bound - std::abs(least.bound) * 8 * kWideUnit) * length;
    return least;
  }
  const Vec3 rounded = direction.cast<double>();
  const double longer = static_cast<double>(length) * (1 + 8 * kUnit);
  const Least least =
      leastFrom(difference, direction, rounded, longer, climb(difference, rounded, longer, hint));
  hint = least.pair;
  return least;
}

}  // namespace enfilade::collision
