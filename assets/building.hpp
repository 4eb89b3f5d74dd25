// The bundled building, and districts of many buildings for tests of scale. Our own work; the same
// seed gives the same model everywhere.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/model/model.hpp"

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

struct BuildingOptions {
  std::uint64_t seed = 1;
  /// 0: the gallery alone (a few thousand objects). Otherwise a district of exactly so many.
  std::size_t objects = 0;
};

/// Makes a two-storey gallery along an enfilade of rooms on the X axis (z = 0); see
/// assets/landmarks.hpp. Throws std::invalid_argument for a district of fewer than
/// kMinDistrictObjects objects.
scene::Model makeBuilding(const BuildingOptions& options = {},
                          std::vector<MovingPart>* movingParts = nullptr);

inline constexpr std::size_t kMinDistrictObjects = 5000;

/// Makes the gallery and varied town houses on streets: exactly `objects` objects, with shared
/// meshes.
scene::Model makeDistrict(std::size_t objects, std::uint64_t seed);

}  // namespace enfilade::assets
