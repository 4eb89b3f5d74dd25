// Intermediate value theorem on orientation determinants.
//
// Let x0..x3 be the four points, V = det(x1 - x0, x2 - x0, x3 - x0), and d a fixed vector. With
//   side(i, j, k) = ((xj - xi) x d) . (xk - xi)
// the points meet if V has opposite signs at both ends, and throughout the interval this holds.
//  - vertex p and triangle t: side(t0, t1, p), side(t1, t2, p), side(t2, t0, p) have one sign.
//    Where V = 0, they are the barycentric coordinates of p times -d . normal: p is inside.
//  - edges a and b: side(a0, a1, b0) and side(a0, a1, b1) have opposite signs, and so have
//    side(b0, b1, a0) and side(b0, b1, a1). Where V = 0, each edge crosses the other's line.
// Two directions d are tried: the relative displacement, along which the sides are constant in a
// translation, and the normal.
//
// Bounds. A difference of two points departs from the chord between its computed ends by at most
// 2 delta. delta sums the bounds of the pose error and the rounding, and h^2 / 8 times the bound of
// the relative acceleration. h is the length of the interval. On the chords, side() is quadratic.
// It departs from the line between its ends by at most |d| |u1 - u0| |q1 - q0| / 4. Here
// u = xj - xi and q = xk - xi. All signs must hold by more than these bounds.
//
// Where these bounds do not suffice, a uniform translation is decided in exact arithmetic, as a ray
// against the faces of the Minkowski difference.
#include "collision/motion/crossing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <span>
#include <utility>
#include <vector>

#include "collision/assert.hpp"
#include "collision/exact/exact_minkowski.hpp"
#include "collision/floating_point.hpp"

namespace enfilade::collision {
namespace {

constexpr std::size_t kMaxFaces = 200;     // for exact arithmetic, two microseconds each
constexpr LongReal kSlack = 1 + 0x1p-40L;  // exceeds the rounding of the bounds

/// A point, or a difference of points, at both ends of the interval.
struct Ends {
  LongVec3 start, end;

  Ends operator-(const Ends& from) const { return {start - from.start, end - from.end}; }
  LongVec3 change() const { return end - start; }
  LongReal maxNorm() const { return std::max(start.norm(), end.norm()); }
};

int findSign(LongReal low, LongReal high, LongReal bound) {
  if (low > bound) return 1;
  return high < -bound ? -1 : 0;  // also for values that are not finite
}

/// Signs of the determinants over the interval; 0: not proved.
struct Signs {
  LongReal delta;  ///< metres, see the head of this file

  int volumeSign(const LongVec3& u, const LongVec3& v, const LongVec3& q) const {
    const LongReal volume = u.cross(v).dot(q);
    const LongReal lu = u.norm(), lv = v.norm(), lq = q.norm(), e = 2 * delta;
    const LongReal bound = e * (lu * lv + lv * lq + lq * lu) + e * e * (lu + lv + lq) + e * e * e +
                           32 * kLongRoundoff * lu * lv * lq;
    return findSign(volume, volume, bound * kSlack);
  }

  bool changesVolumeSign(const Ends& u, const Ends& v, const Ends& q) const {
    return volumeSign(u.start, v.start, q.start) * volumeSign(u.end, v.end, q.end) == -1;
  }

  /// Sign of (u x d) . q throughout; |d| = 1.
  int sideSign(const Ends& u, const Ends& q, const LongVec3& d) const {
    const LongReal start = u.start.cross(d).dot(q.start), end = u.end.cross(d).dot(q.end);
    const LongReal lu = u.maxNorm(), lq = q.maxNorm(), e = 2 * delta;
    const LongReal bound = u.change().norm() * q.change().norm() / 4 + e * (lu + lq) + e * e +
                           32 * kLongRoundoff * lu * lq;
    return findSign(std::min(start, end), std::max(start, end), bound * kSlack);
  }

  bool isPierced(const std::array<Ends, 3>& triangle, const Ends& point) const {
    const Ends u = triangle[1] - triangle[0], v = triangle[2] - triangle[0];
    const Ends q = point - triangle[0];
    if (!changesVolumeSign(u, v, q)) return false;
    const auto isInsideAlong = [&](const LongVec3& d) {
      const int side = sideSign(u, q, d);
      return side != 0 && sideSign(triangle[2] - triangle[1], point - triangle[1], d) == side &&
             sideSign(triangle[0] - triangle[2], point - triangle[2], d) == side;
    };
    return isInsideAlong(q.change().normalized()) ||
           isInsideAlong(u.start.cross(v.start).normalized());
  }

