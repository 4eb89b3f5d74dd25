// The Minkowski difference B - A of two placed convex bodies: its points in extended precision and
// its support points with certified bounds. Internal to collision/.
//
// Rounding analysis. LongReal is long double; eta is its unit roundoff (2^-64 on x86-64). The
// bounds are written in eta, so they hold for any long double. S_A is the radius of A's vertices
// times the Frobenius norm of its rotation, S_B likewise. D is the maximum |coordinate| of t_B -
// t_A, and reach = S_A + S_B + D.
//  - A rotated vertex takes three products and two sums per coordinate. By Cauchy's inequality the
//    products sum up to at most S, so the error is at most 3 eta S. Second-order terms are absorbed
//    by the slack below.
//  - t_B - t_A: eta D. Adding B's vertex: eta (S_B + D). Subtracting A's vertex: eta reach.
//  - In total at most eta (4 S_A + 5 S_B + 3 D) per coordinate; pointError() returns 6 eta reach.
// Underflowing products lose less than the smallest normal LongReal, far below every bound here.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/double2.hpp"
#include "collision/floating_point.hpp"
#include "collision/minkowski/feature_cache.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/placed_convex.hpp"

namespace enfilade::collision {

/// Upper bound on the length of a unit direction after a few roundings.
inline constexpr double kMaxUnitLength = 1 + 16 * kRoundoff;

/// The maximum |coordinate|.
inline double computeMaxAbsCoordinate(const Vec3& v) {
  return std::max(std::max(std::abs(v.x()), std::abs(v.y())), std::abs(v.z()));
}

// Scalar code on purpose: Eigen loads pairs of coordinates, which stalls store forwarding after
// scalar stores.
template <class Real>
Eigen::Matrix<Real, 3, 1> addVectors(const Eigen::Matrix<Real, 3, 1>& a,
                                     const Eigen::Matrix<Real, 3, 1>& b) {
  return {a.x() + b.x(), a.y() + b.y(), a.z() + b.z()};
}
template <class Real>
Eigen::Matrix<Real, 3, 1> subtractVectors(const Eigen::Matrix<Real, 3, 1>& a,
                                          const Eigen::Matrix<Real, 3, 1>& b) {
  return {a.x() - b.x(), a.y() - b.y(), a.z() - b.z()};
}
template <class Real>
Eigen::Matrix<Real, 3, 1> scaleVector(const Eigen::Matrix<Real, 3, 1>& a, Real factor) {
  return {a.x() * factor, a.y() * factor, a.z() * factor};
}
template <class Real>
Real dot(const Eigen::Matrix<Real, 3, 1>& a, const Eigen::Matrix<Real, 3, 1>& b) {
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}
template <class Real>
Real computeNorm(const Eigen::Matrix<Real, 3, 1>& a) {
  return std::sqrt(dot(a, a));
}

/// Upper bound on the distance (metres) of the vertices from the body's origin; NaN if a coordinate
/// is not finite. Throws std::invalid_argument if there are no vertices.
double computeRadiusBound(const PlacedConvex& convex);
inline double getRadiusBound(const PlacedConvex& convex) {
  return convex.hull && !convex.vertices.empty() ? convex.hull->radius : computeRadiusBound(convex);
}

/// Upper bound on the Frobenius norm: sqrt(x) <= (x / c + c) / 2 for any c. Equality holds at
/// x = c^2, which is 3 for a rotation.
inline double computeNormBound(const Mat3& rotation) {
  constexpr double c = 1.7320508075688774;
  return rotation.squaredNorm() * (0.5 / c) + 0.5 * c;
}

/// A placed convex with the radius that the error bounds need.
struct BoundedConvex {
  const PlacedConvex* shape;
  double radius;  ///< S of the file head, metres

