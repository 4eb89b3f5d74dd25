// What a body is said to be: doors, lifts, things on paths, free rigid bodies, trigger volumes.
// Plain data that comes with the model; all that no spec names is still.
//
// A body's frame has its origin at `anchor`, and the axes of the scene where the body stands as it
// was authored. Its one degree of freedom is its coordinate: radians about `axis` (hinged), metres
// along it (sliding, lift), seconds since the path began (path). 0 is the authored place, for a
// path if its first key says so.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::scene {

using collision::Vec3;

struct Model;

enum class BodyKind : std::uint8_t {
  hinged,   ///< turns about the axis through the anchor, between two limits
  sliding,  ///< moves along the axis, between two limits
  lift,     ///< as sliding, with stops to be called to
  path,     ///< follows key frames
  rigid,    ///< free: falls, is pushed, comes to rest
  trigger   ///< not solid, not drawn: tells who enters and leaves
};

/// Where a spec comes from, highest first.
enum class BodySource : std::uint8_t { sidecar, khr, extras, suffix, ifc };

/// Who opens a door besides commands.
enum class OpenedBy : std::uint8_t {
  command,  ///< nobody
  touch     ///< an avatar that walks into it; it opens away from the avatar where it can
};

/// A place on a path, relative to the authored one.
struct PathKey {
  double time = 0;             ///< seconds since the path began
  Vec3 offset = Vec3::Zero();  ///< metres, scene frame
  double turn = 0;             ///< radians about BodySpec::axis through the anchor
};

struct BodySpec {
  std::string name;  ///< unique among bodies; events and commands use it
  BodyKind kind = BodyKind::rigid;
  BodySource source = BodySource::sidecar;
  /// Indices into Model::objects of what moves with it: at least one, each in one body at most. The
  /// first one's entity id is the body's.
  std::vector<std::uint32_t> objects;

  Vec3 anchor = Vec3::Zero();  ///< scene frame, metres; see the file's head
  Vec3 axis = Vec3::UnitY();   ///< scene frame, unit

  // hinged, sliding, lift: low <= 0 <= high.
  double low = 0, high = 0;           ///< of the coordinate
  double closed = 0;                  ///< doors: coordinate; open: the limit farther from it
  std::vector<double> stops;          ///< lift: coordinates, ascending
  double speed = 1;                   ///< of the coordinate per second, > 0
  double acceleration = 0;            ///< of the coordinate; 0: it has its speed at once
  std::optional<double> closesAfter;  ///< seconds that it stays open; none: until told
  OpenedBy openedBy = OpenedBy::command;

  // path
  std::vector<PathKey> keys;  ///< times ascending from 0; at least two
  bool loops = false;         ///< begins again; then the last key is where the first one is
  bool runs = true;           ///< from the first tick on; else when it is told

  // rigid
  double density = 500;          ///< kilograms per cubic metre
  std::optional<double> mass;    ///< kilograms; none: from the density
  double friction = 0.5;         ///< Coulomb's, >= 0
  double restitution = 0;        ///< 0..1
  Vec3 velocity = Vec3::Zero();  ///< at the start, of the centre of mass, m/s, scene frame
  Vec3 spin = Vec3::Zero();      ///< at the start, rad/s, scene frame
};

/// Driven along its coordinate, and nothing but what cannot yield stops it.
constexpr bool isKinematic(BodyKind kind) {
  return kind != BodyKind::rigid && kind != BodyKind::trigger;
}

/// A path that begins again, whenever it goes.
inline bool goesRound(const BodySpec& body) {
  return body.kind == BodyKind::path && body.loops;
}

/// Of the coordinate of a kinematic body: low, high.
std::pair<double, double> limitsOf(const BodySpec& spec);

/// Metres a second of the fastest point of a kinematic body whose coordinate goes by 1 a second.
/// `radius`: of its shape, metres.
double fastestPointOf(const BodySpec& spec, double radius);

const char* wordOf(BodyKind kind);
const char* wordOf(BodySource source);

/// What is wrong with one body's numbers, naming the field; nullopt when nothing is.
std::optional<std::string> refusalOfBody(const BodySpec& body);

/// What is wrong with a speed of the coordinate, of anything that may go.
std::optional<std::string> refusalOfSpeed(double speed);

/// What is wrong with the model's bodies, naming body and field; nullopt when nothing is.
std::optional<std::string> refusalOfBodies(const Model& model);

}  // namespace enfilade::scene
