// The nearest point of a segment, a triangle and a tetrahedron by the signs of sub-areas and
// sub-volumes (Ericson, "Real-Time Collision Detection", 2005, sections 5.1.2, 5.1.5, 5.1.6).
// Only faces and edges that the origin is beyond are looked at: the nearest point of a convex set
// lies on one of those.
// Departures: a triangle's nearest point is taken along its normal and a segment's is made
// perpendicular to the segment once more, so that its direction is good to a few units of rounding
// even where its length is tiny beside the coordinates.
#include "collision/minkowski/simplex.hpp"

namespace enfilade::collision {
namespace {

/// A face of a simplex with the point of it nearest the origin.
template <class Real>
struct Face {
  std::array<int, 4> corner;
  std::array<Real, 4> weight;
  int size;
  Eigen::Matrix<Real, 3, 1> nearest;
};

template <class Real>
const Face<Real>& closer(const Face<Real>& first, const Face<Real>& second) {
  return dot(second.nearest, second.nearest) < dot(first.nearest, first.nearest) ? second : first;
}

template <class Real>
void keepCloser(const Face<Real>& face, Face<Real>& best) {
  if (best.size == 0 || dot(face.nearest, face.nearest) < dot(best.nearest, best.nearest))
    best = face;
}

template <class Real>
Face<Real> corner(const Simplex<Real>& s, int i) {
  return {{i}, {1}, 1, s.points[i]};
}

template <class Real>
Face<Real> segment(const Simplex<Real>& s, int i, int j) {
  using Vec = typename Simplex<Real>::Vec;
  const Vec& from = s.points[i];
  const Vec edge = minus(s.points[j], from);
  const Real squared = dot(edge, edge);
  const Real t = -dot(from, edge);
  if (!(t > 0)) return corner(s, i);
  if (t >= squared) return corner(s, j);
  if (!(squared > std::numeric_limits<Real>::min()))  // 1 / squared might be infinite
    return closer(corner(s, i), corner(s, j));
  const Real inverse = 1 / squared;
  const Real w = t * inverse;
  const Vec near = plus(from, times(edge, w));
  return {{i, j}, {1 - w, w}, 2, minus(near, times(edge, dot(near, edge) * inverse))};
}

template <class Real>
Face<Real> triangle(const Simplex<Real>& s, int i, int j, int k) {
  using Vec = typename Simplex<Real>::Vec;
  const Vec& a = s.points[i];
  const Vec ab = minus(s.points[j], a), ac = minus(s.points[k], a);
  const Vec normal = ab.cross(ac);
  const Real squared = dot(normal, normal);
  // Twice the signed areas that the origin's projection spans with each edge, times |normal|.
  const Vec an = a.cross(normal);
  const Real wk = -dot(ab, an);
  const Real wj = dot(ac, an);
  const Real wi = squared - wj - wk;
  const bool flat = !(squared > std::numeric_limits<Real>::min());  // or 1 / squared is infinite
  const bool beyondIJ = flat || !(wk > 0), beyondIK = flat || !(wj > 0),
             beyondJK = flat || !(wi > 0);
  if (!beyondIJ && !beyondIK && !beyondJK) {
    const Real inverse = 1 / squared;
    return {{i, j, k},
            {wi * inverse, wj * inverse, wk * inverse},
            3,
            times(normal, dot(a, normal) * inverse)};
  }
  Face<Real> best;
  best.size = 0;
  if (beyondIJ) keepCloser(segment(s, i, j), best);
  if (beyondIK) keepCloser(segment(s, i, k), best);
  if (beyondJK) keepCloser(segment(s, j, k), best);
  return best;
}

/// With u the unit of rounding of Real, the determinants are off by less than 256 u reach^3: each
/// of nine entries, off by at most 8 u reach, has a cofactor of at most 2 reach^2; the
/// determinant's own five roundings of six products of at most reach^3 add 30 u reach^3.
template <class Real>
Face<Real> tetrahedron(const Simplex<Real>& s, double reach, bool& inside) {
  using Vec = typename Simplex<Real>::Vec;
  const Vec &a = s.points[0], &b = s.points[1], &c = s.points[2], &d = s.points[3];
  const Vec ab = a.cross(b), cd = c.cross(d);
  const Real d0 = dot(b, cd), d1 = -dot(a, cd), d2 = dot(d, ab), d3 = -dot(c, ab);
  const Real sum = d0 + d1 + d2 + d3;
  const Real sign = sum < 0 ? -1 : 1;
  const Real size = reach;
  const Real bound = 256 * unitOf<Real>() * size * size * size + std::numeric_limits<Real>::min();
  const bool flat = !(sign * sum > bound);
  const bool sees0 = flat || !(sign * d0 > bound), sees1 = flat || !(sign * d1 > bound);
  const bool sees2 = flat || !(sign * d2 > bound), sees3 = flat || !(sign * d3 > bound);
  inside = !sees0 && !sees1 && !sees2 && !sees3;
  if (inside) return {{0, 1, 2, 3}, {d0 / sum, d1 / sum, d2 / sum, d3 / sum}, 4, Vec::Zero()};
  Face<Real> best;
  best.size = 0;
  if (sees3) keepCloser(triangle(s, 0, 1, 2), best);
  if (sees2) keepCloser(triangle(s, 0, 1, 3), best);
  if (sees1) keepCloser(triangle(s, 0, 2, 3), best);
  if (sees0) keepCloser(triangle(s, 1, 2, 3), best);
  return best;
}

}  // namespace

template <class Real>
void Simplex<Real>::keepNearestFace(double reach) {
  holdsOrigin = false;
  const Face<Real> face = size == 2   ? segment(*this, 0, 1)
                          : size == 3 ? triangle(*this, 0, 1, 2)
                                      : tetrahedron(*this, reach, holdsOrigin);
  for (int i = 0; i < face.size; ++i) {  // corners ascend, so none is overwritten before it is read
    pairs[i] = pairs[face.corner[i]];
    points[i] = points[face.corner[i]];
    weight[i] = face.weight[i];
  }
  size = face.size;
  nearest = face.nearest;
}

template <class Real>
PointOn combinedPointOn(const Simplex<Real>& simplex, const PlacedBody& placed,
                        std::uint32_t VertexPair::*vertex) {
  int greatest = 0;
  for (int i = 1; i < simplex.size; ++i)
    if (simplex.weight[i] > simplex.weight[greatest]) greatest = i;
  const auto& vertices = placed.body->vertices;
  const Vec3& p = vertices[simplex.pairs[greatest].*vertex];
  Wide x = p.x(), y = p.y(), z = p.z();
  for (int i = 0; i < simplex.size; ++i) {
    if (i == greatest) continue;
    const Vec3& q = vertices[simplex.pairs[i].*vertex];
    const Wide weight = simplex.weight[i];
    x += weight * (Wide{q.x()} - p.x());
    y += weight * (Wide{q.y()} - p.y());
    z += weight * (Wide{q.z()} - p.z());
  }
  return {PointOn::kNone, {x, y, z}};
}

template struct Simplex<double>;
template struct Simplex<Wide>;
template PointOn combinedPointOn(const Simplex<double>&, const PlacedBody&,
                                 std::uint32_t VertexPair::*);
template PointOn combinedPointOn(const Simplex<Wide>&, const PlacedBody&,
                                 std::uint32_t VertexPair::*);

}  // namespace enfilade::collision
