// Integers instead of rationals. All coordinates share one scale, a power of two, and quotients
// stay numerator and denominator, so that no fraction is ever reduced.
//
// findSeparatingDirection: let the origin be in the relative interior of a face of B - A, and L the
// linear span of the face. A separating plane passes through the origin and therefore contains L.
// Modulo L the problem has fewer dimensions: is there a direction on which no projected point has a
// negative projection? GJK on the projected points either finds one, or finds a face that contains
// the origin, whose span is added to L. If L becomes all of space, there is no such direction.
#include "collision/exact/exact_minkowski.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

constexpr int kPreciseBits = 256;

/// The exponent of the last of the 53 bits of a double.
int findLastBit(double value) {
  int exponent = 0;
  std::frexp(value, &exponent);
  return exponent - 53;
}

/// The minimum of findLastBit(); INT_MAX / 4 if all values are zero.
template <class Derived>
int findMinLastBit(const Eigen::DenseBase<Derived>& values) {
  int minExponent = std::numeric_limits<int>::max() / 4;
  for (Eigen::Index j = 0; j < values.cols(); ++j)
    for (Eigen::Index i = 0; i < values.rows(); ++i)
      if (values(i, j) != 0) minExponent = std::min(minExponent, findLastBit(values(i, j)));
  return minExponent;
}

/// value / 2^scale as an integer. Requires scale <= findLastBit(value).
Integer toInteger(double value, int scale) {
  if (value == 0) return 0;
  int exponent = 0;
  Integer result(std::ldexp(std::frexp(value, &exponent), 53));
  ENFILADE_ASSERT(exponent - 53 >= scale);
  result <<= static_cast<unsigned>(exponent - 53 - scale);
  return result;
}

/// `direction` in doubles, scaled so that the maximum |coordinate| is in [1/2, 1]; each coordinate
/// has a relative error of at most 2u.
Vec3 roundDirection(const ExactPoint& direction) {
  std::array<const Integer*, 3> from{&direction.x, &direction.y, &direction.z};
  std::array<long, 3> exponent{};
  Vec3 mantissa;
  long maxExponent = std::numeric_limits<long>::min();
  for (int i = 0; i < 3; ++i) {
    mantissa[i] = mpz_get_d_2exp(&exponent[i], from[i]->get_mpz_t());
    if (mantissa[i] != 0) maxExponent = std::max(maxExponent, exponent[i]);
  }
  for (int i = 0; i < 3; ++i) {
    const long shift = std::max(exponent[i] - maxExponent, -2000L);
    mantissa[i] = std::ldexp(mantissa[i], static_cast<int>(shift));
  }
  return mantissa;
}

ExactPoint negate(const ExactPoint& a) {
  return {-a.x, -a.y, -a.z};
}

// ---- faces of a simplex ------------------------------------------------------------------------

/// Computes weights and direction of the point of the corners' affine hull nearest the origin.
/// False if the corners are not affinely independent or the point is not strictly inside.
bool findNearestInside(const std::vector<ExactPoint>& p, ExactFace& face) {
  const std::vector<int>& c = face.corners;
  const ExactPoint& a = p[c[0]];
  if (c.size() == 1) {
    face.weights = {1};
    face.direction = a;
  } else if (c.size() == 2) {
    const ExactPoint edge = p[c[1]] - a;
    const Integer squared = dot(edge, edge), t = -dot(a, edge);
    face.weights = {squared - t, t};
    if (sgn(t) > 0 && t < squared) face.direction = face.weights[0] * a + t * p[c[1]];
  } else if (c.size() == 3) {
    const ExactPoint ab = p[c[1]] - a, ac = p[c[2]] - a;
    const ExactPoint normal = cross(ab, ac), an = cross(a, normal);
    const Integer k = -dot(ab, an), j = dot(ac, an);
    face.weights = {dot(normal, normal) - j - k, j, k};
    const int side = sgn(dot(a, normal));
    face.direction = side == 0 ? ExactPoint{} : side > 0 ? normal : negate(normal);
  } else {
    const ExactPoint &b = p[c[1]], &d = p[c[3]];
    const ExactPoint ab = cross(a, b), cd = cross(p[c[2]], d);
    face.weights = {dot(b, cd), -dot(a, cd), dot(d, ab), -dot(p[c[2]], ab)};
    face.direction = {};
    if (sgn(face.weights[0]) < 0)
      for (Integer& w : face.weights) w = -w;
  }
  face.total = 0;
  for (const Integer& w : face.weights) {
    if (sgn(w) <= 0) return false;
    face.total += w;
  }
  return true;
}

