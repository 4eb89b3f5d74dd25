// Drive of kinematic bodies: commands, and the motion planned for the tick.
#pragma once

#include <optional>
#include <string>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Sets a kinematic body to its initial joint position and pose.
void initKinematicDrive(Body& body);
/// Error of a command whose body is resolved; nullopt if it is valid.
std::optional<std::string> validateBodyCommand(const WorldData& world, const BodyCommand& command);
/// Error of the resolved doors and lifts of a walk; nullopt if they are valid.
std::optional<std::string> validateWalkBodies(const WorldData& world, const Walk& walk);
/// Applies the pending body commands.
void applyBodyCommands(WorldData& world);
/// Computes the target of each kinematic body for this tick, and its motion bounds.
void planKinematicMotion(WorldData& world);

/// Bound on the distance that kinematic bodies push or carry the avatar in this tick, metres.
double computePushMargin(const WorldData& world, const Avatar& avatar);

}  // namespace enfilade::scene
