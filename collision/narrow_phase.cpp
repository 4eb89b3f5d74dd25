// Steps
//  1. Both bodies go into one frame, axes as the world's, origin at t_A: translations are
//  subtracted
//     before anything is rounded, so a scene far from the origin loses nothing.
//  2. The walk over closest features. The pair of features is kept as a simplex of the Minkowski
//     difference B - A: one point is vertex-vertex, two span vertex-edge (or a diagonal), three
//     vertex-face or edge-edge. It starts at last tick's features; a support along the nearest
//     point, climbed to over the hulls' edges from last tick's vertices, proves them closest or
//     names the feature to go on with. That is GJK (Gilbert, Johnson, Keerthi 1988) with the
//     coherence of Lin and Canny (1991) as in Cameron, "Enhancing GJK" (1997). The walk is in
//     doubles; it ends, since |nearest| falls at every step but a bounded number of equal ones.
//  3. The filter. One support in extended precision proves that all of B - A lies beyond a plane;
//     where that plane stands clear of the origin by more than the rounding bound, the bodies are
//     `separated`, at least by that. A tetrahedron that holds the origin by more than the bound
//     proves `penetrating`.
//  4. An origin that lies on the simplex: exact sums of doubles may prove `touching`
//     (touching_proof.hpp), a polytope grown from the simplex `penetrating` (polytope.hpp).
//  5. Where that is not enough, as among slivers, steps 2 to 4 in extended precision.
//  6. Where that cannot decide either, or the distance is not good enough: exact_answer.hpp.
// Departures from V-Clip (Mirtich 1998): no Voronoi regions. Points, segments, flat and coplanar
// faces need no cases of their own, and one support proves what V-Clip proves region by region.
#include "collision/narrow_phase.hpp"

#include <cmath>

#include "collision/exact_answer.hpp"
#include "collision/polytope.hpp"
#include "collision/simplex.hpp"
#include "collision/touching_proof.hpp"

namespace enfilade::collision {
namespace {

constexpr Wide kMostError = 15;   // units of rounding of the largest coordinate; one to spare
constexpr Wide kFine = 0x1p-32L;  // of the distance: see describeSeparation
constexpr double kLeastInDoubles = 1e-140;  // metres: below, a squared length loses bits
constexpr int kMostEqualSteps = 4;          // of a walk, that come no nearer
constexpr int kIterationBound = 96;  // about 10 are usual, from nothing; reaching it: the next step

bool valid(const FeatureCache& cache, const ConvexBody& a, const ConvexBody& b) {
  if (cache.size < 1 || cache.size > 4) return false;
  for (int i = 0; i < cache.size; ++i)
    if (cache.pairs[i].a >= a.vertices.size() || cache.pairs[i].b >= b.vertices.size())
      return false;
  return true;
}

/// A proved bound along a direction as one in metres: bound / |direction|, a little less. Since
/// |d|^2 = 1 + e with |e| small, 1 / |d| >= 1 - e / 2.
Wide metresAlong(Wide bound, const WideVec& direction) {
  const Wide excess = direction.squaredNorm() - 1;
  return bound * (1 - excess / 2) - std::abs(bound) * (8 * kWideUnit + excess * excess);
}

/// What the walk over features found.
template <class Real>
struct Search {
  using Vec = Eigen::Matrix<Real, 3, 1>;

  Simplex<Real> simplex;
  Real distance = 0;            ///< of simplex.nearest
  Vec direction = Vec::Zero();  ///< of simplex.nearest, unit up to rounding; of the last support
  VertexPair hint;              ///< where the next support may be found
  Summits summits;              ///< of the last support, when the walk is in doubles
  Wide lower = -std::numeric_limits<Wide>::infinity();  ///< of the true distance, proved

