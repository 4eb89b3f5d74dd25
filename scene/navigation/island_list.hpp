// IslandList: the islands (connected components) of a navigation mesh on which an agent can stand.
// An island may be a roof. No open portal joins two islands.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "scene/navigation/mesh/navigation_mesh.hpp"
#include "scene/navigation/mesh/off_mesh_connections.hpp"
#include "scene/navigation/walk/walker.hpp"

namespace enfilade::scene {

/// Metres between floors on both sides of a thick wall
inline constexpr double kWallAndDoor = 1.5;
inline constexpr std::uint32_t kNoIsland = std::numeric_limits<std::uint32_t>::max();

struct Island {
  double area = 0;            ///< square metres
  Vec3 place = Vec3::Zero();  ///< where an agent stands on it: feet, scene frame, metres
  /// Roof: most of its area is open to the sky and above other islands.
  bool isRoof = false;
  /// Random places without an island are drawn here: no roof, and not tiny.
  bool isDrawn = false;
};

struct IslandList {
  std::vector<std::uint32_t> numberOf;  ///< by polygon; kNoIsland: an agent cannot stand there
  std::vector<Island> islands;          ///< by number: the largest first
};

/// Leaves out islands on which no place to stand is found, as those in the inside of solids.
/// joinIslands() decides whether an island is drawn. `bounds`: of the scene.
IslandList collectIslands(const NavigationMesh& mesh, Walker& walker, const Aabb& bounds);

/// Makes one of islands between which off-mesh connections lead in both directions, and decides
/// which are drawn.
void joinIslands(IslandList& list, const ConnectionList& connections);

/// The number of the island on which an agent stands; nullopt: on none. The mesh ends at a distance
/// from the edge of a floor. A place there has the island of the closest mesh to which an agent
/// walks, and back.
std::optional<std::uint32_t> findIslandAt(const NavigationMesh& mesh, const IslandList& list,
                                          Walker& walker, const Vec3& place);

/// Another island that is close, and the points of both that are closest, about.
struct IslandNeighbour {
  std::uint32_t number = 0;
  double distance = 0;  ///< metres, horizontal
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();
};

/// The islands within `reach` metres of an island, horizontally, on about its height: the closest
/// first.
std::vector<IslandNeighbour> findNeighbours(const NavigationMesh& mesh, const IslandList& list,
                                            std::uint32_t number, double reach, double heightReach);

}  // namespace enfilade::scene
