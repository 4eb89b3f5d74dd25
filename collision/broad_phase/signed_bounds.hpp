// Boxes by half-axes, on which every question about overlap is one comparison.
#pragma once

#include <array>
#include <cstring>

#include "collision/types.hpp"

namespace enfilade::collision {

/// A closed interval has two ends and space three axes: six half-axes, -x -y -z +x +y +z. On each a
/// mover has a reach (how far its box goes: -min, or max) and a still box has an onset (from which
/// reach on it is met: -max, or min). Boxes overlap exactly if every onset <= the reach beside it.
using HalfAxes = std::array<double, 6>;

inline HalfAxes reachOf(const Box& box) {
  return {-box.min.x(), -box.min.y(), -box.min.z(), box.max.x(), box.max.y(), box.max.z()};
}
inline HalfAxes onsetOf(const Box& box) {
  return {-box.max.x(), -box.max.y(), -box.max.z(), box.min.x(), box.min.y(), box.min.z()};
}
inline Box boxOfOnset(const HalfAxes& o) {
  return {Vec3(o[3], o[4], o[5]), Vec3(-o[0], -o[1], -o[2])};
}

// Two half-axes at once, in a form that gcc and clang know on every processor. A comparison gives
// -1 where it holds and 0 elsewhere.
using Lanes = double __attribute__((vector_size(16)));
using LaneMask = long long __attribute__((vector_size(16)));

inline Lanes lanesAt(const double* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

/// One bit a lane. Of one comparison: gcc 12 takes masks that are combined apart, lane by lane.
inline unsigned bitsOf(LaneMask mask) {
#ifdef __SSE2__
  return static_cast<unsigned>(__builtin_ia32_movmskpd(reinterpret_cast<Lanes>(mask)));
#else
  return static_cast<unsigned>((mask[0] & 1) | (mask[1] & 2));
#endif
}

/// Bit k: a[k] > b[k].
inline unsigned beyond(const HalfAxes& a, const HalfAxes& b) {
  return bitsOf(lanesAt(&a[0]) > lanesAt(&b[0])) | bitsOf(lanesAt(&a[2]) > lanesAt(&b[2])) << 2 |
         bitsOf(lanesAt(&a[4]) > lanesAt(&b[4])) << 4;
}

inline bool meets(const HalfAxes& onset, const HalfAxes& reach) {
  return beyond(onset, reach) == 0;
}

/// The same of two boxes by their reach: a sum has the sign of the difference of the coordinates,
/// exactly.
inline bool overlapping(const HalfAxes& a, const HalfAxes& b) {
  const unsigned inXY =
      bitsOf(lanesAt(&a[0]) + lanesAt(&b[3]) >= 0) & bitsOf(lanesAt(&b[0]) + lanesAt(&a[3]) >= 0);
  const unsigned inZ = unsigned{a[2] + b[5] >= 0} & unsigned{b[2] + a[5] >= 0};  // no branch
  return (unsigned{inXY == 3} & inZ) != 0;
}

}  // namespace enfilade::collision
