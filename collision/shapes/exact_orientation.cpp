// Filtered predicates after J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast
// Robust Geometric Predicates" (1997). The error of a determinant of differences is at most a small
// multiple of its permanent. His bounds hold only without underflow and overflow. The filters
// therefore accept only determinants of differences below kMaxDifference that also exceed
// kUnderflow. If a filter cannot decide, three further stages follow in this order:
// 1. integers of 62 bits at a common scale, if the differences are exact (axis-aligned faces);
// 2. the same filter in extended precision, which decides the corners of rotated flat faces;
// 3. integers of arbitrary length (GMP).
#include "collision/shapes/exact_orientation.hpp"

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"

namespace enfilade::collision {
namespace {

template <class Real>  // Shewchuk's o3derrboundA
constexpr Real kBound3 = (7 + 56 * getUnitRoundoff<Real>()) * getUnitRoundoff<Real>();
template <class Real>  // and ccwerrboundA
constexpr Real kBound2 = (3 + 16 * getUnitRoundoff<Real>()) * getUnitRoundoff<Real>();
// Six products of two factors below 1e90 lose less than 6 * 2^-1074 to underflow. Multiplied by a
// third factor, the loss stays below 1e-230.
constexpr double kMaxDifference = 1e90;
constexpr double kUnderflow = 1e-220;

/// Computes `value` * `scale`. True if it is an integer and nothing was lost to underflow.
bool toInteger(double value, double scale, std::int64_t& integer) {
  const double scaled = value * scale;
  integer = static_cast<std::int64_t>(scaled);
  return static_cast<double>(integer) == scaled && (integer != 0 || value == 0);
}

/// Sign of u . (v x w) if the nine numbers are multiples of one power of two by less than 2^62, and
/// nullopt otherwise. 192 bits then hold all sums of triple products.
std::optional<int> computeSignInFixedPoint(const Vec3& u, const Vec3& v, const Vec3& w,
                                           double largest) {
  __extension__ typedef __int128 Int128;
  int exponent = 0;
  std::frexp(largest, &exponent);  // largest < 2^exponent
  if (exponent < -900 || exponent > 900) return std::nullopt;
  const double scale = std::ldexp(1.0, 62 - exponent);
  std::array<std::array<std::int64_t, 3>, 3> n{};
  const std::array<const Vec3*, 3> rows{&u, &v, &w};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!toInteger((*rows[row])[static_cast<Eigen::Index>(k)], scale, n[row][k]))
        return std::nullopt;
    }
  }
  Int128 high = 0;  // the sum is high * 2^64 + low
  std::uint64_t low = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    const Int128 minor = Int128{n[1][i]} * n[2][j] - Int128{n[1][j]} * n[2][i];
    const Int128 rest = Int128{static_cast<std::uint64_t>(minor)} * n[0][k];
    high += (minor >> 64) * n[0][k] + (rest >> 64);
    low += static_cast<std::uint64_t>(rest);
    if (low < static_cast<std::uint64_t>(rest)) ++high;
  }
  return high > 0 || (high == 0 && low > 0) ? 1 : high < 0 ? -1 : 0;
}

/// Sign of ux vy - uy vx if the four numbers are multiples of one power of two by less than 2^62;
/// nullopt otherwise.
std::optional<int> computeSignInFixedPoint(double ux, double uy, double vx, double vy,
                                           double largest) {
  __extension__ typedef __int128 Int128;
  int exponent = 0;
  std::frexp(largest, &exponent);
  if (exponent < -900 || exponent > 900) return std::nullopt;
  const double scale = std::ldexp(1.0, 62 - exponent);
  std::array<std::int64_t, 4> n{};
  const std::array<double, 4> values{ux, uy, vx, vy};
  for (std::size_t i = 0; i < 4; ++i)
    if (!toInteger(values[i], scale, n[i])) return std::nullopt;
  const Int128 left = Int128{n[0]} * n[3], right = Int128{n[1]} * n[2];
  return left > right ? 1 : left < right ? -1 : 0;
}

/// True if `d`, the computed b - a, is exact: d + a (D. E. Knuth's two-sum) gives b without error.
bool isExactDifference(double d, double a, double b) {
  const double sum = d + a, rest = sum - d;
  return sum == b && (d - (sum - rest)) + (a - rest) == 0;
}

bool isExactDifference(const Vec3& difference, const Vec3& a, const Vec3& b) {
  return isExactDifference(difference.x(), a.x(), b.x()) &&
         isExactDifference(difference.y(), a.y(), b.y()) &&
         isExactDifference(difference.z(), a.z(), b.z());
}

/// Converts doubles to integers at one common scale, a power of two.
template <std::size_t N>
std::array<mpz_class, N> toCommonIntegers(const std::array<double, N>& values) {
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
    ENFILADE_ASSERT(exponent[i] >= lowest);
    result[i] = mpz_class(mantissa[i]);
    result[i] <<= static_cast<unsigned>(exponent[i] - lowest);
  }
  return result;
}

