// Places a new or teleported avatar: its shape, and a free position on a floor.
#pragma once

#include <optional>
#include <string>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Gives an avatar that has its shape a free position at, or slightly above, `position`. Returns
/// the error, with the nearest free position, if that is not free; otherwise `message` gets a
/// remark or "".
std::optional<std::string> placeOrSuggest(const WorldData& world, const Vec3& position,
                                          Avatar& avatar, std::string& message, QueryCount& count);
/// Puts an avatar that has its shape at, or slightly above, `position`. Returns the error if it is
/// not free there, or if there is no floor below.
std::optional<std::string> placeStanding(const WorldData& world, const Vec3& position,
                                         Avatar& avatar, QueryCount& count);
/// Rotates parts and links to a facing in degrees, without regard to obstacles; a prism has none.
void setFacing(Avatar& avatar, double degrees);
/// Gives an avatar the shape, chain and height of its spawn order.
void applySpawnShape(const Spawn& order, const WorldSettings& settings, Avatar& avatar);

}  // namespace enfilade::scene