/// The optimality condition: no other point has a smaller projection on the direction.
bool isNearest(const std::vector<ExactPoint>& points, const ExactFace& face) {
  if (isZero(face.direction)) return true;
  const Integer projection = dot(face.direction, points[face.corners[0]]);
  for (const ExactPoint& point : points)
    if (dot(face.direction, point) < projection) return false;
  return true;
}

// ---- touching or penetrating -------------------------------------------------------------------

/// A linear subspace of space, and the projection along it.
struct Subspace {
  int dimension = 0;
  ExactPoint vector;  ///< dimension 1: its direction; 2: its normal

  /// The component of p perpendicular to the subspace, times a positive factor.
  ExactPoint project(const ExactPoint& p) const {
    if (dimension == 0) return p;
    const ExactPoint parallel = dot(vector, p) * vector;
    return dimension == 2 ? parallel : dot(vector, vector) * p - parallel;
  }
  /// Adds the span of `p`, perpendicular to the subspace; the hull of `p` contains the origin
  /// inside.
  void join(const std::vector<ExactPoint>& p) {
    const int added = static_cast<int>(p.size()) - 1;
    ENFILADE_ASSERT(added >= 0 && dimension + added <= 3);
    if (added == 0) return;
    if (dimension + added == 1) vector = p[0];
    if (dimension + added == 2) vector = cross(dimension == 1 ? vector : p[1], p[0]);
    dimension += added;
  }
};

struct ProjectedResult {
  bool separated = false;
  ExactPoint direction;               ///< if separated
  std::vector<ExactPoint> enclosing;  ///< else: projected points whose hull contains the origin
};

/// Finds a point of B - A outside the subspace. nullopt: all of B - A lies in the subspace, and
/// `direction` is perpendicular to it.
std::optional<ExactPoint> findPointOutside(ExactMinkowskiDifference& difference,
                                           const Subspace& subspace, VertexPair& hint,
                                           ExactPoint& direction) {
  for (const ExactPoint& axis : {ExactPoint{1, 0, 0}, ExactPoint{0, 1, 0}, ExactPoint{0, 0, 1}}) {
    const ExactPoint projected = subspace.project(axis);
    if (isZero(projected)) continue;
    direction = projected;
    for (const ExactPoint& candidate : {projected, negate(projected)}) {
      const ExactPoint point = difference(difference.findSupport(candidate, hint));
      if (sgn(dot(candidate, point)) != 0) return subspace.project(point);
    }
  }
  return std::nullopt;
}

ProjectedResult searchProjected(ExactMinkowskiDifference& difference, const Subspace& subspace,
                                VertexPair& hint) {
  ProjectedResult result;
  const auto first = findPointOutside(difference, subspace, hint, result.direction);
  if (!first) {
    result.separated = true;
    return result;
  }
  std::vector<ExactPoint> points{*first};
  for (;;) {  // terminates: the nearest point gets strictly nearer
    const ExactFace face = findNearestFace(points);
    std::vector<ExactPoint> kept;
    for (const int i : face.corners) kept.push_back(points[i]);
    if (isZero(face.direction)) {
      result.enclosing = std::move(kept);
      return result;
    }
    const ExactPoint support = difference(difference.findSupport(face.direction, hint));
    if (sgn(dot(face.direction, support)) >= 0) {
      result.separated = true;
      result.direction = face.direction;
      return result;
    }
    points = std::move(kept);
    points.push_back(subspace.project(support));
  }
}

}  // namespace

// ---- points ------------------------------------------------------------------------------------

