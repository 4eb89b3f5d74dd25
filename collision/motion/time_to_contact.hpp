// Time to contact (Lin 1993, section 5.1): a proved time before which two bodies need no contact
// check. Metres and seconds.
#pragma once

#include "collision/types.hpp"

namespace enfilade::collision {

/// Bounds on the future motion of a body.
struct MotionBounds {
  Vec3 velocity = Vec3::Zero();         ///< of the reference point, now (m/s, world)
  double acceleration = 0;              ///< maximum |acceleration| of the reference point (m/s^2)
  Vec3 angularVelocity = Vec3::Zero();  ///< now (rad/s, world)
  double angularAcceleration = 0;       ///< maximum |angular acceleration| (rad/s^2)
  double radius = 0;  ///< maximum distance of a vertex from the reference point (m)
};

/// Closing bound of a gap: in a time t it closes by at most speed * t + acceleration * t * t / 2.
struct ClosingBounds {
  double speed = 0;         ///< >= 0
  double acceleration = 0;  ///< >= 0
};

/// Bounds for a gap along `normal` (unit, from A to B) over the next `interval` seconds, rounded
/// up. They hold for exactly this normal. If the normal is known only roughly, pass the direction
/// of the relative velocity, along which a gap closes fastest.
ClosingBounds computeClosingBounds(const MotionBounds& a, const MotionBounds& b, const Vec3& normal,
                                   double interval);

/// tc: time (seconds) before which a gap of at least `distance` cannot close. 0 if distance is not
/// positive or an argument is NaN; infinity if nothing closes. Never above the exact value
/// 2 d / (v + sqrt(v^2 + 2 a d)), and less than 16 units of rounding below it unless below 1e-290.
double computeTimeToContact(double distance, const ClosingBounds& closing);

struct NextCheck {
  double after = 0;     ///< max(tc, minInterval), seconds
  bool proved = false;  ///< no contact before `after` is missed: `after` is tc, or the gap closes
                        ///< by less than 2 * clearance until then. A near miss (d < 2 * clearance)
                        ///< is thus detected before contact
};

/// Time of the next check of a pair. `distance`: proved lower bound, metres. `minInterval` > 0:
/// shortest useful delay, seconds; without it a closing pair would be checked ever more often
/// (Zeno). `clearance` >= 0, metres.
NextCheck scheduleCheck(double distance, const ClosingBounds& closing, double minInterval,
                        double clearance);

}  // namespace enfilade::collision
