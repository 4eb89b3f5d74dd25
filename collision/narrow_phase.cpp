// Steps
//  1. Both bodies go into one frame: A's vertices as they are, B's moved by tB - tA. Translations
//     are subtracted before anything is rounded, so a scene far from the origin loses nothing.
//  2. GJK (Gilbert, Johnson, Keerthi 1988) on M = B - A, started from last tick's axis. Each
//     support point gives a lower bound of the distance (the slab along the axis), each simplex an
//     upper bound; it stops when they meet, or when doubles make no more progress.
//  3. The filter: a lower bound above its own rounding bound proves `separated`; a tetrahedron that
//     holds the origin by more than the rounding bound proves `penetrating`.
//  4. Else exact_verdict.cpp decides with rationals.
// Departures from GJK as published: termination is by the certified gap between the two bounds, not
// by an absolute tolerance, and reaching the iteration bound costs tightness, never the verdict.
//
// Rounding bounds, u = 2^-53. Let S bound every |coordinate| of A's and of B's moved vertices, and
// D = |tB - tA| if that difference was rounded, else 0.
//  - A moved vertex of B is off by at most u (S + D), a coordinate.
//  - axis . vertex: three products, two sums: at most 3u |axis|_1 S (1 + 2u).
//  - gap = min over B - max over A: both of the above and one difference of size <= 2 |axis|_1 S:
//    at most u |axis|_1 (9 S + D). kGapRounding (S + D) leaves room for second order.
//  - A point of M is off by e = u (3 S + D), a coordinate, and its coordinates are at most m = 2 S.
//    A determinant of three such: each of nine entries has a cofactor of at most 2 m^2, so 18 e m^2
//    come from the entries; its own five roundings of six products of at most m^3 are 30 u m^3.
//    Together less than u S^2 (456 S + 72 D), which kDeterminantRounding (S + D) rounds up.
//  - The nearest point of a simplex, a combination of points of size <= 2S a coordinate, is off by
//    at most kPointRounding u S (weights, products, sums; generous).
// Products that underflow lose less than kUnderflow besides; what overflows proves nothing.
#include "collision/narrow_phase.hpp"

#include <array>
#include <cmath>

#include "collision/exact_verdict.hpp"

namespace enfilade::collision {
namespace {

constexpr double kUnit = 0x1p-53;             // half an ulp of 1
constexpr double kGapRounding = 10;           // units of S, see the file's head
constexpr double kPointRounding = 64;         // units of S, see the file's head
constexpr double kDeterminantRounding = 512;  // units of S^3, see the file's head
constexpr double kUnderflow = 0x1p-1000;      // above what a few products can lose
constexpr double kBoundsMeet = 4 * kUnit;     // relative: the normal is as good as the root of this
constexpr int kIterationBound = 64;           // GJK on polytopes needs about 10

/// Both bodies in one frame, with what the rounding bounds need.
struct Pair {
  std::span<const Vec3> a, b;
  Vec3 shift;       ///< added to B's vertices
  double size = 0;  ///< S of the file's head
  double lost = 0;  ///< D of the file's head

  Vec3 pointB(std::uint32_t i) const { return b[i] + shift; }
};

/// Whether a - b == difference without rounding, by the error term of Knuth's two-sum.
bool differenceIsExact(const Vec3& a, const Vec3& b, const Vec3& difference) {
  const Vec3 back = difference - a;
  return ((a - (difference - back)) + (-b - back)).isZero(0);
}

Pair pairOf(const ConvexBody& a, const ConvexBody& b) {
  Pair pair{a.vertices, b.vertices, b.translation - a.translation, 0, 0};
  for (const Vec3& p : pair.a) pair.size = std::max(pair.size, p.cwiseAbs().maxCoeff());
  for (const Vec3& p : pair.b)
    pair.size = std::max(pair.size, (p + pair.shift).cwiseAbs().maxCoeff());
  if (!differenceIsExact(b.translation, a.translation, pair.shift))
    pair.lost = pair.shift.cwiseAbs().maxCoeff();
  return pair;
}

/// A point of M = B - A.
struct Support {
  Vec3 difference;
  std::uint32_t a, b;
};

struct Slab {
  Support support;
  double gap;       ///< along the axis, not divided by its length
  double rounding;  ///< |gap - true gap| is at most this
};

Slab supportAlong(const Pair& pair, const Vec3& axis) {
  std::uint32_t bestA = 0, bestB = 0;
  double mostA = -std::numeric_limits<double>::infinity(), leastB = -mostA;
  for (std::uint32_t i = 0; i < pair.a.size(); ++i) {
    const double d = axis.dot(pair.a[i]);
    if (d > mostA) mostA = d, bestA = i;
  }
  for (std::uint32_t i = 0; i < pair.b.size(); ++i) {
    const double d = axis.dot(pair.pointB(i));
    if (d < leastB) leastB = d, bestB = i;
  }
  const double length1 = axis.cwiseAbs().sum();
  return {{pair.pointB(bestB) - pair.a[bestA], bestA, bestB},
          leastB - mostA,
          kUnit * length1 * kGapRounding * (pair.size + pair.lost) + kUnderflow};
}

/// Up to four points of M and the weights of the point nearest the origin.
struct Simplex {
  std::array<Support, 4> points;
  std::array<double, 4> weights{1, 0, 0, 0};
  int size = 0;

