// Navigation of one size of agent in a scene: proved paths, random places, islands. Recast proposes
// paths; each leg of a path is walked by the motion of avatars before it is returned.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "scene/navigation/clear_width.hpp"
#include "scene/navigation/island_list.hpp"
#include "scene/navigation/mesh_states.hpp"
#include "scene/navigation/path_search.hpp"
#include "scene/navigation/place_names.hpp"
#include "scene/navigation/unreachable_reasons.hpp"
#include "scene/navigation/walk/path_steps.hpp"
#include "scene/navigation/walk/walker.hpp"
#include "scene/world/world.hpp"

namespace enfilade::scene {

struct NavigationReport {
  std::size_t polygons = 0;         ///< of the mesh for ample clearance
  double area = 0;                  ///< square metres, of all islands
  std::vector<double> islandAreas;  ///< square metres, by number: descending
  std::size_t bytes = 0;  ///< of memory, with connections, drops, lifts, tried gaps, kept meshes
  double seconds = 0;     ///< to build or load the first meshes
};

inline constexpr double kMapTolerance = 0.5;  ///< metres: habitat-sim's default

/// The walkable cells of a map seen from above.
struct NavigationMap {
  Vec3 corner = Vec3::Zero();           ///< of cell 0, scene frame, metres: smallest x and z
  double cell = 0;                      ///< metres
  std::uint32_t width = 0, height = 0;  ///< cells along x and z
  std::vector<std::uint8_t> cells;      ///< row by row along x; 1: walkable
};

/// Restricts the places that are drawn at random. Without `near` and `island`: those of the islands
/// with Island::isDrawn.
struct RandomPlace {
  std::optional<Vec3> near = {};  ///< within `maxDistance` metres in space
  double maxDistance = 0;
  std::optional<Vec3> awayFrom = {};  ///< at least `minDistance` metres in space
  double minDistance = 0;
  std::optional<std::uint32_t> island = {};  ///< number as by findIsland()
};

/// Where Navigation::snapTo() looks for a place.
struct SnapTarget {
  Vec3 extents = Vec3::Zero();          ///< metres: half the box around the point
  std::optional<std::uint32_t> island;  ///< nullopt: any
  bool isDrawn = false;  ///< only islands with Island::isDrawn; a place within 2 mm stays
};

/// Thread-safe; queries run one after another. The state of bodies is that of the construction or
/// of the last update().
class Navigation {
 public:
  using Progress = MeshProgress;
  static constexpr double kTileShare = scene::kTileShare;

  /// Builds the meshes on `threads` threads. `snapshot`: poses of the bodies; null: as authored.
  /// Throws std::runtime_error.
  Navigation(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
             const NavigationAgent& agent, const Snapshot* snapshot = nullptr, int threads = 2,
             const Progress& progress = {});
  /// Takes meshes and gaps of save() instead of building them, with bodies as they were then;
  /// update() brings them to a later state. Progress begins at kTileShare. Throws MeshFileError if
  /// they belong to another scene or size.
  Navigation(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
             const NavigationAgent& agent, std::span<const std::uint8_t> saved, int threads = 2,
             const Progress& progress = {});
  ~Navigation();

  /// The meshes and the gaps that were tried, as bytes.
  std::vector<std::uint8_t> save();

  /// Takes over the poses of bodies. If no meshes for them are kept, builds the tiles again in
  /// which they changed. Returns the number of these tiles. Without any it reports no progress.
  std::size_t update(const Snapshot& snapshot, int threads = 2, const Progress& progress = {});

  /// Of the meshes for the present poses; differs from that of all others.
  std::uint64_t stateNumber();

  const NavigationAgent& agent() const { return agent_; }
  std::shared_ptr<const AvatarShape> agentShape() {
    const std::lock_guard lock(mutex_);
    return walker().shape();
  }
  NavigationReport report();
  std::string findEntityName(EntityId id) const { return world_.data().findEntityName(id); }

