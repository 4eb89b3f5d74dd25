// Steps
//  1. Translation: every product is exactly two doubles (Dekker 1971, no fused multiply-add). All
//     of them are added to an expansion without error (Shewchuk 1997, Grow-Expansion). Its two
//     leading components are kept; the others bound the error.
//  2. Rotation: Rodrigues' formula in long double, rounded to doubles once.
//
// Error of a rotated point. Let eta be the unit roundoff of long double (2^-64 on x86-64) and u =
// 2^-53. The error of the axis is 4 eta per coordinate, that of sine and cosine 8 eta, apart from
// the angle. Each of the nine entries thus has an error below 32 eta, and the matrix below 96 eta
// in the Frobenius norm |.|. The error of the angle, a length times a time, is 4 eta relative. The
// product with the first rotation adds 6 eta |rotation|, and rounding to doubles u |rotation|. The
// sum is less than (u + (128 + 8 angle) eta) |rotation| radius.
#include "collision/motion/moving_pose.hpp"

#include <array>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"
#include "collision/sine_cosine.hpp"

namespace enfilade::collision {
namespace {

using LongMat3 = Eigen::Matrix<LongReal, 3, 3>;

constexpr auto kLongUnit = static_cast<double>(kLongRoundoff);
constexpr double kTiny = 0x1p-900;  // the error term of a smaller product may underflow

/// a + b == sum + error (Knuth).
double twoSum(double a, double b, double& error) {
  const double sum = a + b;
  const double back = sum - a;
  error = (a - (sum - back)) + (b - back);
  return sum;
}

/// a * b == product + error (Dekker), barring underflow and overflow.
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

/// Exact sum as an expansion: nonoverlapping components in order of increasing magnitude.
class Expansion {
 public:
  void add(double term) {
    int count = 0;
    for (int i = 0; i < size_; ++i) {
      double error = 0;
      term = twoSum(term, components_[i], error);
      if (error != 0) components_[count++] = error;
    }
    ENFILADE_ASSERT(static_cast<std::size_t>(count) < components_.size());
    components_[count++] = term;
    size_ = count;
  }

  void addProduct(double a, double b) {
    double error = 0;
    const double product = twoProduct(a, b, error);
    if (a != 0 && b != 0 && std::abs(product) < kTiny) lost_ += 2 * kTiny * kRoundoff * kRoundoff;
    add(error);
    add(product);
  }

  void addProduct(double a, double b, double c) {
    double error = 0;
    const double product = twoProduct(a, b, error);
    if (a != 0 && b != 0 && std::abs(product) < kTiny)
      lost_ += 2 * kTiny * kRoundoff * kRoundoff * std::abs(c);
    addProduct(product, c);
    addProduct(error, c);
  }

  DoubleDouble rounded() const {
    DoubleDouble result;
    double rest = lost_;
    for (int i = size_ - 1; i >= 0; --i) {
      double error = 0;
      result.high = twoSum(result.high, components_[i], error);
      double smaller = 0;
      result.low = twoSum(result.low, error, smaller);
      rest += std::abs(smaller);
    }
    double error = 0;
    result.high = twoSum(result.high, result.low, error);
    result.low = error;
    result.error = rest * (1 + 32 * kRoundoff);
    return result;
  }

 private:
  std::array<double, 32> components_{};  // computeDisplacement() adds 18 terms
  int size_ = 0;
  double lost_ = 0;
};

LongReal computeLongNorm(const LongVec3& v) {
  return std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z());
}

Mat3 toRotationMatrix(const PlacedConvex& body) {
  return body.rotation ? *body.rotation : Mat3(Mat3::Identity());
}

}  // namespace

