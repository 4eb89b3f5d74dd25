// Where two convex bodies at or near contact lean on one another: some points and one normal.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// The points lie on the supporting features (vertex, edge or face) of the two bodies: world frame,
/// metres. pointB - pointA = separation * normal, up to rounding.
struct ContactPoint {
  Vec3 pointA = Vec3::Zero();
  Vec3 pointB = Vec3::Zero();
  double separation = 0;  ///< signed; negative where they penetrate
};

struct ContactManifold {
  static constexpr std::size_t kMostPoints = 8;

  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B
  std::array<ContactPoint, kMostPoints> points;
  std::size_t size = 0;
  bool overlap = false;  ///< the features lie above one another; false: the one point is the seed's

  std::span<const ContactPoint> list() const { return {points.data(), size}; }
};

/// What is asked for. `normal` and the points are those of decide() for bodies that are separated
/// or touch, of penetrationDepth() for such that penetrate.
struct ContactSeed {
  Vec3 normal;           ///< unit, from A to B
  Vec3 pointA, pointB;   ///< closest or deepest points, world
  double limit = 0;      ///< metres, >= 0: farther points of the features are left out
  std::size_t most = 4;  ///< points wanted, 1 to kMostPoints: the deepest, and the most spread
  /// Of the faces of the bodies' hulls, unit, outwards, body's frame; none: they are worked out.
  std::span<const Vec3> normalsA = {}, normalsB = {};
};

/// At least one point if the bodies are as near as `limit` along the normal, else none. Numbers are
/// rounded: a manifold says where to push, decide() says whether they touch. A body without a hull
/// may have at most three vertices that matter (a triangle, a segment, a point); of a larger one,
/// only the vertex that is farthest along the normal is seen.
ContactManifold contactManifold(const ConvexBody& a, const ConvexBody& b, const ContactSeed& seed);

}  // namespace enfilade::collision
