// An avatar in a world, and its queued orders.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"
#include "scene/world/data/chain.hpp"
#include "scene/world/data/contact.hpp"
#include "scene/world/data/obstacle.hpp"
#include "scene/world/data/orders.hpp"
#include "scene/world/data/query_count.hpp"

namespace enfilade::scene {

/// Progress of a walk: the minimum distance to its current waypoint so far.
struct WalkProgress {
  std::size_t waypointIndex = 0;  ///< index of the current waypoint
  double minDistance = -1;        ///< metres, horizontal or, if flying, in space; -1: none yet
  double timeoutLeft = 0;         ///< seconds
  std::uint32_t calls = 0;        ///< commands that this walk has given to doors and lifts
  EntityId waitsFor = 0;          ///< door or lift; 0: none
  bool yields = false;            ///< to a walker ahead of it (avatars/yielding.hpp)
  /// The tick in which the first of its queue was free. It passes from one to the next each tick,
  /// so it ages where a queue has no free first one.
  std::uint64_t flowTick = 0;
};

/// A turn under way, in degrees.
struct TurnProgress {
  double heading = 0;      ///< of the view
  double left = 0;         ///< counter-clockwise seen from above
  double rate = 0;         ///< degrees per second; 0: no order
  double timeoutLeft = 0;  ///< seconds
  EntityId blockedBy = 0;  ///< in the last tick
};

struct Avatar {
  std::string name;
  EntityId id = 0;
  std::shared_ptr<const AvatarShape> shape;
  std::shared_ptr<const Spawn> spawnOrder;  ///< the order with its parts or links; null: a prism
  Vec3 footPosition = Vec3::Zero();         ///< scene frame, metres
  Vec3 viewDirection = Vec3::UnitX();       ///< unit
  double eyeHeight = 0;
  double fallSpeed = 0;  ///< metres per second, downwards > 0
  bool grounded = false;
  EntityId groundEntity = 0;  ///< entity it stands on; 0 if not grounded
  bool flying = false;
  bool jumping = false;
  double spawnHeight = 0;  ///< metres, of the prism at spawn; 0 for a shape made of parts
  double height = 0;       ///< metres, current height of the prism
  double radius = 0;       ///< metres, of the prism
  std::vector<TurningHull> turningParts;  ///< of the spawn order; empty for a prism
  std::vector<AvatarPart> baseParts;  ///< parts of `shape` that are no links; empty without a chain
  Chain chain;
  double facing = 0;  ///< degrees, of its parts and links; 0 for a mere prism
  TurnProgress turn;
  bool viewHeld = false;                ///< the view does not follow the driven velocity
  std::uint32_t teleports = 0;          ///< since it spawned
  Vec3 driveVelocity = Vec3::Zero();    ///< m/s, requested by Drive
  Vec3 desiredVelocity = Vec3::Zero();  ///< m/s, requested by its orders in this tick
  WalkProgress walk;
  double waitTimeLeft = -1;     ///< seconds; negative: not waiting
  double stalledInAirTime = 0;  ///< seconds without motion in the air, in or before an order

  // Results of the last motion.
  Vec3 lastDisplacement = Vec3::Zero();
  Vec3 requestedDisplacement = Vec3::Zero();  ///< metres
  bool idle = false;   ///< grounded, at rest, no moving neighbours: skipped in this tick
  bool dirty = false;  ///< shape or position changed since: not idle in this tick
  EntityId blockedBy = 0;
  std::uint64_t lastStoppedTick = 0;  ///< the last one with `blockedBy`; 0: none. Not hashed
  bool pairsChanged = true;  ///< its broad-phase pairs changed since `obstacles` were collected
  collision::SeparationResult blockingHit;  ///< to `blockedBy`, where the move ended
  bool blockedReported = false;             ///< driven against an obstacle; reported at the start

  // Caches from tick to tick. They change no verdict, but the last bits of distances and so of the
  // motion. They are determined by the commands; a copy of a world must copy them.
  collision::ProxyId proxy = 0;
  Aabb motionBounds;  ///< bounds of its motion in this tick, scene frame, metres
  Aabb cachedBounds;  ///< region in which `obstacles` are complete
  ObstacleSet obstacles;
  QueryCount work;                ///< of its motion and contacts in this tick
  BoxWork boxWork;                ///< for boxes of its parts and links
  bool hasBodyObstacles = false;  ///< `obstacles` contain parts of bodies
  std::vector<Contact> contacts;  ///< ascending `other`; part of the state, not a cache
};

/// Whether parts or links turn with the avatar. A mere prism does not: only its view turns.
inline bool turnsShape(const Avatar& avatar) {
  return avatar.spawnOrder != nullptr;
}
/// Whether its joints or a turn change its shape.
inline bool changesShape(const Avatar& avatar) {
  return avatar.chain.speed > 0 || (avatar.turn.left != 0 && turnsShape(avatar));
}

struct QueuedOrder {
  Order order;
  std::uint64_t tag = 0;
};

/// The orders for a name, in sequence. Exists while it holds orders or the avatar is in the world.
struct OrderQueue {
  std::string name;
  EntityId avatar = 0;  ///< of this name; 0: not in the world
  std::deque<QueuedOrder> orders = {};
};

}  // namespace enfilade::scene
