// Integers instead of rationals: all coordinates are brought to one scale, a power of two, and what
// would be a quotient is kept as numerator and denominator, so that nothing is ever reduced.
//
// partingDirection: let the origin lie in the relative interior of a face of B - A, and L be the
// face's linear span. A plane that parts the bodies passes through the origin and so contains L.
// Modulo L the question is the same in fewer dimensions: does a direction exist along which no
// (projected) point is negative? GJK on the projected points either finds one, or a face of theirs
// that holds the origin, whose span joins L. When L is all of space, there is none.
#include "collision/exact/exact_minkowski.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace enfilade::collision {
namespace {

constexpr int kPreciseBits = 256;

/// The exponent of the last bit of a double, as if it had 53.
int lastBit(double value) {
  int exponent = 0;
  std::frexp(value, &exponent);
  return exponent - 53;
}

/// The least lastBit() of some doubles; INT_MAX / 4 when all are zero.
template <class Derived>
int leastBit(const Eigen::DenseBase<Derived>& values) {
  int least = std::numeric_limits<int>::max() / 4;
  for (Eigen::Index j = 0; j < values.cols(); ++j)
    for (Eigen::Index i = 0; i < values.rows(); ++i)
      if (values(i, j) != 0) least = std::min(least, lastBit(values(i, j)));
  return least;
}

/// value / 2^scale, an integer: scale <= lastBit(value).
Integer integer(double value, int scale) {
  if (value == 0) return 0;
  int exponent = 0;
  Integer result(std::ldexp(std::frexp(value, &exponent), 53));
  result <<= static_cast<unsigned>(exponent - 53 - scale);
  return result;
}

/// `direction` in doubles, its greatest |coordinate| in [1/2, 1]; each off by 2u of itself at most.
Vec3 rounded(const ExactPoint& direction) {
  std::array<const Integer*, 3> from{&direction.x, &direction.y, &direction.z};
  std::array<long, 3> exponent{};
  Vec3 mantissa;
  long greatest = std::numeric_limits<long>::min();
  for (int i = 0; i < 3; ++i) {
    mantissa[i] = mpz_get_d_2exp(&exponent[i], from[i]->get_mpz_t());
    if (mantissa[i] != 0) greatest = std::max(greatest, exponent[i]);
  }
  for (int i = 0; i < 3; ++i) {
    const long shift = std::max(exponent[i] - greatest, -2000L);
    mantissa[i] = std::ldexp(mantissa[i], static_cast<int>(shift));
  }
  return mantissa;
}

ExactPoint negated(const ExactPoint& a) {
  return {-a.x, -a.y, -a.z};
}

// ---- faces of a simplex ------------------------------------------------------------------------

/// Weights of the point of the corners' affine hull nearest the origin, and the direction of it;
/// false when the corners are not affinely independent or the point is not strictly inside.
bool nearestInside(const std::vector<ExactPoint>& p, ExactFace& face) {
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
    face.direction = side == 0 ? ExactPoint{} : side > 0 ? normal : negated(normal);
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

/// The optimality condition: no other point lies nearer along the direction.
bool isNearest(const std::vector<ExactPoint>& points, const ExactFace& face) {
  if (isZero(face.direction)) return true;
  const Integer along = dot(face.direction, points[face.corners[0]]);
  for (const ExactPoint& point : points)
    if (dot(face.direction, point) < along) return false;
  return true;
}

// ---- touching or penetrating -------------------------------------------------------------------

/// A linear subspace of space, and the projection along it.
struct Subspace {
  int dimension = 0;
  ExactPoint vector;  ///< dimension 1: its direction; 2: its normal

  /// The part of p perpendicular to the subspace, some positive length.
  ExactPoint project(const ExactPoint& p) const {
    if (dimension == 0) return p;
    const ExactPoint along = dot(vector, p) * vector;
    return dimension == 2 ? along : dot(vector, vector) * p - along;
  }
  /// Joins the span of `p` (perpendicular to the subspace), whose hull holds the origin inside.
  void join(const std::vector<ExactPoint>& p) {
    const int added = static_cast<int>(p.size()) - 1;
    if (added == 0) return;
    if (dimension + added == 1) vector = p[0];
    if (dimension + added == 2) vector = cross(dimension == 1 ? vector : p[1], p[0]);
    dimension += added;
  }
};

struct ProjectedSearch {
  bool parted = false;
  ExactPoint direction;            ///< if parted
  std::vector<ExactPoint> around;  ///< else: projected points whose hull holds the origin inside
};

/// A point that is not in the subspace; none when all of B - A is: then `direction` is
/// perpendicular to all of it.
std::optional<ExactPoint> pointOutside(ExactDifference& difference, const Subspace& subspace,
                                       VertexPair& hint, ExactPoint& direction) {
  for (const ExactPoint& axis : {ExactPoint{1, 0, 0}, ExactPoint{0, 1, 0}, ExactPoint{0, 0, 1}}) {
    const ExactPoint projected = subspace.project(axis);
    if (isZero(projected)) continue;
    direction = projected;
    for (const ExactPoint& way : {projected, negated(projected)}) {
      const ExactPoint point = difference(difference.leastAlong(way, hint));
      if (sgn(dot(way, point)) != 0) return subspace.project(point);
    }
  }
  return std::nullopt;
}

ProjectedSearch searchProjected(ExactDifference& difference, const Subspace& subspace,
                                VertexPair& hint) {
  ProjectedSearch search;
  const auto first = pointOutside(difference, subspace, hint, search.direction);
  if (!first) {
    search.parted = true;
    return search;
  }
  std::vector<ExactPoint> points{*first};
  for (;;) {  // the nearest point falls strictly
    const ExactFace face = nearestFace(points);
    std::vector<ExactPoint> kept;
    for (const int i : face.corners) kept.push_back(points[i]);
    if (isZero(face.direction)) {
      search.around = std::move(kept);
      return search;
    }
    const ExactPoint least = difference(difference.leastAlong(face.direction, hint));
    if (sgn(dot(face.direction, least)) >= 0) {
      search.parted = true;
      search.direction = face.direction;
      return search;
    }
    points = std::move(kept);
    points.push_back(subspace.project(least));
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

ExactDifference::Body::Body(const ConvexBody& body)
    : placed(&body),
      bounds(body),
      translationScale(leastBit(body.translation)),
      vertices(body.vertices.size()) {
  vertexScale = std::numeric_limits<int>::max() / 4;
  for (const Vec3& p : body.vertices) vertexScale = std::min(vertexScale, leastBit(p));
  if (!body.rotation) return;
  rotationScale = leastBit(*body.rotation);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rotation.push_back(integer((*body.rotation)(i, j), rotationScale));
}

int ExactDifference::Body::scale() const {
  return std::min(rotationScale + vertexScale, translationScale);
}

const ExactPoint& ExactDifference::Body::vertex(std::uint32_t i, int scale) {
  if (vertices[i]) return *vertices[i];
  const Vec3& p = placed->vertices[i];
  ExactPoint point;
  if (rotation.empty()) {
    point = {integer(p.x(), scale), integer(p.y(), scale), integer(p.z(), scale)};
  } else {
    // Zero vertices or rotations have no last bit; their products are zero at any scale.
    const int products = rotationScale + vertexScale;
    const auto shift = static_cast<unsigned>(products > scale ? products - scale : 0);
    const ExactPoint local{integer(p.x(), vertexScale), integer(p.y(), vertexScale),
                           integer(p.z(), vertexScale)};
    const auto row = [&](int r) {
      const Integer sum =
          rotation[3 * r] * local.x + rotation[3 * r + 1] * local.y + rotation[3 * r + 2] * local.z;
      return sgn(sum) == 0 ? sum : Integer(sum << shift);
    };
    point = {row(0), row(1), row(2)};
  }
  const Vec3& t = placed->translation;
  const ExactPoint moved{integer(t.x(), scale), integer(t.y(), scale), integer(t.z(), scale)};
  vertices[i] = point + moved;
  return *vertices[i];
}

ExactDifference::ExactDifference(const ConvexBody& a, const ConvexBody& b)
    : a_(a), b_(b), scale_(std::min(a_.scale(), b_.scale())) {
  if (scale_ > std::numeric_limits<int>::max() / 16) scale_ = 0;  // every coordinate is zero
}

VertexPair ExactDifference::leastAlong(const ExactPoint& direction, VertexPair& hint) {
  const Vec3 approximate = rounded(direction);
  const auto farthest = [&](Body& body, int sign, std::uint32_t& climbed) {
    std::optional<std::uint32_t> best;
    Integer most;
    const WideVec towards = approximate.cast<Wide>() * static_cast<Wide>(sign);
    const Vec3 local = body.bounds.bodyFromWorld<Wide>(towards).cast<double>();
    const double length = approximate.lpNorm<1>() + local.lpNorm<1>();
    const double slack = supportSlack(body.bounds, length);
    const Summit summit = climb(body.bounds, local, slack, climbed);
    forEachFarthest(body.bounds, local, slack, summit, [&](std::uint32_t i) {
      const Integer along = sign * dot(direction, body.vertex(i, scale_));
      if (best && along <= most) return;
      best = i;
      most = along;
    });
    climbed = *best;
    return *best;
  };
  const std::uint32_t ofA = farthest(a_, 1, hint.a);
  const std::uint32_t ofB = farthest(b_, -1, hint.b);
  return {ofA, ofB};
}

// ---- features ----------------------------------------------------------------------------------

ExactFace nearestFace(const std::vector<ExactPoint>& points) {
  // The whole simplex first: the search that led here has usually left out what does not matter.
  for (unsigned mask = (1u << points.size()) - 1; mask > 0; --mask) {
    ExactFace face;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (mask >> i & 1u) face.corners.push_back(static_cast<int>(i));
    if (nearestInside(points, face) && isNearest(points, face)) return face;
  }
  throw std::logic_error("a simplex without a nearest point");  // it has one, inside some face
}

ExactNearest nearestExactly(ExactDifference& difference, const FeatureCache& cache) {
  std::vector<VertexPair> pairs(cache.pairs.begin(), cache.pairs.begin() + cache.size);
  if (pairs.empty()) pairs.emplace_back();
  VertexPair hint = pairs[0];
  for (;;) {  // the nearest point falls strictly
    std::vector<ExactPoint> points;
    for (const VertexPair& pair : pairs) points.push_back(difference(pair));
    ExactNearest nearest{{}, nearestFace(points)};
    for (int& corner : nearest.face.corners) {
      nearest.pairs.push_back(pairs[corner]);
      corner = static_cast<int>(nearest.pairs.size()) - 1;
    }
    if (isZero(nearest.face.direction)) return nearest;
    const VertexPair least = difference.leastAlong(nearest.face.direction, hint);
    const ExactPoint& direction = nearest.face.direction;
    if (dot(direction, difference(least)) >= dot(direction, difference(nearest.pairs[0])))
      return nearest;
    pairs = std::move(nearest.pairs);
    pairs.push_back(least);
  }
}

std::optional<ExactPoint> partingDirection(ExactDifference& difference,
                                           const ExactNearest& nearest) {
  Subspace subspace;
  std::vector<ExactPoint> around;
  for (const VertexPair& pair : nearest.pairs) around.push_back(difference(pair));
  subspace.join(around);
  VertexPair hint = nearest.pairs[0];
  while (subspace.dimension < 3) {
    const ProjectedSearch search = searchProjected(difference, subspace, hint);
    if (search.parted) return search.direction;
    subspace.join(search.around);
  }
  return std::nullopt;
}

// ---- rounding ----------------------------------------------------------------------------------

mpf_class precise(const Integer& value) {
  return mpf_class(value, kPreciseBits);
}

static mpf_class scaled(const mpf_class& value, int scale) {
  mpf_class result(0, value.get_prec());
  if (scale >= 0) {
    mpf_mul_2exp(result.get_mpf_t(), value.get_mpf_t(), static_cast<unsigned>(scale));
  } else {
    mpf_div_2exp(result.get_mpf_t(), value.get_mpf_t(), static_cast<unsigned>(-scale));
  }
  return result;
}

void roundInTwo(const mpf_class& value, int scale, double& head, double& tail) {
  const mpf_class metres = scaled(value, scale);
  const double truncated = metres.get_d();
  mpf_class rest = metres - truncated;
  head = truncated + rest.get_d();
  rest = metres - head;
  tail = rest.get_d();
  // What is no double any more was cut off: by then the unit of `head` is the least double.
  constexpr double kLeast = std::numeric_limits<double>::denorm_min();
  if (tail == 0 && 2 * abs(rest) > kLeast) head += std::copysign(kLeast, sgn(rest));
}

double toDouble(const mpf_class& value, int scale) {
  double head = 0, tail = 0;
  roundInTwo(value, scale, head, tail);
  return head;
}

ExactPoint weightedSum(ExactDifference& difference, const ExactNearest& nearest) {
  ExactPoint sum;
  for (std::size_t i = 0; i < nearest.pairs.size(); ++i)
    sum = sum + nearest.face.weights[i] * difference(nearest.pairs[i]);
  return sum;
}

std::array<mpf_class, 3> weightedPoint(ExactDifference& difference, const ExactNearest& nearest,
                                       bool ofA) {
  ExactPoint sum;
  for (std::size_t i = 0; i < nearest.pairs.size(); ++i) {
    const VertexPair pair = nearest.pairs[i];
    sum = sum +
          nearest.face.weights[i] * (ofA ? difference.pointA(pair.a) : difference.pointB(pair.b));
  }
  const mpf_class total = precise(nearest.face.total);
  return {mpf_class(precise(sum.x) / total), mpf_class(precise(sum.y) / total),
          mpf_class(precise(sum.z) / total)};
}

Vec3 unitVector(const ExactPoint& direction) {
  return rounded(direction).normalized();
}

}  // namespace enfilade::collision
