// Reduces an angle to +-45 degrees by quarter turns, then evaluates the Taylor polynomials of sine
// and cosine about 0. Their remainders at pi/4 are below 1e-17 (double) and 2^-64 (LongReal).
// Quarter turns are exact in degrees, as fmod is exact. In radians, pi/2 is a sum of three doubles
// (W. J. Cody and W. Waite, "Software Manual for the Elementary Functions", 1980).
#include "collision/sine_cosine.hpp"

#include <array>
#include <cmath>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

// 33 bits each: their products with up to 2^31 quarter turns are exact.
constexpr std::array<double, 3> kHalfPi{0x1.921fb544p+0, 0x1.0b4611a6p-34, 0x1.3198a2ep-69};

/// |x| <= pi/4. The terms up to the power kDegree + 1 are summed.
template <int kDegree, class Real>
SineCosine<Real> sumTaylorSeries(Real x) {
  const Real q = x * x;
  Real sine = 0, cosine = 0;
  for (int n = kDegree; n >= 3; n -= 2) sine = (1 + sine) * (-q / static_cast<Real>(n * (n - 1)));
  for (int n = kDegree + 1; n >= 2; n -= 2)
    cosine = (1 + cosine) * (-q / static_cast<Real>(n * (n - 1)));
  return {x * (1 + sine), 1 + cosine};
}

template <class Real>
SineCosine<Real> addQuarterTurns(const SineCosine<Real>& at, long quarters) {
  const auto& [s, c] = at;
  switch (((quarters % 4) + 4) % 4) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

}  // namespace

SineCosine<double> computeSineCosineOfDegrees(double degrees) {
  double rest = std::fmod(degrees, 360.0);
  long quarters = 0;
  while (rest > 45) rest -= 90, ++quarters;
  while (rest < -45) rest += 90, --quarters;
  return addQuarterTurns(sumTaylorSeries<17>(rest * kRadiansPerDegree), quarters);
}

SineCosine<LongReal> computeSineCosine(LongReal radians) {
  ENFILADE_ASSERT(radians >= 0 && radians <= static_cast<LongReal>(kMaxAngle));
  const auto quarters =
      static_cast<long>(radians * LongReal{0.63661977236758134308L} + LongReal{0.5L});
  LongReal rest = radians;
  for (const double part : kHalfPi)
    rest -= static_cast<LongReal>(quarters) * static_cast<LongReal>(part);
  ENFILADE_ASSERT(std::abs(rest) < LongReal{0.7854L});
  return addQuarterTurns(sumTaylorSeries<25>(rest), quarters);
}

Quat makeAxisRotation(const Vec3& axis, double radians) {
  if (radians == 0) return Quat::Identity();
  const auto [s, c] = computeSineCosineOfDegrees(0.5 * radians / kRadiansPerDegree);
  return {c, s * axis.x(), s * axis.y(), s * axis.z()};
}

}  // namespace enfilade::collision