  /// A path from where an agent at `from` stands to where it stands at `to`. Both may be up to a
  /// step above the floor. With jumps and lifts it is the quickest that is found. `progress`:
  /// of the unobstructed mesh, which is built when a path is first not found.
  NavigationPath findPath(const Vec3& from, const Vec3& to, const PathOptions& options = {},
                          const Progress& progress = {});
  /// As findPath() for an agent on its way. `kept`: its last path, which is used again as
  /// rejoinPath() says, and replaced. After a body has moved, update() makes other meshes, for
  /// which it does not serve.
  NavigationPath findPathAgain(const Vec3& from, const Vec3& to, std::optional<KeptPath>& kept,
                               const Progress& progress = {});
  /// As scene::findPathOut().
  NavigationPath findPathOut(const Vec3& from, const std::function<bool(const Vec3&)>& isWanted);
  /// The narrowest place of a path; nullopt: both sides are nowhere closer than 3 m.
  std::optional<NarrowPlace> findNarrowest(const std::vector<Vec3>& points);
  /// The steps of a path, in order.
  std::vector<PathStep> findSteps(const std::vector<Vec3>& points);
  /// The standing place in one of some named places that is horizontally closest to its middle.
  /// `start`: named places on the island of that place are preferred, then the closest to it.
  std::optional<Vec3> findPlaceIn(std::span<const NamedPlace> named,
                                  const std::optional<Vec3>& start = std::nullopt);
  /// The standing place at `point`, or else the closest one within `maxDistance` metres.
  std::optional<Vec3> snap(const Vec3& point, double maxDistance);
  /// The closest standing place on the wanted islands.
  std::optional<Vec3> snapTo(const Vec3& point, const SnapTarget& wanted);
  /// A place that is uniform in area; nullopt: none was found.
  std::optional<Vec3> findRandomPlace(std::mt19937_64& random, const RandomPlace& wanted);
  /// The end of a walk from one place towards another: at the first obstacle, or, if it slides,
  /// where it gains nothing more. nullopt: there is no place to stand at `from`.
  std::optional<Vec3> tryStep(const Vec3& from, const Vec3& to, bool slides);
  /// nullopt: there is no place to stand at `point`.
  std::optional<ObstacleDistance> findObstacle(const Vec3& point, double maxDistance);
  /// The cells with a floor within `tolerance` metres of `height`, and some with one up to 5 cm
  /// beyond. Throws std::invalid_argument for more than 16 million cells.
  NavigationMap drawMap(double cell, double height, double tolerance = kMapTolerance);
  /// The triangles of the mesh, three corners each, or of one island: scene frame, metres.
  std::vector<Vec3> collectTriangles(const std::optional<std::uint32_t>& island);
  /// Number of the island of a place where an agent stands, 0 for the largest; nullopt: no polygon
  /// of its floor is near.
  std::optional<std::uint32_t> findIsland(const Vec3& place);
  /// By number.
  std::vector<Island> islands();
  /// Islands next to an island, the closest first, with places to stand near the gap between both.
  std::vector<IslandNeighbour> findIslandNeighbours(std::uint32_t island);

 private:
  /// As findPath(); the caller holds the mutex.
  NavigationPath searchPath(const Vec3& from, const Vec3& to, const PathOptions& options,
                            const Progress& progress);
  MeshState& now() { return meshes_.now(); }
  Walker& walker() { return meshes_.walker(); }
  PathFinder makeFinder(std::function<const UnobstructedMesh&()> unobstructed);
  std::optional<std::uint32_t> islandAt(const Vec3& place);
  Aabb computeBox(const NamedPlace& named) const;
  /// As findPlaceIn(), on an island, or anywhere.
  std::optional<Vec3> findPlaceOn(const NamedPlace& named,
                                  const std::optional<std::uint32_t>& island);

  const NavigationAgent agent_;
  World world_;  ///< never ticks
  std::mutex mutex_;
  std::shared_ptr<const Snapshot> bodies_;  ///< where they are
  MeshStates meshes_;
};

}  // namespace enfilade::scene
