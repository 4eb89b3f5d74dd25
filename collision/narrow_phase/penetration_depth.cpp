// The expanding polytope (van den Bergen 2001), certified.
// Steps
//  1. A polytope of points of M = B - A around the origin: last tick's, where it still surrounds
//     the origin, else the tetrahedron that proved the penetration or supports around the simplex
//     that the origin lies on, else one that is searched for (polytope.hpp).
//  2. Its facet nearest the origin, and the support of M along that facet's normal. The plane of
//     the support bounds the depth from above: moving by the support's distance parts the bodies.
//  3. The facet bounds it from below (see the proof). Where both meet, that is the depth; else the
//     support joins the polytope, in place of the facets that it sees.
//  4. This goes in doubles. Where the bounds seem to meet, the nearest facet, its support and every
//     facet that might be nearer than it are looked at again in extended precision: the proof.
//     Where doubles do not lead there, as among slivers, all of it goes in extended precision.
// Proof of the lower bound: the facets form a closed surface, and seen from the origin each is
// turned the same way (its determinant is positive, beyond rounding). So the surface winds around
// the origin at least once, and every ray from the origin meets a facet, not before the distance
// of that facet's plane. All corners are in M, which is convex and holds the origin: so does M hold
// the ball of the least such distance. The polytope need not be convex, and is not asked to be.
// Departures: termination is by the two bounds; a facet that is not proved to face outward is
// expanded before all others, and where that is in vain the search ends with an upper bound, never
// with an exception.
#include "collision/narrow_phase/penetration_depth.hpp"

#include <algorithm>
#include <limits>

#include "collision/minkowski/polytope.hpp"
#include "collision/minkowski/simplex.hpp"