ExactPoint operator+(const ExactPoint& a, const ExactPoint& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
ExactPoint operator-(const ExactPoint& a, const ExactPoint& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
ExactPoint operator*(const Integer& s, const ExactPoint& a) {
  return {s * a.x, s * a.y, s * a.z};
}
Integer dot(const ExactPoint& a, const ExactPoint& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
ExactPoint cross(const ExactPoint& a, const ExactPoint& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
bool isZero(const ExactPoint& a) {
  return sgn(a.x) == 0 && sgn(a.y) == 0 && sgn(a.z) == 0;
}

// ---- bodies ------------------------------------------------------------------------------------

ExactMinkowskiDifference::ExactConvex::ExactConvex(const PlacedConvex& placedConvex)
    : shape(&placedConvex),
      bounds(placedConvex),
      translationScale(findMinLastBit(placedConvex.translation)),
      vertices(placedConvex.vertices.size()) {
  vertexScale = std::numeric_limits<int>::max() / 4;
  for (const Vec3& p : placedConvex.vertices)
    vertexScale = std::min(vertexScale, findMinLastBit(p));
  if (!placedConvex.rotation) return;
  rotationScale = findMinLastBit(*placedConvex.rotation);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      rotation.push_back(toInteger((*placedConvex.rotation)(i, j), rotationScale));
}

int ExactMinkowskiDifference::ExactConvex::scale() const {
  return std::min(rotationScale + vertexScale, translationScale);
}

const ExactPoint& ExactMinkowskiDifference::ExactConvex::vertex(std::uint32_t i, int scale) {
  if (vertices[i]) return *vertices[i];
  const Vec3& p = shape->vertices[i];
  ExactPoint point;
  if (rotation.empty()) {
    point = {toInteger(p.x(), scale), toInteger(p.y(), scale), toInteger(p.z(), scale)};
  } else {
    // Zeros have no last bit; their products are zero at any scale.
    const int products = rotationScale + vertexScale;
    const auto shift = static_cast<unsigned>(products > scale ? products - scale : 0);
    const ExactPoint local{toInteger(p.x(), vertexScale), toInteger(p.y(), vertexScale),
                           toInteger(p.z(), vertexScale)};
    const auto row = [&](int r) {
      const Integer sum =
          rotation[3 * r] * local.x + rotation[3 * r + 1] * local.y + rotation[3 * r + 2] * local.z;
      return sgn(sum) == 0 ? sum : Integer(sum << shift);
    };
    point = {row(0), row(1), row(2)};
  }
  const Vec3& t = shape->translation;
  const ExactPoint moved{toInteger(t.x(), scale), toInteger(t.y(), scale), toInteger(t.z(), scale)};
  vertices[i] = point + moved;
  return *vertices[i];
}

ExactMinkowskiDifference::ExactMinkowskiDifference(const PlacedConvex& a, const PlacedConvex& b)
    : a_(a), b_(b), scale_(std::min(a_.scale(), b_.scale())) {
  if (scale_ > std::numeric_limits<int>::max() / 16) scale_ = 0;  // every coordinate is zero
}

VertexPair ExactMinkowskiDifference::findSupport(const ExactPoint& direction, VertexPair& hint) {
  const Vec3 approximate = roundDirection(direction);
  const auto findFarthest = [&](ExactConvex& convex, int sign, std::uint32_t& startVertex) {
    std::optional<std::uint32_t> best;
    Integer maxProjection;
    const LongVec3 towards = approximate.cast<LongReal>() * static_cast<LongReal>(sign);
    const Vec3 local = convex.bounds.bodyFromWorld<LongReal>(towards).cast<double>();
    const double length = approximate.lpNorm<1>() + local.lpNorm<1>();
    const double slack = computeSupportSlack(convex.bounds, length);
    const SupportVertex support = hillClimb(convex.bounds, local, slack, startVertex);
    forEachSupportCandidate(convex.bounds, support, [&](std::uint32_t i) {
      const Integer projection = sign * dot(direction, convex.vertex(i, scale_));
      if (best && projection <= maxProjection) return;
      best = i;
      maxProjection = projection;
    });
    startVertex = *best;
    return *best;
  };
  const std::uint32_t vertexA = findFarthest(a_, 1, hint.a);
  const std::uint32_t vertexB = findFarthest(b_, -1, hint.b);
  return {vertexA, vertexB};
}

// ---- features ----------------------------------------------------------------------------------

ExactFace findNearestFace(const std::vector<ExactPoint>& points) {
  ENFILADE_ASSERT(!points.empty() && points.size() <= 4);
  // The whole simplex first: the preceding search has usually removed irrelevant points.
  for (unsigned mask = (1u << points.size()) - 1; mask > 0; --mask) {
    ExactFace face;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (mask >> i & 1u) face.corners.push_back(static_cast<int>(i));
    if (findNearestInside(points, face) && isNearest(points, face)) return face;
  }
  throw std::logic_error("a simplex without a nearest point");  // unreachable
}

ExactNearestFeature findNearestExactly(ExactMinkowskiDifference& difference,
                                       const FeatureCache& cache) {
  std::vector<VertexPair> pairs(cache.pairs.begin(), cache.pairs.begin() + cache.size);
  if (pairs.empty()) pairs.emplace_back();
  VertexPair hint = pairs[0];
  for (;;) {  // terminates: the nearest point gets strictly nearer
    std::vector<ExactPoint> points;
    for (const VertexPair& pair : pairs) points.push_back(difference(pair));
    ExactNearestFeature nearest{{}, findNearestFace(points)};
    for (int& corner : nearest.face.corners) {
      nearest.pairs.push_back(pairs[corner]);
      corner = static_cast<int>(nearest.pairs.size()) - 1;
    }
    if (isZero(nearest.face.direction)) return nearest;
    const VertexPair support = difference.findSupport(nearest.face.direction, hint);
    const ExactPoint& direction = nearest.face.direction;
    if (dot(direction, difference(support)) >= dot(direction, difference(nearest.pairs[0])))
      return nearest;
    pairs = std::move(nearest.pairs);
    pairs.push_back(support);
  }
}

std::optional<ExactPoint> findSeparatingDirection(ExactMinkowskiDifference& difference,
                                                  const ExactNearestFeature& nearest) {
  Subspace subspace;
  std::vector<ExactPoint> around;
  for (const VertexPair& pair : nearest.pairs) around.push_back(difference(pair));
  subspace.join(around);
  VertexPair hint = nearest.pairs[0];
  while (subspace.dimension < 3) {
    const ProjectedResult projected = searchProjected(difference, subspace, hint);
    if (projected.separated) return projected.direction;
    subspace.join(projected.enclosing);
  }
  return std::nullopt;
}

// ---- rounding ----------------------------------------------------------------------------------

mpf_class toPreciseFloat(const Integer& value) {
  return mpf_class(value, kPreciseBits);
}

static mpf_class scaleByPowerOfTwo(const mpf_class& value, int scale) {
  mpf_class result(0, value.get_prec());
  if (scale >= 0) {
    mpf_mul_2exp(result.get_mpf_t(), value.get_mpf_t(), static_cast<unsigned>(scale));
  } else {
    mpf_div_2exp(result.get_mpf_t(), value.get_mpf_t(), static_cast<unsigned>(-scale));
  }
  return result;
}

void splitToDoubles(const mpf_class& value, int scale, double& head, double& tail) {
  const mpf_class metres = scaleByPowerOfTwo(value, scale);
  const double truncated = metres.get_d();
  mpf_class rest = metres - truncated;
  head = truncated + rest.get_d();
  rest = metres - head;
  tail = rest.get_d();
  // get_d() truncates below the smallest double; the unit of `head` is then the smallest double.
  constexpr double kMinPositive = std::numeric_limits<double>::denorm_min();
  if (tail == 0 && 2 * abs(rest) > kMinPositive) head += std::copysign(kMinPositive, sgn(rest));
}

double toDouble(const mpf_class& value, int scale) {
  double head = 0, tail = 0;
  splitToDoubles(value, scale, head, tail);
  return head;
}

ExactPoint computeWeightedSum(ExactMinkowskiDifference& difference,
                              const ExactNearestFeature& nearest) {
  ENFILADE_ASSERT(nearest.pairs.size() == nearest.face.weights.size());
  ExactPoint sum;
  for (std::size_t i = 0; i < nearest.pairs.size(); ++i)
    sum = sum + nearest.face.weights[i] * difference(nearest.pairs[i]);
  return sum;
}

std::array<mpf_class, 3> computeWeightedPoint(ExactMinkowskiDifference& difference,
                                              const ExactNearestFeature& nearest, bool ofA) {
  ExactPoint sum;
  for (std::size_t i = 0; i < nearest.pairs.size(); ++i) {
    const VertexPair pair = nearest.pairs[i];
    sum = sum +
          nearest.face.weights[i] * (ofA ? difference.pointA(pair.a) : difference.pointB(pair.b));
  }
  ENFILADE_ASSERT(sgn(nearest.face.total) > 0);
  const mpf_class total = toPreciseFloat(nearest.face.total);
  return {mpf_class(toPreciseFloat(sum.x) / total), mpf_class(toPreciseFloat(sum.y) / total),
          mpf_class(toPreciseFloat(sum.z) / total)};
}

Vec3 toUnitVector(const ExactPoint& direction) {
  return roundDirection(direction).normalized();
}

}  // namespace enfilade::collision
