// Separating planes of one convex body that translates among many obstacles. A plane that proves a
// miss of one obstacle usually proves it of the obstacle's neighbours, too. A wall of a thousand
// triangles thus costs one support of the body and a thousand tests of some nanoseconds.
#pragma once

#include <array>
#include <cstddef>

#include "collision/shapes/placed_convex.hpp"

namespace enfilade::collision {

/// The planes found in one shape cast of a body A, or in one search around it.
class SeparatingPlanes {
 public:
  /// For the translation of `a` by `displacement`, which must keep `distance`; metres, world.
  /// `a` must outlive this.
  SeparatingPlanes(const PlacedConvex& a, const Vec3& displacement, double distance)
      : a_(a), displacement_(displacement), distance_(distance) {}

  /// Only this part of the displacement is left, or a smaller distance is asked; metres, world.
  void reduceTo(const Vec3& displacement, double distance);

  /// True if a plane proves that A keeps more than the distance from everything in `box` during the
  /// whole motion. False proves nothing.
  bool haveMissed(const Aabb& box);

  /// The same for a stationary body in `boxOfB`.
  bool haveMissed(const PlacedConvex& b, const Aabb& boxOfB);

  /// The same by the plane across `axis` (from A to B, any length; zero: unknown), which is kept if
  /// it proves the miss.
  bool tryAxis(const PlacedConvex& b, const Aabb& boxOfB, const Vec3& axis);

 private:
  struct Plane {     // not initialised: most casts need few of them
    Vec3 normal;     ///< from A to B, unit up to rounding
    double support;  ///< metres: A's rounded maximum along it
    double height;   ///< metres: the motion misses what lies above it
  };
  static constexpr std::size_t kMaxPlanes = 8;

  Plane makePlane(const Vec3& axis) const;
  double computeHeight(const Plane& plane) const;
  template <class Misses>
  bool isAny(const Misses& misses);

  const PlacedConvex& a_;
  Vec3 displacement_;
  double distance_;
  std::array<Plane, kMaxPlanes> planes_;
  std::size_t size_ = 0;
  std::size_t last_ = 0;  ///< of the last miss: neighbours come one after the other
  std::size_t next_ = 0;  ///< to be replaced when all are in use
};

}  // namespace enfilade::collision