  /// False: the simplex holds the origin, or all but touches it.
  bool hasDirection() const {
    constexpr bool isDouble = std::is_same_v<Real, double>;
    return !simplex.holdsOrigin &&
           distance > (isDouble ? kLeastInDoubles : std::numeric_limits<double>::min());
  }
};

/// The features of last time, or any point.
template <class Real>
void start(const MinkowskiDifference& difference, const FeatureCache& cache, Search<Real>& search) {
  if (valid(cache, *difference.a.body, *difference.b.body)) {
    for (int i = 0; i < cache.size; ++i) search.simplex.add(difference, cache.pairs[i]);
    search.hint = cache.pairs[0];
  } else {
    search.simplex.add(difference, {});
  }
  search.simplex.reduce(difference);
  search.distance = search.simplex.nearest.norm();
}

/// A point of B - A that is the least along search.direction, up to rounding.
struct Support {
  VertexPair pair;
  Wide along;  ///< metres
};

/// Raises search.lower if the support proves more.
Support findSupport(const MinkowskiDifference& difference, Search<double>& search) {
  search.summits = climb(difference, search.direction, kUnitLength, search.hint);
  search.hint = search.summits.pair();
  const Along along = alongOf(difference, search.direction, kUnitLength, search.summits);
  if (along.bound > 0) search.lower = std::max(search.lower, Wide{along.bound / kUnitLength});
  return {search.hint, along.value};
}
Support findSupport(const MinkowskiDifference& difference, Search<Wide>& search) {
  const Least least = leastAlong(difference, search.direction, kUnitLength, search.hint);
  if (least.bound > 0)
    search.lower = std::max(search.lower, metresAlong(least.bound, search.direction));
  return {least.pair, least.along};
}

/// Ends at the closest features, at a tetrahedron that holds the origin, where the distance is
/// proved above `limit`, or where Real makes no more progress.
template <class Real>
void walk(const MinkowskiDifference& difference, Wide limit, Search<Real>& search) {
  const Real enough = 24 * unitOf<Real>() * static_cast<Real>(difference.reach);
  Simplex<Real>& simplex = search.simplex;
  int equalSteps = 0;
  for (int i = 0; i < kIterationBound && search.hasDirection(); ++i) {
    search.direction = simplex.nearest * (1 / search.distance);
    const Support support = findSupport(difference, search);
    if (search.lower > limit || search.distance - support.along <= enough ||
        simplex.holds(support.pair))
      return;
    Simplex<Real> next = simplex;
    next.add(difference, support.pair);
    next.reduce(difference);
    const Real distance = next.nearest.norm();
    if (!next.holdsOrigin && !(distance < search.distance)) {
      // As near may be good, too: the feature whose direction proves it.
      if (!(distance <= search.distance) || !next.holds(support.pair)) return;
      if (++equalSteps > kMostEqualSteps) return;
    }
    simplex = next;
    search.distance = distance;
  }
}

template <class Real>
void remember(const Search<Real>& search, FeatureCache& cache) {
  cache.size = search.simplex.size;
  std::copy_n(search.simplex.pairs.begin(), search.simplex.size, cache.pairs.begin());
  // A nearest point that proves nothing may point anywhere: then the last axis is the better one.
  if (search.lower > 0) cache.axis = search.direction.template cast<double>();
}

double largestOf(const Vec3& v) {
  return v.cwiseAbs().maxCoeff();
}

/// The points of A and B that the simplex' weights name: world axes, from t_A.
struct Combination {
  WideVec aToB;
  Vec3 onA, onB;   ///< rounded
  double largest;  ///< of the |coordinates| of both bodies, from below

  template <class Real>
  Combination(const MinkowskiDifference& difference, const Simplex<Real>& simplex) {
    const WideVec a = pointOn(simplex, difference.a, &VertexPair::a);
    const WideVec b = pointOn(simplex, difference.b, &VertexPair::b) + difference.shift;
    aToB = b - a;
    onA = a.cast<double>();
    onB = b.cast<double>();
    largest = std::max(largestOf(onA), largestOf(onB));
    for (int i = 0; i < simplex.size; ++i)  // a vertex of A or one of B has half of it
      largest = std::max(largest, largestOf(simplex.points[i].template cast<double>()) / 2);
    largest *= 1 - 8 * kUnit;
  }
};

/// Raises search.lower by a proof in extended precision, along the direction that the walk ended
/// with.
void proveLower(const MinkowskiDifference& difference, Search<double>& search) {
  if (!search.hasDirection()) return;
  const Least least = leastAlong(difference, search.direction, kUnitLength, search.summits);
  search.lower = std::max(search.lower, metresAlong(least.bound, search.direction.cast<Wide>()));
}
/// The walk has done that.
void proveLower(const MinkowskiDifference&, Search<Wide>&) {}

enum class Outcome : std::uint8_t {
  open,    ///< not proved, or not to the bound that Decision promises
  beyond,  ///< proved: farther apart than the limit
  decided
};

/// Fills in what holds of separated bodies that are proved to be `lower` apart.
/// `direction`: unit, along which that was proved.
Outcome describeSeparation(const MinkowskiDifference& difference, const Combination& at, Wide lower,
                           const Vec3& direction, Decision& decision) {
  // Weights round by at most 8.1 eta S a body, turning by 3 eta S, shift and sums by eta (S_A +
  // 2 S_B + 3 sqrt(3) D), the norm by 2.5 sqrt(3) eta reach: below 17.5 eta reach; this is 24.
  const Wide length = at.aToB.norm();
  const Wide upper = length + 4 * difference.pointError();
  decision.verdict = Verdict::separated;
  decision.distance = static_cast<double>(std::max(length, lower));
  const Wide distance = decision.distance;
  const Wide bound = std::max(upper - distance, distance - lower);
  decision.errorBound = static_cast<double>(bound) * (1 + 4 * kUnit);
  // Where the bound is no small part of the distance, the vector from point to point may lead
  // anywhere, and only the last unit will do.
  const bool fine = bound <= kFine * distance;
  decision.normal = fine ? Vec3(at.aToB.cast<double>() / decision.distance) : direction;
  return bound <= (fine ? kMostError : 1) * kUnit * at.largest ? Outcome::decided : Outcome::open;
}

/// Whether the bodies are proved to touch along `axis`, the last one known, or along another that
/// things often stand or lean along: the simplex' normal, the world's axes. Sets `axis`. `again`:
/// all but the normal have been tried.
template <class Real>
bool findTouching(const MinkowskiDifference& difference, const Search<Real>& search, bool again,
                  Vec3& axis) {
  std::array<Vec3, 9> directions;
  std::size_t count = 0;
  const Simplex<Real>& simplex = search.simplex;
  if (!again) directions[count++] = axis;
  if (simplex.size == 3) {
    const auto& p = simplex.points;
    const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]).template cast<double>();
    directions[count++] = normal;
    directions[count++] = -normal;
  }
  for (int k = 0; k < 3 && !again; ++k) {
    directions[count++] = Vec3::Unit(k);
    directions[count++] = -Vec3::Unit(k);
  }
  for (const Vec3& direction : std::span(directions).first(count)) {
    if (!(direction.squaredNorm() > 0)) continue;
    if (!provedTouching(difference, direction, search.hint)) continue;
    axis = direction;  // as it is: made unit, its sums would not come out exact
    return true;
  }
  return false;
}

