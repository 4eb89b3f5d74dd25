// State hash, snapshot and turn radius of an avatar.
#pragma once

#include "scene/model/hasher.hpp"
#include "scene/world/data/avatar.hpp"

namespace enfilade::scene {

void hashAvatar(const Avatar& avatar, Hasher& hash);
AvatarSnapshot makeAvatarSnapshot(const Avatar& avatar);

/// Maximum distance from the vertical through the feet of any point that turns, for all values of
/// the joints; metres. 0 for a mere prism.
double computeTurnRadius(const Avatar& avatar);

/// Updates stalledInAirTime. True if the avatar made no progress in the air for stuckTimeout: it is
/// held by non-walkable surfaces.
bool updateStalledInAir(Avatar& avatar, const WorldSettings& settings);

}  // namespace enfilade::scene