  explicit BoundedConvex(const PlacedConvex& placedConvex)
      : shape(&placedConvex),
        radius(getRadiusBound(placedConvex) *
               (placedConvex.rotation ? computeNormBound(*placedConvex.rotation) : 1) *
               (1 + 32 * kRoundoff)) {}
  std::uint32_t vertexCount() const { return static_cast<std::uint32_t>(shape->vertices.size()); }
  /// Rotates a point from the body's frame to world axes; does not translate it.
  template <class Real>
  Eigen::Matrix<Real, 3, 1> rotated(Real x, Real y, Real z) const {
    if (!shape->rotation) return {x, y, z};
    const Mat3& r = *shape->rotation;
    return {r(0, 0) * x + r(0, 1) * y + r(0, 2) * z, r(1, 0) * x + r(1, 1) * y + r(1, 2) * z,
            r(2, 0) * x + r(2, 1) * y + r(2, 2) * z};
  }
  LongVec3 rotated(const LongVec3& p) const { return rotated<LongReal>(p.x(), p.y(), p.z()); }
  template <class Real>
  Eigen::Matrix<Real, 3, 1> rotated(std::uint32_t i) const {
    const Vec3& p = shape->vertices[i];
    return rotated<Real>(p.x(), p.y(), p.z());
  }
  /// Rotates a direction from world axes to the body's frame: n . (R p) = (R^T n) . p.
  template <class Real>
  Eigen::Matrix<Real, 3, 1> bodyFromWorld(const Eigen::Matrix<Real, 3, 1>& n) const {
    if (!shape->rotation) return n;
    const Mat3& r = *shape->rotation;
    const Real x = n.x(), y = n.y(), z = n.z();
    return {r(0, 0) * x + r(1, 0) * y + r(2, 0) * z, r(0, 1) * x + r(1, 1) * y + r(2, 1) * z,
            r(0, 2) * x + r(1, 2) * y + r(2, 2) * z};
  }
};

/// Throws std::invalid_argument that names the first value that is not finite.
void requireFinite(const PlacedConvex& a, const PlacedConvex& b);

/// a - b. Two coordinates are stored at once, because they are loaded at once: a load that spans
/// two recent stores waits for both.
inline Vec3 subtractAsPair(const Vec3& a, const Vec3& b) {
  Vec3 difference;
  const Double2 xy{a.x() - b.x(), a.y() - b.y()};
  std::memcpy(difference.data(), &xy, sizeof(xy));
  difference.z() = a.z() - b.z();
  return difference;
}

/// The Minkowski difference B - A of two placed convex bodies, axes as the world's, in metres.
/// The constructor throws std::invalid_argument if a coordinate is not finite.
struct MinkowskiDifference {
  BoundedConvex a, b;
  Vec3 roundedShift;  ///< t_B - t_A in doubles
  double reach;       ///< upper bound on every |coordinate| of a point of B - A

  MinkowskiDifference(const PlacedConvex& convexA, const PlacedConvex& convexB)
      : a(convexA),
        b(convexB),
        roundedShift(subtractAsPair(convexB.translation, convexA.translation)),
        reach((a.radius + b.radius + computeMaxAbsCoordinate(roundedShift)) * (1 + 8 * kRoundoff)) {
    if (!(reach + 0 * (roundedShift.x() + roundedShift.y() + roundedShift.z()) <
          std::numeric_limits<double>::infinity())) [[unlikely]]
      requireFinite(convexA, convexB);
  }

