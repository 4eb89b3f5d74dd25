// Steps
//  1. Translation: every product is two doubles exactly (Dekker 1971, no fused multiply-add), all
//  of
//     them are added to an expansion without loss (Shewchuk 1997, Grow-Expansion), and the two
//     leading components of it are kept; the others bound what is missing.
//  2. Rotation: Rodrigues' formula in long double, with sine and cosine of our own (libm's differ
//     between processors), rounded to doubles once.
//
// Error of a turned point, eta the unit of rounding of long double (2^-64 on x86-64), u = 2^-53:
// the axis is off by 4 eta a coordinate, sine and cosine by 8 eta besides the angle, so each of the
// nine entries is off by less than 32 eta and the matrix (Frobenius) by less than 96 eta; the
// angle, a length times a time, is off by 4 eta times itself; the product with the first rotation
// by 6 eta |rotation|; and rounding to doubles by u |rotation|. Together, with |.| of Frobenius,
// less than (u + (128 + 8 angle) eta) |rotation| radius.
#include "collision/motion/moving_pose.hpp"

#include <array>
#include <cmath>

namespace enfilade::collision {
namespace {

using Wide = long double;
using WideMat = Eigen::Matrix<Wide, 3, 3>;

constexpr double kUnit = 0x1p-53;
constexpr double kWideUnit = static_cast<double>(std::numeric_limits<Wide>::epsilon() / 2);
constexpr double kMostRadians = 1e6;  // q * kHalfPi[0] below stays exact up to 2^31 quarter turns
constexpr double kTiny = 0x1p-900;    // the error term of a smaller product may underflow

// pi/2 in three parts of 33 bits.
constexpr std::array<double, 3> kHalfPi{0x1.921fb544p+0, 0x1.0b4611a6p-34, 0x1.3198a2ep-69};

/// a + b == sum + error (Knuth).
double twoSum(double a, double b, double& error) {
  const double sum = a + b;
  const double back = sum - a;
  error = (a - (sum - back)) + (b - back);
  return sum;
}

/// a * b == product + error (Dekker), short of underflow and overflow.
double twoProduct(double a, double b, double& error) {
  const auto upper = [](double x) {
    const double big = 0x1.0000002p27 * x;
    return big - (big - x);
  };
  const double product = a * b;
  const double a1 = upper(a), b1 = upper(b);
  const double a2 = a - a1, b2 = b - b1;
  error = a2 * b2 - (((product - a1 * b1) - a2 * b1) - a1 * b2);
  return product;
}

/// A sum kept without loss: components that do not overlap, least first.
class Expansion {
 public:
  void add(double term) {
    int kept = 0;
    for (int i = 0; i < size_; ++i) {
      double error = 0;
      term = twoSum(term, parts_[i], error);
      if (error != 0) parts_[kept++] = error;
    }
    parts_[kept++] = term;
    size_ = kept;
  }

  void addProduct(double a, double b) {
    double error = 0;
    const double product = twoProduct(a, b, error);
    if (a != 0 && b != 0 && std::abs(product) < kTiny) lost_ += 2 * kTiny * kUnit * kUnit;
    add(error);
    add(product);
  }

  void addProduct(double a, double b, double c) {
    double error = 0;
    const double product = twoProduct(a, b, error);
    if (a != 0 && b != 0 && std::abs(product) < kTiny)
      lost_ += 2 * kTiny * kUnit * kUnit * std::abs(c);
    addProduct(product, c);
    addProduct(error, c);
  }

  TwoDoubles rounded() const {
    TwoDoubles result;
    double rest = lost_;
    for (int i = size_ - 1; i >= 0; --i) {
      double error = 0;
      result.high = twoSum(result.high, parts_[i], error);
      double smaller = 0;
      result.low = twoSum(result.low, error, smaller);
      rest += std::abs(smaller);
    }
    double error = 0;
    result.high = twoSum(result.high, result.low, error);
    result.low = error;
    result.rest = rest * (1 + 32 * kUnit);
    return result;
  }

