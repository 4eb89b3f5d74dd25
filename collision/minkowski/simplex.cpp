// The nearest point of a segment, a triangle and a tetrahedron by the signs of sub-areas and
// sub-volumes. The tests are those of Ericson 2005 ("Real-Time Collision Detection", sections
// 5.1.2, 5.1.5, 5.1.6). Only faces and edges with the origin on their outer side are tested,
// because one of them contains the nearest point.
// Departures: a triangle's nearest point is computed along its normal, and a segment's is
// orthogonalised a second time. The direction is then accurate to a few roundoffs even if its
// length is tiny relative to the coordinates.
#include "collision/minkowski/simplex.hpp"

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

/// A face of a simplex with its point nearest the origin.
template <class Real>
struct Face {
  std::array<int, 4> corner;
  std::array<Real, 4> weight;
  int size;
  Eigen::Matrix<Real, 3, 1> nearest;
};

/// Whether a face with this nearest point replaces the closest one so far.
template <class Real>
bool isCloser(const Eigen::Matrix<Real, 3, 1>& nearest, const Face<Real>& best) {
  return best.size == 0 || dot(nearest, nearest) < dot(best.nearest, best.nearest);
}

template <class Real>
void keepCorner(const Simplex<Real>& s, int i, Face<Real>& best) {
  if (!isCloser(s.points[i], best)) return;
  best.corner[0] = i;
  best.weight[0] = 1;
  best.size = 1;
  best.nearest = s.points[i];
}

template <class Real>
void keepSegment(const Simplex<Real>& s, int i, int j, Face<Real>& best) {
  using Vec = typename Simplex<Real>::Vec;
  const Vec& from = s.points[i];
  const Vec edge = subtractVectors(s.points[j], from);
  const Real squared = dot(edge, edge);
  const Real t = -dot(from, edge);
  if (!(t > 0)) return keepCorner(s, i, best);
  if (t >= squared) return keepCorner(s, j, best);
  if (!(squared > std::numeric_limits<Real>::min())) {  // 1 / squared might be infinite
    keepCorner(s, i, best);
    return keepCorner(s, j, best);
  }
  const Real inverse = 1 / squared;
  const Real w = t * inverse;
  const Vec approximate = addVectors(from, scaleVector(edge, w));
  const Vec nearest =
      subtractVectors(approximate, scaleVector(edge, dot(approximate, edge) * inverse));
  if (!isCloser(nearest, best)) return;
  best.corner[0] = i, best.corner[1] = j;
  best.weight[0] = 1 - w, best.weight[1] = w;
  best.size = 2;
  best.nearest = nearest;
}

template <class Real>
void keepTriangle(const Simplex<Real>& s, int i, int j, int k, Face<Real>& best) {
  using Vec = typename Simplex<Real>::Vec;
  const Vec& a = s.points[i];
  const Vec ab = subtractVectors(s.points[j], a), ac = subtractVectors(s.points[k], a);
  const Vec normal = ab.cross(ac);
  const Real squared = dot(normal, normal);
  // Twice the signed sub-areas between the origin's projection and each edge, times |normal|.
  const Vec an = a.cross(normal);
  const Real wk = -dot(ab, an);
  const Real wj = dot(ac, an);
  const Real wi = squared - wj - wk;
  const bool flat = !(squared > std::numeric_limits<Real>::min());  // or 1 / squared is infinite
  const bool beyondIJ = flat || !(wk > 0), beyondIK = flat || !(wj > 0),
             beyondJK = flat || !(wi > 0);
  if (!beyondIJ && !beyondIK && !beyondJK) {
    const Real inverse = 1 / squared;
    const Vec nearest = scaleVector(normal, dot(a, normal) * inverse);
    if (!isCloser(nearest, best)) return;
    best.corner[0] = i, best.corner[1] = j, best.corner[2] = k;
    best.weight[0] = wi * inverse, best.weight[1] = wj * inverse, best.weight[2] = wk * inverse;
    best.size = 3;
    best.nearest = nearest;
    return;
  }
  if (beyondIJ) keepSegment(s, i, j, best);
  if (beyondIK) keepSegment(s, i, k, best);
  if (beyondJK) keepSegment(s, j, k, best);
}