  /// t_B - t_A.
  LongVec3 shift() const {
    const Vec3 &from = a.shape->translation, &to = b.shape->translation;
    return {LongReal{to.x()} - from.x(), LongReal{to.y()} - from.y(), LongReal{to.z()} - from.z()};
  }
  template <class Real>
  Eigen::Matrix<Real, 3, 1> point(VertexPair pair) const {
    if constexpr (std::is_same_v<Real, double>) {
      return subtractVectors(addVectors(b.rotated<double>(pair.b), roundedShift),
                             a.rotated<double>(pair.a));
    } else {
      return b.rotated<Real>(pair.b) + shift() - a.rotated<Real>(pair.a);
    }
  }
  LongVec3 operator()(VertexPair pair) const { return point<LongReal>(pair); }
  /// Error bound (metres) of any coordinate of a point in LongReal.
  LongReal pointError() const { return 6 * kLongRoundoff * reach; }
};

/// Whether products of six coordinates and their rounding errors stay in the range of doubles.
/// Outside that range GJK starts in extended precision.
inline bool fitsDoubleRange(const MinkowskiDifference& difference) {
  return difference.reach > 0x1p-160 && difference.reach < 0x1p160;
}

/// The result of a hill climb in doubles: a local maximum, or a vertex that is far enough along.
struct SupportVertex {
  std::uint32_t vertex = 0;
  bool unique = false;  ///< certified: every other vertex is less far along the direction
  double projection = 0;
  double slack = 0;               ///< of the direction: computeSupportSlack()
  Vec3 direction = Vec3::Zero();  ///< in the body's frame, rounded to double
};

/// The support vertex of A along a direction and that of B against it. Up to rounding, their
/// difference is the point of B - A with the smallest projection, or one that is small enough.
struct SupportPair {
  SupportVertex a, b;
  VertexPair pair() const { return {a.vertex, b.vertex}; }
  bool isUnique() const { return a.unique && b.unique; }
};
/// `enough` as for hillClimb() below.
void hillClimbPair(const MinkowskiDifference& difference, const Vec3& direction, double length,
                   VertexPair hint, double enough, SupportPair& supports);
inline SupportPair hillClimbPair(const MinkowskiDifference& difference, const Vec3& direction,
                                 double length, VertexPair hint) {
  SupportPair supports;
  hillClimbPair(difference, direction, length, hint, std::numeric_limits<double>::infinity(),
                supports);
  return supports;
}

/// direction . w of a support pair in doubles, and a certified lower bound of direction . w over
/// B - A. The bound is minus infinity if a support vertex is not unique.
struct SupportValue {
  double value = 0;
  double bound = -std::numeric_limits<double>::infinity();
};
inline SupportValue computeSupportValue(const MinkowskiDifference& difference,
                                        const Vec3& direction, double length,
                                        const SupportPair& supports) {
  SupportValue result{dot(direction, difference.roundedShift) - supports.b.projection -
                      supports.a.projection};
  // Each product is off by half a slack, together 8u length (S_A + S_B). The shift's rounding, its
  // product and the two differences add less than three times that.
  if (supports.isUnique()) result.bound = result.value - 40 * kRoundoff * length * difference.reach;
  return result;
}

/// The point of B - A with the smallest projection on a direction, with a certified bound.
struct CertifiedSupport {
  VertexPair pair;
  LongReal projection = 0;  ///< direction . w(pair)
  LongReal lowerBound = 0;  ///< direction . w >= lowerBound for every w of B - A, exactly
};

/// A direction rotated into both bodies' frames. This is cheaper than rotating more than two
/// vertices.
struct RotatedDirection {
  const MinkowskiDifference& difference;
  double length;  ///< upper bound on the length of the direction, also as rounded to doubles
  LongVec3 inA, inB;
  LongReal shiftProjection;

