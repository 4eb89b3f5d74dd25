// Pairs of parts that the solver examines in a tick: those whose motion bounds overlap.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Rigid bodies that are awake or may be woken, ascending.
std::vector<std::uint32_t> collectActiveBodies(const WorldData& world);

/// Gives the solver the pairs of the active bodies with anything in their motion bounds.
void collectPairs(WorldData& world, ThreadPool* threadPool);

}  // namespace enfilade::scene
