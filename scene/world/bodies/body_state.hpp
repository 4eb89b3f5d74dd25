// State hash and snapshots of bodies.
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

/// True if a kinematic body is moving to its target and not blocked.
bool isBodyBusy(const Body& body);

}  // namespace enfilade::scene