  const Vec3& operator[](int i) const { return points[i].difference; }
  Vec3 nearest() const {
    Vec3 sum = weights[0] * points[0].difference;
    for (int i = 1; i < size; ++i) sum += weights[i] * points[i].difference;
    return sum;
  }
};

Simplex chosen(const Simplex& from, std::initializer_list<int> which,
               std::initializer_list<double> weights) {
  Simplex result;
  auto weight = weights.begin();
  for (int i : which) {
    result.points[result.size] = from.points[i];
    result.weights[result.size++] = *weight++;
  }
  return result;
}

/// The closer of two simplices; the first when equal.
Simplex closer(const Simplex& first, const Simplex& second) {
  return second.nearest().squaredNorm() < first.nearest().squaredNorm() ? second : first;
}

Simplex nearestOnSegment(const Simplex& s, int i, int j) {
  const Vec3 edge = s[j] - s[i];
  const double squared = edge.squaredNorm();
  const double t = -s[i].dot(edge);
  if (!(t > 0)) return chosen(s, {i}, {1});
  if (t >= squared) return chosen(s, {j}, {1});
  const double w = t / squared;
  return chosen(s, {i, j}, {1 - w, w});
}

Simplex nearestOnTriangle(const Simplex& s, int i, int j, int k) {
  const Vec3 normal = (s[j] - s[i]).cross(s[k] - s[i]);
  const double squared = normal.squaredNorm();
  // Signed areas of the origin's projection against each edge.
  const double wi = s[j].cross(s[k]).dot(normal);
  const double wj = s[k].cross(s[i]).dot(normal);
  const double wk = s[i].cross(s[j]).dot(normal);
  if (squared > 0 && wi > 0 && wj > 0 && wk > 0) {
    const double sum = wi + wj + wk;
    return chosen(s, {i, j, k}, {wi / sum, wj / sum, wk / sum});
  }
  return closer(closer(nearestOnSegment(s, i, j), nearestOnSegment(s, j, k)),
                nearestOnSegment(s, k, i));
}

double determinant(const Vec3& a, const Vec3& b, const Vec3& c) {
  return a.dot(b.cross(c));
}

/// Four points: the origin is inside when every face has it on the side of the fourth point.
/// `inside` is proved by the rounding bound, else the nearest face is taken.
Simplex nearestOnTetrahedron(const Simplex& s, const Pair& pair, bool& inside) {
  const double bound =
      kDeterminantRounding * kUnit * pair.size * pair.size * (pair.size + pair.lost) + kUnderflow;
  const double d0 = determinant(s[1], s[2], s[3]), d1 = -determinant(s[0], s[2], s[3]);
  const double d2 = determinant(s[0], s[1], s[3]), d3 = -determinant(s[0], s[1], s[2]);
  const double sum = d0 + d1 + d2 + d3;
  const double sign = sum < 0 ? -1 : 1;
  inside = std::min(std::min(sign * d0, sign * d1), std::min(sign * d2, sign * d3)) > bound;
  if (inside) return chosen(s, {0, 1, 2, 3}, {d0 / sum, d1 / sum, d2 / sum, d3 / sum});
  return closer(closer(nearestOnTriangle(s, 0, 1, 2), nearestOnTriangle(s, 0, 1, 3)),
                closer(nearestOnTriangle(s, 0, 2, 3), nearestOnTriangle(s, 1, 2, 3)));
}

Simplex nearestOn(const Simplex& s, const Pair& pair, bool& inside) {
  inside = false;
  switch (s.size) {
    case 1:
      return chosen(s, {0}, {1});
    case 2:
      return nearestOnSegment(s, 0, 1);
    case 3:
      return nearestOnTriangle(s, 0, 1, 2);
    default:
      return nearestOnTetrahedron(s, pair, inside);
  }
}

bool holds(const Simplex& s, const Support& point) {
  for (int i = 0; i < s.size; ++i)
    if (s.points[i].a == point.a && s.points[i].b == point.b) return true;
  return false;
}

/// What GJK found: an interval for the distance, and the simplex.
struct Search {
  Simplex simplex;
  Vec3 nearest = Vec3::Zero();
  double lower = -std::numeric_limits<double>::infinity();  ///< proved; <= 0 proves nothing
  Vec3 axis = Vec3::Zero();                                 ///< of the best lower bound
  bool inside = false;                                      ///< proved to penetrate
};

/// The proved separation along an axis, in metres; minus infinity where doubles overflowed.
double provedAlong(const Slab& slab, const Vec3& axis) {
  if (!std::isfinite(slab.gap)) return -std::numeric_limits<double>::infinity();
  // The norm, the quotient and the differences round by less than 8u together.
  const double bound = (slab.gap - slab.rounding) / axis.norm();
  return bound - std::abs(bound) * 8 * kUnit;
}

void improve(Search& search, const Slab& slab, const Vec3& axis) {
  const double lower = provedAlong(slab, axis);
  if (lower > search.lower) search.lower = lower, search.axis = axis;
}

Search gjk(const Pair& pair, const Vec3& start, double limit) {
  Search search;
  const Slab first = supportAlong(pair, start);
  improve(search, first, start);
  search.simplex.points[0] = first.support;
  search.simplex.size = 1;
  search.nearest = first.support.difference;
  for (int i = 0; i < kIterationBound; ++i) {
    const double upper = search.nearest.norm();
    if (!(upper > 0) || search.lower > limit) return search;
    const Slab slab = supportAlong(pair, search.nearest);
    improve(search, slab, search.nearest);
    if (upper - search.lower <= kBoundsMeet * upper || holds(search.simplex, slab.support))
      return search;
    Simplex next = search.simplex;
    next.points[next.size++] = slab.support;
    next = nearestOn(next, pair, search.inside);
    if (search.inside) {
      search.simplex = next;
      return search;
    }
    const Vec3 nearest = next.nearest();
    if (!(nearest.squaredNorm() < search.nearest.squaredNorm())) return search;
    search.simplex = next;
    search.nearest = nearest;
  }
  return search;
}

Vec3 combination(const Simplex& simplex, const ConvexBody& body, bool ofA) {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < simplex.size; ++i)
    sum += simplex.weights[i] * body.vertices[ofA ? simplex.points[i].a : simplex.points[i].b];
  return sum + body.translation;
}

/// The least overlap of the slabs along some axes: moving B that far parts the bodies, so it is an
/// upper bound of the depth.
void boundPenetration(const Pair& pair, const Search& search, Decision& decision) {
  std::array<Vec3, 4> axes{Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ(), search.axis};
  decision.penetration = std::numeric_limits<double>::infinity();
  for (const Vec3& axis : axes) {
    if (!(axis.squaredNorm() > 0)) continue;
    for (const double sign : {1.0, -1.0}) {
      const Vec3 direction = sign * axis / axis.norm();
      const Slab slab = supportAlong(pair, direction);
      // The direction's length is off 1 by a few u.
      const double overlap = std::max(0.0, -slab.gap + slab.rounding) * (1 + 8 * kUnit);
      if (overlap >= decision.penetration) continue;
      decision.penetration = overlap;
      decision.normal = direction;
    }
  }
}

void describeSeparation(const Pair& pair, const Search& search, Decision& decision) {
  const double upper = search.nearest.norm();
  const double rounding = kPointRounding * kUnit * (pair.size + pair.lost);
  decision.verdict = Verdict::separated;
  decision.distance = upper;
  decision.errorBound = std::max(upper - search.lower, 0.0) + rounding;
  decision.normal = upper > 0 ? Vec3(search.nearest / upper) : Vec3(search.axis.normalized());
}

Vec3 startAxis(const ConvexBody& a, const ConvexBody& b, const SeparationCache& cache) {
  if (cache.axis.squaredNorm() > 0) return cache.axis;
  const Vec3 between = (b.vertices[0] - a.vertices[0]) + (b.translation - a.translation);
  return between.squaredNorm() > 0 ? between : Vec3(Vec3::UnitY());
}

}  // namespace

