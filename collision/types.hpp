// Basic geometric types of Enfilade: vectors, poses and axis-aligned boxes.
//
// Metres, seconds, radians; right-handed, Y up; doubles. The name of a transform states its
// direction: `worldFromBody` maps a point of the body frame to the world frame.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>

namespace enfilade::collision {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;

/// Rigid transform: `rotation` is a unit quaternion, `translation` is in metres.
struct Pose {
  Quat rotation = Quat::Identity();
  Vec3 translation = Vec3::Zero();
};

/// Closed axis-aligned bounding box. It is empty if `min` > `max` on any axis.
struct Aabb {
  Vec3 min = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 max = Vec3::Constant(-std::numeric_limits<double>::infinity());

  void include(const Vec3& point) {
    min = min.cwiseMin(point);
    max = max.cwiseMax(point);
  }
  void include(const Aabb& other) {
    min = min.cwiseMin(other.min);
    max = max.cwiseMax(other.max);
  }
  bool empty() const { return !(min.array() <= max.array()).all(); }
  Vec3 centre() const { return 0.5 * (min + max); }
  Vec3 size() const { return max - min; }
};

/// True if the closed boxes share a point. Boxes that only touch overlap.
inline bool overlaps(const Aabb& a, const Aabb& b) {
  return a.min.x() <= b.max.x() && b.min.x() <= a.max.x() && a.min.y() <= b.max.y() &&
         b.min.y() <= a.max.y() && a.min.z() <= b.max.z() && b.min.z() <= a.max.z();
}

/// True if `inner` lies entirely in `outer`. An empty `outer` contains no box.
inline bool contains(const Aabb& outer, const Aabb& inner) {
  return (outer.min.array() <= inner.min.array()).all() &&
         (inner.max.array() <= outer.max.array()).all();
}

/// `box` extended by `margin` metres in both directions of each axis.
inline Aabb inflate(const Aabb& box, double margin) {
  return {box.min - Vec3::Constant(margin), box.max + Vec3::Constant(margin)};
}

/// Squared distance of two boxes, m^2, rounded; 0 if they overlap.
inline double computeSquaredGap(const Aabb& a, const Aabb& b) {
  return (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(0).squaredNorm();
}

/// Distance of two boxes, metres, rounded; 0 if they overlap.
inline double computeGap(const Aabb& a, const Aabb& b) {
  return std::sqrt(computeSquaredGap(a, b));
}

/// Bounding box of the motion of `box` by `displacement` (metres).
inline Aabb computeSweptAabb(const Aabb& box, const Vec3& displacement) {
  Aabb result = box;
  result.include(Aabb{box.min + displacement, box.max + displacement});
  return result;
}

}  // namespace enfilade::collision
