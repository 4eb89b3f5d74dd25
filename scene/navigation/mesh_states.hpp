// MeshStates: the meshes of one size of agent, and all that follows from them. Each state has its
// own poses of bodies. Worlds whose bodies stand elsewhere take turns, so states stay for a while.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "scene/navigation/connection_search.hpp"
#include "scene/navigation/island_list.hpp"
#include "scene/navigation/links.hpp"
#include "scene/navigation/mesh/navigation_mesh.hpp"
#include "scene/navigation/mesh/polygon_sampler.hpp"
#include "scene/navigation/path_search.hpp"
#include "scene/navigation/unreachable_reasons.hpp"
#include "scene/navigation/walk/walker.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

using MeshProgress = std::function<void(double)>;  ///< share that is done, 0..1

/// The share of the tiles; the rest is of islands and connections.
inline constexpr double kTileShare = 0.8;

struct MeshState {
  std::uint64_t number = 0;                       ///< differs from that of any other state
  std::vector<collision::Pose> poses;             ///< of all bodies, by index
  std::vector<TileMesh> ampleTiles, scarceTiles;  ///< by tile of the grid
  TriedGaps triedGaps;
  std::optional<NavigationMesh> ample, scarce;
  IslandList islands;          ///< of `ample`
  ConnectionList connections;  ///< of `ample`
  PolygonSampler drawn;        ///< of islands with Island::isDrawn
  double area = 0;             ///< square metres, of all islands
  std::size_t bytes = 0;       ///< of memory, of all above
  // Made by the queries that need them.
  std::optional<UnobstructedMesh> unobstructed;
  std::list<Links> links;                                                ///< the last options last
  std::map<std::pair<std::uint32_t, std::uint32_t>, Refusals> refusals;  ///< by islands

  std::size_t memoryBytes() const;
};

/// Not thread-safe.
class MeshStates {
 public:
  /// Builds the meshes on `threads` threads, for the poses that the bodies have in `world`, which
  /// must outlive this. Throws std::runtime_error.
  MeshStates(WorldData& world, const NavigationAgent& agent, int threads,
             const MeshProgress& progress);
  /// Takes those of save() instead, with bodies as they were then. Progress begins at kTileShare.
  /// Throws MeshFileError if they belong to another scene or size.
  MeshStates(WorldData& world, const NavigationAgent& agent, std::span<const std::uint8_t> saved,
             int threads, const MeshProgress& progress);

  std::vector<std::uint8_t> save() const;

  /// Places the bodies, and makes the state of their poses the present one. If it is not kept,
  /// builds it from the present one. Returns the number of tiles that it built for it; without any
  /// it reports no progress.
  std::size_t update(const Snapshot& snapshot, int threads, const MeshProgress& progress);

  const MeshState& now() const { return states_.front(); }
  MeshState& now() { return states_.front(); }
  Walker& walker() { return *walker_; }
  const TileGrid& grid() const { return grid_; }
  double buildSeconds() const { return seconds_; }  ///< to build or load the first meshes
  /// The unobstructed mesh of the present state. Builds tiles at the first call of all states.
  const UnobstructedMesh& unobstructed(const MeshProgress& progress);
  /// Of all states.
  std::size_t memoryBytes() const;

 private:
  void buildTiles(MeshState& state, const std::vector<int>& tiles, int threads,
                  const MeshProgress& progress) const;
  /// Makes the state of other poses from the present one. Returns the number of built tiles.
  std::size_t derive(MeshState& state, std::vector<collision::Pose> poses, int threads,
                     const MeshProgress& progress);
  void placeBodies(const std::vector<collision::Pose>& poses);
  /// Makes the meshes of the tiles, and all that follows from them.
  void assemble(MeshState& state, int threads, const MeshProgress& progress);
  /// Moves a body, and marks the tiles that its box touches before or afterwards.
  void moveBody(Body& body, const collision::Pose& from, const collision::Pose& to,
                TriedGaps& tried, std::vector<bool>& isChanged) const;
  void forgetOldStates();

  WorldData& world_;
  const NavigationAgent agent_;
  const TileGrid grid_;
  double seconds_ = 0;
  std::optional<Walker> walker_;
  std::list<MeshState> states_;  ///< the present one first, then by their last use
  std::shared_ptr<const NavigationMesh> unobstructedMesh_;  ///< without bodies: of all states
};

}  // namespace enfilade::scene
