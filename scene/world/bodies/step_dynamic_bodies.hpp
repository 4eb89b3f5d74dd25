// Steps the dynamic bodies in a tick: motion bounds, solver, continuous collision.
#pragma once

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Creates the physics bodies. All start awake, so that a body authored in the air falls.
void initDynamicBodies(WorldData& world);

/// Computes the motion bounds of each rigid body for this tick.
void planDynamicMotion(WorldData& world);

/// Runs the solver and the continuous collision check, and reads back the poses.
void stepDynamicBodies(WorldData& world, TickReport& report, QueryCount& count);

}  // namespace enfilade::scene
