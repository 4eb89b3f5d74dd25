// Time to contact. For a gap d that closes at v and accelerates by a at most,
//   tc = 2 d / (v + sqrt(v^2 + 2 a d)),
// which is the seed's (sqrt(v^2 + 2 a d) - v) / a without its cancellation and its division by 0.
//
// Departures from seed 5.1. The seed takes for v the speed of the closest points. That is no bound
// when bodies turn: the centre of a rod along a wall is closest and at rest, while its tip comes
// down. Here v is the closing speed of the reference points along the parting plane's normal plus
// |w| rho of each body, which no vertex exceeds; a is the sum of |linear|, |alpha| rho and
// |w|^2 rho, |w| at its greatest in the interval. And where tw = max(tc, tmin) exceeds tc, the seed
// calls nothing unproved.
//
// Rounding. With u = 2^-53, in tc the terms under the root are off by 3u and 2u, their sum by 4u,
// its root by 3u, the denominator by 4u and the quotient by 5u, relative: 12u is taken off. No
// product may have underflowed for that, so the gap, the speed and the acceleration are first
// scaled by the same power of two, which changes no time.
#include "collision/motion/time_to_contact.hpp"

#include <algorithm>
#include <cmath>

#include "collision/motion/shape_cast.hpp"

namespace enfilade::collision {
namespace {

constexpr double kUnit = 0x1p-53;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kScale = 0x1p480;         // at most three of them lift any double's square
constexpr double kLeastSquare = 0x1p-960;  // a lost product (below 2^-1074) is no part of this
constexpr double kLeastTime = 0x1p-960;    // a quotient below it may have lost digits
constexpr int kScalings = 3;
constexpr double kUp = 1 + 16 * kUnit;  // above the roundings of a sum of a few rounded products

struct Scaled {
  double distance, speed, acceleration;

  double underRoot() const { return speed * speed + 2 * (acceleration * distance); }
};

Scaled scaledUp(Scaled s) {
  for (int i = 0; i < kScalings && s.underRoot() < kLeastSquare; ++i)
    s = {s.distance * kScale, s.speed * kScale, s.acceleration * kScale};
  return s;
}

}  // namespace

ClosingBounds closingBounds(const MotionBounds& a, const MotionBounds& b, const Vec3& normal,
                            double interval) {
  const Vec3 relative = a.velocity - b.velocity;
  // Rounded products along the normal lose up to 6u of the speeds themselves.
  const double lost = 16 * kUnit * (a.velocity.norm() + b.velocity.norm());
  double speed = normal.dot(relative) + lost;
  double acceleration = 0;
  for (const MotionBounds* body : {&a, &b}) {
    const double spin = body->angularVelocity.norm();
    const double fastest = spin + body->angularAcceleration * interval;
    speed += spin * body->radius * kUp;
    acceleration += body->acceleration + body->angularAcceleration * body->radius +
                    fastest * fastest * body->radius;
  }
  return {std::max(0.0, speed) * kUp, acceleration * kUp};
}

double timeToContact(double distance, const ClosingBounds& closing) {
  if (!(distance > 0) || !(closing.speed >= 0) || !(closing.acceleration >= 0)) return 0;
  if (closing.speed == 0 && closing.acceleration == 0) return kInfinity;
  const Scaled s = scaledUp({distance, closing.speed, closing.acceleration});
  const double time = 2 * s.distance / (s.speed + std::sqrt(s.underRoot()));
  if (!(time >= kLeastTime)) return 0;
  return std::min(time, std::numeric_limits<double>::max()) * (1 - 12 * kUnit);
}

WakeUp wakeUp(double distance, const ClosingBounds& closing, double least, double clearance) {
  const double contact = timeToContact(distance, closing);
  if (contact >= least) return {contact, true};
  const double closes = (closing.speed * least + 0.5 * closing.acceleration * least * least) * kUp;
  return {least, closes < 2 * clearance};
}

CannotTouch cannotTouchBefore(const MovingBody& a, const MovingBody& b, double t,
                              FeatureCache& cache) {
  const auto boundsOf = [](const MovingBody& moving) {
    return MotionBounds{moving.motion.velocity, moving.motion.acceleration.norm() * kUp,
                        moving.motion.angularVelocity, 0, radiusOf(moving.body, true)};
  };
  const Decision now = decide(a.body, b.body, cache);
  if (now.verdict != Verdict::separated) return {};
  const double apart = now.distance - now.errorBound;
  // Along the motion itself: whichever plane parts the bodies by `apart`, none closes faster.
  const Vec3 along = (a.motion.velocity - b.motion.velocity).normalized();
  const double soonest = timeToContact(apart, closingBounds(boundsOf(a), boundsOf(b), along, t));
  if (soonest >= t) return {true, t};
  const TimeOfImpact impact = timeOfImpact(a, b, t, cache);
  return {impact.impact == Impact::none, impact.lo};
}

}  // namespace enfilade::collision
