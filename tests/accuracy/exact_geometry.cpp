// Nearest point of a hull: GJK (Gilbert, Johnson, Keerthi 1988) in integers. The nearest point of
// at most four points is found by trying every subset (Cramer's rule on the Gram matrix of its
// edges). Each step gets strictly nearer and there are finitely many subsets, so it terminates. The
// final support checks the result.
//
// Depth: the overlap of the two bodies' slabs along any direction is an upper bound of the depth.
// The depth is the overlap along the normal of some face of the Minkowski difference. Such a normal
// comes from three vertices of one body or two vertices of each. The depth is therefore the minimum
// overlap over all these normals; it does not matter which of them are faces.
#include "tests/accuracy/exact_geometry.hpp"

#include <array>
#include <stdexcept>

namespace enfilade::accuracy {
namespace {

constexpr unsigned kPrecision = 512;  // bits; the truth in the files has 60 digits, 200 bits
constexpr int kDescentBound = 100000;

IntegerPoint operator-(const IntegerPoint& p, const IntegerPoint& q) {
  return {p.x - q.x, p.y - q.y, p.z - q.z};
}
mpz_class computeDot(const IntegerPoint& p, const IntegerPoint& q) {
  return p.x * q.x + p.y * q.y + p.z * q.z;
}
IntegerPoint computeCross(const IntegerPoint& p, const IntegerPoint& q) {
  return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
}
bool isZero(const IntegerPoint& p) {
  return sgn(p.x) == 0 && sgn(p.y) == 0 && sgn(p.z) == 0;
}

using RationalPoint = std::array<mpq_class, 3>;

RationalPoint toExactPoint(const Vec3& p) {
  return {mpq_class(p.x()), mpq_class(p.y()), mpq_class(p.z())};
}

RationalPoint computeWorldPoint(const Placed& body, const Vec3& vertex) {
  RationalPoint world = toExactPoint(body.translation);
  for (int row = 0; row < 3; ++row)
    for (int k = 0; k < 3; ++k)
      world[row] += mpq_class(body.rotation(row, k)) * mpq_class(vertex[k]);
  return world;
}

/// The exponent of a denominator, which is a power of two.
long computeDenominatorBits(const mpq_class& q) {
  return static_cast<long>(mpz_sizeinbase(q.get_den_mpz_t(), 2)) - 1;
}

mpz_class scaleToInteger(const mpq_class& q, long bits) {
  return q.get_num() << (bits - computeDenominatorBits(q));
}

IntegerPoint scaleToInteger(const RationalPoint& p, long bits) {
  return {scaleToInteger(p[0], bits), scaleToInteger(p[1], bits), scaleToInteger(p[2], bits)};
}

struct Descent {
  std::vector<IntegerPoint> simplex;
  NearestPoint nearest;
};

/// Solves a symmetric system of size n <= 3 by Cramer's rule: x[i] / determinant.
mpz_class computeDeterminant(const std::array<std::array<mpz_class, 3>, 3>& m, std::size_t n) {
  if (n == 0) return 1;
  if (n == 1) return m[0][0];
  if (n == 2) return m[0][0] * m[1][1] - m[0][1] * m[1][0];
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/// Finds the nearest point of the affine hull of `points`, if it lies strictly inside their hull.
std::optional<NearestPoint> findNearestInside(const std::vector<IntegerPoint>& points) {
  const std::size_t n = points.size() - 1;
  std::array<IntegerPoint, 3> edges;
  std::array<std::array<mpz_class, 3>, 3> gram;
  for (std::size_t i = 0; i < n; ++i) edges[i] = points[i + 1] - points[0];
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) gram[i][j] = computeDot(edges[i], edges[j]);
  NearestPoint result;
  result.denominator = computeDeterminant(gram, n);
  if (sgn(result.denominator) <= 0) return std::nullopt;
  std::array<mpz_class, 4> weight;
  weight[0] = result.denominator;
  for (std::size_t column = 0; column < n; ++column) {
    auto replaced = gram;
    for (std::size_t row = 0; row < n; ++row)
      replaced[row][column] = -computeDot(edges[row], points[0]);
    weight[column + 1] = computeDeterminant(replaced, n);
    if (sgn(weight[column + 1]) <= 0) return std::nullopt;
    weight[0] -= weight[column + 1];
  }
  if (sgn(weight[0]) <= 0) return std::nullopt;
  for (std::size_t i = 0; i <= n; ++i) {
    result.numerator.x += weight[i] * points[i].x;
    result.numerator.y += weight[i] * points[i].y;
    result.numerator.z += weight[i] * points[i].z;
  }
  return result;
}

bool isNearer(const NearestPoint& p, const NearestPoint& q) {
  return computeDot(p.numerator, p.numerator) * q.denominator * q.denominator <
         computeDot(q.numerator, q.numerator) * p.denominator * p.denominator;
}

/// Searches the subsets of `points` with the last point; the others were tried before.
Descent findNearestOfSimplex(const std::vector<IntegerPoint>& points) {
  Descent best;
  const unsigned last = 1U << (points.size() - 1);
  for (unsigned mask = last; mask < 2 * last; ++mask) {
    std::vector<IntegerPoint> subset;
    for (std::size_t i = 0; i < points.size(); ++i)
      if ((mask >> i & 1U) != 0) subset.push_back(points[i]);
    auto nearest = findNearestInside(subset);
    if (nearest && (best.simplex.empty() || isNearer(*nearest, best.nearest)))
      best = {std::move(subset), std::move(*nearest)};
  }
  if (best.simplex.empty())
    throw std::logic_error("no subset of a simplex contains its nearest point");
  return best;
}

const IntegerPoint& findExtreme(const std::vector<IntegerPoint>& points, const IntegerPoint& along,
                                bool maximize) {
  const IntegerPoint* best = &points.front();
  mpz_class value = computeDot(along, *best);
  for (const IntegerPoint& p : points) {
    mpz_class candidate = computeDot(along, p);
    if (maximize ? candidate > value : candidate < value) value = std::move(candidate), best = &p;
  }
  return *best;
}

struct Slab {
  mpz_class min, max;
};

Slab computeSlab(const std::vector<IntegerPoint>& points, const IntegerPoint& along) {
  Slab slab{computeDot(along, points.front()), computeDot(along, points.front())};
  for (const IntegerPoint& p : points) {
    mpz_class value = computeDot(along, p);
    if (value < slab.min)
      slab.min = std::move(value);
    else if (value > slab.max)
      slab.max = std::move(value);
  }
  return slab;
}

/// The minimum overlap so far: overlap / |normal|.
struct MinOverlap {
  bool any = false;
  mpz_class overlap, squaredNormal;

