// State hash, snapshots and part boxes of bodies.
#pragma once

#include <memory>
#include <vector>

#include "scene/model/hasher.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Skips resting bodies: nothing has changed since the tick in which they came to rest.
void hashBodies(const WorldData& world, Hasher& hash);
/// Snapshots in the order of Model::bodies; the previous instance if no body moved.
std::shared_ptr<const std::vector<BodySnapshot>> makeBodySnapshots(const WorldData& world);

/// Makes the boxes of the parts if the body overlaps something in the broad phase. Tasks may call
/// it for different bodies at once.
void updatePartBoxes(const WorldData& world, Body& body);

/// True if a kinematic body is moving to its target and not blocked.
bool isBodyBusy(const Body& body);

}  // namespace enfilade::scene
