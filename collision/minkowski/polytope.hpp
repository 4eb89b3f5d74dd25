// The expanding polytope of EPA: points of a Minkowski difference that enclose the origin. Internal
// to the narrow phase. Real is double or LongReal.
#pragma once

#include <span>

#include "collision/assert.hpp"
#include "collision/minkowski/minkowski.hpp"

namespace enfilade::collision {

inline constexpr std::size_t kMaxCorners = 256;  // of a polytope; 10 to 30 are typical

using Corners = std::array<std::uint16_t, 3>;  ///< counter-clockwise seen from outside

template <class Real>
struct Facet {
  Corners corners;
  Eigen::Matrix<Real, 3, 1> normal;  ///< outward, any length
  Real offset;                       ///< minimum of normal . corner
  Real squaredDistance;              ///< (offset / |normal|)^2, squared metres
};

template <class Real>
void setFacet(const Corners& corners, const Eigen::Matrix<Real, 3, 1>& a,
              const Eigen::Matrix<Real, 3, 1>& b, const Eigen::Matrix<Real, 3, 1>& c,
              Facet<Real>& facet) {
  const Eigen::Matrix<Real, 3, 1> normal = subtractVectors(b, a).cross(subtractVectors(c, a));
  facet.corners = corners;
  facet.normal = normal;
  facet.offset = std::min(std::min(dot(normal, a), dot(normal, b)), dot(normal, c));
  facet.squaredDistance = facet.offset * facet.offset / dot(normal, normal);
}

/// Error bound (metres) of a facet's distance sqrt(squaredDistance), for any rounding of its normal
/// n. Each point of the facet is a convex combination of its corners, so n . point is at least the
/// minimum of n . corner. A corner is off by 8u reach per coordinate, the product by 3u |n| reach.
template <class Real>
Real computeFacetError(double reach) {
  return 24 * getUnitRoundoff<Real>() * static_cast<Real>(reach);
}

/// Facets that form a closed surface. If every facet faces away from the origin, the surface winds
/// around the origin, which is then strictly inside.
template <class Real>
struct Polytope {
  using Vec = Eigen::Matrix<Real, 3, 1>;

  const MinkowskiDifference& difference;
  Real minDeterminant;        ///< a larger determinant has a certified sign
  struct UninitializedPair {  // a VertexPair without initialisation
    std::uint32_t a, b;
    operator VertexPair() const { return {a, b}; }
  };
  std::array<UninitializedPair, kMaxCorners> pairs;
  std::array<Vec, kMaxCorners> points;
  std::array<Facet<Real>, 2 * kMaxCorners> facets;
  std::size_t corners = 0, facetCount = 0;

  explicit Polytope(const MinkowskiDifference& minkowskiDifference)
      : difference(minkowskiDifference) {
    const Real reach = minkowskiDifference.reach;
    // Nine entries off by at most 8u reach, with cofactors of at most 2 reach^2. The same again for
    // rounding the product of edges of up to 2 reach.
    minDeterminant =
        512 * getUnitRoundoff<Real>() * reach * reach * reach + std::numeric_limits<Real>::min();
  }
  void clear() { corners = facetCount = 0; }
  bool facesAway(const Facet<Real>& facet) const { return facet.offset > minDeterminant; }
  std::span<Facet<Real>> all() { return {facets.data(), facetCount}; }
  bool contains(VertexPair pair) const {
    const auto isSame = [&](const UninitializedPair& existing) {
      return VertexPair(existing) == pair;
    };
    return std::any_of(pairs.begin(), pairs.begin() + corners, isSame);
  }
  std::uint16_t addCorner(VertexPair pair) {
    ENFILADE_ASSERT(corners < kMaxCorners);
    pairs[corners] = {pair.a, pair.b};
    points[corners] = difference.point<Real>(pair);
    return static_cast<std::uint16_t>(corners++);
  }
  /// Adds a facet that faces away from the origin, or any facet if `allowInward` is set. Returns
  /// false and adds nothing if that is not certified or there is no room.
  bool addFacet(const Corners& facetCorners, bool allowInward = false) {
    if (facetCount == facets.size()) return false;
    ENFILADE_ASSERT(facetCorners[0] < corners && facetCorners[1] < corners &&
                    facetCorners[2] < corners);
    Facet<Real>& facet = facets[facetCount];
    setFacet<Real>(facetCorners, points[facetCorners[0]], points[facetCorners[1]],
                   points[facetCorners[2]], facet);
    if (!(allowInward || facesAway(facet))) return false;
    ++facetCount;
    return true;
  }
};

/// Builds a polytope around the origin from a simplex of two to four points that contains it. On a
/// face or an edge it may do so only up to rounding. A flat simplex is completed with support
/// points. `polytope` must be empty. Returns false if enclosure is not certified.
template <class Real>
bool encloseOrigin(std::span<const VertexPair> simplex, Polytope<Real>& polytope);

/// The same without a simplex: starts from four distant points and adds support points along the
/// facet that the origin is farthest outside of. Needed if GJK's simplex does not certify that the
/// origin is inside, for example on a plane of symmetry.
template <class Real>
bool encloseOriginBySearch(Polytope<Real>& polytope);

/// Replaces the facets that a new point sees by facets to that point, whether or not these face
/// away from the origin. Returns false, and leaves the polytope unusable, if there is no room or
/// the point sees no facet or all of them.
template <class Real>
bool expandPolytope(VertexPair pair, Polytope<Real>& polytope);

extern template bool encloseOrigin(std::span<const VertexPair>, Polytope<double>&);
extern template bool encloseOrigin(std::span<const VertexPair>, Polytope<LongReal>&);
extern template bool encloseOriginBySearch(Polytope<double>&);
extern template bool encloseOriginBySearch(Polytope<LongReal>&);
extern template bool expandPolytope(VertexPair, Polytope<double>&);
extern template bool expandPolytope(VertexPair, Polytope<LongReal>&);

}  // namespace enfilade::collision