std::optional<Decision> decideWithin(const ConvexBody& a, const ConvexBody& b, double limit,
                                     SeparationCache& cache) {
  const Pair pair = pairOf(a, b);
  const Search search = gjk(pair, startAxis(a, b, cache), limit);
  if (search.axis.squaredNorm() > 0) cache.axis = search.axis;
  if (search.lower > limit) return std::nullopt;

  Decision decision;
  decision.pointA = combination(search.simplex, a, true);
  decision.pointB = combination(search.simplex, b, false);
  if (search.lower > 0) {
    describeSeparation(pair, search, decision);
    return decision;
  }
  if (search.inside) {
    decision.verdict = Verdict::penetrating;
  } else {
    decision.decidedBy = DecidedBy::rational;
    decision.verdict = exactVerdict(a, b);
    if (decision.verdict == Verdict::separated) {
      describeSeparation(pair, search, decision);
      return decision;
    }
  }
  boundPenetration(pair, search, decision);
  if (decision.verdict == Verdict::touching) decision.penetration = 0;
  return decision;
}

Decision decide(const ConvexBody& a, const ConvexBody& b, SeparationCache& cache) {
  return *decideWithin(a, b, std::numeric_limits<double>::infinity(), cache);
}

double provedSeparation(const ConvexBody& a, const ConvexBody& b, const SeparationCache& cache) {
  if (!(cache.axis.norm() > 0)) return -std::numeric_limits<double>::infinity();
  return provedAlong(supportAlong(pairOf(a, b), cache.axis), cache.axis);
}

}  // namespace enfilade::collision
