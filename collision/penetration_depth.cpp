// The expanding polytope (van den Bergen 2001), certified.
// Steps
//  1. A polytope of points of M = B - A around the origin: last tick's, where it still surrounds
//     the origin, else the tetrahedron that proved the penetration.
//  2. Its facet nearest the origin, and the support of M along that facet's normal. The plane of
//  the
//     support bounds the depth from above: moving by the support's distance parts the bodies.
//  3. The facet bounds it from below (see the proof). Where both meet, that is the depth; else the
//     support joins the polytope, in place of the facets that it sees.
// Proof of the lower bound: the facets form a closed surface, and seen from the origin each is
// turned the same way (its determinant is positive, beyond rounding). So the surface winds around
// the origin at least once, and every ray from the origin meets a facet, not before the distance
// of that facet's plane. All corners are in M, which is convex and holds the origin: so does M hold
// the ball of the least such distance. The polytope need not be convex, and is not asked to be.
// Departures: termination is by the two bounds; a facet that cannot be proved to face outward ends
// the search with an upper bound, never with an exception.
#include "collision/penetration_depth.hpp"

#include <algorithm>

#include "collision/minkowski.hpp"

namespace enfilade::collision {
namespace {

constexpr int kExpansionBound = 256;         // facets of M that may be tried; 10 to 30 are usual
constexpr std::size_t kMostRemembered = 40;  // corners; a polytope grown larger is begun anew
constexpr Wide kBoundsMeet = 1e-12L;         // relative: upper and lower bound of the depth

struct Facet {
  DepthCache::Facet corners;
  WideVec normal;    ///< outward, any length
  Wide determinant;  ///< of the corners; normal . corner of each
  Wide distance;     ///< of the plane from the origin
};

struct Polytope {
  const MinkowskiDifference& difference;
  std::vector<VertexPair> pairs;
  std::vector<WideVec> points;
  std::vector<Facet> facets;

  /// Of a facet's determinant; simplex.cpp has the sum.
  Wide determinantError() const {
    const Wide reach = difference.reach;
    return 256 * kWideUnit * reach * reach * reach;
  }
  void addPoint(VertexPair pair) {
    pairs.push_back(pair);
    points.push_back(difference(pair));
  }
  /// False, and nothing added, when the facet is not proved to face away from the origin.
  bool addFacet(const DepthCache::Facet& corners) {
    const WideVec &a = points[corners[0]], &b = points[corners[1]], &c = points[corners[2]];
    const WideVec normal = (b - a).cross(c - a);
    const Wide determinant = a.dot(b.cross(c));
    if (!(determinant > determinantError())) return false;
    facets.push_back({corners, normal, determinant, determinant / normal.norm()});
    return true;
  }
};

bool restore(const DepthCache& cache, Polytope& polytope) {
  if (cache.facets.empty() || cache.vertices.size() > kMostRemembered) return false;
  for (const VertexPair& pair : cache.vertices) {
    if (pair.a >= polytope.difference.a.vertexCount() ||
        pair.b >= polytope.difference.b.vertexCount())
      return false;
    polytope.addPoint(pair);
  }
  for (const DepthCache::Facet& facet : cache.facets)
    if (!polytope.addFacet(facet)) return false;
  return true;
}

bool startFromTetrahedron(const FeatureCache& decided, Polytope& polytope) {
  polytope.pairs.clear();
  polytope.points.clear();
  polytope.facets.clear();
  if (decided.size != 4) return false;
  for (const VertexPair& pair : decided.pairs) polytope.addPoint(pair);
  const auto& p = polytope.points;
  const bool turned = (p[1] - p[0]).dot((p[2] - p[0]).cross(p[3] - p[0])) < 0;
  if (turned) {
    std::swap(polytope.points[2], polytope.points[3]);
    std::swap(polytope.pairs[2], polytope.pairs[3]);
  }
  return polytope.addFacet({0, 2, 1}) && polytope.addFacet({0, 1, 3}) &&
         polytope.addFacet({0, 3, 2}) && polytope.addFacet({1, 2, 3});
}

std::size_t nearestFacet(const Polytope& polytope) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < polytope.facets.size(); ++i)
    if (polytope.facets[i].distance < polytope.facets[best].distance) best = i;
  return best;
}

using Edge = std::array<std::uint16_t, 2>;

/// Takes away the facets that see `point`, and returns the rim of the hole, each edge as the facet
/// that went had it.
std::vector<Edge> openTowards(const WideVec& point, Polytope& polytope) {
  std::vector<Edge> rim;
  const auto toggle = [&](std::uint16_t from, std::uint16_t to) {
    const auto twin = std::find(rim.begin(), rim.end(), Edge{to, from});
    if (twin != rim.end()) {
      rim.erase(twin);
    } else {
      rim.push_back({from, to});
    }
  };
  std::erase_if(polytope.facets, [&](const Facet& facet) {
    if (facet.normal.dot(point) <= facet.normal.dot(polytope.points[facet.corners[0]]))
      return false;
    for (int k = 0; k < 3; ++k) toggle(facet.corners[k], facet.corners[(k + 1) % 3]);
    return true;
  });
  return rim;
}

