// Boxes as bounds on six signed axes, on which every overlap test is a single comparison.
#pragma once

#include <array>

#include "collision/double2.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

/// Bounds on the six signed axes -x -y -z +x +y +z. A dynamic box is given by its maximum endpoints
/// (-min or max), a static box by its minimum endpoints (-max or min). Two boxes overlap if and
/// only if every minimum endpoint <= the corresponding maximum endpoint.
using SignedBounds = std::array<double, 6>;

inline SignedBounds toMaxEndpoints(const Aabb& box) {
  return {-box.min.x(), -box.min.y(), -box.min.z(), box.max.x(), box.max.y(), box.max.z()};
}
inline SignedBounds toMinEndpoints(const Aabb& box) {
  return {-box.max.x(), -box.max.y(), -box.max.z(), box.min.x(), box.min.y(), box.min.z()};
}
inline Aabb makeAabbFromMinEndpoints(const SignedBounds& o) {
  return {Vec3(o[3], o[4], o[5]), Vec3(-o[0], -o[1], -o[2])};
}

/// Bit k: a[k] > b[k].
inline unsigned findGreater(const SignedBounds& a, const SignedBounds& b) {
  return toBits(loadDouble2(&a[0]) > loadDouble2(&b[0])) |
         toBits(loadDouble2(&a[2]) > loadDouble2(&b[2])) << 2 |
         toBits(loadDouble2(&a[4]) > loadDouble2(&b[4])) << 4;
}

/// Whether a[k] <= b[k] for all k.
inline bool isNoneGreater(const SignedBounds& a, const SignedBounds& b) {
  return isNoneSet(loadDouble2(&a[0]) > loadDouble2(&b[0]), loadDouble2(&a[2]) > loadDouble2(&b[2]),
                   loadDouble2(&a[4]) > loadDouble2(&b[4]));
}

/// The minimum endpoints of a box that is given by its maximum endpoints.
inline SignedBounds computeMinEndpoints(const SignedBounds& maxEndpoints) {
  return {-maxEndpoints[3], -maxEndpoints[4], -maxEndpoints[5],
          -maxEndpoints[0], -maxEndpoints[1], -maxEndpoints[2]};
}

inline bool overlaps(const SignedBounds& minEndpoints, const SignedBounds& maxEndpoints) {
  return findGreater(minEndpoints, maxEndpoints) == 0;
}

/// Overlap test of two boxes, both given by their maximum endpoints. Exact: a rounded sum has the
/// sign of the exact one.
inline bool overlapsByMaxEndpoints(const SignedBounds& a, const SignedBounds& b) {
  const unsigned inXY = toBits(loadDouble2(&a[0]) + loadDouble2(&b[3]) >= 0) &
                        toBits(loadDouble2(&b[0]) + loadDouble2(&a[3]) >= 0);
  const unsigned inZ = unsigned{a[2] + b[5] >= 0} & unsigned{b[2] + a[5] >= 0};  // no branch
  return (unsigned{inXY == 3} & inZ) != 0;
}

}  // namespace enfilade::collision
