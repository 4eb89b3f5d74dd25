// The expanding polytope (van den Bergen 2001), certified.
// Steps
//  1. Build a polytope of points of M = B - A around the origin. This is the cached one if it
//     still encloses the origin. Otherwise it is grown from GJK's final simplex, or else found by
//     search (polytope.hpp).
//  2. Find its facet nearest the origin and the support of M along that facet's normal. The plane
//     of the support is an upper bound of the depth: moving by its distance separates the bodies.
//  3. The facet is a lower bound (see the proof). If both bounds meet, they are the depth.
//     Otherwise the support replaces the facets that it sees.
//  4. This runs in doubles. Once the bounds seem to meet, they are recomputed in extended precision
//     from the nearest facet, its support and every facet that might be nearer. If doubles do not
//     converge, as for slivers, all steps run in extended precision.
// Proof of the lower bound. The facets form a closed surface, and all of them face away from the
// origin (each determinant is positive beyond rounding). The surface therefore winds around the
// origin at least once. Every ray from the origin meets a facet, at no less than the distance of
// that facet's plane. M is convex and contains all corners and the origin, so it contains the ball
// whose radius is the minimum of these distances. The polytope need not be convex.
// Departures: termination is by the two bounds. A facet that is not certified to face outward is
// expanded before all others. If that fails, the result is an upper bound, never an exception.
#include "collision/narrow_phase/penetration_depth.hpp"

#include <algorithm>
#include <limits>

#include "collision/assert.hpp"
#include "collision/minkowski/polytope.hpp"
#include "collision/minkowski/simplex.hpp"

