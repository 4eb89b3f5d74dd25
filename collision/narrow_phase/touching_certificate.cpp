// Steps
//  1. Collect the possible support vertices of A along the direction and of B against it
//     (minkowski.hpp). Only their differences can have a negative or zero projection.
//  2. Compute the sign of each difference's projection by floating-point expansions (J. R.
//     Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
//     Predicates", 1997). No sign may be negative.
//  3. Differences with sign zero lie in a plane through the origin. They are projected along an
//     axis that is not parallel to the plane. They contain the origin if a cycle of left turns
//     leads around it. They also do if one of them is the origin, or if two lie on opposite sides
//     of it.
//     Orientations are decided by their rounding bound, or exactly if both points are exact.
#include "collision/narrow_phase/touching_certificate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

constexpr std::size_t kMaxFaceVertices =
    16;  // of a face; with more, certifyTouching() returns false

/// An exact sum of doubles (expansion): terms do not overlap and ascend in magnitude.
class ExactSum {
 public:
  void add(double term) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < count_; ++k) {  // Shewchuk's grow-expansion
      const double sum = term + terms_[k];
      const double restored = sum - term;
      const double lost = (term - (sum - restored)) + (terms_[k] - restored);
      if (lost != 0) terms_[kept++] = lost;
      term = sum;
    }
    ENFILADE_ASSERT(kept < terms_.size());
    if (term != 0) terms_[kept++] = term;
    count_ = kept;
  }
  /// Exact unless a product under- or overflows; isSafe() is false after a possible one.
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
  bool isSafe() const { return safe_; }
  int sign() const { return count_ == 0 ? 0 : terms_[count_ - 1] > 0 ? 1 : -1; }
  /// nullopt if the sum is not a double.
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
  std::array<double, 16> terms_;  // three products have six terms; the rest is reserve
  std::size_t count_ = 0;
  bool safe_ = true;
};

/// A vector with a flag for each coordinate that is exact.
struct TrackedVec3 {
  Vec3 value;
  std::array<bool, 3> exact{};
};

/// A vertex rotated to world axes.
TrackedVec3 rotateVertex(const BoundedConvex& convex, std::uint32_t i) {
  const Vec3& p = convex.shape->vertices[i];
  if (!convex.shape->rotation) return {p, {true, true, true}};
  TrackedVec3 point{convex.rotated<double>(i)};
  for (int k = 0; k < 3; ++k) {
    ExactSum sum;
    for (int j = 0; j < 3; ++j) sum.addProduct((*convex.shape->rotation)(k, j), p[j]);
    const auto value = sum.value();
    point.exact[k] = value.has_value();
    if (value) point.value[k] = *value;
  }
  return point;
}

