// The Minkowski difference B - A of two placed convex bodies, point by point, in extended
// precision, and its supports with a proof. Internal to the narrow phase.
//
// Rounding. `Wide` is long double; eta is its unit of rounding (2^-64 on x86-64; the bounds are
// written in eta, so they hold where long double is another type). S_A bounds the radius of A's
// vertices times the greatest norm of a row or a column of its rotation, S_B likewise, D is the
// greatest |coordinate| of t_B - t_A, and reach = S_A + S_B + D.
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

#include "collision/hull.hpp"
#include "collision/narrow_phase.hpp"

namespace enfilade::collision {

using Wide = long double;
using WideVec = Eigen::Matrix<Wide, 3, 1>;

inline constexpr double kUnit = 0x1p-53;  ///< of double
inline constexpr Wide kWideUnit = std::numeric_limits<Wide>::epsilon() / 2;

/// One body, ready to be asked: the bounds that the proofs need.
struct PlacedBody {
  const ConvexBody* body;
  double size;  ///< S of the file's head, metres

  explicit PlacedBody(const ConvexBody& placed);
  std::uint32_t vertexCount() const { return static_cast<std::uint32_t>(body->vertices.size()); }
  /// The vertex turned to world axes, not moved.
  WideVec turned(std::uint32_t i) const;
  /// A direction of the world's axes, in the body's.
  Vec3 bodyFromWorld(const Vec3& direction) const;
};

/// A support of one body. `best` is the vertex that rounded arithmetic finds farthest along the
/// direction, and `most` its coordinate along it in Wide.
struct BodySupport {
  std::uint32_t best = 0;
  Wide most = 0;
};

struct MinkowskiDifference {
  PlacedBody a, b;
  WideVec shift;  ///< t_B - t_A
  double reach;   ///< bounds every |coordinate| of a point of B - A, with room

  MinkowskiDifference(const ConvexBody& bodyA, const ConvexBody& bodyB);

  WideVec pointA(std::uint32_t i) const { return a.turned(i); }
  WideVec pointB(std::uint32_t i) const { return b.turned(i) + shift; }
  WideVec operator()(VertexPair pair) const { return pointB(pair.b) - pointA(pair.a); }
  /// Of any coordinate of a point.
  Wide pointError() const { return 6 * kWideUnit * reach; }
};

/// The point of B - A least along a direction, and the proof.
struct Least {
  VertexPair pair;
  Wide along = 0;  ///< direction . w(pair)
  Wide bound = 0;  ///< direction . w >= bound for every w of B - A, exactly
};

/// `direction`: any length, not zero. `hint`: vertices to climb from; the best ones afterwards.
Least leastAlong(const MinkowskiDifference& difference, const WideVec& direction, VertexPair& hint);

/// Scaled by a power of two so that its greatest |coordinate| lies in [1/2, 1), and rounded.
Vec3 directionInDoubles(const WideVec& direction);

/// Calls visit(i) for vertices of `placed` among which is, exactly, one that is farthest along
/// `direction` (body's frame, each coordinate off by at most a few units of rounding of its
/// length); `hint` is where the climb starts, and the best vertex afterwards.
///
/// Each product `direction . vertex` is off by less than `slack`/2 (proof: supportSlack). Climb to
/// a vertex that no neighbour exceeds in doubles. From there an exact ascent over the edges leads
/// to the exact maximum (convexity); all its vertices have, in doubles, at least the value of the
/// start less `slack`. So visiting all vertices that are linked to the start by such ones is
/// enough.
template <class Visit>
void forEachFarthest(const PlacedBody& placed, const Vec3& direction, double slack,
                     std::uint32_t& hint, Visit visit) {
  const std::span<const Vec3> vertices = placed.body->vertices;
  const Hull* hull = placed.body->hull;
  if (!hull) {
    double most = -std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < vertices.size(); ++i) {
      const double along = direction.dot(vertices[i]);
      if (along > most) most = along, hint = i;
    }
    for (std::uint32_t i = 0; i < vertices.size(); ++i)
      if (direction.dot(vertices[i]) >= most - slack) visit(i);
    return;
  }

  double most = direction.dot(vertices[hint]);
  bool alone = false;
  for (bool climbing = true; climbing;) {  // ends: `most` grows, and there are finitely many
    climbing = false;
    alone = true;
    std::uint32_t next = hint;
    for (const std::uint32_t neighbour : hull->neighboursOf(hint)) {
      const double along = direction.dot(vertices[neighbour]);
      if (along >= most - slack) alone = false;
      if (along > most) most = along, next = neighbour, climbing = true;
    }
    hint = next;
  }
  visit(hint);
  if (alone) return;

  // Few vertices stand so near the maximum, except on nearly flat caps.
  std::array<std::uint32_t, 48> reached{hint};
  std::size_t count = 1;
  for (std::size_t k = 0; k < count; ++k) {
    for (const std::uint32_t neighbour : hull->neighboursOf(reached[k])) {
      if (direction.dot(vertices[neighbour]) < most - slack) continue;
      if (std::find(reached.begin(), reached.begin() + count, neighbour) != reached.begin() + count)
        continue;
      if (count == reached.size()) {
        for (std::uint32_t i = 0; i < vertices.size(); ++i)
          if (direction.dot(vertices[i]) >= most - slack) visit(i);
        return;
      }
      reached[count++] = neighbour;
      visit(neighbour);
    }
  }
}

/// For a direction made by directionInDoubles and bodyFromWorld: with u = 2^-53 and |d| < sqrt(3),
/// the direction is off by u |d| (rounded to double), its turning by 3 sqrt(3) u |d| (by Cauchy as
/// above), the product by 3 u |d| S: less than 10 u |d| S together; the slack is twice that.
inline double supportSlack(const PlacedBody& placed) {
  return 40 * kUnit * placed.size + std::numeric_limits<double>::min();
}

}  // namespace enfilade::collision