namespace enfilade::collision {
namespace {

constexpr std::size_t kMaxCachedCorners = 40;    // corners; a larger polytope is not cached
constexpr double kBoundsTolerance = 1e-12;       // relative difference of the two bounds
constexpr double kTightBoundsTolerance = 1e-13;  // the same, for bounds along a rounded normal

template <class Real>
bool restorePolytope(const DepthCache& cache, Polytope<Real>& polytope) {
  const MinkowskiDifference& difference = polytope.difference;
  if (cache.facets.empty() || cache.vertices.size() > kMaxCorners) return false;
  for (const VertexPair& pair : cache.vertices) {
    if (pair.a >= difference.a.vertexCount() || pair.b >= difference.b.vertexCount()) return false;
    polytope.addCorner(pair);
  }
  return std::all_of(cache.facets.begin(), cache.facets.end(),
                     [&](const DepthCache::Facet& facet) { return polytope.addFacet(facet); });
}

/// Bounds of the depth (metres), and where the upper bound is attained.
struct DepthBounds {
  LongReal lower = 0;
  LongReal upper = std::numeric_limits<LongReal>::infinity();
  LongVec3 direction = LongVec3::UnitY();  ///< outward, any length
  VertexPair support;                      ///< the support point along it
  std::array<VertexPair, 3> facet{};       ///< the corners of the nearest facet, if any
};

/// Lowers the upper bound to M's extent along `direction`, if that is smaller.
void tightenUpperBound(const MinkowskiDifference& difference, const LongVec3& direction,
                       VertexPair hint, DepthBounds& bounds) {
  const LongReal length = direction.norm();
  const CertifiedSupport support = findCertifiedSupport(difference, -direction, length, hint);
  const LongReal upper = -support.lowerBound / length * (1 + 8 * kLongRoundoff);
  if (!(upper < bounds.upper)) return;
  bounds.upper = upper;
  bounds.direction = direction;
  bounds.support = support.pair;
}

/// Recomputes a facet in extended precision.
template <class Real>
Facet<LongReal> refineFacet(const Facet<Real>& facet, const Polytope<Real>& polytope) {
  const auto& c = facet.corners;
  const auto& pairs = polytope.pairs;
  const MinkowskiDifference& difference = polytope.difference;
  Facet<LongReal> refined;
  setFacet<LongReal>(c, difference(pairs[c[0]]), difference(pairs[c[1]]), difference(pairs[c[2]]),
                     refined);
  return refined;
}

/// The minimum of `minDistance`, the distance of the nearest facet, and those of all other facets.
template <class Real>
LongReal computeMinFacetDistance(LongReal minDistance, const Facet<Real>& nearest,
                                 Polytope<Real>& polytope) {
  const double reach = polytope.difference.reach;
  const LongReal clearance = minDistance + computeFacetError<Real>(reach);
  const Real squared =
      static_cast<Real>(clearance * clearance) * (1 + 16 * getUnitRoundoff<Real>());
  for (const Facet<Real>& facet : polytope.all()) {
    if (facet.squaredDistance > squared || &facet == &nearest) continue;
    minDistance = std::min(minDistance, std::sqrt(refineFacet(facet, polytope).squaredDistance));
  }
  return minDistance * (1 - 8 * kLongRoundoff) - computeFacetError<LongReal>(reach);
}

/// Computes certified bounds from the polytope and a support along its nearest facet's normal.
template <class Real>
DepthBounds certifyBounds(const Facet<Real>& nearest, Polytope<Real>& polytope) {
  const Facet<LongReal> refined = refineFacet(nearest, polytope);
  DepthBounds bounds;
  tightenUpperBound(polytope.difference, refined.normal, polytope.pairs[nearest.corners[0]],
                    bounds);
  for (int k = 0; k < 3; ++k) bounds.facet[k] = polytope.pairs[nearest.corners[k]];
  bounds.lower = std::max(
      LongReal{0}, computeMinFacetDistance(std::sqrt(refined.squaredDistance), nearest, polytope));
  return bounds;
}

/// The support point of M along a facet's normal.
template <class Real>
struct FacetSupport {
  VertexPair pair;
  Real metres;  ///< beyond the facet, up to rounding
  Vec3 inward;  ///< doubles only: unit up to rounding, with its supports
  SupportPair supports;
};
FacetSupport<double> findFacetSupport(const Facet<double>& facet,
                                      const Polytope<double>& polytope) {
  const Vec3 inward = scaleVector(facet.normal, -1 / computeNorm(facet.normal));
  const SupportPair supports =
      hillClimbPair(polytope.difference, inward, kMaxUnitLength, polytope.pairs[facet.corners[0]]);
  const SupportValue value = computeSupportValue(polytope.difference, inward, 1, supports);
  return {supports.pair(), -value.value - std::sqrt(facet.squaredDistance), inward, supports};
}
FacetSupport<LongReal> findFacetSupport(const Facet<LongReal>& facet,
                                        const Polytope<LongReal>& polytope) {
  VertexPair hint = polytope.pairs[facet.corners[0]];
  const LongReal length = facet.normal.norm();
  const CertifiedSupport support =
      findCertifiedSupport(polytope.difference, -facet.normal, length, hint);
  return {support.pair, -support.projection / length - std::sqrt(facet.squaredDistance), {}, {}};
}

/// As certifyBounds(), along the nearest facet's normal rounded to doubles. Along any direction, no
/// point of the facet is nearer than its nearest corner. The bound is weaker for a small depth.
DepthBounds certifyBoundsAlongRounded(const Facet<double>& nearest,
                                      const FacetSupport<double>& facetSupport,
                                      Polytope<double>& polytope) {
  const LongVec3 inward = facetSupport.inward.cast<LongReal>();
  const LongReal length = computeNorm(inward);
  const RotatedDirection rotatedDirection(polytope.difference, inward, kMaxUnitLength);
  const CertifiedSupport support = rotatedDirection.certify(facetSupport.supports);
  DepthBounds bounds;
  bounds.upper = -support.lowerBound / length * (1 + 8 * kLongRoundoff);
  bounds.direction = -inward;
  bounds.support = support.pair;
  LongReal lower = std::numeric_limits<LongReal>::infinity();
  for (int k = 0; k < 3; ++k) {
    bounds.facet[k] = polytope.pairs[nearest.corners[k]];
    lower = std::min(lower, -rotatedDirection.project(bounds.facet[k]));
  }
  lower = std::max(LongReal{0}, lower / length);
  bounds.lower = std::max(LongReal{0}, computeMinFacetDistance(lower, nearest, polytope));
  return bounds;
}

bool doBoundsMeet(const DepthBounds& bounds, double tolerance,
                  const MinkowskiDifference& difference) {
  return bounds.upper - bounds.lower <= tolerance * bounds.lower + 16 * difference.pointError();
}

/// Facets that are not certified to face away come first, for example if the origin is in their
/// plane.
template <class Real>
const Facet<Real>& findNearestFacet(const Polytope<Real>& polytope) {
  ENFILADE_ASSERT(polytope.facetCount > 0);
  const Facet<Real>* nearest = polytope.facets.data();
  bool away = polytope.facesAway(*nearest);
  for (std::size_t k = 1; k < polytope.facetCount; ++k) {
    const Facet<Real>& facet = polytope.facets[k];
    const bool candidateAway = polytope.facesAway(facet);
    if (candidateAway == away ? !(facet.squaredDistance < nearest->squaredDistance) : candidateAway)
      continue;
    nearest = &facet, away = candidateAway;
  }
  return *nearest;
}

/// Expands the polytope until the bounds meet (true) or no more progress is certified (false).
template <class Real>
bool expandUntilBoundsMeet(Polytope<Real>& polytope, DepthBounds& bounds) {
  const Real tolerance =
      64 * getUnitRoundoff<Real>() * static_cast<Real>(polytope.difference.reach);
  while (true) {  // terminates: each iteration adds a corner
    const Facet<Real>& nearest = findNearestFacet(polytope);
    const bool away = polytope.facesAway(nearest);
    const FacetSupport<Real> facetSupport = findFacetSupport(nearest, polytope);
    VertexPair next = facetSupport.pair;
    if ((away && facetSupport.metres <= tolerance) || polytope.contains(next)) {
      if (!away) return false;
      if constexpr (std::is_same_v<Real, double>) {
        bounds = certifyBoundsAlongRounded(nearest, facetSupport, polytope);
        if (doBoundsMeet(bounds, kTightBoundsTolerance, polytope.difference)) return true;
      }
      bounds = certifyBounds(nearest, polytope);
      if (doBoundsMeet(bounds, kBoundsTolerance, polytope.difference)) return true;
      if (polytope.contains(bounds.support)) return false;
      next = bounds.support;
    }
    if (!expandPolytope(next, polytope)) return false;
  }
}

/// Fallback for bodies that penetrate so little that no polytope is certified: bounds the depth
/// along a fixed set of directions.
void boundByTrialAxes(const MinkowskiDifference& difference, const FeatureCache& features,
                      DepthBounds& bounds) {
  std::vector<LongVec3> axes{LongVec3::UnitX(), LongVec3::UnitY(), LongVec3::UnitZ(),
                             features.axis.cast<LongReal>()};
  std::vector<LongVec3> points;
  for (int i = 0; i < features.size; ++i) points.push_back(difference(features.pairs[i]));
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j)
      for (std::size_t k = j + 1; k < points.size(); ++k)
        axes.push_back((points[j] - points[i]).cross(points[k] - points[i]));
  for (const LongVec3& axis : axes) {
    if (!(axis.squaredNorm() > 0)) continue;
    tightenUpperBound(difference, axis, features.pairs[0], bounds);
    tightenUpperBound(difference, -axis, features.pairs[0], bounds);
  }
}

/// Stores the polytope without unused corners. False: it is too large to be cached.
template <class Real>
bool storePolytope(const Polytope<Real>& polytope, DepthCache& cache) {
  constexpr std::uint16_t kNone = kMaxCorners;
  std::array<std::uint16_t, kMaxCorners> cornerIndex;
  std::fill_n(cornerIndex.begin(), polytope.corners, kNone);
  cache.vertices.clear();
  cache.facets.resize(polytope.facetCount);
  for (std::size_t k = 0; k < polytope.facetCount; ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint16_t corner = polytope.facets[k].corners[i];
      ENFILADE_ASSERT(corner < polytope.corners);
      if (cornerIndex[corner] == kNone) {
        cornerIndex[corner] = static_cast<std::uint16_t>(cache.vertices.size());
        cache.vertices.push_back(polytope.pairs[corner]);
      }
      cache.facets[k][i] = cornerIndex[corner];
    }
  }
  return cache.vertices.size() <= kMaxCachedCorners;
}