  void include(const mpz_class& candidate, const mpz_class& squared) {
    if (any && sgn(candidate) >= 0 && sgn(overlap) >= 0 &&
        candidate * candidate * squaredNormal >= overlap * overlap * squared)
      return;
    if (any && sgn(overlap) < 0) return;  // separated: the amount does not matter
    any = true, overlap = candidate, squaredNormal = squared;
  }
};

void tryNormal(const ExactPair& pair, const IntegerPoint& normal, MinOverlap& minimum) {
  if (isZero(normal)) return;
  const mpz_class squared = computeDot(normal, normal);
  const Slab a = computeSlab(pair.a, normal);
  const Slab b = computeSlab(pair.b, normal);
  minimum.include(a.max - b.min, squared);
  minimum.include(b.max - a.min, squared);
}

std::vector<IntegerPoint> computeEdges(const std::vector<IntegerPoint>& points) {
  std::vector<IntegerPoint> edges;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j) edges.push_back(points[j] - points[i]);
  return edges;
}

void tryFaces(const ExactPair& pair, const std::vector<IntegerPoint>& body, MinOverlap& minimum) {
  for (std::size_t i = 0; i < body.size(); ++i)
    for (std::size_t j = i + 1; j < body.size(); ++j)
      for (std::size_t k = j + 1; k < body.size(); ++k)
        tryNormal(pair, computeCross(body[j] - body[i], body[k] - body[i]), minimum);
}

/// Whether the Minkowski difference has an interior: its edges span space.
bool spansSpace(const ExactPair& pair) {
  std::vector<IntegerPoint> edges;
  for (const auto& p : pair.a) edges.push_back(p - pair.a.front());
  for (const auto& p : pair.b) edges.push_back(p - pair.b.front());
  const IntegerPoint* first = nullptr;
  std::optional<IntegerPoint> normal;
  for (const IntegerPoint& e : edges) {
    if (isZero(e)) continue;
    if (first == nullptr) {
      first = &e;
    } else if (!normal) {
      IntegerPoint n = computeCross(*first, e);
      if (!isZero(n)) normal = std::move(n);
    } else if (sgn(computeDot(*normal, e)) != 0) {
      return true;
    }
  }
  return false;
}

mpf_class toMetres(const mpz_class& integer, long bits) {
  mpf_class value(integer, kPrecision);
  mpf_div_2exp(value.get_mpf_t(), value.get_mpf_t(), static_cast<mp_bitcnt_t>(bits));
  return value;
}

}  // namespace

