// Hinges and sliders between rigid bodies, with limits and motors.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/physics/body_motion.hpp"

namespace enfilade::scene {

/// Holds body B to body A. A hinge leaves it one turn about its axis, a slider one way along it.
/// Anchors are metres from the bodies' centres, axes unit, both in the bodies' own axes. What a
/// slider's coordinate is measured in (metres) a hinge's is in radians.
struct Joint {
  enum class Kind : std::uint8_t { hinge, slider };
  static constexpr std::size_t kMostRows = 8;

  Kind kind = Kind::hinge;
  std::uint32_t a = 0, b = 0;  ///< indices of the bodies
  Vec3 anchorA = Vec3::Zero(), anchorB = Vec3::Zero();
  Vec3 axisA = Vec3::UnitY(), axisB = Vec3::UnitY();
  Vec3 acrossA = Vec3::UnitX(), acrossB = Vec3::UnitX();  ///< at right angles to the axis; where
                                                          ///< they agree, a hinge's angle is 0
  bool limited = false;
  double lower = 0, upper = 0;  ///< of the coordinate, lower <= upper; a hinge's within +-3.1
  double motorSpeed = 0;        ///< of the coordinate, a second
  double mostMotor = 0;         ///< newtons, or newton metres; 0: no motor

  std::array<double, kMostRows> impulses{};  ///< of the last substep: what the next starts from
};

/// A joint at a point and along an axis of the world, between bodies as they are now.
Joint jointAt(Joint::Kind kind, std::span<const RigidBody> bodies, std::uint32_t a, std::uint32_t b,
              const Vec3& point, const Vec3& axis);

/// One equation or inequality: the relative motion linear . (vB - vA) + angularB . wB - angularA .
/// wA is to be `target`, by an impulse within [least, most].
struct JointRow {
  std::uint32_t joint = 0, slot = 0;  ///< slot: of Joint::impulses
  Vec3 linear = Vec3::Zero(), angularA = Vec3::Zero(), angularB = Vec3::Zero();
  double error = 0;  ///< how far the coordinate is off, metres or radians; of a limit: how far
                     ///< from it
  double speed = 0;  ///< a motor's
  double least = 0, most = 0;
  enum class Kind : std::uint8_t { hold, limit, motor } kind = Kind::hold;
};

/// Appends the rows of a joint for the poses of now. `seconds`: of the substep.
void appendRows(const Joint& joint, std::uint32_t index, std::span<const RigidBody> bodies,
                double seconds, std::vector<JointRow>& rows);

}  // namespace enfilade::scene
