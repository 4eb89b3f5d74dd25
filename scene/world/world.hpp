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

#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/world/audit.hpp"
#include "scene/world/avatars/orders.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

// ---- commands ----------------------------------------------------------------------------------

/// Tells a kinematic body what to do. Acts at the next tick; the last one wins.
struct BodyCommand {
  enum class Action : std::uint8_t {
    open,   ///< doors: to the limit that is farther from the closed place
    close,  ///< doors: to BodySpec::closed
    stop,   ///< where it is
    to,     ///< to coordinate `to` (radians or metres); not for paths
    level,  ///< lifts: to stop number `level`, counted from 0
    run     ///< paths: on, from where it stopped; from the beginning when it is through
  };
  std::string body;  ///< BodySpec::name
  Action action = Action::open;
  double to = 0;
  std::uint32_t level = 0;
  std::optional<double> speed;  ///< of the coordinate, from now on; none: BodySpec::speed
};

// ---- what a tick tells -------------------------------------------------------------------------

struct ContactEvent {
  enum class Kind : std::uint8_t { begin, end, near, blocked, enter, leave, leftWorld };
  enum class Reason : std::uint8_t { parted, left, shutdown };
  /// Of `near`: it begins, was closest (with tick and decision of then; told when it is over
  /// without a contact), and is over.
  enum class Phase : std::uint8_t { none, begin, min, end };

  std::uint64_t tick = 0;
  double time = 0;  ///< seconds
  Kind kind = Kind::begin;
  Reason reason = Reason::parted;  ///< for `end` and `leave`
  Phase phase = Phase::none;
  /// An avatar or a body; for `blocked` the one that was stopped, which may be any body.
  EntityId a = 0;
  /// What it met. A pair is told once: by the avatar of lesser id, by an avatar before a body, by a
  /// rigid body before others, by a driven body before what stands, by the one of lesser id. For
  /// `enter` and `leave` the trigger; for `leftWorld`, told of a free body that fell or flew far
  /// beyond the scene, nothing.
  EntityId b = 0;
  collision::Decision decision;  ///< points and normal (from a to b) in the scene's frame
};

/// How an order went.
struct Notice {
  enum class Kind : std::uint8_t {
    spawned,  ///< at `position`
    refused,  ///< the order cannot be done: `text` says why; for Spawn the queue is dropped too
    dropped,  ///< the order was taken out of the queue and is not done: `text` says by what
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
inline constexpr std::size_t kStages = 8;
inline constexpr std::array<const char*, kStages> kStageNames{
    "commands", "broad", "bodies", "avatars", "solver", "narrow", "hash", "snapshot"};

struct TickReport {
  std::shared_ptr<const Snapshot> snapshot;
  std::vector<ContactEvent> contacts;  ///< sorted by (a, b, kind)
  std::vector<Notice> notices;         ///< in order of avatar name, then as they happened
  std::array<double, kStages> stageSeconds{};
  std::uint32_t pairs = 0;            ///< that the broad phase holds
  std::uint32_t narrowQueries = 0;    ///< made by sweeps and contacts
  std::uint32_t rationalQueries = 0;  ///< of those, decided by exact arithmetic
  std::uint32_t boundedSweeps = 0;    ///< and looks back on ways, that their iteration bound ended
  std::uint32_t liveContacts = 0;
  std::uint32_t squeezedBodies = 0;  ///< pairs of a kinematic body and a free one without way out
  /// Metres, by the exact verdict, of avatars and free bodies; 0 when none penetrates.
  double worstPenetration = 0;
  std::optional<TickAudit> audit;  ///< when the tick was audited
  /// Every queue is empty, nobody is falling or driven, and no body is on its way, but for paths.
  bool idle = true;
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

/// The same for a body's command.
std::optional<std::string> refusal(const World& world, const BodyCommand& command);
std::optional<std::string> submit(World& world, BodyCommand command);

/// Advances the world by Lengths::tick.
TickReport tick(World& world);

/// How many threads the solver may use for many free bodies: from 1 on, but no more than there are
/// processors; 0: two, as at first. Nothing that is told depends on it.
void setThreads(World& world, int threads);

/// From now on every `everyTicks`-th tick is audited (0: none, as at first): its pairs beside brute
/// force, avatars * (objects + avatars) box tests of some 5 ns, but no more avatars at a time than
/// take some 2 ms, in turn, and at least one.
void auditBroadPhase(World& world, std::uint32_t everyTicks);

/// Ends every contact with the given reason, as at shutdown; the world is not ticked after this.
std::vector<ContactEvent> endContacts(World& world, ContactEvent::Reason reason);

/// Path of a still object, name of a body or of an avatar (also one that left); "" for 0 or
/// unknown.
std::string nameOf(const World& world, EntityId id);

}  // namespace enfilade::scene
