// Orders for avatars and commands for bodies. Each avatar has a queue, keyed by its name. Its
// orders run in sequence; the queues of different avatars run in parallel. Positions: scene frame,
// metres.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::scene {

using collision::Vec3;

/// A body of the scene. Clients name it; submission replaces the name by the index.
struct BodyHandle {
  BodyHandle() = default;
  BodyHandle(std::string bodyName) : name(std::move(bodyName)) {}
  BodyHandle(const char* bodyName) : name(bodyName) {}
  explicit BodyHandle(std::uint32_t bodyIndex) : index(bodyIndex) {}

  std::string name;         ///< BodySpec::name; empty after submission
  std::uint32_t index = 0;  ///< into Model::bodies; valid after submission
  bool operator==(const BodyHandle&) const = default;
};

/// Maximum number of queued orders and waypoints in one world: about 30 MB.
inline constexpr std::size_t kMaxQueuedOrders = 1'000'000;

/// Joint between a link and its parent, in the frame of the parent (or of the avatar).
struct LinkJoint {
  enum class Kind : std::uint8_t { revolute, prismatic };
  Kind kind = Kind::revolute;
  Vec3 anchor = Vec3::Zero();      ///< metres: origin of the link's frame for value 0
  Vec3 axis = Vec3::UnitY();       ///< any non-zero length
  double low = -3.14159265358979;  ///< radians or metres; the value stays in low..high
  double high = 3.14159265358979;
};

/// A convex part moved by a joint. Links form a tree; a parent precedes its links.
struct Link {
  std::int32_t parent = -1;  ///< index of a link; -1: the avatar's base
  LinkJoint joint;
  std::vector<Vec3> points;  ///< metres, link frame; the link is their convex hull
  double value = 0;          ///< radians or metres, at spawn
};

/// Creates an avatar.
struct Spawn {
  Vec3 position = Vec3::Zero();  ///< of the feet
  double facing = 0;             ///< degrees about +Y; 0 looks along +X, 90 along -Z
  double radius = 0.3;           ///< metres, 0.05..5
  double height = 1.75;          ///< metres, 0.2..10
  bool flying = false;           ///< needs no floor; falls only after Fly{false}
  /// Points of convex parts that replace the prism; empty: the prism. Metres, origin at the feet,
  /// +X ahead, before the rotation by `facing`.
  std::vector<std::vector<Vec3>> parts = {};
  std::vector<Link> links = {};  ///< a chain on the parts or the prism
  bool selfContact = false;      ///< non-adjacent links collide with one another
};
/// A lift must stand at a stop before a walk continues.
struct Ride {
  std::uint32_t waypoint = 0;  ///< index: before the walk to this one
  BodyHandle lift;
  std::uint32_t level = 0;  ///< stop number, from 0
  bool operator==(const Ride&) const = default;
};
/// Walks to the waypoints in sequence. Opens doors in its way, calls lifts, and waits for them.
struct Walk {
  std::vector<Vec3> waypoints;         ///< waypoints, at least one
  double speed = 1.4;                  ///< metres per second, > 0
  std::vector<BodyHandle> opens = {};  ///< doors
  std::vector<Ride> rides = {};        ///< ascending waypoints
  std::size_t opensFrom = 0;           ///< waypoints to reach before it opens any door
  bool fromFloor = false;              ///< if the avatar falls, begins when it stands
};
/// Limits of a Walk order.
inline constexpr std::size_t kMaxWalkDoors = 256, kMaxRides = 256;
/// Turns the view to a point. While the avatar is driven, the view stays there until the next Drive
/// or Walk.
struct Look {
  Vec3 target;
};
/// Delays the next order.
struct Wait {
  double seconds = 0;
};
/// Requests an image of this tick from the avatar's view.
struct Capture {
  std::string name;  ///< a file-name stem: letters, digits, '.', '_', '-'
};
/// Removes the avatar.
struct Leave {};
/// Sets a persistent velocity, m/s; (0,0,0) stops. A walking avatar ignores the vertical component.
/// It is not queued: it drops the queue and acts at the next tick.
struct Drive {
  Vec3 velocity = Vec3::Zero();
};
/// Jumps so that the feet rise by `height` metres, and ends at the landing.
struct Jump {
  double height = 0.5;  ///< metres, > 0..WorldSettings::maxJumpHeight
  /// horizontal velocity in the air, m/s; nullopt: that of the last Drive
  std::optional<Vec3> velocity = {};
};
/// Starts or ends flying: no gravity, and motion in all three directions.
struct Fly {
  bool on = true;
};
/// Changes the height of the prism; an increase needs free space. 0: the height at spawn.
struct Crouch {
  double height = 0;  ///< metres, kMinCrouchFraction..1 times the height at spawn
};
inline constexpr double kMinCrouchFraction = 0.3;

/// Moves joints towards target values until all are reached or no joint makes progress.
struct DriveJoints {
  /// radians or metres, one per link from the first; nullopt: this joint stays
  std::vector<std::optional<double>> targets;
  double speed = 1;        ///< rad/s or m/s, > 0..WorldSettings::maxJointSpeed
  bool immediate = false;  ///< not queued: drops the queue and acts at the next tick
};

/// Turns the view about the vertical, and with it the parts and links; a prism itself does not
/// rotate. Obstacles stop parts and links.
struct Turn {
  double angle = 0;  ///< degrees; relative: counter-clockwise seen from above; otherwise a facing
  bool relative = true;
  double rate = 90;  ///< degrees per second, > 0..WorldSettings::maxJointSpeed
};

/// Places the avatar elsewhere, if it has room there.
struct Teleport {
  Vec3 position = Vec3::Zero();  ///< of the feet, as Spawn::position
  std::optional<double> facing;  ///< degrees, as Spawn::facing; nullopt: it keeps its own
};

using Order = std::variant<Spawn, Walk, Look, Wait, Capture, Leave, Drive, Jump, Fly, Crouch,
                           DriveJoints, Turn, Teleport>;

// Limits of a Spawn order.
inline constexpr std::size_t kMaxParts = 32;
inline constexpr std::size_t kMaxLinks = 32;
inline constexpr std::size_t kMaxPartPoints = 256;
inline constexpr double kMaxPartCoordinate = 100;  ///< metres: magnitude of coordinates

/// An order for the avatar of a name.
struct Command {
  std::string avatar;  ///< name: 1..64 letters, digits, '.', '_', '-'
  Order order;
  std::uint64_t tag = 0;  ///< returned in the notices of this command
};

/// Command for a kinematic body. Acts at the next tick; the last one takes precedence.
struct BodyCommand {
  enum class Action : std::uint8_t {
    open,         ///< doors: to the limit that is farther from BodySpec::closed
    close,        ///< doors: to BodySpec::closed
    stop,         ///< at its current position
    moveTo,       ///< to joint position `target` (radians or metres); not for paths
    moveToLevel,  ///< lifts: to stop number `level`, counted from 0
    run           ///< paths: continue; restart if the end was reached
  };
  BodyHandle body;
  Action action = Action::open;
  double target = 0;
  std::uint32_t level = 0;
  std::optional<double> speed;  ///< of the joint, from now on; nullopt: BodySpec::speed
};

}  // namespace enfilade::scene