 private:
  std::array<double, 32> parts_{};  // travelled() adds 18 terms
  int size_ = 0;
  double lost_ = 0;
};

struct SineAndCosine {
  Wide sine, cosine;
};

/// Taylor's polynomials; |x| <= pi/4 leaves less than eta.
SineAndCosine ofSmallAngle(Wide x) {
  const Wide q = x * x;
  Wide sine = 0, cosine = 0;
  for (int n = 25; n >= 3; n -= 2) sine = (1 + sine) * (-q / static_cast<Wide>(n * (n - 1)));
  for (int n = 26; n >= 2; n -= 2) cosine = (1 + cosine) * (-q / static_cast<Wide>(n * (n - 1)));
  return {x * (1 + sine), 1 + cosine};
}

/// 0 <= angle <= kMostRadians: reduced by whole quarter turns.
SineAndCosine sineAndCosine(Wide angle) {
  const auto quarters = static_cast<long>(angle * Wide{0.63661977236758134308L} + Wide{0.5L});
  Wide rest = angle;
  for (const double part : kHalfPi) rest -= static_cast<Wide>(quarters) * static_cast<Wide>(part);
  const auto [s, c] = ofSmallAngle(rest);
  switch (quarters % 4) {
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

Wide wideNorm(const Eigen::Matrix<Wide, 3, 1>& v) {
  return std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z());
}

Mat3 rotationOf(const ConvexBody& body) {
  return body.rotation ? *body.rotation : Mat3(Mat3::Identity());
}

}  // namespace

Mat3 turned(const Mat3& rotation, const Vec3& angularVelocity, double time) {
  if (angularVelocity.isZero(0) || time == 0) return rotation;
  const Eigen::Matrix<Wide, 3, 1> omega = angularVelocity.cast<Wide>();
  const Wide speed = wideNorm(omega);
  const Wide angle = speed * static_cast<Wide>(time);
  if (!(angle <= static_cast<Wide>(kMostRadians))) return rotation;  // turningError() is infinite
  const Eigen::Matrix<Wide, 3, 1> k = omega / speed;
  const auto [s, c] = sineAndCosine(angle);
  WideMat turn = (1 - c) * (k * k.transpose()) + c * WideMat::Identity();
  turn(0, 1) -= s * k.z(), turn(1, 0) += s * k.z();
  turn(0, 2) += s * k.y(), turn(2, 0) -= s * k.y();
  turn(1, 2) -= s * k.x(), turn(2, 1) += s * k.x();
  const WideMat product = turn * rotation.cast<Wide>();
  return product.cast<double>();
}

double turningError(const Mat3& rotation, const Vec3& angularVelocity, double time, double radius) {
  if (angularVelocity.isZero(0) || time == 0) return 0;
  const double angle = angularVelocity.norm() * time * (1 + 8 * kUnit);
  if (!(angle <= kMostRadians * (1 - 64 * kUnit))) return std::numeric_limits<double>::infinity();
  const double size = rotation.norm() * radius * (1 + 16 * kUnit);
  return (kUnit + (128 + 8 * angle) * kWideUnit) * size;
}

double radiusOf(const ConvexBody& body, bool placed) {
  const bool turn = placed && body.rotation;
  const double stretch =
      turn ? body.rotation->norm() : 0;  // a product is off by 3u of it times |v|
  double radius = 0;
  for (const Vec3& v : body.vertices) {
    const Vec3 r = turn ? Vec3(*body.rotation * v) : v;
    radius = std::max(radius, r.norm() + 4 * kUnit * stretch * v.norm());
  }
  return radius * (1 + 16 * kUnit);
}

TwoDoubles travelled(Difference place, Difference velocity, Difference acceleration, double time) {
  Expansion sum;
  sum.add(place.to);
  sum.add(-place.from);
  sum.addProduct(velocity.to, time);
  sum.addProduct(-velocity.from, time);
  sum.addProduct(acceleration.to, time, time / 2);
  sum.addProduct(-acceleration.from, time, time / 2);
  return sum.rounded();
}

PairAtTime::PairAtTime(const MovingBody& a, const MovingBody& b, double time)
    : rotationA_(turned(rotationOf(a.body), a.motion.angularVelocity, time)),
      rotationB_(turned(rotationOf(b.body), b.motion.angularVelocity, time)),
      a_(a.body),
      b_(b.body) {
  if (a.motion.turns() || a.body.rotation) a_.rotation = &rotationA_;
  if (b.motion.turns() || b.body.rotation) b_.rotation = &rotationB_;
  for (int k = 0; k < 3; ++k) {
    const TwoDoubles apart = travelled({b.body.translation[k], a.body.translation[k]},
                                       {b.motion.velocity[k], a.motion.velocity[k]},
                                       {b.motion.acceleration[k], a.motion.acceleration[k]}, time);
    b_.translation[k] = apart.high;
    a_.translation[k] = -apart.low;
    error_ += apart.rest;
  }
  const auto turning = [&](const MovingBody& moving) {
    return turningError(rotationOf(moving.body), moving.motion.angularVelocity, time,
                        radiusOf(moving.body, false));
  };
  error_ += turning(a);
  error_ += turning(b);
  error_ *= 1 + 8 * kUnit;
}

}  // namespace enfilade::collision
