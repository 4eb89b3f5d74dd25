// What an avatar can be told. Each avatar has a queue, keyed by its name; its orders run in order,
// different avatars together. Positions are in the scene's frame, in metres.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::scene {

using collision::Vec3;

/// Orders and way points that may wait in one world: some 30 MB.
inline constexpr std::size_t kMostWaiting = 1'000'000;

/// How a link hangs on the one before it, in the frame of that one (or of the avatar).
struct LinkJoint {
  enum class Kind : std::uint8_t { revolute, prismatic };
  Kind kind = Kind::revolute;
  Vec3 anchor = Vec3::Zero();      ///< metres: origin of the link's frame when `value` is 0
  Vec3 axis = Vec3::UnitY();       ///< any length but zero
  double low = -3.14159265358979;  ///< radians or metres; the value stays in low..high
  double high = 3.14159265358979;
};

/// A convex piece that a joint moves. Links make a tree: `parent` comes before its links.
struct Link {
  std::int32_t parent = -1;  ///< index of a link; -1: the avatar's base
  LinkJoint joint;
  std::vector<Vec3> points;  ///< metres, in the link's frame: their hull is the link
  double value = 0;          ///< radians or metres, as it enters the world
};

struct Spawn {
  Vec3 at = Vec3::Zero();  ///< the feet
  double facing = 0;       ///< degrees about +Y; 0 looks along +X, 90 along -Z
  double radius = 0.3;     ///< metres, 0.05..5
  double height = 1.75;    ///< metres, 0.2..10
  bool flying = false;     ///< needs no floor, and falls only after Fly{false}
  /// Convex parts in the place of the prism: the points of each in the avatar's frame, +X ahead (as
  /// `facing` turns it), the feet at the origin. Empty: the prism.
  std::vector<std::vector<Vec3>> parts = {};
  std::vector<Link> links = {};  ///< a chain that stands on the parts or the prism
  bool selfContact = false;      ///< links that are no neighbours stop one another, too
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
/// Walks with this horizontal velocity from now on, until the next Drive; (0,0,0) stops. Who flies
/// takes the vertical part as well. Unlike the others it does not queue: it drops what is queued
/// and acts at the next tick.
struct Drive {
  Vec3 velocity = Vec3::Zero();
};
/// Leaves the ground so fast that the feet rise by `height` metres, and ends on the next ground.
struct Jump {
  double height = 0.5;  ///< metres, > 0..Lengths::jumpLimit
  /// metres per second over the ground while in the air; nullopt: as it is driven
  std::optional<Vec3> velocity = {};
};
/// From now on without gravity, walking and driving in all three directions; or no longer.
struct Fly {
  bool on = true;
};
/// Makes the prism so high; more than now only where there is room. 0: as high as it was spawned.
struct Crouch {
  double height = 0;  ///< metres, kLowestCrouch..1 of the spawned height
};
inline constexpr double kLowestCrouch = 0.3;

/// Moves joints towards these values until all are there or nothing moves any more.
struct DriveJoints {
  /// radians or metres, one a link from the first on; nullopt: this one stays as it is
  std::vector<std::optional<double>> to;
  double speed = 1;     ///< radians or metres per second, > 0..Lengths::jointSpeedLimit
  bool atOnce = false;  ///< does not queue: drops what is queued and acts at the next tick
};

using Order =
    std::variant<Spawn, Walk, Look, Wait, Capture, Leave, Drive, Jump, Fly, Crouch, DriveJoints>;

// What a spawn may ask for at most.
inline constexpr std::size_t kMostParts = 32;
inline constexpr std::size_t kMostLinks = 32;
inline constexpr std::size_t kMostPartPoints = 256;
inline constexpr double kLargestPart = 100;  ///< metres: coordinates of points and anchors

struct Command {
  std::string avatar;  ///< name: 1..64 letters, digits, '.', '_', '-'
  Order order;
  std::uint64_t tag = 0;  ///< given back in the notices that this command causes
};

}  // namespace enfilade::scene
