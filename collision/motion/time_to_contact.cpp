// Time to contact. For a gap d with maximum closing speed v and maximum acceleration a,
//   tc = 2 d / (v + sqrt(v^2 + 2 a d)).
// It equals (sqrt(v^2 + 2 a d) - v) / a (Lin 1993, section 5.1) without its cancellation and its
// division by 0.
//
// Departures from Lin 1993. There v is the speed of the closest points, which is no bound for
// rotating bodies. The centre of a rod along a wall is closest and at rest while a tip approaches.
// Here v is the closing speed of the reference points along the normal of the separating plane,
// plus |w| rho of each body. This bounds the speed of every vertex. a is the sum of |linear|,
// |alpha| rho and |w|^2 rho, with the maximum |w| in the interval. NextCheck::proved is false if
// max(tc, tmin) > tc and the gap may close too far; Lin does not make this distinction.
//
// Rounding. Let u = 2^-53. The relative errors in tc are 3u and 2u for the terms under the root, 4u
// for their sum, 3u for the root. They are 4u for the denominator and 5u for the quotient. The
// result is reduced by 12u. This holds only without underflow. Gap, speed and acceleration are
// therefore first scaled by the same power of two, which leaves the time unchanged.
#include "collision/motion/time_to_contact.hpp"

#include <algorithm>
#include <cmath>

#include "collision/floating_point.hpp"

namespace enfilade::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kScale = 0x1p480;       // three factors lift the square of any double
constexpr double kMinSquare = 0x1p-960;  // underflow (below 2^-1074) is negligible above this
constexpr double kMinTime = 0x1p-960;    // a smaller quotient may be inexact
constexpr int kMaxScalings = 3;
constexpr double kRoundUp =
    1 + 16 * kRoundoff;  // exceeds the rounding of a sum of a few rounded products

struct ScaledGap {
  double distance, speed, acceleration;

  double computeDiscriminant() const { return speed * speed + 2 * (acceleration * distance); }
};

ScaledGap scaleUp(ScaledGap s) {
  for (int i = 0; i < kMaxScalings && s.computeDiscriminant() < kMinSquare; ++i)
    s = {s.distance * kScale, s.speed * kScale, s.acceleration * kScale};
  return s;
}

}  // namespace

ClosingBounds computeClosingBounds(const MotionBounds& a, const MotionBounds& b, const Vec3& normal,
                                   double interval) {
  const Vec3 relative = a.velocity - b.velocity;
  // Rounded products along the normal have an error of up to 6u of the speeds.
  const double lost = 16 * kRoundoff * (a.velocity.norm() + b.velocity.norm());
  double speed = normal.dot(relative) + lost;
  double acceleration = 0;
  for (const MotionBounds* body : {&a, &b}) {
    const double angularSpeed = body->angularVelocity.norm();
    const double maxAngularSpeed = angularSpeed + body->angularAcceleration * interval;
    speed += angularSpeed * body->radius * kRoundUp;
    acceleration += body->acceleration + body->angularAcceleration * body->radius +
                    maxAngularSpeed * maxAngularSpeed * body->radius;
  }
  return {std::max(0.0, speed) * kRoundUp, acceleration * kRoundUp};
}

double computeTimeToContact(double distance, const ClosingBounds& closing) {
  if (!(distance > 0) || !(closing.speed >= 0) || !(closing.acceleration >= 0)) return 0;
  if (closing.speed == 0 && closing.acceleration == 0) return kInfinity;
  const ScaledGap s = scaleUp({distance, closing.speed, closing.acceleration});
  const double time = 2 * s.distance / (s.speed + std::sqrt(s.computeDiscriminant()));
  if (!(time >= kMinTime)) return 0;
  return std::min(time, std::numeric_limits<double>::max()) * (1 - 12 * kRoundoff);
}

NextCheck scheduleCheck(double distance, const ClosingBounds& closing, double minInterval,
                        double clearance) {
  const double contact = computeTimeToContact(distance, closing);
  if (contact >= minInterval) return {contact, true};
  const double closes =
      (closing.speed * minInterval + 0.5 * closing.acceleration * minInterval * minInterval) *
      kRoundUp;
  return {minInterval, closes < 2 * clearance};
}

}  // namespace enfilade::collision
