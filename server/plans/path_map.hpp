// Map of a walk: floor plans per storey with paths, contacts and captures.
#pragma once

#include <optional>
#include <vector>

#include "server/floors/floor_plan.hpp"
#include "server/plans/plan_image.hpp"
#include "server/plans/walk_trace.hpp"

namespace enfilade::server {

/// Finds the floor heights with much walking, ascending; empty without walks.
std::vector<double> findWalkedStoreys(const std::vector<WalkedPath>& paths);

/// The background of a map.
struct MapBackground {
  PlanRenderer renderPlan;
  FloorPlanSource findFloorPlan = nullptr;  ///< walls, doors and names of rooms; null: none
};

/// Draws the map; nullopt without paths or without a background.
std::optional<render::Image> drawMap(const WalkTrace& trace, const MapBackground& background);

}  // namespace enfilade::server
