// Hinge and slider joints between rigid bodies, with limits and motors.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/physics/body_motion.hpp"

namespace enfilade::scene {

/// Connects body B to body A. A hinge leaves the rotation about its axis free, a slider the
/// translation along it. Anchors are in metres from the centres of mass; anchors and unit axes are
/// in body axes. The joint coordinate is in radians for a hinge and in metres for a slider.
struct Joint {
  enum class Kind : std::uint8_t { hinge, slider };
  static constexpr std::size_t kMaxRows = 8;

  Kind kind = Kind::hinge;
  std::uint32_t a = 0, b = 0;  ///< body indices
  Vec3 anchorA = Vec3::Zero(), anchorB = Vec3::Zero();
  Vec3 axisA = Vec3::UnitY(), axisB = Vec3::UnitY();
  /// perpendicular to the axis; a hinge has angle 0 where they agree
  Vec3 perpendicularA = Vec3::UnitX(), perpendicularB = Vec3::UnitX();
  bool hasLimits = false;
  double lower = 0, upper = 0;  ///< limits of the coordinate, lower <= upper; a hinge within +-3.1
  double motorSpeed = 0;        ///< target of the coordinate's rate, per second
  double maxMotorForce = 0;     ///< newtons or newton metres; 0: no motor

  std::array<double, kMaxRows> impulses{};  ///< of the last substep; warm-starts the next one
};

/// Returns a joint at a world point and axis, for the present poses of the bodies.
Joint makeJoint(Joint::Kind kind, std::span<const BodyMotion> motions, std::uint32_t a,
                std::uint32_t b, const Vec3& point, const Vec3& axis);

/// One scalar equation or inequality. The relative velocity linear . (vB - vA) + angularB . wB -
/// angularA . wA is driven to its target by an impulse within [minImpulse, maxImpulse].
struct JointRow {
  std::uint32_t joint = 0, slot = 0;  ///< slot: index into Joint::impulses
  Vec3 linear = Vec3::Zero(), angularA = Vec3::Zero(), angularB = Vec3::Zero();
  double error = 0;       ///< position error in metres or radians; for a limit the distance to it
  double motorSpeed = 0;  ///< of a motor
  double minImpulse = 0, maxImpulse = 0;
  enum class Kind : std::uint8_t { equality, limit, motor } kind = Kind::equality;
};

/// Appends the rows of a joint for the present poses. `seconds`: length of the substep.
void appendJointRows(const Joint& joint, std::uint32_t index, std::span<const BodyMotion> motions,
                     double seconds, std::vector<JointRow>& rows);

}  // namespace enfilade::scene
