// The immutable result of a tick, shared with all readers: avatars, bodies and the state hash.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "scene/model/model.hpp"
#include "scene/world/data/avatar_shape.hpp"

namespace enfilade::scene {

/// Id of an object, body or avatar. 0: no entity. Object i of the model has id i + 1; a body has
/// the id of its first object. Avatar ids follow the objects and are never reused.
using EntityId = std::uint32_t;

/// Motion of an avatar in one tick, and the entity that blocked it.
struct MoveResult {
  Vec3 requestedDisplacement = Vec3::Zero();  ///< metres, by its orders, without gravity
  Vec3 actualDisplacement = Vec3::Zero();     ///< metres, of the feet, with falls and steps
  EntityId blockedBy = 0;                     ///< first non-walkable entity hit; 0: none
  collision::SeparationResult
      separation;  ///< to that entity where the avatar stopped, from the avatar
};

/// State of a joint after a tick.
struct JointSnapshot {
  double value = 0;        ///< radians or metres
  EntityId blockedBy = 0;  ///< entity hit by a link that the joint moves; 0: none
  /// Metres per unit of `value`: bound on the displacement of any point that the joint moves, for
  /// all values of the other joints.
  double leverArm = 0;
};

struct AvatarSnapshot {
  EntityId id = 0;
  std::string name;
  Vec3 footPosition = Vec3::Zero();    ///< scene frame, metres: the centre of the soles
  Vec3 viewDirection = Vec3::UnitX();  ///< scene frame, unit length
  double eyeHeight = 1.6;              ///< metres above the feet
  bool grounded = false;
  std::shared_ptr<const AvatarShape> shape;
  bool flying = false;
  EntityId groundEntity = 0;  ///< entity it stands on; 0: none
  double height = 1.75;       ///< metres, current height of the prism; 0 for a shape made of parts
  double spawnHeight = 0;     ///< metres, height of the prism at spawn; 0 for a shape made of parts
  MoveResult move;
  std::vector<JointSnapshot> joints;  ///< empty without a chain
  double facing = 0;                  ///< degrees, of its parts and links; 0 for a mere prism
  double turnRadius = 0;              ///< as computeTurnRadius()
  std::uint32_t teleports = 0;        ///< since it spawned
  std::uint64_t lastStoppedTick = 0;  ///< the last one with `move.blockedBy`; 0: none
};

struct BodySnapshot {
  EntityId id = 0;          ///< of its first object
  std::uint32_t index = 0;  ///< into Model::bodies
  /// worldFromBody; the body's frame has its origin at Scene::bodyShape(index).origin.
  collision::Pose pose;
  bool displaced = false;    ///< its pose differs from the authored one
  double jointPosition = 0;  ///< of BodySpec's joint; 0 for rigid bodies and triggers
  Vec3 velocity = Vec3::Zero(), angularVelocity = Vec3::Zero();  ///< m/s, rad/s, scene frame
  double velocityDeviation = 0;  ///< m/s: bound on a point's deviation from that motion in the tick
  bool moving = false;           ///< moved in this tick, or rigid and awake
  EntityId blockedBy = 0;        ///< entity that it cannot push aside; 0: none
};

struct Snapshot {
  std::uint64_t tick = 0;
  double time = 0;  ///< seconds
  std::uint64_t stateHash = 0;
  std::vector<AvatarSnapshot> avatars;  ///< ascending ids
  /// In the order of Model::bodies; never null. Shared with the previous snapshot if unchanged.
  std::shared_ptr<const std::vector<BodySnapshot>> bodies;
};

}  // namespace enfilade::scene
