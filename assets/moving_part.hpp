// A moving part is an object of a model under construction with its joint.
#pragma once

#include <cstdint>

#include "collision/types.hpp"

namespace enfilade::assets {

/// Joint of a door, a lift's cabin or the like. It is at rest until it is moved.
struct MovingPart {
  enum class Kind : std::uint8_t { hinge, slide };

  std::uint32_t object = 0;  ///< index into Model::objects; the object's origin lies on the hinge's
                             ///< axis
  Kind kind = Kind::hinge;
  collision::Vec3 axis;      ///< unit length, in the object's own frame
  double low = 0, high = 0;  ///< relative to the modelled pose: radians about, or metres along, the
                             ///< axis

  /// Parts that slide upwards are lifts.
  bool isLift() const { return kind == Kind::slide && axis.y() > 0; }
};
inline constexpr double kLiftSpeed = 1.5, kLiftAcceleration = 1;  ///< m/s, m/s^2

}  // namespace enfilade::assets