int exactOrient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto v = toCommonIntegers<12>(
      {a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), c.x(), c.y(), c.z(), d.x(), d.y(), d.z()});
  const mpz_class bx = v[3] - v[0], by = v[4] - v[1], bz = v[5] - v[2];
  const mpz_class cx = v[6] - v[0], cy = v[7] - v[1], cz = v[8] - v[2];
  const mpz_class dx = v[9] - v[0], dy = v[10] - v[1], dz = v[11] - v[2];
  const mpz_class determinant =
      dx * (by * cz - bz * cy) + dy * (bz * cx - bx * cz) + dz * (bx * cy - by * cx);
  return sgn(determinant);
}

int exactOrient2d(double ax, double ay, double bx, double by, double cx, double cy) {
  const auto v = toCommonIntegers<6>({ax, ay, bx, by, cx, cy});
  const mpz_class determinant = (v[2] - v[0]) * (v[5] - v[1]) - (v[3] - v[1]) * (v[4] - v[0]);
  return sgn(determinant);
}

/// Sign of a determinant whose error is at most `bound`; nullopt if the sign is uncertain.
template <class Real>
std::optional<int> certifySign(Real determinant, Real bound) {
  if (determinant > bound) return 1;
  if (determinant < -bound) return -1;
  return std::nullopt;
}

/// Shewchuk's filter, for differences below kMaxDifference.
template <class Real>
std::optional<int> filteredOrient3d(const Eigen::Matrix<Real, 3, 1>& u,
                                    const Eigen::Matrix<Real, 3, 1>& v,
                                    const Eigen::Matrix<Real, 3, 1>& w) {
  const Real yz = u.y() * v.z(), zy = u.z() * v.y();
  const Real zx = u.z() * v.x(), xz = u.x() * v.z();
  const Real xy = u.x() * v.y(), yx = u.y() * v.x();
  const Real determinant = w.x() * (yz - zy) + w.y() * (zx - xz) + w.z() * (xy - yx);
  const Real permanent = std::abs(w.x()) * (std::abs(yz) + std::abs(zy)) +
                         std::abs(w.y()) * (std::abs(zx) + std::abs(xz)) +
                         std::abs(w.z()) * (std::abs(xy) + std::abs(yx));
  return certifySign<Real>(determinant, kBound3<Real> * permanent + kUnderflow);
}

template <class Real>
std::optional<int> filteredOrient2d(Real ux, Real uy, Real vx, Real vy) {
  const Real left = ux * vy, right = uy * vx;
  return certifySign<Real>(left - right,
                           kBound2<Real> * (std::abs(left) + std::abs(right)) + kUnderflow);
}

}  // namespace

int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a, v = c - a, w = d - a;
  const double largest =
      std::max({u.cwiseAbs().maxCoeff(), v.cwiseAbs().maxCoeff(), w.cwiseAbs().maxCoeff()});
  if (largest < kMaxDifference) {
    if (const auto sign = filteredOrient3d<double>(u, v, w)) return *sign;
    if (isExactDifference(u, a, b) && isExactDifference(v, a, c) && isExactDifference(w, a, d)) {
      if (const auto sign = computeSignInFixedPoint(w, u, v, largest)) return *sign;
    }
    const LongVec3 longA = a.cast<LongReal>();
    const auto sign = filteredOrient3d<LongReal>(
        b.cast<LongReal>() - longA, c.cast<LongReal>() - longA, d.cast<LongReal>() - longA);
    if (sign) return *sign;
  }
  return exactOrient3d(a, b, c, d);
}

int orient2d(const Vec3& a, const Vec3& b, const Vec3& c, int dropped) {
  ENFILADE_ASSERT(dropped >= 0 && dropped < 3);
  const int i = (dropped + 1) % 3;
  const int j = (dropped + 2) % 3;
  const double ux = b[i] - a[i], uy = b[j] - a[j];
  const double vx = c[i] - a[i], vy = c[j] - a[j];
  const double largest = std::max({std::abs(ux), std::abs(uy), std::abs(vx), std::abs(vy)});
  if (largest < kMaxDifference) {
    if (const auto sign = filteredOrient2d<double>(ux, uy, vx, vy)) return *sign;
    if (isExactDifference(ux, a[i], b[i]) && isExactDifference(uy, a[j], b[j]) &&
        isExactDifference(vx, a[i], c[i]) && isExactDifference(vy, a[j], c[j])) {
      if (const auto sign = computeSignInFixedPoint(ux, uy, vx, vy, largest)) return *sign;
    }
    const auto sign = filteredOrient2d<LongReal>(LongReal{b[i]} - a[i], LongReal{b[j]} - a[j],
                                                 LongReal{c[i]} - a[i], LongReal{c[j]} - a[j]);
    if (sign) return *sign;
  }
  return exactOrient2d(a[i], a[j], b[i], b[j], c[i], c[j]);
}

bool areCollinear(const Vec3& a, const Vec3& b, const Vec3& c) {
  return orient2d(a, b, c, 0) == 0 && orient2d(a, b, c, 1) == 0 && orient2d(a, b, c, 2) == 0;
}

}  // namespace enfilade::collision
