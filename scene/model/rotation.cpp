// Reduces an angle to +-45 degrees by quarter turns (exact in doubles, as fmod is exact), then
// evaluates the Taylor polynomials of sine and cosine about 0. Their remainder at pi/4 is below
// 1e-17.
#include "scene/model/rotation.hpp"

#include <cmath>

namespace enfilade::scene {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295;

double sine(double x) {
  const double q = x * x;
  double sum = 0;
  for (int n = 17; n >= 3; n -= 2) sum = (1 + sum) * (-q / (n * (n - 1)));
  return x * (1 + sum);
}

double cosine(double x) {
  const double q = x * x;
  double sum = 0;
  for (int n = 18; n >= 2; n -= 2) sum = (1 + sum) * (-q / (n * (n - 1)));
  return 1 + sum;
}

struct SineAndCosine {
  double sine, cosine;
};

/// For any finite angle; quarter turns are removed in degrees, where they are exact.
SineAndCosine computeSineAndCosine(double degrees) {
  double rest = std::fmod(degrees, 360.0);
  int quarters = 0;
  while (rest > 45) rest -= 90, ++quarters;
  while (rest < -45) rest += 90, --quarters;
  const double c = cosine(rest * kRadiansPerDegree);
  const double s = sine(rest * kRadiansPerDegree);
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

collision::Vec3 makeHeadingFromDegrees(double degrees) {
  const auto [s, c] = computeSineAndCosine(degrees);
  return {c, 0, -s};
}

collision::Quat makeAxisRotation(const collision::Vec3& axis, double radians) {
  if (radians == 0) return collision::Quat::Identity();
  const auto [s, c] = computeSineAndCosine(0.5 * radians / kRadiansPerDegree);
  return {c, s * axis.x(), s * axis.y(), s * axis.z()};
}

}  // namespace enfilade::scene
