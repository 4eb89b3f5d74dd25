// Moves the joints of a chain in a tick.
#pragma once

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Moves the joints of a chain towards their targets.
void moveJoints(const WorldData& world, Avatar& avatar, QueryCount& count);

}  // namespace enfilade::scene