  bool doEdgesCross(const std::array<Ends, 2>& a, const std::array<Ends, 2>& b) const {
    const Ends u = a[1] - a[0], v = b[1] - b[0];
    if (!changesVolumeSign(u, b[0] - a[0], b[1] - a[0])) return false;
    const auto crossAlong = [&](const LongVec3& d) {
      return sideSign(u, b[0] - a[0], d) * sideSign(u, b[1] - a[0], d) == -1 &&
             sideSign(v, a[0] - b[0], d) * sideSign(v, a[1] - b[0], d) == -1;
    };
    return crossAlong((b[0] - a[0]).change().normalized()) ||
           crossAlong(u.start.cross(v.start).normalized());
  }
};

LongVec3 placeVertex(const PlacedConvex& body, std::size_t i) {
  const LongVec3 v = body.vertices[i].cast<LongReal>();
  const LongVec3 translation = body.translation.cast<LongReal>();
  return body.rotation ? LongVec3(body.rotation->cast<LongReal>() * v + translation)
                       : LongVec3(v + translation);
}

/// Upper bound of |rotation * vertex| over all vertices, for rounding errors.
double computeMagnitude(const PlacedConvex& body) {
  return (body.rotation ? body.rotation->norm() : 1) * computeRadius(body, false);
}

class CrossingSearch {
 public:
  CrossingSearch(const MovingBody& a, const MovingBody& b, double from, double to)
      : start_(a, b, from), end_(a, b, to) {
    ENFILADE_ASSERT(from < to);
    const auto centripetal = [](const MovingBody& body) {
      return body.motion.angularVelocity.squaredNorm() * computeRadius(body.body, true);
    };
    const double acceleration =
        (b.motion.acceleration - a.motion.acceleration).norm() + centripetal(a) + centripetal(b) +
        kRoundoff * (a.motion.acceleration.norm() + b.motion.acceleration.norm());
    const double magnitude = computeMagnitude(a.body) + computeMagnitude(b.body) +
                             (start_.b().translation.norm() + end_.b().translation.norm());
    const LongReal h = to - from;
    signs_.delta = (std::max(start_.error(), end_.error()) + 16 * kLongRoundoff * magnitude +
                    acceleration * h * h / 8) *
                   kSlack;
  }

  bool isProvedFor(const FeatureCache& features) const {
    std::vector<std::uint32_t> a, b;
    for (int i = 0; i < features.size; ++i) {
      const auto [vertexA, vertexB] = features.pairs[i];
      if (vertexA >= start_.a().vertices.size() || vertexB >= start_.b().vertices.size())
        return false;
      if (std::ranges::find(a, vertexA) == a.end()) a.push_back(vertexA);
      if (std::ranges::find(b, vertexB) == b.end()) b.push_back(vertexB);
    }
    // A vertex and a triangle, or two edges.
    return a.size() + b.size() == 4 && isProvedAmong(a, b);
  }

  /// Of bodies of at most four vertices: at most 68 pairs of features.
  bool isProvedForAny() const {
    constexpr std::array<std::uint32_t, 4> kAll{0, 1, 2, 3};
    const std::size_t sizeA = start_.a().vertices.size(), sizeB = start_.b().vertices.size();
    if (std::max(sizeA, sizeB) > kAll.size()) return false;
    return isProvedAmong(std::span(kAll).first(sizeA), std::span(kAll).first(sizeB));
  }

 private:
  /// Tries all vertices, edges and triangles of these vertices.
  bool isProvedAmong(std::span<const std::uint32_t> verticesA,
                     std::span<const std::uint32_t> verticesB) const {
    std::vector<Ends> a, b;
    for (const std::uint32_t i : verticesA)
      a.push_back({placeVertex(start_.a(), i), placeVertex(end_.a(), i)});
    for (const std::uint32_t i : verticesB)
      b.push_back({placeVertex(start_.b(), i), placeVertex(end_.b(), i)});
    return isAnyTrianglePierced(a, b) || isAnyTrianglePierced(b, a) || doAnyEdgesCross(a, b);
  }

  bool isAnyTrianglePierced(std::span<const Ends> corners, std::span<const Ends> points) const {
    for (std::size_t k = 2; k < corners.size(); ++k)
      for (std::size_t j = 1; j < k; ++j)
        for (std::size_t i = 0; i < j; ++i)
          for (const Ends& point : points)
            if (signs_.isPierced({corners[i], corners[j], corners[k]}, point)) return true;
    return false;
  }

  bool doAnyEdgesCross(std::span<const Ends> a, std::span<const Ends> b) const {
    for (std::size_t j = 1; j < a.size(); ++j)
      for (std::size_t i = 0; i < j; ++i)
        for (std::size_t l = 1; l < b.size(); ++l)
          for (std::size_t k = 0; k < l; ++k)
            if (signs_.doEdgesCross({a[i], a[j]}, {b[k], b[l]})) return true;
    return false;
  }

