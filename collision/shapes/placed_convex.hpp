// A convex body at a pose: the input of all queries on pairs.
#pragma once

#include <span>

#include "collision/types.hpp"

namespace enfilade::collision {

struct Hull;

/// A convex shape without a pose: the hull of `vertices` (body's frame, metres; at least one).
struct ConvexShape {
  std::span<const Vec3> vertices;
  const Hull* hull = nullptr;  ///< of exactly these vertices; null: queries scan all vertices
};

/// A convex hull at a pose, for one query: the hull of `vertices` (body's frame, metres; at least
/// one), placed at rotation * vertex + translation. All values must be finite; every query throws
/// std::invalid_argument that names the first value that is not. The doubles are used exactly: a
/// rotation that is orthonormal only up to rounding gives a very slightly sheared body.
struct PlacedConvex {
  std::span<const Vec3> vertices;
  Vec3 translation = Vec3::Zero();
  const Mat3* rotation = nullptr;  ///< worldFromBody; null: identity
  const Hull* hull = nullptr;      ///< of exactly these vertices; null: queries scan all vertices
};

/// A point of the body's frame where the pose puts it.
inline Vec3 placeVertex(const PlacedConvex& body, const Vec3& vertex) {
  return (body.rotation ? Vec3(*body.rotation * vertex) : vertex) + body.translation;
}

}  // namespace enfilade::collision
