// The Minkowski difference B - A of two placed convex bodies, point by point, in extended
// precision, and its supports with a proof. Internal to the narrow phase.
//
// Rounding. `Wide` is long double; eta is its unit of rounding (2^-64 on x86-64; the bounds are
// written in eta, so they hold where long double is another type). S_A bounds the radius of A's
// vertices times the Frobenius norm of its rotation, S_B likewise, D is the greatest |coordinate|
// of t_B - t_A, and reach = S_A + S_B + D.
//  - A rotated vertex: three products, two sums. By Cauchy the products of a coordinate sum up to
//  at
//    most S, so it is off by at most 3 eta S (second order left to the slack below).
//  - t_B - t_A: eta D. Added to B's vertex: eta (S_B + D). Less A's vertex: eta reach.
//  - Together at most eta (4 S_A + 5 S_B + 3 D) a coordinate: pointError() says 6 eta reach.
// Products that underflow lose less than the least normal Wide, which no bound here comes near.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"

namespace enfilade::collision {

using Wide = long double;
using WideVec = Eigen::Matrix<Wide, 3, 1>;

inline constexpr double kUnit = 0x1p-53;  ///< of double
/// At least the length of a unit direction that is rounded a few times.
inline constexpr double kUnitLength = 1 + 16 * kUnit;
inline constexpr Wide kWideUnit = std::numeric_limits<Wide>::epsilon() / 2;

template <class Real>
constexpr Real unitOf() {
  return std::numeric_limits<Real>::epsilon() / 2;
}

/// The greatest |coordinate|.
inline double largestOf(const Vec3& v) {
  return std::max(std::max(std::abs(v.x()), std::abs(v.y())), std::abs(v.z()));
}

// By single coordinates: pairs of them, as Eigen loads them, would wait for the stores of single
// ones just made.
template <class Real>
Eigen::Matrix<Real, 3, 1> plus(const Eigen::Matrix<Real, 3, 1>& a,
                               const Eigen::Matrix<Real, 3, 1>& b) {
  return {a.x() + b.x(), a.y() + b.y(), a.z() + b.z()};
}
template <class Real>
Eigen::Matrix<Real, 3, 1> minus(const Eigen::Matrix<Real, 3, 1>& a,
                                const Eigen::Matrix<Real, 3, 1>& b) {
  return {a.x() - b.x(), a.y() - b.y(), a.z() - b.z()};
}
template <class Real>
Eigen::Matrix<Real, 3, 1> times(const Eigen::Matrix<Real, 3, 1>& a, Real factor) {
  return {a.x() * factor, a.y() * factor, a.z() * factor};
}
template <class Real>
Real dot(const Eigen::Matrix<Real, 3, 1>& a, const Eigen::Matrix<Real, 3, 1>& b) {
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}
template <class Real>
Real lengthOf(const Eigen::Matrix<Real, 3, 1>& a) {
  return std::sqrt(dot(a, a));
}

/// Of the vertices, from the body's origin, in metres; none where a coordinate is none.
double greatestRadius(const ConvexBody& body);
inline double radiusOf(const ConvexBody& body) {
  return body.hull && !body.vertices.empty() ? body.hull->radius : greatestRadius(body);
}

/// Of the Frobenius norm: sqrt(x) <= (x / c + c) / 2 for any c, and equal at x = c^2, which is 3
/// for a rotation.
inline double normBound(const Mat3& rotation) {
  constexpr double c = 1.7320508075688774;
  return rotation.squaredNorm() * (0.5 / c) + 0.5 * c;
}

/// One body, ready to be asked: the bounds that the proofs need.
struct PlacedBody {
  const ConvexBody* body;
  double size;  ///< S of the file's head, metres

  explicit PlacedBody(const ConvexBody& placed)
      : body(&placed),
        size(radiusOf(placed) * (placed.rotation ? normBound(*placed.rotation) : 1) *
             (1 + 32 * kUnit)) {}
  std::uint32_t vertexCount() const { return static_cast<std::uint32_t>(body->vertices.size()); }
  /// A point of the body's frame turned to world axes, not moved.
  template <class Real>
  Eigen::Matrix<Real, 3, 1> turned(Real x, Real y, Real z) const {
    if (!body->rotation) return {x, y, z};
    const Mat3& r = *body->rotation;
    return {r(0, 0) * x + r(0, 1) * y + r(0, 2) * z, r(1, 0) * x + r(1, 1) * y + r(1, 2) * z,
            r(2, 0) * x + r(2, 1) * y + r(2, 2) * z};
  }
  WideVec turned(const WideVec& p) const { return turned<Wide>(p.x(), p.y(), p.z()); }
  template <class Real>
  Eigen::Matrix<Real, 3, 1> turned(std::uint32_t i) const {
    const Vec3& p = body->vertices[i];
    return turned<Real>(p.x(), p.y(), p.z());
  }
  /// A direction of the world's axes, in the body's: n . (R p) = (R^T n) . p.
  template <class Real>
  Eigen::Matrix<Real, 3, 1> bodyFromWorld(const Eigen::Matrix<Real, 3, 1>& n) const {
    if (!body->rotation) return n;
    const Mat3& r = *body->rotation;
    const Real x = n.x(), y = n.y(), z = n.z();
    return {r(0, 0) * x + r(1, 0) * y + r(2, 0) * z, r(0, 1) * x + r(1, 1) * y + r(2, 1) * z,
            r(0, 2) * x + r(1, 2) * y + r(2, 2) * z};
  }
};

/// Throws std::invalid_argument naming what is not.
void requireFinite(const ConvexBody& a, const ConvexBody& b);

struct MinkowskiDifference {
  PlacedBody a, b;
  Vec3 roundedShift;  ///< t_B - t_A in doubles
  double reach;       ///< bounds every |coordinate| of a point of B - A, with room

