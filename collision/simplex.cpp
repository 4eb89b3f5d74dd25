// The nearest point of a segment, a triangle and a tetrahedron by the signs of sub-areas and
// sub-volumes (Ericson, "Real-Time Collision Detection", 2005, sections 5.1.2, 5.1.5, 5.1.6).
// Departures: a triangle's nearest point is taken along its normal and a segment's is made
// perpendicular to the segment once more, so that its direction is good to a few units of rounding
// even where its length is tiny beside the coordinates.
#include "collision/simplex.hpp"

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
  return second.nearest.squaredNorm() < first.nearest.squaredNorm() ? second : first;
}

template <class Real>
Face<Real> corner(const Simplex<Real>& s, int i) {
  return {{i}, {1}, 1, s.points[i]};
}

template <class Real>
Face<Real> segment(const Simplex<Real>& s, int i, int j) {
  using Vec = typename Simplex<Real>::Vec;
  const Vec& from = s.points[i];
  const Vec edge = s.points[j] - from;
  const Real squared = edge.squaredNorm();
  const Real t = -from.dot(edge);
  if (!(t > 0)) return corner(s, i);
  if (t >= squared) return corner(s, j);
  const Real inverse = 1 / squared;
  const Real w = t * inverse;
  const Vec near = from + w * edge;
  return {{i, j}, {1 - w, w}, 2, near - (near.dot(edge) * inverse) * edge};
}

template <class Real>
Face<Real> triangle(const Simplex<Real>& s, int i, int j, int k) {
  using Vec = typename Simplex<Real>::Vec;
  const Vec& a = s.points[i];
  const Vec ab = s.points[j] - a, ac = s.points[k] - a;
  const Vec normal = ab.cross(ac);
  const Real squared = normal.squaredNorm();
  // Twice the signed areas that the origin's projection spans with each edge, times |normal|.
  const Vec an = a.cross(normal);
  const Real wk = -ab.dot(an);
  const Real wj = ac.dot(an);
  const Real wi = squared - wj - wk;
  if (squared > 0 && wi > 0 && wj > 0 && wk > 0) {
    const Real inverse = 1 / squared;
    return {{i, j, k},
            {wi * inverse, wj * inverse, wk * inverse},
            3,
            (a.dot(normal) * inverse) * normal};
  }
  return closer(closer(segment(s, i, j), segment(s, j, k)), segment(s, i, k));
}

/// With u the unit of rounding of Real, the determinants are off by less than 256 u reach^3: each
/// of nine entries, off by at most 8 u reach, has a cofactor of at most 2 reach^2; the
/// determinant's own five roundings of six products of at most reach^3 add 30 u reach^3.
template <class Real>
Face<Real> tetrahedron(const Simplex<Real>& s, double reach, bool& inside) {
  using Vec = typename Simplex<Real>::Vec;
  const Vec &a = s.points[0], &b = s.points[1], &c = s.points[2], &d = s.points[3];
  const Vec ab = a.cross(b), cd = c.cross(d);
  const Real d0 = b.dot(cd), d1 = -a.dot(cd), d2 = d.dot(ab), d3 = -c.dot(ab);
  const Real sum = d0 + d1 + d2 + d3;
  const Real sign = sum < 0 ? -1 : 1;
  const Real size = reach;
  const Real bound = 256 * unitOf<Real>() * size * size * size + std::numeric_limits<Real>::min();
  inside = std::min(std::min(sign * d0, sign * d1), std::min(sign * d2, sign * d3)) > bound;
  if (inside) return {{0, 1, 2, 3}, {d0 / sum, d1 / sum, d2 / sum, d3 / sum}, 4, Vec::Zero()};
  return closer(closer(triangle(s, 0, 1, 2), triangle(s, 0, 1, 3)),
                closer(triangle(s, 0, 2, 3), triangle(s, 1, 2, 3)));
}

}  // namespace

template <class Real>
bool Simplex<Real>::holds(VertexPair pair) const {
  for (int i = 0; i < size; ++i)
    if (pairs[i] == pair) return true;
  return false;
}

template <class Real>
void Simplex<Real>::add(const MinkowskiDifference& difference, VertexPair pair) {
  pairs[size] = pair;
  points[size++] = difference.point<Real>(pair);
}

template <class Real>
void Simplex<Real>::reduce(const MinkowskiDifference& difference) {
  holdsOrigin = false;
  const Face<Real> face = size == 1   ? corner(*this, 0)
                          : size == 2 ? segment(*this, 0, 1)
                          : size == 3 ? triangle(*this, 0, 1, 2)
                                      : tetrahedron(*this, difference.reach, holdsOrigin);
  for (int i = 0; i < face.size; ++i) {  // corners ascend, so none is overwritten before it is read
    pairs[i] = pairs[face.corner[i]];
    points[i] = points[face.corner[i]];
    weight[i] = face.weight[i];
  }
  size = face.size;
  nearest = face.nearest;
}

template struct Simplex<double>;
template struct Simplex<Wide>;

}  // namespace enfilade::collision
