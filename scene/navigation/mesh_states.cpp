#include "scene/navigation/mesh_states.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numeric>

#include "collision/assert.hpp"
#include "scene/base/elapsed.hpp"
#include "scene/base/parallel_for.hpp"
#include "scene/navigation/mesh/saved_meshes.hpp"
#include "scene/world/data/body.hpp"

namespace enfilade::scene {
namespace {

constexpr double kTileMargin = 0.3;  // metres: more than the border of a tile beyond the radius
// A door that moves makes a state a tick, of which none is used again. The states of worlds whose
// bodies rest are used in each step of their environments, and stay.
constexpr std::size_t kMaxStates = 64;
constexpr std::size_t kMaxKeptBytes = std::size_t{128} << 20;

bool isSamePose(const collision::Pose& a, const collision::Pose& b) {
  return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
}

std::vector<collision::Pose> collectPoses(const WorldData& world) {
  std::vector<collision::Pose> poses;
  for (const Body& body : world.bodies) poses.push_back({body.orientation, body.position});
  return poses;
}

std::uint64_t drawStateNumber() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

/// Reports a part of the work as the shares from `first` to `last`.
MeshProgress scaleProgress(const MeshProgress& progress, double first, double last) {
  if (!progress) return {};
  return [&progress, first, last](double share) { progress(first + (last - first) * share); };
}

std::vector<int> listTiles(const TileGrid& grid) {
  std::vector<int> tiles(static_cast<std::size_t>(grid.tilesX) *
                         static_cast<std::size_t>(grid.tilesZ));
  std::iota(tiles.begin(), tiles.end(), 0);
  return tiles;
}

TileMesh buildTile(const WorldData& world, const NavigationAgent& agent, const TileGrid& grid,
                   int tile, Clearance clearance) {
  return buildTileMesh(world, agent, grid, tile % grid.tilesX, tile / grid.tilesX, clearance);
}

}  // namespace

std::size_t MeshState::memoryBytes() const {
  std::size_t sum = bytes;
  if (unobstructed) sum += unobstructed->memoryBytes();
  for (const Links& one : links) sum += one.memoryBytes();
  return sum;
}

MeshStates::MeshStates(WorldData& world, const NavigationAgent& agent, int threads,
                       const MeshProgress& progress)
    : world_(world), agent_(agent), grid_(makeTileGrid(world.scene->bounds(), agent)) {
  const auto start = std::chrono::steady_clock::now();
  const std::vector<int> tiles = listTiles(grid_);
  MeshState& state = states_.emplace_front();
  state.poses = collectPoses(world);
  state.ampleTiles.resize(tiles.size());
  state.scarceTiles.resize(tiles.size());
  buildTiles(state, tiles, threads, scaleProgress(progress, 0, kTileShare));
  assemble(state, threads, progress);
  seconds_ = measureSecondsSince(start);
}

MeshStates::MeshStates(WorldData& world, const NavigationAgent& agent,
                       std::span<const std::uint8_t> saved, int threads,
                       const MeshProgress& progress)
    : world_(world), agent_(agent), grid_(makeTileGrid(world.scene->bounds(), agent)) {
  const auto start = std::chrono::steady_clock::now();
  SavedMeshes meshes = loadMeshes(world, agent, grid_, saved);
  MeshState& state = states_.emplace_front();
  for (std::size_t i = 0; i < meshes.bodies.size(); ++i)
    placeBody(world.bodies[i], meshes.bodies[i]);
  state.poses = std::move(meshes.bodies);
  state.ampleTiles = std::move(meshes.ample);
  state.scarceTiles = std::move(meshes.scarce);
  for (SavedGap& gap : meshes.gaps)
    state.triedGaps[gap.key] = {std::move(gap.there), std::move(gap.back), gap.reach};
  assemble(state, threads, progress);
  seconds_ = measureSecondsSince(start);
}

std::vector<std::uint8_t> MeshStates::save() const {
  SavedMeshes meshes{now().ampleTiles, now().scarceTiles, now().poses, {}};
  for (const auto& [key, paths] : now().triedGaps)
    meshes.gaps.push_back({key, paths.there, paths.back, paths.reach});
  return saveMeshes(world_, agent_, meshes);
}

void MeshStates::buildTiles(MeshState& state, const std::vector<int>& tiles, int threads,
                            const MeshProgress& progress) const {
  parallelFor(2 * tiles.size(), threads, progress,
              [&](std::size_t i) {  // so that one tile takes both threads
                const int tile = tiles[i / 2];
                const bool isAmple = i % 2 == 0;
                auto& built = isAmple ? state.ampleTiles : state.scarceTiles;
                built[static_cast<std::size_t>(tile)] = buildTile(
                    world_, agent_, grid_, tile, isAmple ? Clearance::ample : Clearance::scarce);
              });
}

void MeshStates::assemble(MeshState& state, int threads, const MeshProgress& progress) {
  state.number = drawStateNumber();
  walker_.emplace(world_, agent_);
  state.ample.emplace(grid_, state.ampleTiles);
  state.scarce.emplace(grid_, state.scarceTiles);
  state.islands = collectIslands(*state.ample, *walker_, world_.scene->bounds());
  state.connections = collectConnections(
      {world_, agent_, *walker_, *state.ample, *state.scarce, nullptr}, state.islands,
      state.triedGaps, threads, scaleProgress(progress, kTileShare, 1));
  joinIslands(state.islands, state.connections);
  for (std::uint32_t i = 0; i < state.ample->polygonCount(); ++i) {
    const std::uint32_t number = state.islands.numberOf[i];
    if (number != kNoIsland && state.islands.islands[number].isDrawn)
      state.drawn.add(*state.ample, i);
  }
  for (const Island& island : state.islands.islands) state.area += island.area;
  state.bytes = 2 * (state.ample->memoryBytes() + state.scarce->memoryBytes()) +
                state.connections.memoryBytes() + measureBytes(state.triedGaps) +
                state.islands.numberOf.size() * sizeof(state.islands.numberOf[0]);
  if (progress) progress(1);
}

void MeshStates::moveBody(Body& body, const collision::Pose& from, const collision::Pose& to,
                          TriedGaps& tried, std::vector<bool>& isChanged) const {
  const double margin = agent_.radius + kTileMargin;
  const auto findTile = [&](double at, double origin, int count) {
    const double tile = std::floor((at - origin) / grid_.tileSize());
    return static_cast<int>(std::clamp(tile, 0.0, count - 1.0));
  };
  for (const collision::Pose* pose : {&from, &to}) {
    placeBody(body, *pose);
    const Aabb& box = body.boxes.whole;
    forgetGaps(tried, box, agent_);
    const int lastZ = findTile(box.max.z() + margin, grid_.origin.z(), grid_.tilesZ);
    const int lastX = findTile(box.max.x() + margin, grid_.origin.x(), grid_.tilesX);
    for (int z = findTile(box.min.z() - margin, grid_.origin.z(), grid_.tilesZ); z <= lastZ; ++z)
      for (int x = findTile(box.min.x() - margin, grid_.origin.x(), grid_.tilesX); x <= lastX; ++x)
        isChanged[static_cast<std::size_t>(z * grid_.tilesX + x)] = true;
  }
}

std::size_t MeshStates::update(const Snapshot& snapshot, int threads,
                               const MeshProgress& progress) {
  std::vector<collision::Pose> poses = now().poses;
  for (const BodySnapshot& body : *snapshot.bodies)
    if (!isTrigger(world_.bodies[body.index].spec->kind)) poses[body.index] = body.pose;
  const auto known = std::ranges::find_if(states_, [&](const MeshState& state) {
    return std::ranges::equal(state.poses, poses, isSamePose);
  });
  if (known == states_.begin()) return 0;
  if (known != states_.end()) {
    placeBodies(poses);
    states_.splice(states_.begin(), states_, known);
    forgetOldStates();
    return 0;
  }
  std::list<MeshState> made(1);
  const std::size_t built = derive(made.front(), std::move(poses), threads, progress);
  states_.splice(states_.begin(), made);
  forgetOldStates();
  return built;
}

std::size_t MeshStates::derive(MeshState& state, std::vector<collision::Pose> poses, int threads,
                               const MeshProgress& progress) try {
  const MeshState& base = now();
  state.ampleTiles = base.ampleTiles;
  state.scarceTiles = base.scarceTiles;
  state.triedGaps = base.triedGaps;
  std::vector<bool> isChanged(state.ampleTiles.size(), false);
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (!isSamePose(poses[i], base.poses[i]))
      moveBody(world_.bodies[i], base.poses[i], poses[i], state.triedGaps, isChanged);
  state.poses = std::move(poses);
  std::vector<int> tiles = listTiles(grid_);
  std::erase_if(tiles, [&](int tile) { return !isChanged[static_cast<std::size_t>(tile)]; });
  ENFILADE_ASSERT(!tiles.empty());
  buildTiles(state, tiles, threads, scaleProgress(progress, 0, kTileShare));
  assemble(state, threads, progress);
  return tiles.size();
} catch (...) {
  placeBodies(now().poses);
  throw;
}

void MeshStates::placeBodies(const std::vector<collision::Pose>& poses) {
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (!isSamePose(poses[i], {world_.bodies[i].orientation, world_.bodies[i].position}))
      placeBody(world_.bodies[i], poses[i]);
  walker_.emplace(world_, agent_);
}

void MeshStates::forgetOldStates() {
  std::size_t bytes = 0, count = 0;
  const auto first =
      std::ranges::find_if(std::next(states_.begin()), states_.end(), [&](const MeshState& state) {
        bytes += state.memoryBytes();
        return ++count >= kMaxStates || bytes > kMaxKeptBytes;
      });
  states_.erase(first, states_.end());
}

const UnobstructedMesh& MeshStates::unobstructed(const MeshProgress& progress) {
  constexpr int kThreads = 2;
  if (!unobstructedMesh_) {
    std::vector<TileMesh> tiles(now().ampleTiles.size());
    parallelFor(tiles.size(), kThreads, progress, [&](std::size_t i) {
      tiles[i] = buildTile(world_, agent_, grid_, static_cast<int>(i), Clearance::none);
    });
    unobstructedMesh_ = std::make_shared<const NavigationMesh>(grid_, std::move(tiles));
  }
  std::optional<UnobstructedMesh>& own = now().unobstructed;
  if (!own) own.emplace(makeUnobstructedMesh(unobstructedMesh_, *now().scarce));
  return *own;
}

std::size_t MeshStates::memoryBytes() const {
  std::size_t bytes = unobstructedMesh_ ? unobstructedMesh_->memoryBytes() : 0;
  for (const MeshState& state : states_) bytes += state.memoryBytes();
  return bytes;
}

}  // namespace enfilade::scene
