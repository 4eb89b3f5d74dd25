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
//  4. Where the filter cannot decide, or its distance is not good enough: exact_minkowski.hpp.
// Departures from V-Clip: no Voronoi regions. Points, segments, flat and coplanar faces need no
// cases of their own, and one support proves what V-Clip proves region by region. The walk and its
// proof are in extended precision (minkowski.hpp has the bounds), so that in practice only exact
// contact, and what differs from it by less than about 2^-58 of the coordinates, is left to step 4.
#include "collision/narrow_phase.hpp"

#include <cmath>

#include "collision/exact_answer.hpp"
#include "collision/simplex.hpp"

namespace enfilade::collision {
namespace {

constexpr int kIterationBound = 96;  // about 10 are usual, from nothing; reaching it: step 4

bool valid(const FeatureCache& cache, const ConvexBody& a, const ConvexBody& b) {
  if (cache.size < 1 || cache.size > 4) return false;
  for (int i = 0; i < cache.size; ++i)
    if (cache.pairs[i].a >= a.vertices.size() || cache.pairs[i].b >= b.vertices.size())
      return false;
  return true;
}

/// What the walk over features found.
struct Search {
  Simplex simplex;
  VertexPair hint;
  Wide lower = -std::numeric_limits<Wide>::infinity();  ///< of the distance, proved
};

/// The features of last time, or a first support.
void start(const MinkowskiDifference& difference, const FeatureCache& cache, Search& search) {
  if (valid(cache, *difference.a.body, *difference.b.body)) {
    for (int i = 0; i < cache.size; ++i) search.simplex.add(difference, cache.pairs[i]);
    search.hint = cache.pairs[0];
  } else {
    const WideVec between = difference({0, 0});
    const bool apart = between.squaredNorm() > 0;
    const Least first =
        leastAlong(difference, apart ? between : WideVec(WideVec::UnitY()), search.hint);
    search.simplex.add(difference, first.pair);
  }
  search.simplex.reduce(difference);
}

/// Ends at the closest features, at a tetrahedron that holds the origin, where the distance is
/// proved above `limit`, or where extended precision makes no more progress.
Search walk(const MinkowskiDifference& difference, const FeatureCache& cache, Wide limit) {
  Search search;
  start(difference, cache, search);
  const Wide enough = 4 * difference.pointError();
  for (int i = 0; i < kIterationBound; ++i) {
    Simplex& simplex = search.simplex;
    if (simplex.holdsOrigin) return search;
    const Wide distance = simplex.nearest.norm();
    if (!(distance > 0)) return search;
    const Least least = leastAlong(difference, simplex.nearest, search.hint);
    search.lower = std::max(search.lower, least.bound / distance * (1 - 8 * kWideUnit));
    if (search.lower > limit || distance - search.lower <= enough || simplex.holds(least.pair))
      return search;
    Simplex next = simplex;
    next.add(difference, least.pair);
    next.reduce(difference);
    if (!next.holdsOrigin && !(next.nearest.norm() < distance)) return search;
    simplex = next;
  }
  return search;
}

void remember(const Simplex& simplex, FeatureCache& cache) {
  cache.size = simplex.size;
  for (int i = 0; i < simplex.size; ++i) cache.pairs[i] = simplex.corners[i].pair;
  if (!simplex.holdsOrigin && simplex.nearest.squaredNorm() > 0)
    cache.axis = directionInDoubles(simplex.nearest);
}

Vec3 inWorld(const WideVec& point, const ConvexBody& a) {
  return (point + a.translation.cast<Wide>()).cast<double>();
}

/// Fills in what holds of separated bodies; false when the bound is not good enough.
bool describeSeparation(const MinkowskiDifference& difference, const Search& search,
                        Decision& decision) {
  const ConvexBody& a = *difference.a.body;
  const WideVec onA = search.simplex.pointOnA(), onB = search.simplex.pointOnB();
  // Weights and sums round by less than 8 eta reach a coordinate besides the points' own error.
  const Wide upper = (onB - onA).norm() + 4 * difference.pointError();
  const Wide distance = std::clamp(search.simplex.nearest.norm(), search.lower, upper);
  decision.verdict = Verdict::separated;
  decision.distance = static_cast<double>(distance);
  const Wide rounding = std::abs(distance - static_cast<Wide>(decision.distance));
  const Wide bound = std::max(upper - distance, distance - search.lower) + rounding;
  decision.errorBound = static_cast<double>(bound) * (1 + 4 * kUnit);
  decision.pointA = inWorld(onA, a);
  decision.pointB = inWorld(onB, a);
  decision.normal = (search.simplex.nearest / search.simplex.nearest.norm()).cast<double>();
  // `reach` is at most 3 sqrt(3) times the largest coordinate, and so is the distance's share:
  // below 16 units of that coordinate together.
  return decision.errorBound <= kUnit * (difference.reach + 1.5 * decision.distance);
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
  const Search search = walk(difference, cache, limit);
  remember(search.simplex, cache);
  if (search.lower > limit) return std::nullopt;

  Decision decision;
  if (search.simplex.holdsOrigin) {
    decision.verdict = Verdict::penetrating;
    decision.pointA = decision.pointB = inWorld(search.simplex.pointOnA(), a);
    return decision;
  }
  if (search.lower > 0 && describeSeparation(difference, search, decision)) return decision;
  return decideExactly(difference, cache);
}

Decision decide(const ConvexBody& a, const ConvexBody& b, FeatureCache& cache) {
  return *decideWithin(a, b, std::numeric_limits<double>::infinity(), cache);
}

double provedSeparation(const ConvexBody& a, const ConvexBody& b, const FeatureCache& cache) {
  if (!(cache.axis.squaredNorm() > 0)) return -std::numeric_limits<double>::infinity();
  VertexPair hint = valid(cache, a, b) ? cache.pairs[0] : VertexPair{};
  const WideVec axis = cache.axis.cast<Wide>();
  const Least least = leastAlong(MinkowskiDifference(a, b), axis, hint);
  const Wide proved = least.bound / axis.norm();
  return static_cast<double>(proved - std::abs(proved) * 2 * kUnit);
}

}  // namespace enfilade::collision