Mat3 integrateRotation(const Mat3& rotation, const Vec3& angularVelocity, double time) {
  if (angularVelocity.isZero(0) || time == 0) return rotation;
  const LongVec3 omega = angularVelocity.cast<LongReal>();
  const LongReal speed = computeLongNorm(omega);
  const LongReal angle = speed * static_cast<LongReal>(time);
  if (!(angle <= static_cast<LongReal>(kMaxAngle))) return rotation;  // infinite error
  const LongVec3 k = omega / speed;
  const auto [s, c] = computeSineCosine(angle);
  LongMat3 increment = (1 - c) * (k * k.transpose()) + c * LongMat3::Identity();
  increment(0, 1) -= s * k.z(), increment(1, 0) += s * k.z();
  increment(0, 2) += s * k.y(), increment(2, 0) -= s * k.y();
  increment(1, 2) -= s * k.x(), increment(2, 1) += s * k.x();
  const LongMat3 product = increment * rotation.cast<LongReal>();
  return product.cast<double>();
}

double computeRotationError(const Mat3& rotation, const Vec3& angularVelocity, double time,
                            double radius) {
  if (angularVelocity.isZero(0) || time == 0) return 0;
  const double angle = angularVelocity.norm() * time * (1 + 8 * kRoundoff);
  if (!(angle <= kMaxAngle * (1 - 64 * kRoundoff))) return std::numeric_limits<double>::infinity();
  const double size = rotation.norm() * radius * (1 + 16 * kRoundoff);
  return (kRoundoff + (128 + 8 * angle) * kLongUnit) * size;
}

double computeRadius(const PlacedConvex& body, bool placed) {
  const bool rotates = placed && body.rotation;
  const double stretch =
      rotates ? body.rotation->norm() : 0;  // a product has an error of 3u times this times |v|
  double radius = 0;
  for (const Vec3& v : body.vertices) {
    const Vec3 r = rotates ? Vec3(*body.rotation * v) : v;
    radius = std::max(radius, r.norm() + 4 * kRoundoff * stretch * v.norm());
  }
  return radius * (1 + 16 * kRoundoff);
}

double computeRadiusAround(const PlacedConvex& body, const Vec3& point) {
  constexpr double kSlack = 64 * kRoundoff;
  double squared = 0, magnitude = point.norm() + body.translation.norm();
  for (const Vec3& v : body.vertices) {
    const Vec3 placed = placeVertex(body, v);
    magnitude = std::max(magnitude, v.norm());
    squared = std::max(squared, (placed - point).squaredNorm());
  }
  return std::sqrt(squared) * (1 + kSlack) + kSlack * magnitude;
}

DoubleDouble computeDisplacement(Difference position, Difference velocity, Difference acceleration,
                                 double time) {
  Expansion sum;
  sum.add(position.to);
  sum.add(-position.from);
  sum.addProduct(velocity.to, time);
  sum.addProduct(-velocity.from, time);
  sum.addProduct(acceleration.to, time, time / 2);
  sum.addProduct(-acceleration.from, time, time / 2);
  return sum.rounded();
}

PairAtTime::PairAtTime(const MovingBody& a, const MovingBody& b, double time)
    : rotationA_(integrateRotation(toRotationMatrix(a.body), a.motion.angularVelocity, time)),
      rotationB_(integrateRotation(toRotationMatrix(b.body), b.motion.angularVelocity, time)),
      a_(a.body),
      b_(b.body) {
  if (a.motion.isRotating() || a.body.rotation) a_.rotation = &rotationA_;
  if (b.motion.isRotating() || b.body.rotation) b_.rotation = &rotationB_;
  for (int k = 0; k < 3; ++k) {
    const DoubleDouble offset =
        computeDisplacement({b.body.translation[k], a.body.translation[k]},
                            {b.motion.velocity[k], a.motion.velocity[k]},
                            {b.motion.acceleration[k], a.motion.acceleration[k]}, time);
    b_.translation[k] = offset.high;
    a_.translation[k] = -offset.low;
    error_ += offset.error;
  }
  const auto computeError = [&](const MovingBody& moving) {
    return computeRotationError(toRotationMatrix(moving.body), moving.motion.angularVelocity, time,
                                computeRadius(moving.body, false));
  };
  error_ += computeError(a);
  error_ += computeError(b);
  error_ *= 1 + 8 * kRoundoff;
  ENFILADE_ASSERT(!(error_ < 0));
}

}  // namespace enfilade::collision
