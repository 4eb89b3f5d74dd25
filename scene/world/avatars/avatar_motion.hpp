// Moves an avatar in a tick: collide-and-slide, steps, falls and flight.
#pragma once

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Bounds of an avatar's motion in this tick at its desired velocity, scene frame.
Aabb computeMotionBounds(const WorldSettings& settings, const Avatar& avatar);

/// Moves an avatar: walks, slides, steps, falls or flies.
void moveAvatar(const WorldData& world, Avatar& avatar, QueryCount& count);

}  // namespace enfilade::scene
