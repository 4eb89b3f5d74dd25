// OrderEnd: the place where an avatar will stand after its orders.
#pragma once

#include <optional>
#include <string_view>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

struct OrderEnd {
  Vec3 footPosition = Vec3::Zero();  ///< scene frame, metres
  double radius = 0, height = 0;     ///< metres, of the prism at spawn; 0: made of parts or links
};

/// The end of the last queued or pending Walk, else of the Spawn, else the present place; nullopt:
/// no avatar has this name. Jumps, flights and drives are not foreseen.
std::optional<OrderEnd> findOrderEnd(const WorldData& world, std::string_view name);

}  // namespace enfilade::scene
