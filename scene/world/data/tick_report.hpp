// The report of a tick: contact events, notices of orders, stage times, counters and the audit.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/world/data/query_count.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// A pair that is missing in the broad phase, or superfluous.
struct AuditFinding {
  enum class Kind : std::uint8_t {
    missed,  ///< boxes overlap, but the pair is missing: a contact may be lost
    extra    ///< boxes do not overlap: unnecessary work
  };
  Kind kind = Kind::missed;
  EntityId entity = 0;  ///< an avatar or a body
  EntityId other = 0;   ///< a static object, avatar or body; 0: no longer exists
  Aabb entityBox;       ///< its motion bounds in the tick; scene frame, metres
  Aabb otherBox;        ///< empty when `other` is 0
};

struct TickAudit {
  std::uint32_t proxies = 0;           ///< avatars and bodies whose pairs were compared
  std::uint64_t pairs = 0;             ///< found for them by brute force
  std::vector<AuditFinding> findings;  ///< ascending entity; empty: the tick passed
  double seconds = 0;                  ///< wall time of the audit; not part of any stage
};

/// The work of one avatar in a tick.
struct AvatarWork {
  EntityId id = 0;
  std::uint32_t narrowQueries = 0;
  std::uint32_t partsLookedAt = 0;
  Vec3 footPosition = Vec3::Zero();  ///< after the tick
};

/// A contact, near miss, block or trigger event of a tick.
struct ContactEvent {
  enum class Kind : std::uint8_t { begin, end, nearMiss, blocked, enter, leave, leftWorld };
  enum class Reason : std::uint8_t { separated, left, shutdown };
  /// Phase of a near miss: begin; closest approach (with its own tick and separation, reported
  /// after the end if no contact followed); end.
  enum class Phase : std::uint8_t { none, begin, min, end };

  std::uint64_t tick = 0;
  double time = 0;  ///< seconds
  Kind kind = Kind::begin;
  Reason reason = Reason::separated;  ///< for `end` and `leave`
  Phase phase = Phase::none;
  /// An avatar or a body; for `blocked` the entity that was stopped.
  EntityId a = 0;
  /// The other entity. Each pair is reported once. `a` is the avatar of lower id, else the avatar,
  /// else the rigid body, else the moving kinematic body, else the entity of lower id. `enter`,
  /// `leave`: `b` is the trigger. `leftWorld` (a rigid body far outside the scene): `b` is 0.
  EntityId b = 0;
  collision::SeparationResult separation;  ///< points and normal (from a to b), scene frame
};

/// Status report of an order.
struct Notice {
  enum class Kind : std::uint8_t {
    spawned,  ///< the avatar entered at `position`
    refused,  ///< invalid order, reason in `text`; a refused Spawn drops the queue, too
    dropped,  ///< removed from the queue before it ran; cause in `text`
    arrived,  ///< the walk reached its last waypoint
    blocked,  ///< no progress for WorldSettings::stuckTimeout, by `obstacle` or 0
    done,     ///< completed
    capture,  ///< an image from this avatar in this tick is requested; name in `text`
    left
  };
  Kind kind = Kind::done;
  std::string avatar;
  EntityId id = 0;
  std::uint64_t tag = 0;
  Vec3 position = Vec3::Zero();  ///< the feet; of a refused Spawn, the place that it gave
  EntityId obstacle = 0;
  std::string text;
  bool isAvatarUnknown = false;  ///< refused, because no avatar has this name
};

/// Timed stages of a tick, in order of execution.
enum class Stage : std::uint8_t {
  commands,
  broad,
  bodies,
  avatars,
  solver,
  narrow,
  hash,
  snapshot
};
inline constexpr std::size_t kStageCount = 8;
inline constexpr std::array<const char*, kStageCount> kStageNames{
    "commands", "broad", "bodies", "avatars", "solver", "narrow", "hash", "snapshot"};

struct TickReport {
  std::shared_ptr<const Snapshot> snapshot;
  std::vector<ContactEvent> contacts;  ///< sorted by (a, b, kind)
  std::vector<Notice> notices;         ///< by avatar name, then in order of occurrence
  std::array<double, kStageCount> stageSeconds{};
  std::uint32_t pairs = 0;                  ///< in the broad phase
  std::uint32_t narrowQueries = 0;          ///< by shape casts, contacts and the solver
  std::uint32_t rationalQueries = 0;        ///< of those, decided by exact arithmetic
  std::uint32_t iterationLimitedCasts = 0;  ///< shape casts stopped at their iteration limit
  std::uint64_t verticesLookedAt = 0;       ///< for the boxes of moving bodies and of avatars
  std::uint64_t partBoxesMade = 0;          ///< of bodies with several parts, and of avatars
  std::uint64_t partsLookedAt = 0;          ///< triangles and hulls in reach of avatars' queries
  std::vector<AvatarWork> avatarWork;       ///< of all avatars, by their names
  std::uint32_t activeContacts = 0;
  std::uint32_t crushedBodies = 0;  ///< penetrating pairs of a kinematic and a rigid body
  /// Maximum depth of avatars and rigid bodies, metres, by the exact verdict; 0: no penetration.
  double maxPenetration = 0;
  std::optional<TickAudit> audit;  ///< only if the tick was audited
  /// All queues are empty, no avatar is falling or driven, no body moves except on a path.
  bool idle = true;
};

}  // namespace enfilade::scene
