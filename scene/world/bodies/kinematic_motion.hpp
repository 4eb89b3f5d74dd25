// Motion of kinematic bodies, with the avatars that they push and carry.
#pragma once

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Moves kinematic bodies as far as obstacles yield, and carries their passengers.
void moveKinematicBodies(WorldData& world, TickReport& report, QueryCount& count);

}  // namespace enfilade::scene
