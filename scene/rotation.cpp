// Reduction to +-45 degrees by whole quarter turns (exact in doubles: fmod is exact), then the
// Taylor polynomials of sine and cosine about 0, whose remainder at pi/4 is below 1e-17.
#include "scene/rotation.hpp"

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

}  // namespace

collision::Vec3 headingFromDegrees(double degrees) {
  double rest = std::fmod(degrees, 360.0);
  int quarters = 0;
  while (rest > 45) rest -= 90, ++quarters;
  while (rest < -45) rest += 90, --quarters;
  const double c = cosine(rest * kRadiansPerDegree);
  const double s = sine(rest * kRadiansPerDegree);
  switch (((quarters % 4) + 4) % 4) {
    case 0:
      return {c, 0, -s};
    case 1:
      return {-s, 0, -c};
    case 2:
      return {-c, 0, s};
    default:
      return {s, 0, c};
  }
}

}  // namespace enfilade::scene