/// Tries the starting polytopes in order; true if one certifies the depth.
template <class Real>
bool findDepth(const MinkowskiDifference& difference, const FeatureCache& features,
               DepthCache& cache, DepthBounds& bounds) {
  Polytope<Real> polytope(difference);
  if (restorePolytope(cache, polytope) && expandUntilBoundsMeet(polytope, bounds)) {
    const bool unchanged = polytope.corners == cache.vertices.size();
    if (!unchanged && !storePolytope(polytope, cache)) cache = {};
    return true;
  }
  const auto proves = [&](auto&& start) {
    polytope.clear();
    return start() && expandUntilBoundsMeet(polytope, bounds);
  };
  const std::span simplex(features.pairs.data(), static_cast<std::size_t>(features.size));
  const bool certified = proves([&] { return encloseOrigin<Real>(simplex, polytope); }) ||
                         proves([&] { return encloseOriginBySearch<Real>(polytope); });
  if (certified && !storePolytope(polytope, cache)) cache = {};
  return certified;
}

/// Fills in the depth and the deepest points, where the support features along the normal meet.
void describeDepth(const MinkowskiDifference& difference, const DepthBounds& bounds,
                   PenetrationResult& depth) {
  const LongReal upper = std::max(LongReal{0}, bounds.upper);
  depth.depth = static_cast<double>(upper);
  const LongReal error = upper - std::min(bounds.lower, upper);
  depth.errorBound = static_cast<double>(error) * (1 + 4 * kRoundoff) + kRoundoff * depth.depth +
                     std::numeric_limits<double>::denorm_min();
  depth.normal = -(bounds.direction / bounds.direction.norm()).cast<double>();
  Simplex<double> deepest;
  if (depth.global && bounds.lower > 0) {
    for (const VertexPair& pair : bounds.facet) deepest.add(difference, pair);
  } else {
    deepest.add(difference, bounds.support);
  }
  deepest.reduce(difference);
  const BodyPoint ofA = computeBodyPoint(deepest, difference.a, &VertexPair::a);
  const LongVec3 onA = difference.a.rotated(ofA.inBodyFrame(*difference.a.shape));
  depth.pointA = (onA + difference.a.shape->translation.cast<LongReal>()).cast<double>();
  depth.pointB = depth.pointA - depth.depth * depth.normal;
}

}  // namespace

PenetrationResult computePenetrationDepth(const PlacedConvex& a, const PlacedConvex& b,
                                          const FeatureCache& features, DepthCache& cache) {
  const MinkowskiDifference difference(a, b);
  DepthBounds bounds;
  PenetrationResult depth;
  depth.global =
      (fitsDoubleRange(difference) && findDepth<double>(difference, features, cache, bounds)) ||
      findDepth<LongReal>(difference, features, cache, bounds);
  if (!depth.global) {
    cache = {};
    bounds = {};
    boundByTrialAxes(difference, features, bounds);
    // A depth within rounding of zero counts as global.
    depth.global = bounds.upper <= 16 * difference.pointError();
  }
  describeDepth(difference, bounds, depth);
  return depth;
}

}  // namespace enfilade::collision
