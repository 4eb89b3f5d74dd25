#include "collision/minkowski/polytope.hpp"

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

template <class Real>
std::uint16_t addSupport(const Eigen::Matrix<Real, 3, 1>& outward, Polytope<Real>& polytope) {
  VertexPair hint{};
  const LongVec3 inward = -outward.template cast<LongReal>();
  findCertifiedSupport(polytope.difference, inward, inward.norm(), hint);
  return polytope.addCorner(hint);
}

/// Two apexes and a ring between them, counter-clockwise seen from the upper apex.
template <class Real>
bool addBipyramid(std::span<const std::uint16_t> ring, std::uint16_t upper, std::uint16_t lower,
                  Polytope<Real>& polytope) {
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const std::uint16_t from = ring[k], to = ring[(k + 1) % ring.size()];
    if (!polytope.addFacet({from, to, upper}) || !polytope.addFacet({to, from, lower}))
      return false;
  }
  return true;
}

constexpr int kMaxSearchSteps = 64;  // a dozen are typical; at the limit: not certified

/// Orients each facet outward, using the corner that is not on it.
template <class Real>
bool addTetrahedron(std::array<std::uint16_t, 4> c, bool allowInward, Polytope<Real>& polytope) {
  const auto& p = polytope.points;
  const Real determinant = (p[c[1]] - p[c[0]]).dot((p[c[2]] - p[c[0]]).cross(p[c[3]] - p[c[0]]));
  if (determinant < 0) std::swap(c[1], c[2]);
  return polytope.addFacet({c[0], c[2], c[1]}, allowInward) &&
         polytope.addFacet({c[0], c[1], c[3]}, allowInward) &&
         polytope.addFacet({c[0], c[3], c[2]}, allowInward) &&
         polytope.addFacet({c[1], c[2], c[3]}, allowInward);
}

/// Adds four points of M that are not coplanar; false if none were found.
template <class Real>
bool findTetrahedron(Polytope<Real>& polytope) {
  using Vec = Eigen::Matrix<Real, 3, 1>;
  const auto& p = polytope.points;
  const Vec oblique(1, 2, 3);  // not parallel to an edge or face that is frequent in models
  const std::uint16_t a = addSupport<Real>(oblique, polytope);
  const std::uint16_t b = addSupport<Real>(-oblique, polytope);
  const Vec axis = p[b] - p[a];
  if (!(axis.squaredNorm() > 0)) return false;
  const Vec side = axis.unitOrthogonal(), other = axis.cross(side);
  for (const Vec& direction : {side, Vec(-side), other, Vec(-other)}) {
    const std::uint16_t c = addSupport<Real>(direction, polytope);
    const Vec normal = axis.cross(p[c] - p[a]);
    if (!(normal.squaredNorm() > 0)) continue;
    for (const Vec& outward : {normal, Vec(-normal)}) {
      const std::uint16_t d = addSupport<Real>(outward, polytope);
      if (outward.dot(p[d] - p[a]) > 0) return addTetrahedron<Real>({a, b, c, d}, true, polytope);
    }
  }
  return false;
}

struct Edge {
  std::uint16_t from, to;
  bool operator==(const Edge&) const = default;
};

/// The horizon: the boundary of the removed facets, each edge directed as in its removed facet.
struct Horizon {
  std::array<Edge, 6 * kMaxCorners> edges;  // at most all edges of all facets
  std::size_t count = 0;

  void toggle(std::uint16_t from, std::uint16_t to) {
    const auto end = edges.begin() + count;
    const auto opposite = std::find(edges.begin(), end, Edge{to, from});
    if (opposite != end) {
      *opposite = edges[--count];
    } else {
      ENFILADE_ASSERT(count < edges.size());
      edges[count++] = {from, to};
    }
  }
};

}  // namespace