/// With u the unit roundoff of Real, the determinants are off by less than 256 u reach^3. Each of
/// nine entries, off by at most 8 u reach, has a cofactor of at most 2 reach^2. The determinant's
/// own five roundings of six products of at most reach^3 add 30 u reach^3.
/// If the origin is inside, returns true and sets the weights of the corners. They are written in
/// place: a copy through a face costs as much as the test.
template <class Real>
bool keepTetrahedron(Simplex<Real>& s, double reach, Face<Real>& best) {
  using Vec = typename Simplex<Real>::Vec;
  const Vec &a = s.points[0], &b = s.points[1], &c = s.points[2], &d = s.points[3];
  const Vec ab = a.cross(b), cd = c.cross(d);
  const Real d0 = dot(b, cd), d1 = -dot(a, cd), d2 = dot(d, ab), d3 = -dot(c, ab);
  const Real sum = d0 + d1 + d2 + d3;
  const Real sign = sum < 0 ? -1 : 1;
  const Real size = reach;
  const Real bound =
      256 * getUnitRoundoff<Real>() * size * size * size + std::numeric_limits<Real>::min();
  const bool flat = !(sign * sum > bound);
  const bool sees0 = flat || !(sign * d0 > bound), sees1 = flat || !(sign * d1 > bound);
  const bool sees2 = flat || !(sign * d2 > bound), sees3 = flat || !(sign * d3 > bound);
  if (!sees0 && !sees1 && !sees2 && !sees3) {
    s.weight[0] = d0 / sum, s.weight[1] = d1 / sum, s.weight[2] = d2 / sum, s.weight[3] = d3 / sum;
    return true;
  }
  if (sees3) keepTriangle(s, 0, 1, 2, best);
  if (sees2) keepTriangle(s, 0, 1, 3, best);
  if (sees1) keepTriangle(s, 0, 2, 3, best);
  if (sees0) keepTriangle(s, 1, 2, 3, best);
  return false;
}

}  // namespace

template <class Real>
void Simplex<Real>::keepNearestFace(double reach) {
  containsOrigin = false;
  Face<Real> face{};
  if (size == 2) {
    keepSegment(*this, 0, 1, face);
  } else if (size == 3) {
    keepTriangle(*this, 0, 1, 2, face);
  } else if (keepTetrahedron(*this, reach, face)) {
    containsOrigin = true;
    nearest.setZero();
    return;
  }
  ENFILADE_ASSERT(face.size > 0 && face.size <= size);
  for (int i = 0; i < face.size; ++i) {  // corners ascend: reads precede overwrites
    ENFILADE_ASSERT(face.corner[i] >= i);
    pairs[i] = pairs[face.corner[i]];
    points[i] = points[face.corner[i]];
    weight[i] = face.weight[i];
  }
  size = face.size;
  nearest = face.nearest;
}

template <class Real>
BodyPoint combineVertices(const Simplex<Real>& simplex, const BoundedConvex& convex,
                          std::uint32_t VertexPair::*vertex) {
  int maxIndex = 0;
  for (int i = 1; i < simplex.size; ++i)
    if (simplex.weight[i] > simplex.weight[maxIndex]) maxIndex = i;
  const auto& vertices = convex.shape->vertices;
  const Vec3& p = vertices[simplex.pairs[maxIndex].*vertex];
  LongReal x = p.x(), y = p.y(), z = p.z();
  for (int i = 0; i < simplex.size; ++i) {
    if (i == maxIndex) continue;
    const Vec3& q = vertices[simplex.pairs[i].*vertex];
    const LongReal weight = simplex.weight[i];
    x += weight * (LongReal{q.x()} - p.x());
    y += weight * (LongReal{q.y()} - p.y());
    z += weight * (LongReal{q.z()} - p.z());
  }
  return {BodyPoint::kNone, {x, y, z}};
}

template struct Simplex<double>;
template struct Simplex<LongReal>;
template BodyPoint combineVertices(const Simplex<double>&, const BoundedConvex&,
                                   std::uint32_t VertexPair::*);
template BodyPoint combineVertices(const Simplex<LongReal>&, const BoundedConvex&,
                                   std::uint32_t VertexPair::*);

}  // namespace enfilade::collision
