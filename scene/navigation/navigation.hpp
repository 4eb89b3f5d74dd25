// Navigation of one size of agent in a scene: proved paths, random places, islands. Recast proposes
// the ways; each leg of a path is walked by the motion of avatars before it is returned.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "scene/navigation/navigation_mesh.hpp"
#include "scene/navigation/walker.hpp"
#include "scene/world/world.hpp"

namespace enfilade::scene {

/// What ends the only ways to a goal.
struct Obstruction {
  EntityId entity = 0;           ///< that the walker hit; 0: unknown
  Vec3 position = Vec3::Zero();  ///< of the walker's feet there, scene frame, metres
  double clearWidth = 0;         ///< metres between the obstacles there; 0: not measured
};

struct NavigationPath {
  std::vector<Vec3> points;  ///< feet, scene frame, metres: way points of a Walk; empty: none found
  double length = 0;         ///< metres, in space, along `points`
  std::string reason;        ///< without a path: why
  std::optional<Obstruction> obstruction;

  bool found() const { return !points.empty(); }
};

/// The place of a path with the least space to its sides.
struct NarrowPlace {
  Vec3 position = Vec3::Zero();  ///< feet, scene frame, metres
  double clearWidth = 0;         ///< metres, measured across the path above the step height
};

struct NavigationReport {
  std::size_t polygons = 0;  ///< of the mesh for ample clearance
  double area = 0;           ///< square metres
  std::size_t islands = 0;
  std::size_t bytes = 0;
  double seconds = 0;  ///< for the meshes
};

/// Places that the agent can stand at, by islands.
struct RandomPlace {
  std::optional<Vec3> near = {};  ///< within `maxDistance` metres in space
  double maxDistance = 0;
  std::optional<Vec3> awayFrom = {};  ///< at least `minDistance` metres in space
  double minDistance = 0;
  std::optional<std::uint32_t> island = {};  ///< number as by islandOf()
};

/// Thread-safe; queries run one after another. The state of bodies is that of the construction.
class Navigation {
 public:
  using Progress = std::function<void(double)>;  ///< share that is done, 0..1

  /// Builds the meshes on `threads` threads. `snapshot`: poses of the bodies; null: as authored.
  /// Throws std::runtime_error.
  Navigation(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
             const NavigationAgent& agent, const Snapshot* snapshot = nullptr, int threads = 2,
             const Progress& progress = {});
  ~Navigation();

  const NavigationAgent& agent() const { return agent_; }
  const NavigationReport& report() const { return report_; }
  std::string findEntityName(EntityId id) const { return world_.data().findEntityName(id); }

  /// A path from where an agent at `from` stands to where it stands at `to`. Both may be up to a
  /// step above the floor.
  NavigationPath findPath(const Vec3& from, const Vec3& to);
  /// The narrowest place of a path; nullopt: both sides are nowhere closer than 3 m.
  std::optional<NarrowPlace> findNarrowest(const std::vector<Vec3>& points);
  /// The place in a box that is closest to its centre, horizontally.
  std::optional<Vec3> findPlaceIn(const Aabb& box);
  /// Where an agent at `point` stands, or else the closest place within `maxDistance` metres.
  std::optional<Vec3> snap(const Vec3& point, double maxDistance);
  /// A place that is uniform in area; nullopt: none was found.
  std::optional<Vec3> findRandomPlace(std::mt19937_64& random, const RandomPlace& wanted);
  /// Number of the island at a point, 0 for the largest; nullopt: no polygon is near.
  std::optional<std::uint32_t> islandOf(const Vec3& point);

 private:
  struct Proof;
  void buildMeshes(int threads, const Progress& progress);
  NavigationMesh buildMesh(Clearance clearance) const;
  std::optional<Vec3> standAt(const Vec3& point, double maxDrop);
  std::optional<Vec3> standNear(const Vec3& point);
  NavigationPath findPathOn(NavigationMesh& mesh, Clearance clearance, const Vec3& from,
                            const Vec3& to, Proof& proof);
  bool proveLegs(std::vector<Vec3> corners, Clearance clearance, NavigationPath& path,
                 Proof& proof);
  bool goAround(const WalkOutcome& stop, const Vec3& corner, NavigationPath& path, Proof& proof);
  void explain(const Vec3& from, const Vec3& to, NavigationPath& path);
  double measureClearWidth(const Vec3& position, const Vec3& direction);
  NarrowPlace measureNarrowest(const std::vector<Vec3>& points, const Vec3& near,
                               double maxDistance);

  const NavigationAgent agent_;
  World world_;  ///< never ticks
  TileGrid grid_;
  std::mutex mutex_;
  Walker walker_;
  std::optional<NavigationMesh> ample_, scarce_, unobstructed_;
  std::vector<std::uint32_t> islands_;  ///< by polygon of `ample_`
  std::vector<double> areaUpTo_;        ///< by polygon of `ample_`, cumulative
  NavigationReport report_;
};

}  // namespace enfilade::scene
