// Unit roundoffs and extended precision, shared by the error bounds of all rooms.
#pragma once

#include <limits>

#include "collision/types.hpp"

namespace enfilade::collision {

using LongReal = long double;
using LongVec3 = Eigen::Matrix<LongReal, 3, 1>;

template <class Real>
constexpr Real getUnitRoundoff() {
  return std::numeric_limits<Real>::epsilon() / 2;
}

inline constexpr double kRoundoff = 0x1p-53;           ///< unit roundoff of double
inline constexpr double kRoundUpFactor = 1 + 0x1p-40;  ///< exceeds a few rounding errors
inline constexpr LongReal kLongRoundoff = getUnitRoundoff<LongReal>();

}  // namespace enfilade::collision