namespace enfilade::collision {
namespace {

constexpr std::size_t kMostRemembered = 40;  // corners; a polytope grown larger is begun anew
constexpr double kBoundsMeet = 1e-12;        // relative: upper and lower bound of the depth
constexpr double kMeetWell = 1e-13;          // the same along a rounded normal

template <class Real>
bool restore(const DepthCache& cache, Polytope<Real>& polytope) {
  const MinkowskiDifference& difference = polytope.difference;
  if (cache.facets.empty() || cache.vertices.size() > kMostCorners) return false;
  for (const VertexPair& pair : cache.vertices) {
    if (pair.a >= difference.a.vertexCount() || pair.b >= difference.b.vertexCount()) return false;
    polytope.addCorner(pair);
  }
  return std::all_of(cache.facets.begin(), cache.facets.end(),
                     [&](const DepthCache::Facet& facet) { return polytope.addFacet(facet); });
}

/// Bounds of the depth, and where the upper one is attained.
struct Bounds {
  Wide lower = 0;
  Wide upper = std::numeric_limits<Wide>::infinity();
  WideVec direction = WideVec::UnitY();  ///< outward, any length
  VertexPair support;                    ///< the farthest along it
  std::array<VertexPair, 3> facet{};     ///< the corners of the nearest facet, if there is one
};

/// M's extent along `direction` bounds the depth.
void boundAlong(const MinkowskiDifference& difference, const WideVec& direction, VertexPair hint,
                Bounds& bounds) {
  const Wide length = direction.norm();
  const Least least = leastAlong(difference, -direction, length, hint);
  const Wide upper = -least.bound / length * (1 + 8 * kWideUnit);
  if (!(upper < bounds.upper)) return;
  bounds.upper = upper;
  bounds.direction = direction;
  bounds.support = least.pair;
}

/// In extended precision.
template <class Real>
Facet<Wide> sharpened(const Facet<Real>& facet, const Polytope<Real>& polytope) {
  const auto& c = facet.corners;
  const auto& pairs = polytope.pairs;
  const MinkowskiDifference& difference = polytope.difference;
  Facet<Wide> sharp;
  setFacet<Wide>(c, difference(pairs[c[0]]), difference(pairs[c[1]]), difference(pairs[c[2]]),
                 sharp);
  return sharp;
}

/// `least`, the distance of the nearest facet, or less where others are nearer.
template <class Real>
Wide leastDistance(Wide least, const Facet<Real>& nearest, Polytope<Real>& polytope) {
  const double reach = polytope.difference.reach;
  const Wide clear = least + facetError<Real>(reach);
  const Real squared = static_cast<Real>(clear * clear) * (1 + 16 * unitOf<Real>());
  for (const Facet<Real>& facet : polytope.all()) {
    if (facet.nearness > squared || &facet == &nearest) continue;
    least = std::min(least, std::sqrt(sharpened(facet, polytope).nearness));
  }
  return least * (1 - 8 * kWideUnit) - facetError<Wide>(reach);
}

/// What the polytope and a support along its nearest facet prove.
template <class Real>
Bounds prove(const Facet<Real>& nearest, Polytope<Real>& polytope) {
  const Facet<Wide> sharp = sharpened(nearest, polytope);
  Bounds bounds;
  boundAlong(polytope.difference, sharp.normal, polytope.pairs[nearest.corners[0]], bounds);
  for (int k = 0; k < 3; ++k) bounds.facet[k] = polytope.pairs[nearest.corners[k]];
  bounds.lower = std::max(Wide{0}, leastDistance(std::sqrt(sharp.nearness), nearest, polytope));
  return bounds;
}

/// The farthest point of M along a facet's normal.
template <class Real>
struct Beyond {
  VertexPair pair;
  Real metres;  ///< beyond the facet, up to rounding
  Vec3 inward;  ///< in doubles alone: the direction, unit up to rounding, and its summits
  Summits summits;
};
Beyond<double> beyond(const Facet<double>& facet, const Polytope<double>& polytope) {
  const Vec3 inward = times(facet.normal, -1 / lengthOf(facet.normal));
  const Summits summits =
      climb(polytope.difference, inward, kUnitLength, polytope.pairs[facet.corners[0]]);
  const Along along = alongOf(polytope.difference, inward, 1, summits);
  return {summits.pair(), -along.value - std::sqrt(facet.nearness), inward, summits};
}
Beyond<Wide> beyond(const Facet<Wide>& facet, const Polytope<Wide>& polytope) {
  VertexPair hint = polytope.pairs[facet.corners[0]];
  const Wide length = facet.normal.norm();
  const Least least = leastAlong(polytope.difference, -facet.normal, length, hint);
  return {least.pair, -least.along / length - std::sqrt(facet.nearness), {}, {}};
}

/// What prove() does, by the nearest facet's normal as rounded to doubles: along any direction, no
/// point of the facet is nearer than the nearest of its corners. That is worth less where the depth
/// is small.
Bounds proveByRounded(const Facet<double>& nearest, const Beyond<double>& farthest,
                      Polytope<double>& polytope) {
  const WideVec inward = farthest.inward.cast<Wide>();
  const Wide length = lengthOf(inward);
  const TurnedDirection turned(polytope.difference, inward, farthest.inward, kUnitLength);
  const Least least = turned.least(farthest.summits);
  Bounds bounds;
  bounds.upper = -least.bound / length * (1 + 8 * kWideUnit);
  bounds.direction = -inward;
  bounds.support = least.pair;
  Wide lower = std::numeric_limits<Wide>::infinity();
  for (int k = 0; k < 3; ++k) {
    bounds.facet[k] = polytope.pairs[nearest.corners[k]];
    lower = std::min(lower, -turned.along(bounds.facet[k]));
  }
  lower = std::max(Wide{0}, lower / length);
  bounds.lower = std::max(Wide{0}, leastDistance(lower, nearest, polytope));
  return bounds;
}

bool meet(const Bounds& bounds, double within, const MinkowskiDifference& difference) {
  return bounds.upper - bounds.lower <= within * bounds.lower + 16 * difference.pointError();
}

/// First those that are not proved to face away, as where the origin lies in their plane.
template <class Real>
const Facet<Real>& nearestOf(const Polytope<Real>& polytope) {
  const Facet<Real>* nearest = polytope.facets.data();
  bool away = polytope.facesAway(*nearest);
  for (std::size_t k = 1; k < polytope.facetCount; ++k) {
    const Facet<Real>& facet = polytope.facets[k];
    const bool itIs = polytope.facesAway(facet);
    if (itIs == away ? !(facet.nearness < nearest->nearness) : itIs) continue;
    nearest = &facet, away = itIs;
  }
  return *nearest;
}

/// True: the bounds meet.
template <class Real>
bool expandUntilBoundsMeet(Polytope<Real>& polytope, Bounds& bounds) {
  const Real little = 64 * unitOf<Real>() * static_cast<Real>(polytope.difference.reach);
  while (true) {  // ends: each turn adds a corner
    const Facet<Real>& nearest = nearestOf(polytope);
    const bool away = polytope.facesAway(nearest);
    const Beyond<Real> farthest = beyond(nearest, polytope);
    VertexPair next = farthest.pair;
    if ((away && farthest.metres <= little) || polytope.holds(next)) {
      if (!away) return false;
      if constexpr (std::is_same_v<Real, double>) {
        bounds = proveByRounded(nearest, farthest, polytope);
        if (meet(bounds, kMeetWell, polytope.difference)) return true;
      }
      bounds = prove(nearest, polytope);
      if (meet(bounds, kBoundsMeet, polytope.difference)) return true;
      if (polytope.holds(bounds.support)) return false;
      next = bounds.support;
    }
    if (!expand(next, polytope)) return false;
  }
}

/// For bodies that penetrate so little that no polytope proves it: directions worth a try.
void boundBySomeAxes(const MinkowskiDifference& difference, const FeatureCache& decided,
                     Bounds& bounds) {
  std::vector<WideVec> axes{WideVec::UnitX(), WideVec::UnitY(), WideVec::UnitZ(),
                            decided.axis.cast<Wide>()};
  std::vector<WideVec> points;
  for (int i = 0; i < decided.size; ++i) points.push_back(difference(decided.pairs[i]));
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j)
      for (std::size_t k = j + 1; k < points.size(); ++k)
        axes.push_back((points[j] - points[i]).cross(points[k] - points[i]));
  for (const WideVec& axis : axes) {
    if (!(axis.squaredNorm() > 0)) continue;
    boundAlong(difference, axis, decided.pairs[0], bounds);
    boundAlong(difference, -axis, decided.pairs[0], bounds);
  }
}

/// Without the corners that no facet has any more. False: it is too large to be worth it.
template <class Real>
bool remember(const Polytope<Real>& polytope, DepthCache& cache) {
  constexpr std::uint16_t kNone = kMostCorners;
  std::array<std::uint16_t, kMostCorners> place;
  std::fill_n(place.begin(), polytope.corners, kNone);
  cache.vertices.clear();
  cache.facets.resize(polytope.facetCount);
  for (std::size_t k = 0; k < polytope.facetCount; ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint16_t corner = polytope.facets[k].corners[i];
      if (place[corner] == kNone) {
        place[corner] = static_cast<std::uint16_t>(cache.vertices.size());
        cache.vertices.push_back(polytope.pairs[corner]);
      }
      cache.facets[k][i] = place[corner];
    }
  }
  return cache.vertices.size() <= kMostRemembered;
}

