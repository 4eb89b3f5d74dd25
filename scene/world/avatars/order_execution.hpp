// Executes the orders at the heads of the avatars' queues in each tick, and reports their ends.
#pragma once

#include <cstddef>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Share of an order in kMaxQueuedOrders: itself and its waypoints.
std::size_t computeOrderCost(const Order& order);

/// Enqueues the pending commands, then starts or continues the first order of each queue.
void runOrders(WorldData& world, TickReport& report, QueryCount& count);
/// After the motion: reports the walks that arrived or are blocked, and removes avatars that left
/// the scene's bounds.
void updateWalkProgress(WorldData& world, TickReport& report, QueryCount& count);

}  // namespace enfilade::scene