/// False when the polytope could not be grown with proof; it is then of no more use.
bool expand(Polytope& polytope, VertexPair pair) {
  polytope.addPoint(pair);
  const auto added = static_cast<std::uint16_t>(polytope.points.size() - 1);
  for (const Edge& edge : openTowards(polytope.points.back(), polytope))
    if (!polytope.addFacet({edge[0], edge[1], added})) return false;
  return true;
}

/// Bounds of the depth, and where the upper one is attained.
struct Bounds {
  Wide lower = 0;
  Wide upper = std::numeric_limits<Wide>::infinity();
  WideVec direction = WideVec::UnitY();  ///< outward, any length
};

/// M's extent along `direction` bounds the depth; returns the support.
VertexPair boundAlong(const MinkowskiDifference& difference, const WideVec& direction,
                      VertexPair& hint, Bounds& bounds) {
  const Wide length = direction.norm();
  const Least least = leastAlong(difference, -direction, length, hint);
  const Wide upper = -least.bound / length * (1 + 8 * kWideUnit);
  if (upper < bounds.upper) {
    bounds.upper = upper;
    bounds.direction = direction;
  }
  return least.pair;
}

/// True: the bounds meet.
bool expandUntilBoundsMeet(Polytope& polytope, Bounds& bounds) {
  VertexPair hint = polytope.pairs[0];
  for (int i = 0; i < kExpansionBound; ++i) {
    const Facet& nearest = polytope.facets[nearestFacet(polytope)];
    const Wide error = polytope.determinantError() / nearest.determinant + 8 * kWideUnit;
    bounds.lower = std::max(bounds.lower, nearest.distance * (1 - error));
    hint = polytope.pairs[nearest.corners[0]];
    const VertexPair support = boundAlong(polytope.difference, nearest.normal, hint, bounds);
    const Wide gap = bounds.upper - nearest.distance;
    if (gap <= kBoundsMeet * nearest.distance + 16 * polytope.difference.pointError()) return true;
    if (std::find(polytope.pairs.begin(), polytope.pairs.end(), support) != polytope.pairs.end())
      return false;
    if (!expand(polytope, support)) return false;
  }
  return false;
}

/// For bodies that penetrate so little that no tetrahedron proves it: directions worth a try.
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
  VertexPair hint = decided.pairs[0];
  for (const WideVec& axis : axes) {
    if (!(axis.squaredNorm() > 0)) continue;
    boundAlong(difference, axis, hint, bounds);
    boundAlong(difference, -axis, hint, bounds);
  }
}

void remember(const Polytope& polytope, DepthCache& cache) {
  cache.vertices = polytope.pairs;
  cache.facets.clear();
  for (const Facet& facet : polytope.facets) cache.facets.push_back(facet.corners);
}

/// Where the features that are farthest along the normal meet: the deepest points.
void describe(const MinkowskiDifference& difference, const Bounds& bounds, const Polytope& polytope,
              Depth& depth) {
  depth.depth = static_cast<double>(bounds.upper);
  depth.errorBound = static_cast<double>(bounds.upper - std::min(bounds.lower, bounds.upper)) +
                     kUnit * depth.depth;
  const WideVec normal = bounds.direction / bounds.direction.norm();
  depth.normal = -normal.cast<double>();
  WideVec onA = WideVec::Zero();
  if (!polytope.facets.empty() && depth.global) {
    const Facet& nearest = polytope.facets[nearestFacet(polytope)];
    const auto& p = polytope.points;
    const DepthCache::Facet& c = nearest.corners;
    // Weights of the facet's point nearest the origin, by sub-areas, kept inside the facet.
    const WideVec foot = nearest.distance / nearest.normal.norm() * nearest.normal;
    std::array<Wide, 3> weight{};
    Wide sum = 0;
    for (int k = 0; k < 3; ++k) {
      const WideVec &from = p[c[(k + 1) % 3]], &to = p[c[(k + 2) % 3]];
      weight[k] = std::max(Wide{0}, (to - from).cross(foot - from).dot(nearest.normal));
      sum += weight[k];
    }
    for (int k = 0; k < 3; ++k) onA += weight[k] / sum * difference.pointA(polytope.pairs[c[k]].a);
  } else {
    VertexPair hint{};
    onA = difference.pointA(leastAlong(difference, -normal, 1, hint).pair.a);
  }
  const Vec3 origin = difference.a.body->translation;
  depth.pointA = (onA + origin.cast<Wide>()).cast<double>();
  depth.pointB = depth.pointA - depth.depth * depth.normal;
}

}  // namespace

Depth penetrationDepth(const ConvexBody& a, const ConvexBody& b, const FeatureCache& decided,
                       DepthCache& cache) {
  const MinkowskiDifference difference(a, b);
  Polytope polytope{difference, {}, {}, {}};
  Bounds bounds;
  Depth depth;
  if (restore(cache, polytope) || startFromTetrahedron(decided, polytope)) {
    depth.global = expandUntilBoundsMeet(polytope, bounds);
    if (depth.global) remember(polytope, cache);
  }
  if (!depth.global) {
    cache = {};
    boundBySomeAxes(difference, decided, bounds);
    // A depth within rounding of nothing is known as well as any.
    depth.global = bounds.upper <= 16 * difference.pointError();
  }
  describe(difference, bounds, polytope, depth);
  return depth;
}

}  // namespace enfilade::collision
