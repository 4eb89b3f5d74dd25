// BodySpec: description of a body (door, lift, path, rigid body, trigger volume). Plain data of the
// model; an object without a spec is static.
// A body frame has its origin at `anchor` and, in the authored pose, the axes of the scene. The one
// degree of freedom of a kinematic body is its joint position. It is in radians about `axis`
// (hinged), metres along it (sliding, lift), or seconds since the path began (path). 0 is the
// authored pose; for a path this holds if its first key is zero.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::scene {

using collision::Vec3;

enum class BodyKind : std::uint8_t {
  hinged,   ///< rotates about the axis through the anchor, between two limits
  sliding,  ///< moves along the axis, between two limits
  lift,     ///< like sliding, with stops
  path,     ///< follows key frames
  rigid,    ///< dynamic: falls, is pushed, comes to rest
  trigger   ///< not solid, not drawn: reports entities that enter and leave
};

/// The source of a body's motion.
enum class MotionSource : std::uint8_t {
  none,   ///< nothing
  joint,  ///< its joint position (kinematic); only an obstacle that cannot yield stops it
  solver  ///< contacts, gravity and impulses (dynamic)
};

/// Properties that all bodies of a kind share.
struct BodyKindTraits {
  const char* name = nullptr;  ///< in files and messages
  MotionSource motion = MotionSource::none;
  bool isSolid = true;       ///< collides and is drawn
  bool isDoor = false;       ///< opens and closes
  bool rotates = false;      ///< joint position in radians about the axis; the anchor is required
  bool takesLimits = false;  ///< low, high, closedPosition
  bool takesStops = false;   ///< stops
  bool takesKeys = false;    ///< keys, loops, autoStart
};

/// The table of kinds, one row each. A kind without a row does not compile (-Werror=switch).
constexpr BodyKindTraits getTraits(BodyKind kind) {
  using enum MotionSource;
  switch (kind) {
    case BodyKind::hinged:
      return {
          .name = "hinged", .motion = joint, .isDoor = true, .rotates = true, .takesLimits = true};
    case BodyKind::sliding:
      return {.name = "sliding", .motion = joint, .isDoor = true, .takesLimits = true};
    case BodyKind::lift:
      return {.name = "lift", .motion = joint, .takesLimits = true, .takesStops = true};
    case BodyKind::path:
      return {.name = "path", .motion = joint, .takesKeys = true};
    case BodyKind::rigid:
      return {.name = "rigid", .motion = solver};
    case BodyKind::trigger:
      return {.name = "trigger", .isSolid = false};
  }
  return {};
}

/// Number of kinds: their values are 0 .. kBodyKindCount - 1.
inline constexpr std::uint8_t kBodyKindCount = [] {
  std::uint8_t count = 0;
  while (getTraits(static_cast<BodyKind>(count)).name != nullptr) ++count;
  return count;
}();

constexpr bool isKinematic(BodyKind kind) {
  return getTraits(kind).motion == MotionSource::joint;
}
constexpr bool isDynamic(BodyKind kind) {
  return getTraits(kind).motion == MotionSource::solver;
}
constexpr bool isTrigger(BodyKind kind) {
  return !getTraits(kind).isSolid;
}
constexpr const char* toString(BodyKind kind) {
  return getTraits(kind).name;
}

/// Source of a spec, by descending precedence.
enum class BodySource : std::uint8_t { sidecar, khr, extras, suffix, ifc };

/// The cause that opens a door, in addition to commands.
enum class OpenedBy : std::uint8_t {
  command,  ///< nothing
  touch     ///< an avatar that walks into it; it opens away from the avatar if it can
};

/// A key pose of a path, relative to the authored pose.
struct PathKey {
  double time = 0;             ///< seconds since the path began
  Vec3 offset = Vec3::Zero();  ///< metres, scene frame
  double angle = 0;            ///< radians about BodySpec::axis through the anchor
};

struct BodySpec {
  std::string name;  ///< unique among bodies; events and commands use it
  BodyKind kind = BodyKind::rigid;
  BodySource source = BodySource::sidecar;
  /// Indices into Model::objects, at least one; an object belongs to at most one body. The body's
  /// entity id is that of the first object.
  std::vector<std::uint32_t> objects;

  Vec3 anchor = Vec3::Zero();  ///< scene frame, metres; see the file's head
  Vec3 axis = Vec3::UnitY();   ///< scene frame, unit

  // hinged, sliding, lift: low <= 0 <= high.
  double low = 0, high = 0;   ///< limits of the joint position
  double closedPosition = 0;  ///< doors: closed joint position; open is the limit farther from it
  std::vector<double> stops;  ///< lift: joint positions, ascending
  double speed = 1;           ///< of the joint position per second, > 0
  double acceleration = 0;    ///< of the joint position; 0: full speed at once
  std::optional<double> autoCloseDelay;  ///< seconds until an open door closes; nullopt: only by
                                         ///< command
  OpenedBy openedBy = OpenedBy::command;

  // path
  std::vector<PathKey> keys;  ///< times ascending from 0; at least two
  bool loops = false;         ///< repeats; the last key pose must equal the first one
  bool autoStart = true;      ///< starts with the first tick; false: by command

  // rigid
  double density = 500;                 ///< kilograms per cubic metre
  std::optional<double> mass;           ///< kilograms; nullopt: computed from the density
  double friction = 0.5;                ///< Coulomb friction, >= 0
  double restitution = 0;               ///< 0..1
  Vec3 velocity = Vec3::Zero();         ///< at the start, of the centre of mass, m/s, scene frame
  Vec3 angularVelocity = Vec3::Zero();  ///< at the start, rad/s, scene frame
};

/// A path that repeats.
inline bool isLoopingPath(const BodySpec& body) {
  return getTraits(body.kind).takesKeys && body.loops;
}

/// Limits of a kinematic body's joint position: low, high.
std::pair<double, double> getJointLimits(const BodySpec& spec);

/// Doors: the limit that is farther from BodySpec::closedPosition.
double findOpenLimit(const BodySpec& spec);

/// Seconds, upper bound, of an unobstructed motion of the joint position by `distance` at its own
/// speed.
double computeMotionSeconds(const BodySpec& spec, double distance);

/// Maximum speed of any point, m/s, of a kinematic body at a joint velocity of 1 per second.
/// `radius`: of its shape, metres.
double computeMaxPointSpeed(const BodySpec& spec, double radius);

const char* toString(BodySource source);

/// Return an error text that names the field; nullopt if the body's values are valid.
std::optional<std::string> validateBody(const BodySpec& body);

/// Validates a speed of the joint position, of a spec or a command.
std::optional<std::string> validateSpeed(double speed);

}  // namespace enfilade::scene
