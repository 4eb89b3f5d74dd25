// Two bodies that move and turn: where they are at a time, and how well that is known.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// At time s (seconds) the body's reference point, ConvexBody::translation, has moved by
/// velocity * s + acceleration * s * s / 2, and the body has turned about it by angularVelocity *
/// s.
struct Motion {
  Vec3 velocity = Vec3::Zero();         ///< m/s, world
  Vec3 acceleration = Vec3::Zero();     ///< m/s^2, world, constant
  Vec3 angularVelocity = Vec3::Zero();  ///< rad/s, world, constant

  bool turns() const { return !angularVelocity.isZero(0); }
};

struct MovingBody {
  ConvexBody body;  ///< at time 0
  Motion motion;
};

/// worldFromBody of a body that has turned by `angularVelocity` * `time` from `rotation`. Each
/// point is off by at most turningError() of the same arguments.
Mat3 turned(const Mat3& rotation, const Vec3& angularVelocity, double time);

/// Metres, for points whose greatest distance from the reference point is `radius` in the body's
/// frame; infinite beyond a million radians.
double turningError(const Mat3& rotation, const Vec3& angularVelocity, double time, double radius);

/// Greatest distance of a vertex from the reference point: at least the exact one. Body's frame
/// (`placed` false), or as the rotation, which may be off orthonormal, places them.
double radiusOf(const ConvexBody& body, bool placed);

/// A sum of doubles as two of them and a bound of what is missing.
struct TwoDoubles {
  double high = 0, low = 0;
  double rest = 0;  ///< |exact sum - (high + low)| is at most this; 0 when exact
};

/// to - from + velocity * time + acceleration * time * time / 2, in one coordinate. `velocity` and
/// `acceleration` are differences too: {of `to`, of `from`}.
struct Difference {
  double to = 0, from = 0;
};
TwoDoubles travelled(Difference place, Difference velocity, Difference acceleration, double time);

/// Both bodies at a time. A's reference point is moved to -low and B's to high, so that their
/// difference is exact to 106 bits; the bodies point into this object.
class PairAtTime {
 public:
  PairAtTime(const MovingBody& a, const MovingBody& b, double time);
  PairAtTime(const PairAtTime&) = delete;
  PairAtTime& operator=(const PairAtTime&) = delete;

  const ConvexBody& a() const { return a_; }
  const ConvexBody& b() const { return b_; }
  /// Metres: the exact motion's distance of the bodies differs from that of a() and b() by at most
  /// this, and so does the depth. 0 when the poses are exact.
  double error() const { return error_; }

 private:
  Mat3 rotationA_, rotationB_;
  ConvexBody a_, b_;
  double error_ = 0;
};

}  // namespace enfilade::collision