TrackedVec3 computeDifference(const TrackedVec3& a, const TrackedVec3& b,
                              const MinkowskiDifference& difference) {
  const Vec3 &tA = difference.a.shape->translation, &tB = difference.b.shape->translation;
  TrackedVec3 w{b.value + (tB - tA) - a.value};
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

/// The exact sign of direction . w; nullopt if it is not known.
std::optional<int> computeSignAlong(const Vec3& direction, const TrackedVec3& w) {
  ExactSum sum;
  for (int k = 0; k < 3; ++k) {
    if (direction[k] == 0) continue;
    if (!w.exact[k]) return std::nullopt;
    sum.addProduct(direction[k], w.value[k]);
  }
  if (!sum.isSafe()) return std::nullopt;
  return sum.sign();
}

/// A point of the plane, projected along an axis.
struct ProjectedPoint {
  double x, y;
  bool exact;
};

/// The orientation of p, q and the origin: 1 for a left turn from p to q; nullopt if it is not
/// known. Coordinates of at most `reach` are off by 10u reach.
std::optional<int> computeOrientation(const ProjectedPoint& p, const ProjectedPoint& q,
                                      double reach) {
  const double cross = p.x * q.y - p.y * q.x;
  const double bound = 64 * kRoundoff * reach * reach + std::numeric_limits<double>::min();
  if (std::abs(cross) > bound) return cross > 0 ? 1 : -1;
  if (!p.exact || !q.exact) return std::nullopt;
  ExactSum sum;
  sum.addProduct(p.x, q.y);
  sum.addProduct(-p.y, q.x);
  if (!sum.isSafe()) return std::nullopt;
  return sum.sign();
}

bool turnsLeft(const ProjectedPoint& p, const ProjectedPoint& q, double reach) {
  return computeOrientation(p, q, reach) == 1;
}

/// Whether a cycle of left turns, each as wide as possible, leads around the origin.
bool windsAroundOrigin(std::span<const ProjectedPoint> points, double reach) {
  const ProjectedPoint* current = &points[0];
  const ProjectedPoint* first = current;
  for (std::size_t step = 0; step < points.size(); ++step) {
    if (step > 0 && turnsLeft(*current, *first, reach)) return true;
    const ProjectedPoint* next = nullptr;
    for (const ProjectedPoint& point : points)
      if (turnsLeft(*current, point, reach) && (!next || turnsLeft(*next, point, reach)))
        next = &point;
    if (!next) return false;
    current = next;
  }
  return false;
}

bool containsOrigin(std::span<const ProjectedPoint> points, double reach) {
  if (points.size() > 2 && windsAroundOrigin(points, reach)) return true;
  for (const ProjectedPoint& p : points) {
    if (!p.exact) continue;
    if (p.x == 0 && p.y == 0) return true;
    for (const ProjectedPoint& q : points) {
      const bool opposite = p.x * q.x < 0 || p.y * q.y < 0;
      if (q.exact && opposite && computeOrientation(p, q, reach) == 0) return true;
    }
  }
  return false;
}

struct SupportVertices {
  std::array<TrackedVec3, kMaxFaceVertices> vertices;
  std::size_t count = 0;
  std::span<const TrackedVec3> all() const { return {vertices.data(), count}; }
};

/// Collects the possible support vertices along `direction`; false if there are too many.
bool collectSupportVertices(const BoundedConvex& convex, const Vec3& direction, std::uint32_t start,
                            SupportVertices& found) {
  const Vec3 local = convex.bodyFromWorld<double>(direction);
  const double slack = computeSupportSlack(convex, direction.lpNorm<1>());
  const SupportVertex support = hillClimb(convex, local, slack, start);
  std::size_t visited = 0;
  forEachSupportCandidate(convex, support, [&](std::uint32_t i) {
    if (++visited <= kMaxFaceVertices) found.vertices[found.count++] = rotateVertex(convex, i);
  });
  return visited <= kMaxFaceVertices;
}

}  // namespace

bool certifyTouching(const MinkowskiDifference& difference, const Vec3& direction,
                     VertexPair hint) {
  SupportVertices ofA, ofB;
  if (!collectSupportVertices(difference.a, direction, hint.a, ofA) ||
      !collectSupportVertices(difference.b, -direction, hint.b, ofB))
    return false;
  Eigen::Index dominantAxis = 0;
  direction.cwiseAbs().maxCoeff(&dominantAxis);
  const Eigen::Index x = (dominantAxis + 1) % 3, y = (dominantAxis + 2) % 3;
  std::array<ProjectedPoint, kMaxFaceVertices * kMaxFaceVertices> inPlane;
  std::size_t count = 0;
  for (const TrackedVec3& a : ofA.all()) {
    for (const TrackedVec3& b : ofB.all()) {
      const TrackedVec3 w = computeDifference(a, b, difference);
      const auto sign = computeSignAlong(direction, w);
      if (!sign || *sign < 0) return false;
      if (*sign == 0) inPlane[count++] = {w.value[x], w.value[y], w.exact[x] && w.exact[y]};
    }
  }
  return count > 0 && containsOrigin(std::span(inPlane).first(count), difference.reach);
}

}  // namespace enfilade::collision
