// The filters are those of J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast
// Robust Geometric Predicates" (1997): a determinant of differences is off by at most a small
// multiple of its permanent. His bounds hold while nothing under- or overflows; the filters below
// therefore trust only determinants of differences below kLargeDifference that exceed kUnderflow
// besides. What they cannot decide is decided with the coordinates scaled to common integers.

#include "collision/exact_orientation.hpp"

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace enfilade::collision {
namespace {

constexpr double kEpsilon = 0x1p-53;
constexpr double kBound3 = (7.0 + 56.0 * kEpsilon) * kEpsilon;  // Shewchuk's o3derrboundA
constexpr double kBound2 = (3.0 + 16.0 * kEpsilon) * kEpsilon;  // Shewchuk's ccwerrboundA
// Six products of two factors below 1e90 lose less than 6 * 2^-1074 to underflow; times a third
// factor that stays below 1e-230.
constexpr double kLargeDifference = 1e90;
constexpr double kUnderflow = 1e-220;

/// Doubles as integers of one common scale, which is a power of two.
template <std::size_t N>
std::array<mpz_class, N> commonIntegers(const std::array<double, N>& values) {
  std::array<double, N> mantissa{};
  std::array<int, N> exponent{};
  int lowest = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < N; ++i) {
    mantissa[i] = std::ldexp(std::frexp(values[i], &exponent[i]), 53);
    if (values[i] != 0) lowest = std::min(lowest, exponent[i]);
  }
  std::array<mpz_class, N> result;
  for (std::size_t i = 0; i < N; ++i) {
    if (values[i] == 0) continue;
    result[i] = mpz_class(mantissa[i]);
    result[i] <<= static_cast<unsigned>(exponent[i] - lowest);
  }
  return result;
}

int exactOrientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto v = commonIntegers<12>(
      {a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), c.x(), c.y(), c.z(), d.x(), d.y(), d.z()});
  const mpz_class bx = v[3] - v[0], by = v[4] - v[1], bz = v[5] - v[2];
  const mpz_class cx = v[6] - v[0], cy = v[7] - v[1], cz = v[8] - v[2];
  const mpz_class dx = v[9] - v[0], dy = v[10] - v[1], dz = v[11] - v[2];
  const mpz_class determinant =
      dx * (by * cz - bz * cy) + dy * (bz * cx - bx * cz) + dz * (bx * cy - by * cx);
  return sgn(determinant);
}

int exactTurn(double ax, double ay, double bx, double by, double cx, double cy) {
  const auto v = commonIntegers<6>({ax, ay, bx, by, cx, cy});
  const mpz_class determinant = (v[2] - v[0]) * (v[5] - v[1]) - (v[3] - v[1]) * (v[4] - v[0]);
  return sgn(determinant);
}

}  // namespace

int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a;
  const Vec3 v = c - a;
  const Vec3 w = d - a;
  const double yz = u.y() * v.z(), zy = u.z() * v.y();
  const double zx = u.z() * v.x(), xz = u.x() * v.z();
  const double xy = u.x() * v.y(), yx = u.y() * v.x();
  const double determinant = w.x() * (yz - zy) + w.y() * (zx - xz) + w.z() * (xy - yx);
  const double permanent = std::abs(w.x()) * (std::abs(yz) + std::abs(zy)) +
                           std::abs(w.y()) * (std::abs(zx) + std::abs(xz)) +
                           std::abs(w.z()) * (std::abs(xy) + std::abs(yx));
  const double largest =
      std::max({u.cwiseAbs().maxCoeff(), v.cwiseAbs().maxCoeff(), w.cwiseAbs().maxCoeff()});
  if (largest < kLargeDifference) {
    const double bound = kBound3 * permanent + kUnderflow;
    if (determinant > bound) return 1;
    if (determinant < -bound) return -1;
  }
  return exactOrientation(a, b, c, d);
}

int turn(const Vec3& a, const Vec3& b, const Vec3& c, int dropped) {
  const int i = (dropped + 1) % 3;
  const int j = (dropped + 2) % 3;
  const double ux = b[i] - a[i], uy = b[j] - a[j];
  const double vx = c[i] - a[i], vy = c[j] - a[j];
  const double left = ux * vy;
  const double right = uy * vx;
  if (std::max({std::abs(ux), std::abs(uy), std::abs(vx), std::abs(vy)}) < kLargeDifference) {
    const double bound = kBound2 * (std::abs(left) + std::abs(right)) + kUnderflow;
    if (left - right > bound) return 1;
    if (left - right < -bound) return -1;
  }
  return exactTurn(a[i], a[j], b[i], b[j], c[i], c[j]);
}

bool collinear(const Vec3& a, const Vec3& b, const Vec3& c) {
  return turn(a, b, c, 0) == 0 && turn(a, b, c, 1) == 0 && turn(a, b, c, 2) == 0;
}

}  // namespace enfilade::collision
