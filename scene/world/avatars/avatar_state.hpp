// State hash and snapshot of an avatar.
#pragma once

#include "scene/model/hasher.hpp"
#include "scene/world/data/avatar.hpp"

namespace enfilade::scene {

void hashAvatar(const Avatar& avatar, Hasher& hash);
AvatarSnapshot makeAvatarSnapshot(const Avatar& avatar);

}  // namespace enfilade::scene
