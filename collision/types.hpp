// The plain data that all of Enfilade's geometry speaks in.
//
// Metres, seconds, radians; right-handed, Y up; doubles. A transform's name tells its direction:
// `worldFromBody` takes a point of the body's frame to the world's frame.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>

namespace enfilade::collision {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;

/// A rigid placement: `rotation` is a unit quaternion, `translation` is in metres.
struct Pose {
  Quat rotation = Quat::Identity();
  Vec3 translation = Vec3::Zero();
};

/// A closed axis-aligned box. `min` > `max` on any axis means empty.
struct Box {
  Vec3 min = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 max = Vec3::Constant(-std::numeric_limits<double>::infinity());

  void include(const Vec3& point) {
    min = min.cwiseMin(point);
    max = max.cwiseMax(point);
  }
  void include(const Box& other) {
    min = min.cwiseMin(other.min);
    max = max.cwiseMax(other.max);
  }
  bool empty() const { return !(min.array() <= max.array()).all(); }
  Vec3 centre() const { return 0.5 * (min + max); }
  Vec3 size() const { return max - min; }
};

/// Closed boxes that share a boundary point overlap.
inline bool overlaps(const Box& a, const Box& b) {
  return a.min.x() <= b.max.x() && b.min.x() <= a.max.x() && a.min.y() <= b.max.y() &&
         b.min.y() <= a.max.y() && a.min.z() <= b.max.z() && b.min.z() <= a.max.z();
}

/// Whether `inner` lies wholly in `outer`; an empty `outer` holds nothing.
inline bool contains(const Box& outer, const Box& inner) {
  return (outer.min.array() <= inner.min.array()).all() &&
         (inner.max.array() <= outer.max.array()).all();
}

/// The box of all points within `margin` metres of `box` along each axis.
inline Box grown(const Box& box, double margin) {
  return {box.min - Vec3::Constant(margin), box.max + Vec3::Constant(margin)};
}

/// The box swept by `box` when it moves by `displacement`.
inline Box swept(const Box& box, const Vec3& displacement) {
  Box result = box;
  result.include(Box{box.min + displacement, box.max + displacement});
  return result;
}

}  // namespace enfilade::collision
