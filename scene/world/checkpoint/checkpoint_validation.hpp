// Validation of a restored world, so that no index or pointer leaves its range. The checksum
// detects damage, not forgery.
#pragma once

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Validates that avatars ascend by name, on which lookups rely. Throws CheckpointError.
void validateAvatarOrder(const WorldData& world);
/// Validates all state but the physics bodies, which do not exist yet. Throws CheckpointError.
void validateRestoredWorld(const WorldData& world);
/// Validates physics bodies and pairs. Throws CheckpointError.
void validateDynamicBodies(const WorldData& world);

}  // namespace enfilade::scene