  PairAtTime start_, end_;
  Signs signs_{};
};

/// The Minkowski difference B - A at time 0 and A's velocity relative to B. The bodies meet at t if
/// t * velocity lies in the difference. Its faces are triangles (a vertex of one body, a triangle
/// of the other) and parallelograms (an edge of each).
class ExactTranslation {
 public:
  ExactTranslation(const MovingBody& a, const MovingBody& b)
      : difference_(a.body, b.body),
        sizeA_(static_cast<std::uint32_t>(a.body.vertices.size())),
        sizeB_(static_cast<std::uint32_t>(b.body.vertices.size())) {
    std::array<mpq_class, 3> velocity;
    for (int k = 0; k < 3; ++k) {
      velocity[k] = mpq_class(a.motion.velocity[k]) - mpq_class(b.motion.velocity[k]);
      denominator_ = std::max(denominator_, velocity[k].get_den());  // all are powers of two
    }
    for (mpq_class& coordinate : velocity) coordinate *= denominator_;
    velocity_ = {velocity[0].get_num(), velocity[1].get_num(), velocity[2].get_num()};
  }

  std::optional<CrossingTime> findContactPosition() {
    for (std::uint32_t i = 0; i < sizeA_; ++i)
      for (std::uint32_t j = 0; j < sizeB_; ++j) addFaces({i, j});
    constexpr double kNever = std::numeric_limits<double>::infinity();
    if (!isTransversal_) return std::nullopt;
    if (!first_) return CrossingTime{kNever, kNever};
    const int scale = difference_.scale();
    (scale >= 0 ? first_->numerator : first_->denominator) <<=
        static_cast<unsigned>(std::abs(scale));
    mpq_class first(first_->numerator, first_->denominator);
    first.canonicalize();
    const double lo = first.get_d();  // rounds towards zero
    return CrossingTime{lo, mpq_class(lo) == first ? lo : std::nextafter(lo, kNever)};
  }

 private:
  /// A fraction, not reduced: common divisors are sought of the first time alone.
  struct Time {
    Integer numerator, denominator;  ///< the denominator is above 0
  };

  /// Adds each face with `corner` as the one of the highest vertices.
  void addFaces(VertexPair corner) {
    const auto [a, b] = corner;
    for (std::uint32_t i = 0; i < b; ++i)
      for (std::uint32_t j = 0; j < i; ++j) addFace({{{a, b}, {a, i}, {a, j}}});
    for (std::uint32_t i = 0; i < a; ++i)
      for (std::uint32_t j = 0; j < i; ++j) addFace({{{a, b}, {i, b}, {j, b}}});
    for (std::uint32_t i = 0; i < a; ++i)
      for (std::uint32_t j = 0; j < b; ++j) addFace({{{a, b}, {i, b}, {i, j}, {a, j}}});
  }

  void addFace(const std::vector<VertexPair>& corners) {
    std::vector<ExactPoint> points;
    for (const VertexPair& corner : corners) points.push_back(difference_(corner));
    const ExactPoint normal = cross(points[1] - points[0], points[2] - points[0]);
    const Integer speed = dot(normal, velocity_), height = dot(normal, points[0]);
    if (speed == 0) return;
    isTransversal_ = true;
    bool anyLeft = false, anyRight = false;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Integer side = dot(velocity_, cross(points[i], points[(i + 1) % points.size()]));
      anyLeft = anyLeft || side > 0;
      anyRight = anyRight || side < 0;
    }
    if (anyLeft && anyRight) return;
    Time time{height * denominator_, speed};
    if (speed < 0) time = {-time.numerator, -time.denominator};
    if (time.numerator < 0) return;
    if (!first_ || time.numerator * first_->denominator < first_->numerator * time.denominator)
      first_ = std::move(time);
  }

  ExactMinkowskiDifference difference_;
  std::uint32_t sizeA_, sizeB_;
  Integer denominator_ = 1;
  ExactPoint velocity_;         ///< times denominator_
  bool isTransversal_ = false;  ///< the velocity is not parallel to every face
  std::optional<Time> first_;
};

/// Number of the faces of a difference that ExactTranslation examines.
std::size_t countFaces(std::size_t a, std::size_t b) {
  if (std::max(a, b) > kMaxFaces) return kMaxFaces + 1;
  return a * (a - 1) * (a - 2) / 6 * b + b * (b - 1) * (b - 2) / 6 * a +
         a * (a - 1) / 2 * (b * (b - 1) / 2);
}

}  // namespace

std::optional<CrossingTime> findExactCrossingTime(const MovingBody& a, const MovingBody& b) {
  if (a.motion.isRotating() || b.motion.isRotating() ||
      a.motion.acceleration != b.motion.acceleration ||
      countFaces(a.body.vertices.size(), b.body.vertices.size()) > kMaxFaces)
    return std::nullopt;
  ExactTranslation translation(a, b);
  return translation.findContactPosition();
}

bool isCrossingProved(const MovingBody& a, const MovingBody& b, double from, double to,
                      const FeatureCache& features) {
  const CrossingSearch search(a, b, from, to);
  return search.isProvedFor(features) || search.isProvedForAny();
}

}  // namespace enfilade::collision
