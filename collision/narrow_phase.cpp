// Steps
//  1. Both bodies go into one frame, axes as the world's, origin at t_A: translations are
//  subtracted
//     before anything is rounded, so a scene far from the origin loses nothing.
//  2. The walk over closest features. The pair of features is kept as a simplex of the Minkowski
//     difference B - A: one point is vertex-vertex, two span vertex-edge (or a diagonal), three
//     vertex-face or edge-edge. It starts at last tick's features; a support along the nearest
//     point, climbed to over the hulls' edges from last tick's vertices, proves them closest or
//     names the feature to go on with. That is GJK (Gilbert, Johnson, Keerthi 1988) with the
//     coherence of Lin and Canny (1991) as in Cameron, "Enhancing GJK" (1997); like V-Clip (Mirtich
//     1998) it needs no tolerance and cannot cycle, since |nearest| falls at every step.
//  3. The filter. A support proves that all of B - A lies beyond a plane; where that plane stands
//     clear of the origin by more than the rounding bound, the bodies are `separated`, at least by
//     that. A tetrahedron that holds the origin by more than the bound proves `penetrating`.
//  4. The walk goes in doubles; its proofs (supports along the direction that it ends with, the
//     distance of the points that it ends at) are in extended precision. Where that is not enough,
//     as among slivers, the walk goes on in extended precision, too.
//  5. Where the filter cannot decide, or its distance is not good enough: exact_minkowski.hpp.
// Departures from V-Clip: no Voronoi regions. Points, segments, flat and coplanar faces need no
// cases of their own, and one support proves what V-Clip proves region by region. The walk and its
// proof are in extended precision (minkowski.hpp has the bounds), so that in practice only exact
// contact, and what differs from it by less than about 2^-58 of the coordinates, is left to step 5.
#include "collision/narrow_phase.hpp"

#include <cmath>

#include "collision/exact_answer.hpp"
#include "collision/simplex.hpp"

namespace enfilade::collision {
namespace {

constexpr Wide kMostError = 15;      // units of rounding of the largest coordinate; one to spare
constexpr Wide kFine = 0x1p-32L;     // of the distance: see describeSeparation
constexpr int kIterationBound = 96;  // about 10 are usual, from nothing; reaching it: the next step

bool valid(const FeatureCache& cache, const ConvexBody& a, const ConvexBody& b) {
  if (cache.size < 1 || cache.size > 4) return false;
  for (int i = 0; i < cache.size; ++i)
    if (cache.pairs[i].a >= a.vertices.size() || cache.pairs[i].b >= b.vertices.size())
      return false;
  return true;
}

/// What the walk over features found.
template <class Real>
struct Search {
  Simplex<Real> simplex;
  VertexPair hint;
  Real distance = 0;                                    ///< of simplex.nearest
  Wide lower = -std::numeric_limits<Wide>::infinity();  ///< of the true distance, proved
};

/// The features of last time, or a first support.
template <class Real>
void start(const MinkowskiDifference& difference, const FeatureCache& cache, Search<Real>& search) {
  if (valid(cache, *difference.a.body, *difference.b.body)) {
    for (int i = 0; i < cache.size; ++i) search.simplex.add(difference, cache.pairs[i]);
    search.hint = cache.pairs[0];
  } else {
    const WideVec between = difference({0, 0});
    const Wide apart = between.norm();
    const WideVec towards = apart > 0 ? between : WideVec(WideVec::UnitY());
    const Least first = leastAlong(difference, towards, apart > 0 ? apart : 1, search.hint);
    search.simplex.add(difference, first.pair);
  }
  search.simplex.reduce(difference);
  search.distance = search.simplex.nearest.norm();
}

/// Ends at the closest features, at a tetrahedron that holds the origin, where the distance is
/// proved above `limit`, or where Real makes no more progress.
template <class Real>
void walk(const MinkowskiDifference& difference, Wide limit, Search<Real>& search) {
  const Real enough = 24 * unitOf<Real>() * static_cast<Real>(difference.reach);
  Simplex<Real>& simplex = search.simplex;
  for (int i = 0; i < kIterationBound; ++i) {
    if (simplex.holdsOrigin || !(search.distance > 0)) return;
    const Wide length = search.distance * (1 + 8 * unitOf<Real>());
    const Least least =
        leastAlong(difference, simplex.nearest.template cast<Wide>(), length, search.hint);
    search.lower = std::max(search.lower, least.bound / length * (1 - 2 * kWideUnit));
    if (search.lower > limit || search.distance - search.lower <= enough ||
        simplex.holds(least.pair))
      return;
    Simplex<Real> next = simplex;
    next.add(difference, least.pair);
    next.reduce(difference);
    const Real distance = next.nearest.norm();
    if (!next.holdsOrigin && !(distance < search.distance)) return;
    simplex = next;
    search.distance = distance;
  }
}

template <class Real>
void remember(const Simplex<Real>& simplex, FeatureCache& cache) {
  cache.size = simplex.size;
  for (int i = 0; i < simplex.size; ++i) cache.pairs[i] = simplex.pairs[i];
  const Real length = simplex.nearest.norm();
  if (!simplex.holdsOrigin && length > 0)
    cache.axis = (simplex.nearest * (1 / length)).template cast<double>();
}

Vec3 inWorld(const WideVec& point, const ConvexBody& a) {
  return (point + a.translation.cast<Wide>()).cast<double>();
}

/// The combination of one body's vertices by the simplex' weights, in its own frame, then turned:
/// world axes, from the body's translation.
template <class Real>
WideVec combination(const Simplex<Real>& simplex, const PlacedBody& placed,
                    std::uint32_t VertexPair::*vertex) {
  Wide sum = simplex.weight[0];
  const auto& vertices = placed.body->vertices;
  WideVec point = vertices[simplex.pairs[0].*vertex].template cast<Wide>() * sum;
  for (int i = 1; i < simplex.size; ++i) {
    const Wide weight = simplex.weight[i];
    point += vertices[simplex.pairs[i].*vertex].template cast<Wide>() * weight;
    sum += weight;
  }
  point *= 1 / sum;
  return placed.turned<Wide>(point.x(), point.y(), point.z());
}

/// The points of A and B that the simplex' weights name: world axes, from t_A. Rigorous, since any
/// weights >= 0 name points of the bodies.
struct Combination {
  WideVec onA, onB;
  Wide
      largest;  ///< a lower bound of the largest |coordinate|: both points lie in the bodies' hulls