  RotatedDirection(const MinkowskiDifference& minkowskiDifference, const LongVec3& direction,
                   double lengthBound)
      : difference(minkowskiDifference),
        length(lengthBound),
        inA(minkowskiDifference.a.bodyFromWorld<LongReal>(direction)),
        inB(minkowskiDifference.b.bodyFromWorld<LongReal>(direction)),
        shiftProjection(direction.dot(minkowskiDifference.shift())) {}
  /// direction . w(pair), with an error below errorBound().
  LongReal project(VertexPair pair) const {
    const Vec3 &a = difference.a.shape->vertices[pair.a], &b = difference.b.shape->vertices[pair.b];
    return shiftProjection + (inB.x() * b.x() + inB.y() * b.y() + inB.z() * b.z()) -
           (inA.x() * a.x() + inA.y() * a.y() + inA.z() * a.z());
  }
  /// A point of B - A is off by 6 eta reach per coordinate, so by 6 sqrt(3) eta reach along the
  /// direction. The dot product rounds by 3 eta |d| |w| with |w| <= sqrt(3) reach. Rotating the
  /// direction instead of the vertices loses less.
  LongReal errorBound() const { return 16 * kLongRoundoff * LongReal{length} * difference.reach; }
  /// `supports`: the result of hillClimbPair() along the direction in doubles.
  CertifiedSupport certify(const SupportPair& supports) const;
};

/// Finds the point of B - A with the smallest projection on `direction` (not zero, of length
/// `length`). `hint`: the start vertices; updated to the support vertices.
CertifiedSupport findCertifiedSupport(const MinkowskiDifference& difference,
                                      const LongVec3& direction, LongReal length, VertexPair& hint);

/// Hill climbing over the hull's edges from `start`, or a scan of all vertices if there is no hull.
/// The direction and the slack are those of `support`; sets the rest of it. A vertex that exceeds
/// all its neighbours by more than the slack is the unique maximum. From any other vertex an exact
/// ascent could continue (see forEachSupportCandidate). With a hull, the climb ends early at a
/// vertex that exceeds the start by `enough` (the unit of the dot product).
inline void hillClimb(const BoundedConvex& convex, std::uint32_t start, double enough,
                      SupportVertex& support) {
  const std::span<const Vec3> vertices = convex.shape->vertices;
  const Hull* hull = convex.shape->hull;
  const Vec3 d = support.direction;  // in registers
  double second = -std::numeric_limits<double>::infinity();
  std::uint32_t vertex = hull ? start : 0;
  ENFILADE_ASSERT(vertex < vertices.size());
  double best = dot(d, vertices[vertex]);
  bool complete = true;
  if (hull) {
    const double goal = best + enough;
    while (true) {  // terminates: the projection grows and there are finitely many vertices
      second = -std::numeric_limits<double>::infinity();
      for (const std::uint32_t neighbour : hull->getNeighbours(vertex)) {
        const double projection = dot(d, vertices[neighbour]);
        start = projection > second ? neighbour : start;  // branchless: avoids mispredictions
        second = std::max(second, projection);
      }
      if (!(second > best)) break;
      vertex = start, best = second;
      if (second > goal) {
        complete = false;
        break;
      }
    }
  } else {
    for (std::uint32_t i = 1; i < vertices.size(); ++i) {
      const double projection = dot(d, vertices[i]);
      second = std::max(second, std::min(projection, best));
      if (projection > best) vertex = i, best = projection;
    }
  }
  support.vertex = vertex;
  support.projection = best;
  support.unique = complete && second < best - support.slack;
}
inline SupportVertex hillClimb(const BoundedConvex& convex, const Vec3& direction, double slack,
                               std::uint32_t start) {
  SupportVertex support{.slack = slack, .direction = direction};
  hillClimb(convex, start, std::numeric_limits<double>::infinity(), support);
  return support;
}

/// Calls visit(i) for a set of vertices that contains the exact support vertex along the direction
/// of `support`, the result of any hill climb.
///
/// Each product `direction . vertex` is off by less than half the slack (computeSupportSlack). By
/// convexity, an exact ascent over the edges leads from the support vertex to the exact maximum.
/// All vertices of that ascent have, in doubles, at least the support's value less the slack.
/// Visiting all vertices that are connected to the support vertex through such vertices is
/// therefore sufficient.
template <class Visit>
void forEachSupportCandidate(const BoundedConvex& convex, const SupportVertex& support,
                             Visit visit) {
  if (support.unique) return visit(support.vertex);

  const std::span<const Vec3> vertices = convex.shape->vertices;
  const Vec3& direction = support.direction;
  const double threshold = support.projection - support.slack;
  const auto visitAllAbove = [&] {
    for (std::uint32_t i = 0; i < vertices.size(); ++i)
      if (!(dot(direction, vertices[i]) < threshold)) visit(i);
  };
  const Hull* hull = convex.shape->hull;
  if (!hull) return visitAllAbove();
  std::array<std::uint32_t, 64> reached;  // sufficient except on nearly flat caps
  reached[0] = support.vertex;
  std::size_t count = 1;
  for (std::size_t k = 0; k < count; ++k) {
    std::size_t end = count;  // appends the vertices above the threshold, branchless
    for (const std::uint32_t neighbour : hull->getNeighbours(reached[k])) {
      if (end == reached.size()) return visitAllAbove();
      reached[end] = neighbour;
      end += dot(direction, vertices[neighbour]) < threshold ? 0 : 1;
    }
    for (std::size_t picked = count; picked < end; ++picked) {
      const auto known = reached.begin() + count;
      if (std::find(reached.begin(), known, reached[picked]) == known)
        reached[count++] = reached[picked];
    }
  }
  for (std::size_t k = 0; k < count; ++k) visit(reached[k]);
}

/// Vertices of a hull up to which a scan of all is cheaper than a search along its edges. At most
/// the bits of a word.
inline constexpr std::size_t kMaxScannedVertices = 48;

/// One bit for each vertex whose projection in doubles is at least `threshold`; at most 64
/// vertices. Without branches: a body that rests on a face of many corners has them all as
/// candidates.
inline std::uint64_t findVerticesAbove(std::span<const Vec3> vertices, const Vec3& direction,
                                       double threshold) {
  const Double2 x = {direction.x(), direction.x()}, y = {direction.y(), direction.y()},
                z = {direction.z(), direction.z()}, limit = {threshold, threshold};
  std::size_t i = vertices.size();
  std::uint64_t above = 0;
  if (i % 2 == 1) above = dot(direction, vertices[--i]) < threshold ? 0 : 1;
  while (i > 0) {
    i -= 2;
    const double* coordinates = vertices[i].data();  // of two vertices: x y z x y z
    const Double2 xy = loadDouble2(coordinates), zx = loadDouble2(coordinates + 2),
                  yz = loadDouble2(coordinates + 4);
    const Double2 projection =
        Double2{xy[0], zx[1]} * x + Double2{xy[1], yz[0]} * y + Double2{zx[0], yz[1]} * z;
    above = above << 2 | (3 ^ toBits(projection < limit));
  }
  return above;
}

/// As forEachSupportCandidate(), in any order and possibly with more vertices. This suits a maximum
/// of values, but not a vertex, which ties would make depend on the order.
template <class Visit>
void forEachSupportValue(const BoundedConvex& convex, const SupportVertex& support, Visit visit) {
  const std::span<const Vec3> vertices = convex.shape->vertices;
  if (support.unique || vertices.size() > kMaxScannedVertices)
    return forEachSupportCandidate(convex, support, visit);
  std::uint64_t above =
      findVerticesAbove(vertices, support.direction, support.projection - support.slack);
  for (; above != 0; above &= above - 1) visit(static_cast<std::uint32_t>(std::countr_zero(above)));
}

/// Twice the error bound of a projection in doubles. With u = 2^-53, the direction is off by 4u
/// `length` (rounded, or truncated from integers) and its product with a vertex by 3u `length` |p|.
/// Together that is less than 8u `length` S. `length`: an upper bound on the length of the
/// direction, in the world's and in the body's frame.
inline double computeSupportSlack(const BoundedConvex& convex, double length) {
  return 16 * kRoundoff * length * convex.radius + std::numeric_limits<double>::min();
}

}  // namespace enfilade::collision
