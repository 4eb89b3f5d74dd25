// Steps
//  1. The vertices of A that may be farthest along the direction, and those of B against it
//     (minkowski.hpp): only their differences can be negative along it, or zero.
//  2. Each difference's sign along the direction, by sums of doubles that keep every rounding error
//     as a term of its own (J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast
//     Robust Geometric Predicates", 1997). None may be negative.
//  3. Those that are zero lie in a plane through the origin. Seen along an axis that the plane is
//     not parallel to, they surround the origin if one can go around it from one to the next with
//     left turns only; or one of them is it, or two lie on opposite sides of it. Turns by their
//     rounding bound, or exactly where both points are.
#include "collision/narrow_phase/touching_certificate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

namespace enfilade::collision {
namespace {

constexpr std::size_t kMostVertices = 16;  // of a face; with more, the proof is left to others

/// A sum of doubles, exactly: no two terms overlap, ascending in magnitude.
class ExactSum {
 public:
  void add(double term) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < count_; ++k) {  // Shewchuk's grow-expansion
      const double sum = term + terms_[k];
      const double was = sum - term;
      const double lost = (term - (sum - was)) + (terms_[k] - was);
      if (lost != 0) terms_[kept++] = lost;
      term = sum;
    }
    if (term != 0) terms_[kept++] = term;
    count_ = kept;
  }
  /// Exact while nothing under- or overflows; `safe` is cleared where that may have happened.
  void addProduct(double a, double b) {
    const double product = a * b;
    if (product == 0) {
      safe_ = safe_ && (a == 0 || b == 0);
      return;
    }
    safe_ = safe_ && std::abs(product) > 0x1p-900 && std::max(std::abs(a), std::abs(b)) < 0x1p900;
    const auto [aHigh, aLow] = split(a);
    const auto [bHigh, bLow] = split(b);
    add(((aHigh * bHigh - product) + aHigh * bLow + aLow * bHigh) + aLow * bLow);
    add(product);
  }
  bool safe() const { return safe_; }
  int sign() const { return count_ == 0 ? 0 : terms_[count_ - 1] > 0 ? 1 : -1; }
  /// Nothing when it is no double.
  std::optional<double> value() const {
    if (!safe_ || count_ > 1) return std::nullopt;
    return count_ == 0 ? 0.0 : terms_[0];
  }

 private:
  static std::pair<double, double> split(double a) {  // Veltkamp: 26 bits each
    const double scaled = 134217729.0 * a;
    const double high = scaled - (scaled - a);
    return {high, a - high};
  }
  std::array<double, 16> terms_;  // six of three products, and a few to spare
  std::size_t count_ = 0;
  bool safe_ = true;
};

/// A vector whose coordinates are known to be exact, or not.
struct Known {
  Vec3 value;
  std::array<bool, 3> exact{};
};

/// A vertex, turned.
Known turned(const PlacedBody& placed, std::uint32_t i) {
  const Vec3& p = placed.body->vertices[i];
  if (!placed.body->rotation) return {p, {true, true, true}};
  Known point{placed.turned<double>(i)};
  for (int k = 0; k < 3; ++k) {
    ExactSum sum;
    for (int j = 0; j < 3; ++j) sum.addProduct((*placed.body->rotation)(k, j), p[j]);
    const auto value = sum.value();
    point.exact[k] = value.has_value();
    if (value) point.value[k] = *value;
  }
  return point;
}

Known differenceOf(const Known& a, const Known& b, const MinkowskiDifference& difference) {
  const Vec3 &tA = difference.a.body->translation, &tB = difference.b.body->translation;
  Known w{b.value + (tB - tA) - a.value};
  for (int k = 0; k < 3; ++k) {
    if (!a.exact[k] || !b.exact[k]) continue;
    ExactSum sum;
    for (const double term : {b.value[k], tB[k], -a.value[k], -tA[k]}) sum.add(term);
    const auto value = sum.value();
    w.exact[k] = value.has_value();
    if (value) w.value[k] = *value;
  }
  return w;
}

