// Smooth motion for the tests, by + - * / and sqrt only, so that it is identical on every machine.
#pragma once

#include <cmath>

#include "collision/types.hpp"

namespace enfilade::collision::testing {

/// Between -1 and 1, continuous, period 4: 0 at 0, 1 at 1, -1 at 3.
inline double computeWave(double t) {
  const double phase = t - 4 * std::floor(t / 4);
  const double x = phase < 1 ? phase : phase < 3 ? 2 - phase : phase - 4;
  return x * (1.5 - 0.5 * x * x);
}

/// A rotation about `axis` that grows with t; by t radians for small t.
inline Mat3 computeRotationAt(double t, const Vec3& axis) {
  const Vec3 half = axis.normalized() * (t / 2);
  return Quat(1, half.x(), half.y(), half.z()).normalized().toRotationMatrix();
}

}  // namespace enfilade::collision::testing
