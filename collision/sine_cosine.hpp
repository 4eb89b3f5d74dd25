// Deterministic sine and cosine, by basic arithmetic: libm's differ between processors.
#pragma once

#include "collision/floating_point.hpp"

namespace enfilade::collision {

template <class Real>
struct SineCosine {
  Real sine, cosine;
};

/// For any finite angle. Whole turns are removed in degrees, where they are exact. Within 1e-15 for
/// |degrees| up to 1e4.
SineCosine<double> computeSineCosineOfDegrees(double degrees);

inline constexpr double kRadiansPerDegree = 0.017453292519943295;
inline constexpr double kDegreesPerRadian = 57.29577951308232;
inline constexpr double kMaxAngle = 1e6;  ///< radians
/// 0 <= radians <= kMaxAngle. The error is below 8 units of rounding of LongReal.
SineCosine<LongReal> computeSineCosine(LongReal radians);

/// Rotation by `radians` (finite) about `axis` (unit). A unit quaternion within 4 ulp; exactly the
/// identity for 0.
Quat makeAxisRotation(const Vec3& axis, double radians);

}  // namespace enfilade::collision
