// Contact manifold of two convex bodies at or near contact: up to eight points and one normal.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// A pair of points on the supporting features (vertex, edge or face) of the two bodies: world
/// frame, metres. pointB - pointA = separation * normal, up to rounding.
struct ContactPoint {
  Vec3 pointA = Vec3::Zero();
  Vec3 pointB = Vec3::Zero();
  double separation = 0;  ///< signed; negative if penetrating
};

/// The result of computeContactManifold().
struct ContactManifold {
  static constexpr std::size_t kMaxPoints = 8;

  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B
  std::array<ContactPoint, kMaxPoints> points;
  std::size_t size = 0;
  bool overlap = false;  ///< the projected features overlap; false: the only point is the input's

  std::span<const ContactPoint> activePoints() const { return {points.data(), size}; }
};

/// The input of computeContactManifold(). `normal` and the points come from computeSeparation() for
/// separated or touching bodies, and from computePenetrationDepth() for penetrating ones.
struct ManifoldInput {
  Vec3 normal;                ///< unit, from A to B
  Vec3 pointA, pointB;        ///< closest or deepest points, world
  double limit = 0;           ///< metres, >= 0: points with a larger separation are dropped
  std::size_t maxPoints = 4;  ///< maximum number of points, 1 to kMaxPoints
  /// Face normals of the bodies' hulls: unit, outward, body's frame. Empty: they are computed.
  std::span<const Vec3> normalsA = {}, normalsB = {};
};

/// Computes at least one point if the separation along the normal is at most `limit`, otherwise no
/// point. Numbers are rounded; only computeSeparation() decides contact. A body without a hull
/// should have at most three vertices (a triangle, a segment, a point); a larger one contributes
/// only its support vertex.
ContactManifold computeContactManifold(const PlacedConvex& a, const PlacedConvex& b,
                                       const ManifoldInput& input);

}  // namespace enfilade::collision
