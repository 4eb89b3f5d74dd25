// What a tick leaves for everyone else to read: immutable, shared, complete.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "scene/avatar_shape.hpp"
#include "scene/model.hpp"

namespace enfilade::scene {

/// One numbering for all that can be touched or seen. 0 is nothing; still object i of the model is
/// i + 1; avatars follow the objects and are never reused.
using EntityId = std::uint32_t;

struct AvatarView {
  EntityId id = 0;
  std::string name;
  Vec3 feet = Vec3::Zero();   ///< world, metres: the middle of the soles
  Vec3 gaze = Vec3::UnitX();  ///< world, unit length: where the eyes look
  double eyeHeight = 1.6;     ///< metres above the feet
  bool grounded = false;
  std::shared_ptr<const AvatarShape> shape;
};

struct Snapshot {
  std::uint64_t tick = 0;
  double time = 0;  ///< seconds
  std::uint64_t stateHash = 0;
  std::vector<AvatarView> avatars;  ///< ascending ids
};

}  // namespace enfilade::scene
