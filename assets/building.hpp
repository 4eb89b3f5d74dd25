// The bundled building, and districts of many buildings for tests of scale. Our own work; the same
// seed gives the same model everywhere.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "assets/moving_part.hpp"
#include "scene/model/model.hpp"

namespace enfilade::assets {

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
