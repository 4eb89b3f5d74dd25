// The world: a still scene, the avatars in it, and what they were told to do. Plain data; the free
// functions below act on it, and only tick() changes it.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "collision/narrow_phase.hpp"
#include "scene/audit.hpp"
#include "scene/lengths.hpp"
#include "scene/scene.hpp"
#include "scene/snapshot.hpp"

namespace enfilade::scene {

// ---- commands ----------------------------------------------------------------------------------
// Each avatar has a queue, keyed by its name; its orders run in order, different avatars together.
// Positions are in the scene's frame, in metres.

struct Spawn {
  Vec3 at = Vec3::Zero();  ///< the feet
  double facing = 0;       ///< degrees about +Y; 0 looks along +X, 90 along -Z
  double radius = 0.3;     ///< metres, 0.05..5
  double height = 1.75;    ///< metres, 0.2..10
};
struct Walk {
  std::vector<Vec3> along;  ///< way points, at least one
  double speed = 1.4;       ///< metres per second, > 0
};
struct Look {
  Vec3 at;
};
struct Wait {
  double seconds = 0;
};
struct Capture {
  std::string as;  ///< a file-name stem: letters, digits, '.', '_', '-'
};
struct Leave {};
/// Walks with this horizontal velocity from now on, until the next Drive; (0,0,0) stops.
/// Unlike the others it does not queue: it drops what is queued and acts at the next tick.
struct Drive {
  Vec3 velocity = Vec3::Zero();
};

using Order = std::variant<Spawn, Walk, Look, Wait, Capture, Leave, Drive>;

struct Command {
  std::string avatar;  ///< name: 1..64 letters, digits, '.', '_', '-'
  Order order;
  std::uint64_t tag = 0;  ///< given back in the notices that this command causes
};

// ---- what a tick tells -------------------------------------------------------------------------

struct ContactEvent {
  enum class Kind : std::uint8_t { begin, end, near, blocked };
  enum class Reason : std::uint8_t { parted, left, shutdown };

  std::uint64_t tick = 0;
  double time = 0;  ///< seconds
  Kind kind = Kind::begin;
  Reason reason = Reason::parted;  ///< for `end`
  EntityId a = 0;                  ///< an avatar; for `blocked` the one that was stopped
  EntityId b = 0;                ///< a still object or an avatar: of a greater id unless `blocked`
  collision::Decision decision;  ///< points and normal (from a to b) in the scene's frame
};

/// How an order went.
struct Notice {
  enum class Kind : std::uint8_t {
    spawned,  ///< at `position`
    refused,  ///< the order cannot be done: `text` says why; for Spawn the queue is dropped too
    arrived,  ///< the walk reached its end
    blocked,  ///< no progress for Lengths::patience; `obstacle` is what stopped it, or 0
    done,     ///< looked or waited
    capture,  ///< a picture of this tick from this avatar is due; `text` is its name
    left
  };
  Kind kind = Kind::done;
  std::string avatar;
  EntityId id = 0;
  std::uint64_t tag = 0;
  Vec3 position = Vec3::Zero();  ///< the feet
  EntityId obstacle = 0;
  std::string text;
};

enum class Stage : std::uint8_t { commands, broad, avatars, narrow, hash, snapshot };
inline constexpr std::size_t kStages = 6;
inline constexpr std::array<const char*, kStages> kStageNames{"commands", "broad", "avatars",
                                                              "narrow",   "hash",  "snapshot"};

struct TickReport {
  std::shared_ptr<const Snapshot> snapshot;
  std::vector<ContactEvent> contacts;  ///< sorted by (a, b, kind)
  std::vector<Notice> notices;         ///< in order of avatar name, then as they happened
  std::array<double, kStages> stageSeconds{};
  std::uint32_t pairs = 0;            ///< that the broad phase holds
  std::uint32_t narrowQueries = 0;    ///< made by sweeps and contacts
  std::uint32_t rationalQueries = 0;  ///< of those, decided by exact arithmetic
  std::uint32_t boundedSweeps = 0;    ///< stopped by their iteration bound, before anything near
  std::uint32_t liveContacts = 0;
  double worstPenetration = 0;     ///< metres, by the exact verdict; 0 when nothing penetrates
  std::optional<TickAudit> audit;  ///< when the tick was audited
  bool idle = true;                ///< every queue is empty and nobody is falling or driven
};

// ---- the world ---------------------------------------------------------------------------------

struct WorldState;

class World {
 public:
  explicit World(std::shared_ptr<const Scene> scene, const Lengths& lengths = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  const Scene& scene() const;
  const Lengths& lengths() const;
  std::shared_ptr<const Snapshot> snapshot() const;  ///< of the last tick

  WorldState& state() { return *state_; }
  const WorldState& state() const { return *state_; }

 private:
  std::unique_ptr<WorldState> state_;
};

/// Why `command` cannot be taken, naming the field and the value; nullopt when it can. A NaN, an
/// infinity, an absurd coordinate (beyond 1e7 m) or speed is refused here and changes nothing.
std::optional<std::string> refusal(const World& world, const Command& command);

/// Hands a command to the next tick. Returns refusal() and does nothing when there is one.
std::optional<std::string> submit(World& world, Command command);

/// Advances the world by Lengths::tick.
TickReport tick(World& world);

/// From now on every `everyTicks`-th tick is audited (0: none, as at first): its pairs beside brute
/// force, avatars * (objects + avatars) box tests of some 5 ns, but no more avatars at a time than
/// take some 2 ms, in turn, and at least one.
void auditBroadPhase(World& world, std::uint32_t everyTicks);

/// Ends every contact with the given reason, as at shutdown; the world is not ticked after this.
std::vector<ContactEvent> endContacts(World& world, ContactEvent::Reason reason);

/// Path of a still object or name of an avatar (also one that left); "" for 0 or unknown.
std::string nameOf(const World& world, EntityId id);

}  // namespace enfilade::scene
