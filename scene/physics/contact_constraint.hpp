// Contact constraint of the solver: up to four points with one normal and one friction pair.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "scene/physics/body_motion.hpp"

namespace enfilade::scene {

/// One contact point. World axes; arms in metres from the centres of mass; impulses in N s per
/// substep.
struct ContactConstraintPoint {
  Vec3 armA = Vec3::Zero(), armB = Vec3::Zero();
  double separation = 0;    ///< along the normal, metres; negative: penetration
  double impulse = 0;       ///< accumulated normal impulse; warm-starts the next solve
  double motorImpulse = 0;  ///< accumulated impulse of the motor (ContactConstraint::maxPushForce)
};

struct ContactConstraint {
  static constexpr std::size_t kMaxPoints = 4;

  std::uint32_t a = 0, b = 0;   ///< body indices
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B
  double friction = 0, restitution = 0;
  std::array<ContactConstraintPoint, kMaxPoints> points;
  std::size_t pointCount = 0;
  Vec3 tangentImpulse = Vec3::Zero();  ///< friction impulse on B, perpendicular to the normal
  double torsionImpulse = 0;           ///< friction impulse on B against rotation about the normal
  /// Motor of an avatar that pushes a body. In addition to the contact itself, the points give up
  /// to `maxPushForce` newtons in total, until they separate at `targetSpeed` m/s. 0: no
  /// motor.
  double targetSpeed = 0, maxPushForce = 0;
  bool gaveImpulse = false;  ///< a point gave an impulse in the last step

  std::span<const ContactConstraintPoint> activePoints() const {
    return {points.data(), pointCount};
  }
};

}  // namespace enfilade::scene
