#include "collision/minkowski/minkowski.hpp"

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

/// The vertex that is farthest along a direction of the body's own frame.
std::uint32_t farthest(const PlacedBody& placed, const WideVec& direction, const Vec3& rounded,
                       double length, const Summit& summit) {
  std::uint32_t vertex = summit.vertex;
  Wide most = -std::numeric_limits<Wide>::infinity();
  forEachFarthest(placed, rounded, supportSlack(placed, length), summit, [&](std::uint32_t i) {
    const Vec3& p = placed.body->vertices[i];
    const Wide along = direction.x() * p.x() + direction.y() * p.y() + direction.z() * p.z();
    if (!(along > most)) return;
    vertex = i, most = along;
  });
  return vertex;
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

Least TurnedDirection::least(const Summits& summits) const {
  Least least{summits.pair()};
  if (!summits.a.alone)
    least.pair.a =
        farthest(difference.a, inA, difference.a.bodyFromWorld<double>(rounded), length, summits.a);
  if (!summits.b.alone)
    least.pair.b = farthest(difference.b, -inB, difference.b.bodyFromWorld<double>(-rounded),
                            length, summits.b);
  least.along = along(least.pair);
  least.bound = least.along - error();
  return least;
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
  const TurnedDirection turned(difference, direction, rounded, longer);
  const Least least = turned.least(climb(difference, rounded, longer, hint));
  hint = least.pair;
  return least;
}

}  // namespace enfilade::collision
