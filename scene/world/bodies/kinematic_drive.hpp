// Drive of kinematic bodies: commands, and the motion planned for the tick.
#pragma once

#include <optional>
#include <string>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Sets a kinematic body to its initial joint position and pose.
void initKinematicDrive(Body& body);
/// Error of a command for this body; nullopt if it is valid.
std::optional<std::string> validateBodyCommandFields(const Body& body, const BodyCommand& command,
                                                     const WorldSettings& settings);
/// Applies the pending body commands.
void applyBodyCommands(WorldData& world);
/// Computes the target of each kinematic body for this tick, and its motion bounds.
void planKinematicMotion(WorldData& world);

/// Bound on the distance that kinematic bodies push or carry the avatar in this tick, metres.
double computePushMargin(const WorldData& world, const Avatar& avatar);

}  // namespace enfilade::scene
