// The state of a scene in which all doors are open.
#pragma once

#include <memory>

#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

/// Opens all hinged and sliding bodies of a new world, waits until they stand still, and returns
/// its state.
std::shared_ptr<const Snapshot> makeSnapshotWithOpenDoors(std::shared_ptr<const Scene> scene,
                                                          const WorldSettings& settings);

}  // namespace enfilade::scene
