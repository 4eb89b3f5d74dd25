// Walkers that follow one another: the one farther from a way point waits for the one before it,
// so that a crowd passes a door one by one instead of wedging itself in.
#pragma once

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Slows walks down behind other walks with the same goal or direction. Call it when the desired
/// velocities of the tick are known.
void yieldToWalkersAhead(WorldData& world);

/// Metres from a way point, not the last one, at which the avatar walks on to the next. In a crowd
/// that is before it, because there is no room for all on one point.
double computePassingDistance(const WorldData& world, const Avatar& avatar);

/// True while the avatar waits in a queue that advances, so that it is not stuck.
bool isQueueing(const WorldData& world, const Avatar& avatar);

}  // namespace enfilade::scene