template <class Real>
bool encloseOrigin(std::span<const VertexPair> simplex, Polytope<Real>& polytope) {
  using Vec = Eigen::Matrix<Real, 3, 1>;
  for (const VertexPair& pair : simplex) polytope.addCorner(pair);
  const auto& p = polytope.points;
  if (simplex.size() == 4) return addTetrahedron<Real>({0, 1, 2, 3}, false, polytope);
  if (simplex.size() == 3) {
    const Vec normal = (p[1] - p[0]).cross(p[2] - p[0]);
    const std::array<std::uint16_t, 3> ring{0, 1, 2};
    const std::uint16_t upper = addSupport<Real>(normal, polytope);
    return addBipyramid<Real>(ring, upper, addSupport<Real>(-normal, polytope), polytope);
  }
  if (simplex.size() == 2) {
    const Vec axis = p[1] - p[0];
    const Vec side = axis.unitOrthogonal() * axis.norm();
    const Vec other = axis.cross(side) / axis.norm() * Real(0.8660254037844386);
    std::array<std::uint16_t, 3> ring{};
    ring[0] = addSupport<Real>(side, polytope);
    ring[1] = addSupport<Real>(other - side / 2, polytope);
    ring[2] = addSupport<Real>(-other - side / 2, polytope);
    return addBipyramid<Real>(ring, 1, 0, polytope);
  }
  return false;
}

template <class Real>
bool expandPolytope(VertexPair pair, Polytope<Real>& polytope) {
  if (polytope.corners == kMaxCorners) return false;
  const std::uint16_t added = polytope.addCorner(pair);
  Horizon horizon;
  std::size_t kept = 0;
  for (const Facet<Real>& facet : polytope.all()) {
    const auto& corner = polytope.points[facet.corners[0]];
    if (dot(facet.normal, subtractVectors(polytope.points[added], corner)) > 0) {
      for (int k = 0; k < 3; ++k) horizon.toggle(facet.corners[k], facet.corners[(k + 1) % 3]);
    } else if (Facet<Real>& to = polytope.facets[kept++]; &to != &facet) {
      to = facet;
    }
  }
  polytope.facetCount = kept;
  if (horizon.count == 0) return false;
  for (std::size_t k = 0; k < horizon.count; ++k)
    if (!polytope.addFacet({horizon.edges[k].from, horizon.edges[k].to, added}, true)) return false;
  return true;
}

template <class Real>
bool encloseOriginBySearch(Polytope<Real>& polytope) {
  if (!findTetrahedron(polytope)) return false;
  for (int step = 0; step < kMaxSearchSteps; ++step) {
    const auto computeSignedDistance = [](const Facet<Real>& facet) {
      return facet.offset < 0 ? -facet.squaredDistance : facet.squaredDistance;
    };
    const Facet<Real> worst = *std::min_element(
        polytope.all().begin(), polytope.all().end(), [&](const auto& a, const auto& b) {
          return computeSignedDistance(a) < computeSignedDistance(b);
        });
    if (polytope.facesAway(worst)) {
      return std::all_of(polytope.all().begin(), polytope.all().end(),
                         [&](const auto& facet) { return polytope.facesAway(facet); });
    }
    VertexPair hint = polytope.pairs[worst.corners[0]];
    const LongVec3 inward = -worst.normal.template cast<LongReal>();
    findCertifiedSupport(polytope.difference, inward, inward.norm(), hint);
    if (polytope.contains(hint) || !expandPolytope(hint, polytope)) return false;
  }
  return false;
}

template bool encloseOrigin(std::span<const VertexPair>, Polytope<double>&);
template bool encloseOrigin(std::span<const VertexPair>, Polytope<LongReal>&);
template bool encloseOriginBySearch(Polytope<double>&);
template bool encloseOriginBySearch(Polytope<LongReal>&);
template bool expandPolytope(VertexPair, Polytope<double>&);
template bool expandPolytope(VertexPair, Polytope<LongReal>&);

}  // namespace enfilade::collision
