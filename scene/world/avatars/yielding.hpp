// Queueing of walkers: of two that follow one another, the one farther from the waypoint waits for
// the other. A crowd thus passes a door one by one instead of wedging itself in.
#pragma once

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Slows walks down behind other walks with the same goal or direction. Call it when the desired
/// velocities of the tick are known.
void yieldToWalkersAhead(WorldData& world);

/// True if the avatar walks on to `next` before it reaches the waypoint at `distance` metres. In a
/// crowd it does so near the point, where there is no room for all. No static object and no body
/// may be in the way.
bool mayPassEarly(const WorldData& world, const Avatar& avatar, double distance, const Vec3& next,
                  QueryCount& count);

/// True while the avatar waits in a queue that advances, so that it is not stuck.
bool isQueueing(const WorldData& world, const Avatar& avatar);

}  // namespace enfilade::scene
