// Steps
//  1. GJK (Gilbert, Johnson, Keerthi 1988) on M = B - A in rationals. It terminates because the
//     nearest point gets strictly nearer with every support and there are finitely many simplices.
//     The nearest point is found by trying every face of the simplex: at most 15.
//  2. If the nearest point is not the origin, the bodies are separated.
//  3. Otherwise the simplex gives an exact common point p of A and B. The origin is inside M if and
//     only if the cone of the directions {b - p} and {p - a} is all of space. If it is not, and the
//     directions span space, a plane through two of them supports the cone: every pair is tried.
#include "tests/collision/rational_verdict.hpp"

#include <gmpxx.h>

#include <array>
#include <vector>

namespace enfilade::collision::testing {
namespace {

using Rational = mpq_class;

struct Point {
  Rational x, y, z;
};

Point operator-(const Point& a, const Point& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Point operator+(const Point& a, const Point& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
Point operator*(const Rational& s, const Point& a) {
  return {s * a.x, s * a.y, s * a.z};
}
Rational computeDotProduct(const Point& a, const Point& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
Point computeCrossProduct(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
bool isZero(const Point& a) {
  return sgn(a.x) == 0 && sgn(a.y) == 0 && sgn(a.z) == 0;
}

std::vector<Point> computeWorldPoints(const PlacedConvex& body) {
  const Point translation{body.translation.x(), body.translation.y(), body.translation.z()};
  std::vector<Point> points;
  points.reserve(body.vertices.size());
  for (const Vec3& v : body.vertices) points.push_back(Point{v.x(), v.y(), v.z()} + translation);
  return points;
}

/// A point of M with its point of A.
struct Support {
  Point difference;
  Point onA;
};

/// Finds the point of M = B - A with the smallest projection on `direction`.
Support findSupport(const Point& direction, const std::vector<Point>& a,
                    const std::vector<Point>& b) {
  const Point* bestA = &a.front();
  Rational maxA = computeDotProduct(direction, *bestA);
  for (const Point& p : a)
    if (Rational d = computeDotProduct(direction, p); d > maxA) maxA = d, bestA = &p;
  const Point* bestB = &b.front();
  Rational minB = computeDotProduct(direction, *bestB);
  for (const Point& p : b)
    if (Rational d = computeDotProduct(direction, p); d < minB) minB = d, bestB = &p;
  return {*bestB - *bestA, *bestA};
}

/// Solves the symmetric system `m` x = `r` of size n <= 3; false when it is singular.
bool solve(std::array<std::array<Rational, 3>, 3> m, std::array<Rational, 3> r, int n,
           std::array<Rational, 3>& x) {
  for (int column = 0; column < n; ++column) {
    int pivot = column;
    while (pivot < n && sgn(m[pivot][column]) == 0) ++pivot;
    if (pivot == n) return false;
    std::swap(m[pivot], m[column]);
    std::swap(r[pivot], r[column]);
    for (int row = 0; row < n; ++row) {
      if (row == column) continue;
      const Rational factor = m[row][column] / m[column][column];
      for (int k = column; k < n; ++k) m[row][k] -= factor * m[column][k];
      r[row] -= factor * r[column];
    }
  }
  for (int k = 0; k < n; ++k) x[k] = r[k] / m[k][k];
  return true;
}

struct NearestPoint {
  std::vector<Support> simplex;  ///< the smallest face that contains the nearest point
  Point point;                   ///< of the face, nearest the origin
  Point onA;
};

/// Finds the point of the face's affine hull nearest the origin; false if not strictly inside the
/// face.
bool findNearestInside(const std::vector<Support>& face, NearestPoint& nearest) {
  const int n = static_cast<int>(face.size()) - 1;
  std::array<std::array<Rational, 3>, 3> gram;
  std::array<Rational, 3> right, weight;
  const Point& base = face[0].difference;
  for (int i = 0; i < n; ++i) {
    const Point edge = face[i + 1].difference - base;
    right[i] = -computeDotProduct(edge, base);
    for (int j = 0; j < n; ++j) gram[i][j] = computeDotProduct(edge, face[j + 1].difference - base);
  }
  if (n > 0 && !solve(gram, right, n, weight)) return false;
  Rational first = 1;
  for (int i = 0; i < n; ++i) {
    if (sgn(weight[i]) <= 0) return false;
    first -= weight[i];
  }
  if (sgn(first) <= 0) return false;
  nearest.simplex = face;
  nearest.point = first * base;
  nearest.onA = first * face[0].onA;
  for (int i = 0; i < n; ++i) {
    nearest.point = nearest.point + weight[i] * face[i + 1].difference;
    nearest.onA = nearest.onA + weight[i] * face[i + 1].onA;
  }
  return true;
}

NearestPoint findNearest(const std::vector<Support>& simplex) {
  NearestPoint best;
  Rational bestSquared = -1;
  for (unsigned mask = 1; mask < 1u << simplex.size(); ++mask) {
    std::vector<Support> face;
    for (std::size_t i = 0; i < simplex.size(); ++i)
      if (mask >> i & 1u) face.push_back(simplex[i]);
    NearestPoint candidate;
    if (!findNearestInside(face, candidate)) continue;
    const Rational squared = computeDotProduct(candidate.point, candidate.point);
    if (sgn(bestSquared) < 0 || squared < bestSquared) {
      bestSquared = squared;
      best = std::move(candidate);
    }
  }
  return best;
}

bool areAllOnOneSide(const Point& normal, const std::vector<Point>& directions) {
  int side = 0;
  for (const Point& d : directions) {
    const int s = sgn(computeDotProduct(normal, d));
    if (s == 0) continue;
    if (side != 0 && s != side) return false;
    side = s;
  }
  return true;
}

/// Whether non-negative combinations of `directions` reach every point of space.
bool spanAllOfSpace(const std::vector<Point>& directions) {
  bool spansSpace = false;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    for (std::size_t j = i + 1; j < directions.size(); ++j) {
      const Point normal = computeCrossProduct(directions[i], directions[j]);
      if (isZero(normal)) continue;
      if (areAllOnOneSide(normal, directions)) return false;
      spansSpace = true;  // directions lie on both sides of this plane
    }
  }
  return spansSpace;
}

}  // namespace

Verdict computeRationalVerdict(const PlacedConvex& bodyA, const PlacedConvex& bodyB) {
  const std::vector<Point> a = computeWorldPoints(bodyA);
  const std::vector<Point> b = computeWorldPoints(bodyB);
  NearestPoint nearest = findNearest({Support{b.front() - a.front(), a.front()}});
  while (!isZero(nearest.point)) {
    Support next = findSupport(nearest.point, a, b);
    if (computeDotProduct(nearest.point, next.difference) >=
        computeDotProduct(nearest.point, nearest.point))
      return Verdict::separated;
    std::vector<Support> simplex = std::move(nearest.simplex);
    simplex.push_back(std::move(next));
    nearest = findNearest(simplex);
  }
  if (nearest.simplex.size() == 4) return Verdict::penetrating;
  std::vector<Point> directions;
  for (const Point& p : b)
    if (Point d = p - nearest.onA; !isZero(d)) directions.push_back(std::move(d));
  for (const Point& p : a)
    if (Point d = nearest.onA - p; !isZero(d)) directions.push_back(std::move(d));
  return spanAllOfSpace(directions) ? Verdict::penetrating : Verdict::touching;
}

}  // namespace enfilade::collision::testing