/// Whether the origin is proved to be strictly inside B - A though it lies on the simplex.
template <class Real>
bool findInside(const MinkowskiDifference& difference, const Simplex<Real>& simplex) {
  Polytope<Real> polytope(difference);
  const std::span pairs(simplex.pairs.data(), static_cast<std::size_t>(simplex.size));
  if (surround<Real>(pairs, polytope)) return true;
  polytope.clear();
  return surroundBySearch<Real>(polytope);
}

/// Fills in what the features that the walk ended at prove. `axis` is the last one known to part
/// the bodies.
template <class Real>
Outcome conclude(const MinkowskiDifference& difference, Search<Real>& search, double limit,
                 Vec3& axis, Decision& decision) {
  if (search.lower > limit) return Outcome::beyond;
  const bool inside = search.simplex.holdsOrigin;
  proveLower(difference, search);
  if (search.lower > limit) return Outcome::beyond;
  const Combination at(difference, search.simplex);
  decision.pointA = at.onA + difference.a.body->translation;
  decision.pointB = at.onB + difference.a.body->translation;
  if (search.lower > 0)
    return describeSeparation(difference, at, search.lower,
                              search.direction.template cast<double>(), decision);
  const bool haveCommonPoint = at.aToB.norm() <= 2 * kUnit * at.largest;
  if (!haveCommonPoint) return Outcome::open;
  const bool again = std::is_same_v<Real, Wide> && fitsDoubles(difference);
  if (!inside && findTouching(difference, search, again, axis)) {
    decision.verdict = Verdict::touching;
    decision.decidedBy = DecidedBy::expansion;
    decision.normal = axis.stableNormalized();
    return Outcome::decided;
  }
  if (!inside && !findInside(difference, search.simplex)) return Outcome::open;
  decision.verdict = Verdict::penetrating;
  return Outcome::decided;
}

Decision decideExactly(const MinkowskiDifference& difference, FeatureCache& cache) {
  ExactDifference integers(*difference.a.body, *difference.b.body);
  const ExactAnswer exact = solveExactly(integers, cache);
  Decision decision;
  decision.verdict = exact.verdict;
  decision.decidedBy = DecidedBy::rational;
  decision.distance = exact.distance;
  decision.errorBound = 2 * kUnit * exact.distance;
  decision.pointA = exact.pointA;
  decision.pointB = exact.pointB;
  if (exact.verdict != Verdict::penetrating) decision.normal = cache.axis = exact.normal;
  return decision;
}

/// The walk in Real from the cached features, and what it proves.
template <class Real>
Outcome search(const MinkowskiDifference& difference, double limit, FeatureCache& cache,
               Decision& decision) {
  Search<Real> search;
  start(difference, cache, search);
  walk(difference, limit, search);
  const Outcome outcome = conclude(difference, search, limit, cache.axis, decision);
  remember(search, cache);
  return outcome;
}

}  // namespace

std::optional<Decision> decideWithin(const ConvexBody& a, const ConvexBody& b, double limit,
                                     FeatureCache& cache) {
  const MinkowskiDifference difference(a, b);
  Decision decision;
  Outcome outcome = Outcome::open;
  if (fitsDoubles(difference)) outcome = search<double>(difference, limit, cache, decision);
  if (outcome == Outcome::open) outcome = search<Wide>(difference, limit, cache, decision);
  if (outcome == Outcome::beyond) return std::nullopt;
  return outcome == Outcome::decided ? decision : decideExactly(difference, cache);
}

Decision decide(const ConvexBody& a, const ConvexBody& b, FeatureCache& cache) {
  return *decideWithin(a, b, std::numeric_limits<double>::infinity(), cache);
}

double provedSeparation(const ConvexBody& a, const ConvexBody& b, const FeatureCache& cache) {
  if (!(cache.axis.squaredNorm() > 0)) return -std::numeric_limits<double>::infinity();
  VertexPair hint = valid(cache, a, b) ? cache.pairs[0] : VertexPair{};
  const WideVec axis = cache.axis.cast<Wide>();
  const Wide length = axis.norm();
  const Wide proved = leastAlong(MinkowskiDifference(a, b), axis, length, hint).bound / length;
  return static_cast<double>(proved - std::abs(proved) * 2 * kUnit);
}

}  // namespace enfilade::collision
