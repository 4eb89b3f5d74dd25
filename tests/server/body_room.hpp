// Test fixture: a room with bodies for servers and clients. A door in a wall, a volume, and a crate
// that is already falling out of the world.
#pragma once

#include <memory>

#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::server::testing {

inline constexpr scene::EntityId kEnd = 4, kLeaf = 5, kZone = 6, kCrate = 7;

/// Floor x, z in -10..10 with its top at 0. A wall at x = 2 with an opening z in -0.6..0.6. In it
/// the leaf "door", hinged at z = -0.6, that opens towards +x. A wall at x = 6, the volume "zone"
/// around (-3, 0, 0), the rigid "crate" beyond the floor.
inline scene::Model makeBodyRoomModel() {
  using scene::Vec3;
  scene::Model model =
      scene::testing::makeBoxModel({{"floor", {-10, -0.5, -10}, {10, 0, 10}},
                                    {"left", {2, 0, -8}, {2.1, 3, -0.6}},
                                    {"right", {2, 0, 0.6}, {2.1, 3, 8}},
                                    {"end", {6, 0, -8}, {6.1, 3, 8}},
                                    {"leaf", {2.02, 0.01, -0.59}, {2.06, 2.9, 0.59}},
                                    {"zone", {-3.5, 0, -0.5}, {-2.5, 2, 0.5}},
                                    {"crate", {12, 1, 0}, {12.4, 1.4, 0.4}}});
  model.source = "body_room";
  scene::BodySpec door;
  door.name = "door";
  door.kind = scene::BodyKind::hinged;
  door.objects = {kLeaf - 1};
  door.anchor = {2.04, 0, -0.6};
  door.high = 1.6;  // turns +z towards +x
  door.speed = 1.6;
  scene::BodySpec zone;
  zone.name = "zone";
  zone.kind = scene::BodyKind::trigger;
  zone.objects = {kZone - 1};
  scene::BodySpec crate;
  crate.name = "crate";
  crate.objects = {kCrate - 1};
  model.bodies = {door, zone, crate};
  return model;
}

inline std::shared_ptr<const scene::Scene> makeBodyRoom() {
  return std::make_shared<const scene::Scene>(makeBodyRoomModel());
}

}  // namespace enfilade::server::testing