  MinkowskiDifference(const ConvexBody& bodyA, const ConvexBody& bodyB)
      : a(bodyA),
        b(bodyB),
        roundedShift(minus(bodyB.translation, bodyA.translation)),
        reach((a.size + b.size + largestOf(roundedShift)) * (1 + 8 * kUnit)) {
    if (!(reach + 0 * (roundedShift.x() + roundedShift.y() + roundedShift.z()) <
          std::numeric_limits<double>::infinity())) [[unlikely]]
      requireFinite(bodyA, bodyB);
  }

  /// t_B - t_A.
  WideVec shift() const {
    const Vec3 &from = a.body->translation, &to = b.body->translation;
    return {Wide{to.x()} - from.x(), Wide{to.y()} - from.y(), Wide{to.z()} - from.z()};
  }
  template <class Real>
  Eigen::Matrix<Real, 3, 1> point(VertexPair pair) const {
    if constexpr (std::is_same_v<Real, double>) {
      return minus(plus(b.turned<double>(pair.b), roundedShift), a.turned<double>(pair.a));
    } else {
      return b.turned<Real>(pair.b) + shift() - a.turned<Real>(pair.a);
    }
  }
  WideVec operator()(VertexPair pair) const { return point<Wide>(pair); }
  /// Of any coordinate of a point in Wide.
  Wide pointError() const { return 6 * kWideUnit * reach; }
};

/// Whether products of six coordinates, and what little they differ by, stay in the range of
/// doubles; outside it the search begins in extended precision.
inline bool fitsDoubles(const MinkowskiDifference& difference) {
  return difference.reach > 0x1p-160 && difference.reach < 0x1p160;
}

/// Where a climb in doubles ends: a vertex that no neighbour exceeds, or one that is far enough up.
struct Summit {
  std::uint32_t vertex = 0;
  double along = 0;
  bool alone = false;  ///< proved: no other vertex is as far
};

/// The summits of A along a direction and of B against it: the point of B - A least along it, up to
/// rounding, or one that is enough.
struct Summits {
  Summit a, b;
  VertexPair pair() const { return {a.vertex, b.vertex}; }
  bool alone() const { return a.alone && b.alone; }
};
/// `enough` as for climb() below.
void climb(const MinkowskiDifference& difference, const Vec3& direction, double length,
           VertexPair hint, double enough, Summits& summits);
inline Summits climb(const MinkowskiDifference& difference, const Vec3& direction, double length,
                     VertexPair hint) {
  Summits summits;
  climb(difference, direction, length, hint, std::numeric_limits<double>::infinity(), summits);
  return summits;
}

/// direction . w of the summits in doubles, and what every w of B - A has at least: nothing where a
/// summit is not alone.
struct Along {
  double value = 0;
  double bound = -std::numeric_limits<double>::infinity();
};
inline Along alongOf(const MinkowskiDifference& difference, const Vec3& direction, double length,
                     const Summits& summits) {
  Along along{dot(direction, difference.roundedShift) - summits.b.along - summits.a.along};
  // Each product is off by half a slack, 8u length (S_A + S_B) together; the shift's own rounding,
  // its product and the two differences by less than three times as much again.
  if (summits.alone()) along.bound = along.value - 40 * kUnit * length * difference.reach;
  return along;
}

/// The point of B - A least along a direction, and the proof.
struct Least {
  VertexPair pair;
  Wide along = 0;  ///< direction . w(pair)
  Wide bound = 0;  ///< direction . w >= bound for every w of B - A, exactly
};

/// A direction in both bodies' frames, which costs less than to turn more than two vertices.
struct TurnedDirection {
  const MinkowskiDifference& difference;
  Vec3 rounded;   ///< the direction
  double length;  ///< at least that of both
  WideVec inA, inB;
  Wide alongShift;

