// PathFinder: the inputs of a path search; its result is a NavigationPath with its legs, or the
// Obstruction.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scene/navigation/mesh/navigation_mesh.hpp"
#include "scene/navigation/mesh/off_mesh_connections.hpp"
#include "scene/navigation/walk/walker.hpp"

namespace enfilade::scene {

/// The obstacle that blocks every path to a goal.
struct Obstruction {
  EntityId entity = 0;           ///< that the walker hit; 0: the floor ends
  Vec3 position = Vec3::Zero();  ///< of the walker's feet there, scene frame, metres
  double clearWidth = 0;         ///< metres between the obstacles there; 0: not measured
};

/// A part of a path, up to the first point of the next one.
struct PathLeg {
  /// aside: a walk to a place that no door sweeps over which opens after it.
  enum class Kind : std::uint8_t { walk, drop, lift, aside };
  Kind kind = Kind::walk;
  std::size_t first = 0;         ///< index of its first point
  double length = 0;             ///< metres that the agent walks
  double seconds = 0;            ///< expected; of a lift: until it has come, and of the ride
  std::uint32_t body = kNoBody;  ///< lift: index into Model::bodies
  std::uint32_t fromLevel = 0, toLevel = 0;  ///< lift: stops
};

struct NavigationPath {
  std::vector<Vec3> points;  ///< feet, scene frame, metres: waypoints of a Walk; empty: none found
  /// Metres that the feet move, from point to point in space. A stair between two points counts as
  /// a slope, a step next to a point with its height. Of falls the distance across, of rides
  /// nothing.
  double length = 0;
  /// Metres up and down in excess of the difference in height of both ends, if the path leads over
  /// a low object. 0 if it does not, or if the excess is small.
  double bumpClimb = 0;
  double feetLength = 0;  ///< FeetTravel::length() of the proof; 0: not measured
  double seconds = 0;     ///< expected, without waits for doors
  std::vector<PathLeg> legs;
  std::string reason;  ///< without a path: why
  std::optional<Obstruction> obstruction;

  bool found() const { return !points.empty(); }
  double cost() const { return length + bumpClimb; }  ///< metres; the search minimises it
};

/// Metres along a line on the ample mesh and on the scarce one; nullopt: none leads there.
using MeshLines = std::array<std::optional<double>, 2>;

/// A walk that a search found. It is kept for an agent on its way to the goal.
struct KeptPath {
  NavigationPath path;               ///< from where the agent was last
  std::uint64_t meshState = 0;       ///< of the meshes on which it was found
  Vec3 goal = Vec3::Zero();          ///< as it was given; the path ends where an agent stands
  Vec3 searchedFrom = Vec3::Zero();  ///< start of the search
  MeshLines lines;                   ///< as last measured
  std::array<double, 2> excess{};    ///< metres of the path beyond each, the least so far
  bool isNearLine = false;           ///< the search found a path about as short as a line
  double moved = 0;                  ///< metres since the lines were measured
  /// Of a path over steps: where the feet stood at its points when the whole was walked; nullopt:
  /// not known, or in the air. Empty: its legs are even.
  std::vector<std::optional<Vec3>> stood;
};

/// The last searches between two islands: they found nothing.
struct Refusals {
  int count = 0;
  NavigationPath last = {};  ///< the reason
};

struct UnobstructedMesh;

/// Inputs of a search. A search may close portals of the meshes.
struct PathFinder {
  const WorldData& world;
  const NavigationAgent& agent;
  Walker& walker;
  NavigationMesh& ample;
  NavigationMesh& scarce;
  /// The mesh of Clearance::none; built at the first call. Null: reasons are not sought.
  std::function<const UnobstructedMesh&()> unobstructed;
  std::size_t maxRepairWalks = 15'000;  ///< of a path: some tenths of a second
  /// Of the islands of both ends; null: these are one, or not known.
  Refusals* refusals = nullptr;
  const ConnectionList* connections = nullptr;  ///< of `ample`; null: none
};

}  // namespace enfilade::scene
