// Checks commands and settings without the state of a world.
#pragma once

#include <optional>
#include <string>

#include "scene/world/data/orders.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

/// Metres: maximum absolute coordinate in commands and queries. Doubles still resolve 2 nm there.
inline constexpr double kMaxCoordinate = 1e7;

/// Error of a command, naming the field and the value; nullopt if it is valid.
std::optional<std::string> validateCommandFields(const Command& command,
                                                 const WorldSettings& settings);

/// Error that names the first invalid setting; nullopt if all are valid.
std::optional<std::string> validateWorldSettings(const WorldSettings& settings);

}  // namespace enfilade::scene
