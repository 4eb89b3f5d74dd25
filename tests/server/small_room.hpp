// A hand-made room: a floor with its top at y = 0, a wall across +X, a column.
#pragma once

#include <memory>

#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::server::testing {

inline constexpr scene::EntityId kFloor = 1, kWall = 2, kColumn = 3;

/// Floor x, z in -10..10; wall x in 5..5.2, z in -4..4, 3 m high; column around (0, 6).
std::shared_ptr<const scene::Scene> makeSmallRoom();

/// The same room as an OBJ file's text (Y up, metres; objects room_floor, room_wall, room_column).
std::string makeSmallRoomObj();

}  // namespace enfilade::server::testing
