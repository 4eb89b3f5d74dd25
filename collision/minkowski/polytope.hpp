// A polytope of points of a Minkowski difference around the origin. Internal to the narrow phase.
// Real is double or Wide.
#pragma once

#include <span>

#include "collision/minkowski/minkowski.hpp"

namespace enfilade::collision {

inline constexpr std::size_t kMostCorners = 256;  // of a polytope; 10 to 30 are usual

using Corners = std::array<std::uint16_t, 3>;  ///< counter-clockwise seen from outside

template <class Real>
struct Facet {
  Corners corners;
  Eigen::Matrix<Real, 3, 1> normal;  ///< outward, any length
  Real offset;                       ///< the least normal . corner
  Real nearness;                     ///< (offset / |normal|)^2, squared metres
};

template <class Real>
void setFacet(const Corners& corners, const Eigen::Matrix<Real, 3, 1>& a,
              const Eigen::Matrix<Real, 3, 1>& b, const Eigen::Matrix<Real, 3, 1>& c,
              Facet<Real>& facet) {
  const Eigen::Matrix<Real, 3, 1> normal = minus(b, a).cross(minus(c, a));
  facet.corners = corners;
  facet.normal = normal;
  facet.offset = std::min(std::min(dot(normal, a), dot(normal, b)), dot(normal, c));
  facet.nearness = facet.offset * facet.offset / dot(normal, normal);
}

/// How much nearer than sqrt(nearness) a facet may be, in metres. Whatever its normal n was rounded
/// to: each of its points is a combination of its corners, so n . point is at least the least
/// n . corner; a corner is off by 8u reach a coordinate and the product by 3u |n| reach more.
template <class Real>
Real facetError(double reach) {
  return 24 * unitOf<Real>() * static_cast<Real>(reach);
}

/// Facets that form a closed surface. Where each of them faces away from the origin, the surface
/// winds around it, and the origin is strictly inside.
template <class Real>
struct Polytope {
  using Vec = Eigen::Matrix<Real, 3, 1>;

  const MinkowskiDifference& difference;
  Real leastDeterminant;  ///< proves that three points are turned as their determinant says
  struct Pair {           // a VertexPair that nobody sets to zero first
    std::uint32_t a, b;
    operator VertexPair() const { return {a, b}; }
  };
  std::array<Pair, kMostCorners> pairs;
  std::array<Vec, kMostCorners> points;
  std::array<Facet<Real>, 2 * kMostCorners> facets;
  std::size_t corners = 0, facetCount = 0;

  explicit Polytope(const MinkowskiDifference& of) : difference(of) {
    const Real reach = of.reach;
    // Nine entries off by at most 8u reach, with cofactors of at most 2 reach^2, and as much again
    // for rounding the product of edges of up to 2 reach.
    leastDeterminant =
        512 * unitOf<Real>() * reach * reach * reach + std::numeric_limits<Real>::min();
  }
  void clear() { corners = facetCount = 0; }
  bool facesAway(const Facet<Real>& facet) const { return facet.offset > leastDeterminant; }
  std::span<Facet<Real>> all() { return {facets.data(), facetCount}; }
  bool holds(VertexPair pair) const {
    const auto isIt = [&](const Pair& held) { return VertexPair(held) == pair; };
    return std::any_of(pairs.begin(), pairs.begin() + corners, isIt);
  }
  std::uint16_t addCorner(VertexPair pair) {
    pairs[corners] = {pair.a, pair.b};
    points[corners] = difference.point<Real>(pair);
    return static_cast<std::uint16_t>(corners++);
  }
  /// False, and nothing added, when the facet is not proved to face away from the origin (and
  /// `anyTurn` is not set), or when there is no room.
  bool addFacet(const Corners& of, bool anyTurn = false) {
    if (facetCount == facets.size()) return false;
    Facet<Real>& facet = facets[facetCount];
    setFacet<Real>(of, points[of[0]], points[of[1]], points[of[2]], facet);
    if (!(anyTurn || facesAway(facet))) return false;
    ++facetCount;
    return true;
  }
};

/// Builds a polytope around the origin from a simplex of two to four points that holds it, if only
/// on a face or an edge (up to rounding): with supports on the sides that the simplex is flat on.
/// `polytope` is empty before. False: not proved.
template <class Real>
bool surround(std::span<const VertexPair> simplex, Polytope<Real>& polytope);

/// The same from nothing: four points far apart, then supports along the facet that the origin is
/// most beyond. For an origin that no simplex shows the inside of, as on a plane of symmetry.
template <class Real>
bool surroundBySearch(Polytope<Real>& polytope);

/// Puts a point in place of the facets that it sees, whether or not the new ones face away from the
/// origin. False when there is no room, or it sees none or all; the polytope is then of no more
/// use.
template <class Real>
bool expand(VertexPair pair, Polytope<Real>& polytope);

extern template bool surround(std::span<const VertexPair>, Polytope<double>&);
extern template bool surround(std::span<const VertexPair>, Polytope<Wide>&);
extern template bool surroundBySearch(Polytope<double>&);
extern template bool surroundBySearch(Polytope<Wide>&);
extern template bool expand(VertexPair, Polytope<double>&);
extern template bool expand(VertexPair, Polytope<Wide>&);

}  // namespace enfilade::collision
