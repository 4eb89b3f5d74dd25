// Shape and position of a new avatar.
#pragma once

#include <optional>
#include <string>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Gives a new avatar its shape and a free position at, or slightly above, the order's. Returns the
/// error if the position is not free; otherwise `message` gets a remark or "".
std::optional<std::string> placeAvatar(const WorldData& world, const Spawn& order, Avatar& avatar,
                                       std::string& message, QueryCount& count);
/// Puts an avatar that has its shape at, or slightly above, `position`. Returns the error if it is
/// not free there, or if there is no floor below.
std::optional<std::string> placeStanding(const WorldData& world, const Vec3& position,
                                         Avatar& avatar, QueryCount& count);
/// Gives an avatar the shape, chain and height of its spawn order.
void applySpawnShape(const Spawn& order, const WorldSettings& settings, Avatar& avatar);

}  // namespace enfilade::scene
