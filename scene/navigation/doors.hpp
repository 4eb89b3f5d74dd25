// Doors for navigation: the state in which all are open, and the closed ones on a path through it.
#pragma once

#include <memory>
#include <vector>

#include "scene/navigation/mesh/agent.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/world_settings.hpp"
#include "scene/world/queries/entity_index.hpp"

namespace enfilade::scene {

bool hasDoors(const Scene& scene);

/// Opens all doors of a new world, waits until they stand still, and returns
/// its state.
std::shared_ptr<const Snapshot> makeSnapshotWithOpenDoors(std::shared_ptr<const Scene> scene,
                                                          const WorldSettings& settings);

struct DoorOnPath {
  std::uint32_t body = 0;    ///< index into Model::bodies
  double distance = 0;       ///< metres from the start of the path to the leg on which it stands
  double secondsToOpen = 0;  ///< at its own speed
};

/// Doors that an agent on the path would touch at their poses in `snapshot`, in the order of the
/// path; for each leg, by body.
std::vector<DoorOnPath> findDoorsOnPath(EntityIndex& index, const WorldSettings& settings,
                                        const Snapshot& snapshot, const NavigationAgent& agent,
                                        const std::vector<Vec3>& points);

}  // namespace enfilade::scene