  template <class Real>
  Combination(const MinkowskiDifference& difference, const Simplex<Real>& simplex)
      : onA(combination(simplex, difference.a, &VertexPair::a)),
        onB(combination(simplex, difference.b, &VertexPair::b) + difference.shift),
        largest(std::max({onA.cwiseAbs().maxCoeff(), onB.cwiseAbs().maxCoeff(),
                          difference.shift.cwiseAbs().maxCoeff()})) {}
};

/// Fills in what holds of separated bodies; false when the bound is not good enough.
bool describeSeparation(const MinkowskiDifference& difference, const Combination& at, Wide lower,
                        Decision& decision) {
  const WideVec aToB = at.onB - at.onA;
  const Wide length = aToB.norm();
  // Weights and sums round by less than 8 eta reach a coordinate besides the points' own error.
  const Wide upper = length + 4 * difference.pointError();
  decision.verdict = Verdict::separated;
  decision.distance = static_cast<double>(std::max(length, lower));
  const Wide distance = decision.distance;
  const Wide bound = std::max(upper - distance, distance - lower);
  decision.errorBound = static_cast<double>(bound) * (1 + 4 * kUnit);
  decision.normal = (aToB * (1 / length)).cast<double>();
  // While the bounds differ by a small part of the distance, it is good to the square of that part.
  return bound <= kUnit * at.largest * (bound <= kFine * distance ? kMostError : 1);
}

/// True: the verdict is proved, and distance and points are good enough.
template <class Real>
bool decided(const MinkowskiDifference& difference, const Search<Real>& search,
             Decision& decision) {
  if (!search.simplex.holdsOrigin && !(search.lower > 0)) return false;
  const Combination at(difference, search.simplex);
  decision.pointA = inWorld(at.onA, *difference.a.body);
  decision.pointB = inWorld(at.onB, *difference.a.body);
  if (!search.simplex.holdsOrigin)
    return describeSeparation(difference, at, search.lower, decision);
  decision.verdict = Verdict::penetrating;
  return (at.onB - at.onA).cwiseAbs().maxCoeff() <= 2 * kUnit * at.largest;
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
  if (exact.verdict != Verdict::penetrating) decision.normal = exact.normal;
  return decision;
}

}  // namespace

std::optional<Decision> decideWithin(const ConvexBody& a, const ConvexBody& b, double limit,
                                     FeatureCache& cache) {
  const MinkowskiDifference difference(a, b);
  Decision decision;
  Search<double> quick;
  start(difference, cache, quick);
  walk(difference, limit, quick);
  remember(quick.simplex, cache);
  if (quick.lower > limit) return std::nullopt;
  if (decided(difference, quick, decision)) return decision;

  Search<Wide> search;
  start(difference, cache, search);
  walk(difference, limit, search);
  remember(search.simplex, cache);
  if (search.lower > limit) return std::nullopt;
  if (decided(difference, search, decision)) return decision;
  return decideExactly(difference, cache);
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
