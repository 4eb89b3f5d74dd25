// Writes paths of navigation into replies: doors and legs of those that were found, the reason of
// others.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "protocol/enfilade.pb.h"
#include "scene/navigation/navigation.hpp"
#include "scene/world/queries/entity_index.hpp"

namespace enfilade::server {

/// A door, closed or half open, that stands on a path through open ones.
struct BlockingDoor {
  std::uint32_t body = 0;                ///< index into Model::bodies
  scene::Vec3 at = scene::Vec3::Zero();  ///< where an agent meets it: feet, scene frame, metres
  double openWidth = 0;  ///< metres clear at its leaf once it is open; 0: not measured
};

/// The reasons why no path leads from one island to another one, as the first query found them.
using ClosedDoors = std::map<std::pair<std::uint32_t, std::uint32_t>, BlockingDoor>;

/// The last paths of avatars that asked to keep them, by name.
using KeptPaths = std::map<std::string, std::optional<scene::KeptPath>, std::less<>>;

/// The means to find the paths of a query.
struct PathAnswer {
  const scene::Scene& scene;
  scene::Navigation& navigation;
  const scene::Snapshot& snapshot;  ///< of the world at the tick of the reply
  const scene::WorldSettings& settings;
  bool doorsOpen = false;  ///< of `navigation`
  /// The same with open doors; builds meshes at the first call. Null without doors.
  std::function<scene::Navigation&()> withOpenDoors;
  std::function<scene::Navigation&()> asTheyAre;  ///< the same with doors as they are
  std::function<scene::EntityIndex&()> index;     ///< built at the first call
  ClosedDoors& closedDoors;                       ///< those that are known, of `navigation`
  scene::Navigation::Progress progress = {};      ///< of building meshes; may be empty
  const char* doorRemedy = "open it, or ask with open doors";  ///< of a closed door
  std::optional<scene::KeptPath>* kept = nullptr;  ///< of the agent of the query; null: not asked
};

/// A standing place in one of some named places. On the island of `start` if there is any, else one
/// that is on it once doors are open, else the closest. nullopt: without room.
std::optional<scene::Vec3> findPlaceIn(scene::Navigation& navigation,
                                       const std::function<scene::Navigation&()>& withOpenDoors,
                                       std::span<const scene::NamedPlace> named,
                                       const std::optional<scene::Vec3>& start);

/// The measures of a path that is found.
struct PathMeasures {
  bool narrowest = false, steps = false;
};

/// The path from one place to another.
void writePath(const PathAnswer& answer, const scene::Vec3& from, const scene::Vec3& to,
               const scene::PathOptions& options, const PathMeasures& measures,
               v1::NavigationPath& message);

}  // namespace enfilade::server
