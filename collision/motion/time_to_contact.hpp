// Time to contact (seed 5.1): how long two bodies can be left alone, and whether that is proved.
// Metres and seconds.
#pragma once

#include "collision/motion/moving_pose.hpp"

namespace enfilade::collision {

/// What is known of a body for a while to come.
struct MotionBounds {
  Vec3 velocity = Vec3::Zero();         ///< of the reference point, now (m/s, world)
  double acceleration = 0;              ///< most |acceleration| of the reference point (m/s^2)
  Vec3 angularVelocity = Vec3::Zero();  ///< now (rad/s, world)
  double angularAcceleration = 0;       ///< most |angular acceleration| (rad/s^2)
  double radius = 0;  ///< least distance from the reference point that no vertex exceeds
};

/// How fast a gap can close: after a time t by at most speed * t + acceleration * t * t / 2.
struct ClosingBounds {
  double speed = 0;         ///< >= 0
  double acceleration = 0;  ///< >= 0
};

/// For a gap along `normal` (unit, from A to B), over the next `interval` seconds. Rounded up.
/// Holds for the gap along this very normal; where that is known only roughly, give the direction
/// of the relative velocity, along which it closes fastest.
ClosingBounds closingBounds(const MotionBounds& a, const MotionBounds& b, const Vec3& normal,
                            double interval);

/// tc: before this time (seconds) a gap of at least `distance` cannot close; 0 when distance is not
/// positive or a number is none, infinity when nothing closes. Never above 2 d / (v + sqrt(v^2 + 2
/// a d)), and below it by less than 16 units of rounding unless it is below 1e-290.
double timeToContact(double distance, const ClosingBounds& closing);

struct WakeUp {
  double after = 0;     ///< tw = max(tc, least), seconds
  bool proved = false;  ///< no contact before `after` is missed: either it is tc, or the gap closes
                        ///< by less than 2 * clearance until then, so a near miss (d < 2 *
                        ///< clearance) is seen before the bodies meet
};

/// When to look at a pair again. `distance`: proved; `least` > 0: the shortest time worth waiting,
/// without which a closing pair would be looked at ever more often (Zeno). `clearance` >= 0.
WakeUp wakeUp(double distance, const ClosingBounds& closing, double least, double clearance);

/// "What cannot touch before t?"
struct CannotTouch {
  bool proved = false;  ///< for all of [0, t)
  double until = 0;     ///< they were proved apart up to here; at most t
};

/// Cheap bound first, then the time of impact. `t` >= 0, finite.
CannotTouch cannotTouchBefore(const MovingBody& a, const MovingBody& b, double t,
                              FeatureCache& cache);

}  // namespace enfilade::collision