/// From the first start that proves the depth, if any does.
template <class Real>
bool findDepth(const MinkowskiDifference& difference, const FeatureCache& decided,
               DepthCache& cache, Bounds& bounds) {
  Polytope<Real> polytope(difference);
  if (restore(cache, polytope) && expandUntilBoundsMeet(polytope, bounds)) {
    const bool asItWas = polytope.corners == cache.vertices.size();
    if (!asItWas && !remember(polytope, cache)) cache = {};
    return true;
  }
  const auto proves = [&](auto&& start) {
    polytope.clear();
    return start() && expandUntilBoundsMeet(polytope, bounds);
  };
  const std::span simplex(decided.pairs.data(), static_cast<std::size_t>(decided.size));
  const bool proved = proves([&] { return surround<Real>(simplex, polytope); }) ||
                      proves([&] { return surroundBySearch<Real>(polytope); });
  if (proved && !remember(polytope, cache)) cache = {};
  return proved;
}

/// Where the features that are farthest along the normal meet: the deepest points.
void describe(const MinkowskiDifference& difference, const Bounds& bounds, Depth& depth) {
  const Wide upper = std::max(Wide{0}, bounds.upper);
  depth.depth = static_cast<double>(upper);
  const Wide error = upper - std::min(bounds.lower, upper);
  depth.errorBound = static_cast<double>(error) * (1 + 4 * kUnit) + kUnit * depth.depth +
                     std::numeric_limits<double>::denorm_min();
  depth.normal = -(bounds.direction / bounds.direction.norm()).cast<double>();
  Simplex<double> deepest;
  if (depth.global && bounds.lower > 0) {
    for (const VertexPair& pair : bounds.facet) deepest.add(difference, pair);
  } else {
    deepest.add(difference, bounds.support);
  }
  deepest.reduce(difference);
  const PointOn ofA = pointOn(deepest, difference.a, &VertexPair::a);
  const WideVec onA = difference.a.turned(ofA.in(*difference.a.body));
  depth.pointA = (onA + difference.a.body->translation.cast<Wide>()).cast<double>();
  depth.pointB = depth.pointA - depth.depth * depth.normal;
}

}  // namespace

Depth penetrationDepth(const ConvexBody& a, const ConvexBody& b, const FeatureCache& decided,
                       DepthCache& cache) {
  const MinkowskiDifference difference(a, b);
  Bounds bounds;
  Depth depth;
  depth.global =
      (fitsDoubles(difference) && findDepth<double>(difference, decided, cache, bounds)) ||
      findDepth<Wide>(difference, decided, cache, bounds);
  if (!depth.global) {
    cache = {};
    bounds = {};
    boundBySomeAxes(difference, decided, bounds);
    // A depth within rounding of nothing is known as well as any.
    depth.global = bounds.upper <= 16 * difference.pointError();
  }
  describe(difference, bounds, depth);
  return depth;
}

}  // namespace enfilade::collision