  TurnedDirection(const MinkowskiDifference& of, const WideVec& direction, const Vec3& inDoubles,
                  double atLeast)
      : difference(of),
        rounded(inDoubles),
        length(atLeast),
        inA(of.a.bodyFromWorld<Wide>(direction)),
        inB(of.b.bodyFromWorld<Wide>(direction)),
        alongShift(direction.dot(of.shift())) {}
  /// direction . w(pair), off by less than error().
  Wide along(VertexPair pair) const {
    const Vec3 &a = difference.a.body->vertices[pair.a], &b = difference.b.body->vertices[pair.b];
    return alongShift + (inB.x() * b.x() + inB.y() * b.y() + inB.z() * b.z()) -
           (inA.x() * a.x() + inA.y() * a.y() + inA.z() * a.z());
  }
  /// A point of B - A is off by 6 eta reach a coordinate, so by 6 sqrt(3) eta reach along the
  /// direction; the product of two vectors rounds by 3 eta |d| |w|, |w| <= sqrt(3) reach. Turning
  /// the direction instead of the vertices loses less.
  Wide error() const { return 16 * kWideUnit * Wide{length} * difference.reach; }
  /// `summits`: of a climb along `rounded`.
  Least least(const Summits& summits) const;
};

/// `direction`: not zero, `length` its length. `hint`: vertices to climb from; the best ones
/// afterwards.
Least leastAlong(const MinkowskiDifference& difference, const WideVec& direction, Wide length,
                 VertexPair& hint);

/// Climbs over the hull's edges from `start`, or looks at every vertex where there is no hull.
/// `slack` as for forEachFarthest(): a vertex whose neighbours are all less by it is the farthest,
/// since an exact ascent would go on from any other. With a hull, ends at the first vertex that is
/// farther than the first one by `enough` (along the direction, times its length).
inline Summit climb(const PlacedBody& placed, const Vec3& direction, double slack,
                    std::uint32_t start, double enough = std::numeric_limits<double>::infinity()) {
  const std::span<const Vec3> vertices = placed.body->vertices;
  const Hull* hull = placed.body->hull;
  double second = -std::numeric_limits<double>::infinity();
  if (!hull) {
    Summit summit{0, dot(direction, vertices[0])};
    for (std::uint32_t i = 1; i < vertices.size(); ++i) {
      const double along = dot(direction, vertices[i]);
      second = std::max(second, std::min(along, summit.along));
      if (along > summit.along) summit = {i, along};
    }
    summit.alone = second < summit.along - slack;
    return summit;
  }
  Summit summit{start, dot(direction, vertices[start])};
  const double goal = summit.along + enough;
  while (true) {  // ends: `along` grows, and there are finitely many vertices
    second = -std::numeric_limits<double>::infinity();
    for (const std::uint32_t neighbour : hull->neighboursOf(summit.vertex)) {
      const double along = dot(direction, vertices[neighbour]);
      start = along > second ? neighbour : start;  // no branch: no guess of it to miss
      second = std::max(second, along);
    }
    if (!(second > summit.along)) break;
    summit.vertex = start, summit.along = second;
    if (second > goal) return summit;
  }
  summit.alone = second < summit.along - slack;
  return summit;
}

/// Calls visit(i) for vertices of `placed` among which is, exactly, one that is farthest along a
/// direction; `direction` is that one in the body's frame, rounded to double, `summit` that of a
/// climb along it, wherever that ended.
///
/// Each product `direction . vertex` is off by less than `slack`/2 (supportSlack). From the summit
/// an exact ascent over the edges leads to the exact maximum (convexity); all its vertices have, in
/// doubles, at least the value of the summit less `slack`. So visiting all vertices that are linked
/// to the summit by such ones is enough.
template <class Visit>
void forEachFarthest(const PlacedBody& placed, const Vec3& direction, double slack,
                     const Summit& summit, Visit visit) {
  if (summit.alone) return visit(summit.vertex);

  const std::span<const Vec3> vertices = placed.body->vertices;
  const double least = summit.along - slack;
  const auto visitAllAbove = [&] {
    for (std::uint32_t i = 0; i < vertices.size(); ++i)
      if (!(dot(direction, vertices[i]) < least)) visit(i);
  };
  const Hull* hull = placed.body->hull;
  if (!hull) return visitAllAbove();
  std::array<std::uint32_t, 64> reached;  // enough, except on nearly flat caps
  reached[0] = summit.vertex;
  std::size_t count = 1;
  for (std::size_t k = 0; k < count; ++k) {
    std::size_t end = count;  // behind it those that are high enough, picked without a branch
    for (const std::uint32_t neighbour : hull->neighboursOf(reached[k])) {
      if (end == reached.size()) return visitAllAbove();
      reached[end] = neighbour;
      end += dot(direction, vertices[neighbour]) < least ? 0 : 1;
    }
    for (std::size_t picked = count; picked < end; ++picked) {
      const auto known = reached.begin() + count;
      if (std::find(reached.begin(), known, reached[picked]) == known)
        reached[count++] = reached[picked];
    }
  }
  for (std::size_t k = 0; k < count; ++k) visit(reached[k]);
}

/// With u = 2^-53: a direction that is off by 4u `length` (rounded, or truncated from integers),
/// and its product with a vertex, off by 3u `length` |p|: less than 8u `length` S together; the
/// slack is twice that. `length`: at least that of the direction, in the world's and in the body's
/// frame.
inline double supportSlack(const PlacedBody& placed, double length) {
  return 16 * kUnit * length * placed.size + std::numeric_limits<double>::min();
}

}  // namespace enfilade::collision
