// Poses of two moving and rotating bodies at a given time, with proved error bounds.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// Motion at constant acceleration and constant angular velocity. At time s (seconds) the reference
/// point, PlacedConvex::translation, has moved by velocity * s + acceleration * s * s / 2. The body
/// has rotated about it by angularVelocity * s.
struct Motion {
  Vec3 velocity = Vec3::Zero();         ///< m/s, world
  Vec3 acceleration = Vec3::Zero();     ///< m/s^2, world, constant
  Vec3 angularVelocity = Vec3::Zero();  ///< rad/s, world, constant

  bool isRotating() const { return !angularVelocity.isZero(0); }
};

struct MovingBody {
  PlacedConvex body;  ///< at time 0
  Motion motion;
};

/// worldFromBody after a rotation by `angularVelocity` * `time` from `rotation`. The error of each
/// point is at most computeRotationError() of the same arguments.
Mat3 integrateRotation(const Mat3& rotation, const Vec3& angularVelocity, double time);

/// Error bound in metres, for points within `radius` of the reference point in the body frame.
/// Infinite beyond a million radians.
double computeRotationError(const Mat3& rotation, const Vec3& angularVelocity, double time,
                            double radius);

/// Maximum distance of a vertex from the reference point, rounded up. `placed` false: in the body
/// frame. `placed` true: after the rotation, which may be slightly non-orthonormal.
double computeRadius(const PlacedConvex& body, bool placed);

/// Maximum distance of a placed vertex from `point`, rounded up; metres.
double computeRadiusAround(const PlacedConvex& body, const Vec3& point);

/// A sum of doubles as two doubles with an error bound.
struct DoubleDouble {
  double high = 0, low = 0;
  double error = 0;  ///< |exact sum - (high + low)| is at most this; 0 when exact
};

/// Difference of two values in one coordinate: to - from.
struct Difference {
  double to = 0, from = 0;
};
/// position + velocity * time + acceleration * time * time / 2, in one coordinate. All three are
/// differences.
DoubleDouble computeDisplacement(Difference position, Difference velocity, Difference acceleration,
                                 double time);

/// Both bodies at a given time. A's reference point is placed at -low and B's at high, so that
/// their difference is exact to 106 bits. The bodies point into this object.
class PairAtTime {
 public:
  PairAtTime(const MovingBody& a, const MovingBody& b, double time);
  PairAtTime(const PairAtTime&) = delete;
  PairAtTime& operator=(const PairAtTime&) = delete;

  const PlacedConvex& a() const { return a_; }
  const PlacedConvex& b() const { return b_; }
  /// Pose error in metres: distance and depth of a() and b() differ from those of the exact motion
  /// by at most this. 0 if the poses are exact.
  double error() const { return error_; }

 private:
  Mat3 rotationA_, rotationB_;
  PlacedConvex a_, b_;
  double error_ = 0;
};

}  // namespace enfilade::collision
