// What a tick leaves for everyone else to read: immutable, shared, complete.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "scene/model/model.hpp"
#include "scene/world/avatars/avatar_shape.hpp"

namespace enfilade::scene {

/// One numbering for all that can be touched or seen. 0 is nothing; still object i of the model is
/// i + 1, and so is object i of a body: the first one's id is the body's; avatars follow the
/// objects and are never reused.
using EntityId = std::uint32_t;

/// How far an avatar came in one tick, and what stopped it.
struct MoveResult {
  Vec3 asked = Vec3::Zero();     ///< metres: what its orders asked for; gravity is not among it
  Vec3 made = Vec3::Zero();      ///< metres: how far the feet came, falls and steps among it
  EntityId stoppedBy = 0;        ///< what it met that cannot be walked on, the first; 0: nothing
  collision::Decision decision;  ///< with it, where it stopped, from the avatar to it
};

/// A joint after one tick.
struct JointView {
  double value = 0;        ///< radians or metres
  EntityId stoppedBy = 0;  ///< what one of the links met that it moves; 0: nothing
  /// Metres: as the value changes by 1, no point that it moves goes farther, however others stand.
  double lever = 0;
};

struct AvatarView {
  EntityId id = 0;
  std::string name;
  Vec3 feet = Vec3::Zero();   ///< world, metres: the middle of the soles
  Vec3 gaze = Vec3::UnitX();  ///< world, unit length: where the eyes look
  double eyeHeight = 1.6;     ///< metres above the feet
  bool grounded = false;
  std::shared_ptr<const AvatarShape> shape;
  bool flying = false;
  EntityId standsOn = 0;  ///< 0: on nothing
  double height = 1.75;   ///< metres, of the prism as it is now; 0 where parts make the shape
  double standing = 0;    ///< metres, of the prism as it was spawned; 0 where parts make the shape
  MoveResult move;
  std::vector<JointView> joints;  ///< of a chain; else empty
};

struct BodyView {
  EntityId id = 0;          ///< of its first object
  std::uint32_t index = 0;  ///< into Model::bodies
  /// worldFromBody; the body's frame has its origin at Scene::shapeOfBody(index).origin.
  collision::Pose pose;
  bool displaced = false;  ///< not where it was authored
  double coordinate = 0;   ///< as BodySpec says; 0 for rigid bodies and triggers
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();  ///< m/s, rad/s, scene frame
  double swing = 0;        ///< m/s: no point departs faster from that motion within the tick
  bool moving = false;     ///< in this tick, or rigid and awake
  EntityId blockedBy = 0;  ///< what it cannot push aside; 0: nothing
};

struct Snapshot {
  std::uint64_t tick = 0;
  double time = 0;  ///< seconds
  std::uint64_t stateHash = 0;
  std::vector<AvatarView> avatars;  ///< ascending ids
  /// As Model::bodies; never null. Shared with the last snapshot when nothing of it changed.
  std::shared_ptr<const std::vector<BodyView>> bodies;
};

}  // namespace enfilade::scene