/// The exact sign of direction . w; nothing where it is not known.
std::optional<int> signAlong(const Vec3& direction, const Known& w) {
  ExactSum sum;
  for (int k = 0; k < 3; ++k) {
    if (direction[k] == 0) continue;
    if (!w.exact[k]) return std::nullopt;
    sum.addProduct(direction[k], w.value[k]);
  }
  if (!sum.safe()) return std::nullopt;
  return sum.sign();
}

/// A point of the plane, seen along an axis.
struct Seen {
  double x, y;
  bool exact;
};

/// Of the turn from p to q around the origin: left is positive; nothing where it is not known.
/// Coordinates of at most `reach` are off by 10u reach.
std::optional<int> turnOf(const Seen& p, const Seen& q, double reach) {
  const double cross = p.x * q.y - p.y * q.x;
  const double bound = 64 * kUnit * reach * reach + std::numeric_limits<double>::min();
  if (std::abs(cross) > bound) return cross > 0 ? 1 : -1;
  if (!p.exact || !q.exact) return std::nullopt;
  ExactSum sum;
  sum.addProduct(p.x, q.y);
  sum.addProduct(-p.y, q.x);
  if (!sum.safe()) return std::nullopt;
  return sum.sign();
}

bool turnsLeft(const Seen& p, const Seen& q, double reach) {
  return turnOf(p, q, reach) == 1;
}

/// Around the origin with left turns only, each as wide as can be.
bool surroundsOrigin(std::span<const Seen> points, double reach) {
  const Seen* at = &points[0];
  const Seen* first = at;
  for (std::size_t step = 0; step < points.size(); ++step) {
    if (step > 0 && turnsLeft(*at, *first, reach)) return true;
    const Seen* next = nullptr;
    for (const Seen& point : points)
      if (turnsLeft(*at, point, reach) && (!next || turnsLeft(*next, point, reach))) next = &point;
    if (!next) return false;
    at = next;
  }
  return false;
}

bool holdsOrigin(std::span<const Seen> points, double reach) {
  if (points.size() > 2 && surroundsOrigin(points, reach)) return true;
  for (const Seen& p : points) {
    if (!p.exact) continue;
    if (p.x == 0 && p.y == 0) return true;
    for (const Seen& q : points) {
      const bool opposite = p.x * q.x < 0 || p.y * q.y < 0;
      if (q.exact && opposite && turnOf(p, q, reach) == 0) return true;
    }
  }
  return false;
}

struct Farthest {
  std::array<Known, kMostVertices> at;
  std::size_t count = 0;
  std::span<const Known> all() const { return {at.data(), count}; }
};

/// The vertices that may be farthest along `direction`; false when they are too many.
bool collectFarthest(const PlacedBody& placed, const Vec3& direction, std::uint32_t start,
                     Farthest& found) {
  const Vec3 local = placed.bodyFromWorld<double>(direction);
  const double slack = supportSlack(placed, direction.lpNorm<1>());
  const Summit summit = climb(placed, local, slack, start);
  std::size_t seen = 0;
  forEachFarthest(placed, local, slack, summit, [&](std::uint32_t i) {
    if (++seen <= kMostVertices) found.at[found.count++] = turned(placed, i);
  });
  return seen <= kMostVertices;
}

}  // namespace

bool provedTouching(const MinkowskiDifference& difference, const Vec3& direction, VertexPair hint) {
  Farthest ofA, ofB;
  if (!collectFarthest(difference.a, direction, hint.a, ofA) ||
      !collectFarthest(difference.b, -direction, hint.b, ofB))
    return false;
  Eigen::Index along = 0;
  direction.cwiseAbs().maxCoeff(&along);
  const Eigen::Index x = (along + 1) % 3, y = (along + 2) % 3;
  std::array<Seen, kMostVertices * kMostVertices> inPlane;
  std::size_t count = 0;
  for (const Known& a : ofA.all()) {
    for (const Known& b : ofB.all()) {
      const Known w = differenceOf(a, b, difference);
      const auto sign = signAlong(direction, w);
      if (!sign || *sign < 0) return false;
      if (*sign == 0) inPlane[count++] = {w.value[x], w.value[y], w.exact[x] && w.exact[y]};
    }
  }
  return count > 0 && holdsOrigin(std::span(inPlane).first(count), difference.reach);
}

}  // namespace enfilade::collision