ExactPair makeExactPair(const Placed& a, const Placed& b, const Vec3& pointA, const Vec3& pointB) {
  std::vector<RationalPoint> all{toExactPoint(pointA), toExactPoint(pointB)};
  for (const Vec3& p : a.points) all.push_back(computeWorldPoint(a, p));
  for (const Vec3& p : b.points) all.push_back(computeWorldPoint(b, p));
  ExactPair pair;
  for (const RationalPoint& p : all)
    for (const mpq_class& q : p) pair.bits = std::max(pair.bits, computeDenominatorBits(q));
  pair.pointA = scaleToInteger(all[0], pair.bits);
  pair.pointB = scaleToInteger(all[1], pair.bits);
  for (std::size_t i = 2; i < all.size(); ++i)
    (i < 2 + a.points.size() ? pair.a : pair.b).push_back(scaleToInteger(all[i], pair.bits));
  return pair;
}

NearestPoint findNearestOfDifference(const std::vector<IntegerPoint>& a,
                                     const std::vector<IntegerPoint>& b) {
  Descent at{{b.front() - a.front()}, {b.front() - a.front(), 1}};
  for (int step = 0; step < kDescentBound; ++step) {
    const IntegerPoint& x = at.nearest.numerator;
    if (isZero(x)) return at.nearest;
    IntegerPoint support = findExtreme(b, x, false) - findExtreme(a, x, true);
    if (computeDot(x, support) * at.nearest.denominator >= computeDot(x, x)) return at.nearest;
    at.simplex.push_back(std::move(support));
    at = findNearestOfSimplex(at.simplex);
  }
  throw std::logic_error("the exact GJK iteration did not terminate");
}

mpf_class computeLength(const NearestPoint& nearest, long bits) {
  const mpf_class squared(computeDot(nearest.numerator, nearest.numerator), kPrecision);
  const mpf_class denominator(nearest.denominator, kPrecision);
  mpf_class length(sqrt(squared) / denominator, kPrecision);
  mpf_div_2exp(length.get_mpf_t(), length.get_mpf_t(), static_cast<mp_bitcnt_t>(bits));
  return length;
}

bool isWithinTolerance(const IntegerPoint& point, const std::vector<IntegerPoint>& body, long bits,
                       double tolerance) {
  const NearestPoint nearest = findNearestOfDifference({point}, body);
  mpq_class scaledTolerance(tolerance);
  mpq_mul_2exp(scaledTolerance.get_mpq_t(), scaledTolerance.get_mpq_t(),
               static_cast<mp_bitcnt_t>(bits));
  const mpq_class reach = scaledTolerance * nearest.denominator;
  return computeDot(nearest.numerator, nearest.numerator) <= reach * reach;
}

ReferenceResult computeReferenceResult(const ExactPair& pair) {
  const NearestPoint nearest = findNearestOfDifference(pair.a, pair.b);
  ReferenceResult answer{ReferenceVerdict::separated, toPreciseNumber(0.0), toPreciseNumber(0.0)};
  if (!isZero(nearest.numerator)) {
    answer.distance = computeLength(nearest, pair.bits);
    return answer;
  }
  answer.verdict = ReferenceVerdict::touching;
  if (!spansSpace(pair)) return answer;
  MinOverlap minimum;
  tryFaces(pair, pair.a, minimum);
  tryFaces(pair, pair.b, minimum);
  const std::vector<IntegerPoint> edgesB = computeEdges(pair.b);
  for (const IntegerPoint& e : computeEdges(pair.a))
    for (const IntegerPoint& f : edgesB) tryNormal(pair, computeCross(e, f), minimum);
  if (!minimum.any || sgn(minimum.overlap) < 0)
    throw std::logic_error("bodies with a common point are separated by a plane");
  if (sgn(minimum.overlap) == 0) return answer;
  answer.verdict = ReferenceVerdict::penetrating;
  const mpf_class squaredNormal(minimum.squaredNormal, kPrecision);
  answer.depth = mpf_class(toMetres(minimum.overlap, pair.bits) / sqrt(squaredNormal), kPrecision);
  return answer;
}

mpf_class toPreciseNumber(const std::string& decimal) {
  return mpf_class(decimal, kPrecision, 10);
}

mpf_class toPreciseNumber(double value) {
  return mpf_class(value, kPrecision);
}

mpf_class computeDistance(const Vec3& p, const Vec3& q) {
  mpf_class squared = toPreciseNumber(0.0);
  for (int k = 0; k < 3; ++k) {
    const mpf_class difference(toPreciseNumber(p[k]) - toPreciseNumber(q[k]), kPrecision);
    squared += difference * difference;
  }
  return mpf_class(sqrt(squared), kPrecision);
}

}  // namespace enfilade::accuracy
