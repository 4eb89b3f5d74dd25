// Doors and lifts of a Walk: it opens doors that it comes to, calls lifts, and waits for both.
#pragma once

#include <string>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Commands the doors ahead and the lift of the next waypoint where necessary, and sets
/// WalkProgress::waitsFor. A walk gives three commands for each of its bodies, and no more.
void commandWalkBodies(WorldData& world, const Walk& walk, Avatar& avatar);

/// Why a walk that waits ends.
std::string describeWait(const WorldData& world, const Walk& walk, const Avatar& avatar);

}  // namespace enfilade::scene
