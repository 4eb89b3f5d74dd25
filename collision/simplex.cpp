// The nearest point of a segment, a triangle and a tetrahedron by the signs of sub-areas and
// sub-volumes (Ericson, "Real-Time Collision Detection", 2005, sections 5.1.2, 5.1.5, 5.1.6).
// Departures: a triangle's nearest point is taken along its normal and a segment's is made
// perpendicular to the segment once more, so that its direction is good to a few units of rounding
// even where its length is tiny beside the coordinates.
#include "collision/simplex.hpp"

namespace enfilade::collision {
namespace {

/// A face of a simplex with the point of it nearest the origin.
struct Face {
  std::array<int, 4> corner{};
  std::array<Wide, 4> weight{};
  int size = 0;
  WideVec nearest = WideVec::Zero();
};

const Face& closer(const Face& first, const Face& second) {
  return second.nearest.squaredNorm() < first.nearest.squaredNorm() ? second : first;
}

Face corner(const Simplex& s, int i) {
  return {{i}, {1}, 1, s.corners[i].w};
}

Face segment(const Simplex& s, int i, int j) {
  const WideVec& from = s.corners[i].w;
  const WideVec edge = s.corners[j].w - from;
  const Wide squared = edge.squaredNorm();
  const Wide t = -from.dot(edge);
  if (!(t > 0)) return corner(s, i);
  if (t >= squared) return corner(s, j);
  const Wide w = t / squared;
  WideVec nearest = from + w * edge;
  nearest -= (nearest.dot(edge) / squared) * edge;
  return {{i, j}, {1 - w, w}, 2, nearest};
}

Face triangle(const Simplex& s, int i, int j, int k) {
  const WideVec &a = s.corners[i].w, &b = s.corners[j].w, &c = s.corners[k].w;
  const WideVec ab = b - a, ac = c - a;
  const WideVec normal = ab.cross(ac);
  const Wide squared = normal.squaredNorm();
  // Twice the signed areas that the origin's projection spans with each edge, times |normal|.
  const WideVec an = a.cross(normal);
  const Wide wk = -ab.dot(an);
  const Wide wj = ac.dot(an);
  const Wide wi = squared - wj - wk;
  if (squared > 0 && wi > 0 && wj > 0 && wk > 0)
    return {{i, j, k},
            {wi / squared, wj / squared, wk / squared},
            3,
            (a.dot(normal) / squared) * normal};
  return closer(closer(segment(s, i, j), segment(s, j, k)), segment(s, i, k));
}

/// The determinants are off by less than 256 eta reach^3: each of nine entries, off by at most
/// 8 eta reach, has a cofactor of at most 2 reach^2; the determinant's own five roundings of six
/// products of at most reach^3 add 30 eta reach^3.
Face tetrahedron(const Simplex& s, double reach, bool& inside) {
  const WideVec &a = s.corners[0].w, &b = s.corners[1].w, &c = s.corners[2].w, &d = s.corners[3].w;
  const WideVec ab = a.cross(b), cd = c.cross(d);
  const Wide d0 = b.dot(cd), d1 = -a.dot(cd), d2 = d.dot(ab), d3 = -c.dot(ab);
  const Wide sum = d0 + d1 + d2 + d3;
  const Wide sign = sum < 0 ? -1 : 1;
  const Wide bound = 256 * kWideUnit * reach * reach * reach;
  inside = std::min(std::min(sign * d0, sign * d1), std::min(sign * d2, sign * d3)) > bound;
  if (inside) return {{0, 1, 2, 3}, {d0 / sum, d1 / sum, d2 / sum, d3 / sum}, 4, WideVec::Zero()};
  return closer(closer(triangle(s, 0, 1, 2), triangle(s, 0, 1, 3)),
                closer(triangle(s, 0, 2, 3), triangle(s, 1, 2, 3)));
}

}  // namespace

bool Simplex::holds(VertexPair pair) const {
  for (int i = 0; i < size; ++i)
    if (corners[i].pair == pair) return true;
  return false;
}

void Simplex::add(const MinkowskiDifference& difference, VertexPair pair) {
  Corner& added = corners[size++];
  added.pair = pair;
  added.onA = difference.pointA(pair.a);
  added.onB = difference.pointB(pair.b);
  added.w = added.onB - added.onA;
}

void Simplex::reduce(const MinkowskiDifference& difference) {
  Face face;
  holdsOrigin = false;
  switch (size) {
    case 1:
      face = corner(*this, 0);
      break;
    case 2:
      face = segment(*this, 0, 1);
      break;
    case 3:
      face = triangle(*this, 0, 1, 2);
      break;
    default:
      face = tetrahedron(*this, difference.reach, holdsOrigin);
  }
  for (int i = 0; i < face.size; ++i) {
    if (face.corner[i] != i) corners[i] = corners[face.corner[i]];
    corners[i].weight = face.weight[i];
  }
  size = face.size;
  nearest = face.nearest;
}

WideVec Simplex::pointOnA() const {
  WideVec sum = WideVec::Zero();
  for (int i = 0; i < size; ++i) sum += corners[i].weight * corners[i].onA;
  return sum;
}

WideVec Simplex::pointOnB() const {
  WideVec sum = WideVec::Zero();
  for (int i = 0; i < size; ++i) sum += corners[i].weight * corners[i].onB;
  return sum;
}

}  // namespace enfilade::collision
