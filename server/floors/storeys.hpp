// Storeys of a scene: the floors that plans are drawn for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"

namespace enfilade::server {

/// Metres above the floor: storeys are cut through the windows, as usual for floor plans.
inline constexpr double kPlanCutHeight = 1.2;

struct StoreyFloor {
  double height = 0;  ///< metres, scene frame
  std::string name;   ///< name in the file, or empty
  /// The storey of the file: an index into Model::storeys; nullopt: it was found by its floor.
  std::optional<std::uint32_t> storey = std::nullopt;
};

/// The storeys of the file that have walls, at their floors. If the file states none: the heights
/// of large walkable floors with walls. Ascending. A scene without floors has one storey at its
/// lowest point.
std::vector<StoreyFloor> findStoreys(const scene::Scene& scene);

}  // namespace enfilade::server
