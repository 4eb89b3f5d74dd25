#include "scene/navigation/navigation.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "scene/base/parallel_for.hpp"
#include "scene/model/shapes/space_solid.hpp"
#include "scene/navigation/link_routes.hpp"
#include "scene/navigation/mesh/saved_meshes.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinFloorArea = 5;  // square metres; less may be furniture
constexpr double kTileMargin = 0.3;  // metres: more than the border of a tile beyond the radius
// Draws until one fits: where one place in 50 does, 200 draws find none in 2 % of the queries.
constexpr int kMaxRandomTries = 200;
// Of options of queries, of which a program uses few. Each set keeps its drops and lifts in memory;
// a fifth one drops the oldest, which is then searched again.
constexpr std::size_t kMaxLinkSets = 4;

/// Puts a body where it rests.
void placeBody(const collision::Pose& pose, Body& own) {
  setBodyPose(own, pose.translation, pose.rotation);
  own.motionBounds = own.boxes.whole;
}

/// Reports a part of the work as the shares from `first` to `last`.
Navigation::Progress scaleProgress(const Navigation::Progress& progress, double first,
                                   double last) {
  if (!progress) return {};
  return [&progress, first, last](double share) { progress(first + (last - first) * share); };
}

}  // namespace

Navigation::Navigation(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
                       const NavigationAgent& agent, const Snapshot* snapshot, int threads,
                       const Progress& progress)
    : agent_(agent),
      world_(std::move(scene), settings),
      grid_(makeTileGrid(world_.scene().bounds(), agent)) {
  const auto start = std::chrono::steady_clock::now();
  bodies_ = snapshot ? std::make_shared<const Snapshot>(*snapshot) : world_.snapshot();
  if (snapshot)
    for (const BodySnapshot& body : *snapshot->bodies)
      placeBody(body.pose, world_.data().bodies[body.index]);
  std::vector<int> tiles(static_cast<std::size_t>(grid_.tilesX) *
                         static_cast<std::size_t>(grid_.tilesZ));
  std::iota(tiles.begin(), tiles.end(), 0);
  ampleTiles_.resize(tiles.size());
  scarceTiles_.resize(tiles.size());
  buildTiles(tiles, threads, scaleProgress(progress, 0, kTileShare));
  assembleMeshes(threads, progress);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  report_.seconds = seconds.count();
}

Navigation::Navigation(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
                       const NavigationAgent& agent, std::span<const std::uint8_t> saved,
                       int threads, const Progress& progress)
    : agent_(agent),
      world_(std::move(scene), settings),
      grid_(makeTileGrid(world_.scene().bounds(), agent)) {
  const auto start = std::chrono::steady_clock::now();
  SavedMeshes meshes = loadMeshes(world_.data(), agent, grid_, saved);
  bodies_ = world_.snapshot();
  for (std::size_t i = 0; i < meshes.bodies.size(); ++i)
    placeBody(meshes.bodies[i], world_.data().bodies[i]);
  ampleTiles_ = std::move(meshes.ample);
  scarceTiles_ = std::move(meshes.scarce);
  for (SavedGap& gap : meshes.gaps)
    triedGaps_[gap.key] = {std::move(gap.there), std::move(gap.back), gap.reach};
  assembleMeshes(threads, progress);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  report_.seconds = seconds.count();
}

Navigation::~Navigation() = default;

std::vector<std::uint8_t> Navigation::save() {
  const std::lock_guard lock(mutex_);
  SavedMeshes meshes{ampleTiles_, scarceTiles_, {}, {}};
  for (const Body& body : world_.data().bodies)
    meshes.bodies.push_back({body.orientation, body.position});
  for (const auto& [key, paths] : triedGaps_)
    meshes.gaps.push_back({key, paths.there, paths.back, paths.reach});
  return saveMeshes(world_.data(), agent_, meshes);
}

void Navigation::buildTiles(const std::vector<int>& tiles, int threads, const Progress& progress) {
  parallelFor(
      2 * tiles.size(), threads, progress,
      [&](std::size_t i) {  // so that one tile takes both threads
        const int tile = tiles[i / 2];
        const bool isAmple = i % 2 == 0;
        auto& built = (isAmple ? ampleTiles_ : scarceTiles_)[static_cast<std::size_t>(tile)];
        built = buildTileMesh(world_.data(), agent_, grid_, tile % grid_.tilesX,
                              tile / grid_.tilesX, isAmple ? Clearance::ample : Clearance::scarce);
      });
}

void Navigation::assembleMeshes(int threads, const Progress& progress) {
  static std::atomic<std::uint64_t> lastState{0};
  meshState_ = ++lastState;
  walker_.emplace(world_.data(), agent_);
  links_.clear();
  unobstructed_.reset();
  refusals_.clear();
  ample_.emplace(grid_, ampleTiles_);
  scarce_.emplace(grid_, scarceTiles_);
  islands_ = collectIslands(*ample_, *walker_, world_.scene().bounds());
  joinIslands(threads, scaleProgress(progress, kTileShare, 1));
  drawn_ = {};
  for (std::uint32_t i = 0; i < ample_->polygonCount(); ++i) {
    const std::uint32_t number = islands_.numberOf[i];
    if (number != kNoIsland && islands_.islands[number].isDrawn) drawn_.add(*ample_, i);
  }
  report_.islandAreas.clear();
  report_.area = 0;
  for (const Island& island : islands_.islands) {
    report_.islandAreas.push_back(island.area);
    report_.area += island.area;
  }
  report_.polygons = ample_->polygonCount();
  report_.bytes = 2 * (ample_->memoryBytes() + scarce_->memoryBytes()) +
                  connections_.memoryBytes() + measureBytes(triedGaps_) +
                  islands_.numberOf.size() * sizeof(islands_.numberOf[0]);
  if (progress) progress(1);
}

void Navigation::joinIslands(int threads, const Progress& progress) {
  connections_ = collectConnections({world_.data(), agent_, *walker_, *ample_, *scarce_, nullptr},
                                    islands_, triedGaps_, threads, progress);
  scene::joinIslands(islands_, connections_);
}

std::size_t Navigation::update(const Snapshot& snapshot, int threads, const Progress& progress) {
  const std::lock_guard lock(mutex_);
  bodies_ = std::make_shared<const Snapshot>(snapshot);
  WorldData& world = world_.data();
  std::vector<bool> isChanged(ampleTiles_.size(), false);
  const double margin = agent_.radius + kTileMargin;
  const auto markTiles = [&](const Aabb& box) {
    forgetGaps(triedGaps_, box, agent_);
    const auto computeTile = [&](double at, double origin, int count) {
      const double tile = std::floor((at - origin) / grid_.tileSize());
      return static_cast<int>(std::clamp(tile, 0.0, count - 1.0));
    };
    for (int z = computeTile(box.min.z() - margin, grid_.origin.z(), grid_.tilesZ);
         z <= computeTile(box.max.z() + margin, grid_.origin.z(), grid_.tilesZ); ++z)
      for (int x = computeTile(box.min.x() - margin, grid_.origin.x(), grid_.tilesX);
           x <= computeTile(box.max.x() + margin, grid_.origin.x(), grid_.tilesX); ++x)
        isChanged[static_cast<std::size_t>(z * grid_.tilesX + x)] = true;
  };
  for (const BodySnapshot& body : *snapshot.bodies) {
    Body& own = world.bodies[body.index];
    if (isTrigger(own.spec->kind) || (own.position == body.pose.translation &&
                                      own.orientation.coeffs() == body.pose.rotation.coeffs()))
      continue;
    markTiles(own.boxes.whole);
    placeBody(body.pose, own);
    markTiles(own.boxes.whole);
  }
  std::vector<int> tiles;
  for (std::size_t i = 0; i < isChanged.size(); ++i)
    if (isChanged[i]) tiles.push_back(static_cast<int>(i));
  if (tiles.empty()) return 0;
  buildTiles(tiles, threads, scaleProgress(progress, 0, kTileShare));
  assembleMeshes(threads, progress);
  return tiles.size();
}

NavigationReport Navigation::report() {
  const std::lock_guard lock(mutex_);
  NavigationReport report = report_;
  if (unobstructed_) report.bytes += unobstructed_->memoryBytes();
  for (const Links& links : links_) report.bytes += links.memoryBytes();
  return report;
}

NavigationMesh Navigation::buildUnobstructed(int threads, const Progress& progress) const {
  std::vector<TileMesh> tiles(ampleTiles_.size());
  parallelFor(tiles.size(), threads, progress, [&](std::size_t i) {
    const int tile = static_cast<int>(i);
    tiles[i] = buildTileMesh(world_.data(), agent_, grid_, tile % grid_.tilesX, tile / grid_.tilesX,
                             Clearance::none);
  });
  return {grid_, std::move(tiles)};
}

PathFinder Navigation::makeFinder(std::function<const UnobstructedMesh&()> unobstructed) {
  PathFinder finder{world_.data(), agent_, *walker_, *ample_, *scarce_, std::move(unobstructed)};
  finder.connections = &connections_;
  return finder;
}

NavigationPath Navigation::searchPath(const Vec3& from, const Vec3& to, const PathOptions& options,
                                      const Progress& progress) {
  const auto unobstructed = [&]() -> const UnobstructedMesh& {
    if (!unobstructed_)
      unobstructed_.emplace(makeUnobstructedMesh(buildUnobstructed(2, progress), *scarce_));
    return *unobstructed_;
  };
  PathFinder finder = makeFinder(unobstructed);
  const auto first = islandAt(from), last = islandAt(to);
  // On furniture one failed search proves nothing about its neighbours.
  const auto isFloor = [&](std::uint32_t island) {
    return islands_.islands[island].area >= kMinFloorArea;
  };
  if (first && last && first != last && isFloor(*first) && isFloor(*last))
    finder.refusals = &refusals_[{*first, *last}];
  NavigationPath path = scene::findPath(finder, from, to);
  finder.refusals = nullptr;
  if (path.found()) {
    path.seconds = path.length / agent_.speed;
    path.legs.push_back({PathLeg::Kind::walk, 0, path.length, path.seconds});
  }
  if (options == PathOptions()) return path;
  auto links = std::ranges::find(links_, options, &Links::options);
  if (links == links_.end()) {
    if (links_.size() == kMaxLinkSets) links_.pop_front();
    links = links_.emplace(links_.end(), world_.data(), agent_, *ample_, options);
  }
  return findLinkedPath(finder, *links, *bodies_, from, to, std::move(path));
}

NavigationPath Navigation::findPath(const Vec3& from, const Vec3& to, const PathOptions& options,
                                    const Progress& progress) {
  const std::lock_guard lock(mutex_);
  return searchPath(from, to, options, progress);
}

NavigationPath Navigation::findPathAgain(const Vec3& from, const Vec3& to,
                                         std::optional<KeptPath>& kept, const Progress& progress) {
  const std::lock_guard lock(mutex_);
  const bool mayServe = kept && kept->goal == to && kept->meshState == meshState_;
  if (mayServe && rejoinPath(makeFinder({}), *kept, from)) return kept->path;
  NavigationPath path = searchPath(from, to, {}, progress);
  kept.reset();
  if (!path.found()) return path;
  kept = keepPath(makeFinder({}), path, to);
  kept->meshState = meshState_;
  return path;
}

NavigationPath Navigation::findPathOut(const Vec3& from,
                                       const std::function<bool(const Vec3&)>& isWanted) {
  const std::lock_guard lock(mutex_);
  return scene::findPathOut(*walker_, from, isWanted);
}

std::optional<NarrowPlace> Navigation::findNarrowest(const std::vector<Vec3>& points) {
  const std::lock_guard lock(mutex_);
  const NarrowPlace narrowest =
      measureNarrowest(world_.data(), agent_, traceFeet(*walker_, points), Vec3::Zero(),
                       std::numeric_limits<double>::infinity());
  return narrowest.clearWidth < kMaxSideWidth ? std::optional(narrowest) : std::nullopt;
}

std::vector<PathStep> Navigation::findSteps(const std::vector<Vec3>& points) {
  const std::lock_guard lock(mutex_);
  return scene::findSteps(world_.data(), agent_, traceFeet(*walker_, points));
}

Aabb Navigation::computeBox(const NamedPlace& named) const {
  return named.body == kNoBody
             ? named.box
             : inflateAround(world_.data().bodies[named.body].boxes.whole, named.reach);
}

std::optional<Vec3> Navigation::findPlaceOn(const NamedPlace& named,
                                            const std::optional<std::uint32_t>& island) {
  const Aabb box = computeBox(named);
  const Vec3 middle = named.body == kNoBody ? named.middle : box.centre();
  const Vec3 centre(middle.x(), box.min.y(), middle.z());
  const auto isInside = [&](const Vec3& place) {
    return collision::contains(inflate(box, kHeightError), {place, place}) &&
           (!named.space || isInSpace(*named.space, {place.x(), middle.y(), place.z()}));
  };
  if (const auto place = standAt(*walker_, centre + Vec3(0, kHeightError, 0), 2 * kHeightError)) {
    const auto number = islandAt(*place);
    const bool isWanted = island ? number == island : number && islands_.islands[*number].isDrawn;
    if (isWanted && isInside(*place)) return place;
  }
  struct Candidate {
    bool isAside;     // on a table, say: places on islands that are drawn come first
    double distance;  // metres from the centre
    Vec3 point;
  };
  std::vector<Candidate> candidates;
  const std::vector<Vec3> aims = listAims(named, centre);
  // The mesh lies up to kHeightError above or below a floor, which may be the top of the box.
  const Vec3 extents = 0.5 * box.size() + Vec3(0, kHeightError, 0);
  for (const std::uint32_t polygon : ample_->findPolygons(box.centre(), extents)) {
    const std::uint32_t number = islands_.numberOf[polygon];
    if (island && number != *island) continue;
    const bool isAside = number == kNoIsland || !islands_.islands[number].isDrawn;
    const auto add = [&](const Vec3& point) {
      candidates.push_back({isAside, computeGroundDistance(point, centre), point});
    };
    add(ample_->centre(polygon));
    for (const Vec3& aim : aims) add(ample_->closestPoint(polygon, aim));
  }
  std::ranges::stable_sort(
      candidates, {}, [](const Candidate& one) { return std::pair(one.isAside, one.distance); });
  for (const Candidate& one : candidates)
    if (const auto place = standNear(*walker_, one.point); place && isInside(*place)) return place;
  return std::nullopt;
}

std::optional<Vec3> Navigation::findPlaceIn(std::span<const NamedPlace> named,
                                            const std::optional<Vec3>& start) {
  const std::lock_guard lock(mutex_);
  std::vector<const NamedPlace*> nearestFirst;
  for (const NamedPlace& place : named) nearestFirst.push_back(&place);
  if (start)
    std::ranges::stable_sort(
        nearestFirst, {}, [&](const NamedPlace* place) { return (place->middle - *start).norm(); });
  const auto findOn = [&](const std::optional<std::uint32_t>& island) -> std::optional<Vec3> {
    for (const NamedPlace* place : nearestFirst)
      if (const auto found = findPlaceOn(*place, island)) return found;
    return std::nullopt;
  };
  const auto standing = start ? standAt(*walker_, *start) : std::nullopt;
  if (const auto island = standing ? islandAt(*standing) : std::nullopt)
    if (const auto found = findOn(island)) return found;
  return findOn(std::nullopt);
}

std::optional<Vec3> Navigation::snap(const Vec3& point, double maxDistance) {
  const std::lock_guard lock(mutex_);
  if (const auto place = standAt(*walker_, point))
    if ((*place - point).norm() <= maxDistance) return place;
  const auto nearest = ample_->findNearest(point, Vec3::Constant(maxDistance));
  if (!nearest) return std::nullopt;
  const auto place = standNear(*walker_, nearest->point);
  return place && (*place - point).norm() <= maxDistance ? place : std::nullopt;
}

/// Places come from the mesh alone: a place without mesh, as on the edge of a table, would have the
/// island of the mesh below.
std::optional<Vec3> Navigation::snapTo(const Vec3& point, const SnapTarget& wanted) {
  constexpr double kExact = 2e-3;  // metres
  // Polygons, closest first, on which the agent is put down. More cost time where all are on stairs
  // or under something low; with fewer a place farther off is missed.
  constexpr std::size_t kMaxCandidates = 16;
  const std::lock_guard lock(mutex_);
  if (!wanted.island)
    if (const auto place = standAt(*walker_, point); place && (*place - point).norm() <= kExact)
      return place;
  const Aabb box{point - wanted.extents, point + wanted.extents};
  std::vector<std::pair<double, Vec3>> candidates;
  for (const std::uint32_t polygon : ample_->findPolygons(point, wanted.extents)) {
    const std::uint32_t number = islands_.numberOf[polygon];
    if (number == kNoIsland || (wanted.island && number != *wanted.island) ||
        (wanted.isDrawn && !islands_.islands[number].isDrawn))
      continue;
    const Vec3 closest = ample_->closestPoint(polygon, point);
    candidates.emplace_back((closest - point).norm(), closest);
  }
  std::ranges::stable_sort(candidates, {}, &std::pair<double, Vec3>::first);
  candidates.resize(std::min(candidates.size(), kMaxCandidates));
  for (const auto& [distance, closest] : candidates) {
    const auto place = standNear(*walker_, closest);
    if (place && std::abs(place->y() - closest.y()) < kHeightError &&
        collision::contains(box, {*place, *place}))
      return place;
  }
  return std::nullopt;
}

std::optional<Vec3> Navigation::tryStep(const Vec3& from, const Vec3& to, bool slides) {
  const std::lock_guard lock(mutex_);
  if (!standAt(*walker_, from)) return std::nullopt;
  return (slides ? walker_->slideTo(to) : walker_->walkTo(to)).footPosition;
}

std::optional<ObstacleDistance> Navigation::findObstacle(const Vec3& point, double maxDistance) {
  const std::lock_guard lock(mutex_);
  const auto place = standAt(*walker_, point);
  if (!place) return std::nullopt;
  return measureObstacle(world_.data(), agent_, *place, maxDistance);
}

/// The mesh lies up to a voxel above level floor, and up to 15 cm off over stairs. Where that
/// decides, an agent is put down.
NavigationMap Navigation::drawMap(double cell, double height, double tolerance) {
  constexpr double kMaxCells = 16e6;
  const std::lock_guard lock(mutex_);
  const Aabb& bounds = world_.scene().bounds();
  const double width = std::ceil(bounds.size().x() / cell);
  const double depth = std::ceil(bounds.size().z() / cell);
  if (!(width * depth <= kMaxCells))
    throw std::invalid_argument("the map would have " +
                                std::to_string(std::llround(std::min(width * depth, 1e15))) +
                                " cells; at most 16 million: give larger cells");
  NavigationMap map{bounds.min,
                    cell,
                    static_cast<std::uint32_t>(std::max(1.0, width)),
                    static_cast<std::uint32_t>(std::max(1.0, depth)),
                    {}};
  map.cells.assign(std::size_t{map.width} * map.height, 0);
  const MapCells grid{bounds.min.x(), bounds.min.z(), cell, map.width, map.height};
  const double lowest = height - tolerance, highest = height + tolerance + grid_.cellHeight;
  const auto measureFloor = [&](const Vec3& onMesh, double top) {
    const Vec3 above(onMesh.x(), top + kHeightError, onMesh.z());
    const auto place = standAt(*walker_, above, above.y() - onMesh.y() + kHeightError);
    return place ? place->y() : onMesh.y();
  };
  for (std::uint32_t polygon = 0; polygon < ample_->polygonCount(); ++polygon)
    if (islands_.numberOf[polygon] != kNoIsland)
      ample_->rasterize(polygon, grid, lowest, highest, measureFloor, map.cells);
  return map;
}

std::vector<Vec3> Navigation::collectTriangles(const std::optional<std::uint32_t>& island) {
  const std::lock_guard lock(mutex_);
  std::vector<Vec3> triangles;
  for (std::uint32_t polygon = 0; polygon < ample_->polygonCount(); ++polygon) {
    const std::uint32_t number = islands_.numberOf[polygon];
    if (number == kNoIsland || (island && number != *island)) continue;
    const std::vector<Vec3> own = ample_->makeTriangles(polygon);
    triangles.insert(triangles.end(), own.begin(), own.end());
  }
  return triangles;
}

std::optional<std::uint32_t> Navigation::islandAt(const Vec3& place) {
  return findIslandAt(*ample_, islands_, *walker_, place);
}

std::optional<std::uint32_t> Navigation::findIsland(const Vec3& place) {
  const std::lock_guard lock(mutex_);
  return islandAt(place);
}

std::vector<Island> Navigation::islands() {
  const std::lock_guard lock(mutex_);
  return islands_.islands;
}

std::vector<IslandNeighbour> Navigation::findIslandNeighbours(std::uint32_t island) {
  const std::lock_guard lock(mutex_);
  std::vector<IslandNeighbour> neighbours =
      findNeighbours(*ample_, islands_, island, kWallAndDoor + 2 * agent_.radius,
                     0.5 + world_.settings().stepHeight);
  std::erase_if(neighbours, [&](IslandNeighbour& near) {
    const auto from = standNear(*walker_, near.from), to = standNear(*walker_, near.to);
    near.from = from.value_or(near.from);
    near.to = to.value_or(near.to);
    return !from || !to;
  });
  return neighbours;
}

std::optional<Vec3> Navigation::findRandomPlace(std::mt19937_64& random,
                                                const RandomPlace& wanted) {
  const std::lock_guard lock(mutex_);
  const bool isPart = wanted.near || wanted.island;
  PolygonSampler part;
  if (isPart) {
    std::vector<std::uint32_t> candidates;
    if (wanted.near) {
      candidates = ample_->findPolygons(*wanted.near, Vec3::Constant(wanted.maxDistance));
    } else {
      candidates.resize(ample_->polygonCount());
      std::iota(candidates.begin(), candidates.end(), 0u);
    }
    for (const std::uint32_t polygon : candidates) {
      if (islands_.numberOf[polygon] == kNoIsland ||
          (wanted.island && islands_.numberOf[polygon] != *wanted.island))
        continue;
      part.add(*ample_, polygon);
    }
  }
  const PolygonSampler& sampler = isPart ? part : drawn_;
  if (sampler.empty()) return std::nullopt;
  for (int i = 0; i < kMaxRandomTries; ++i) {
    const Vec3 point = sampler.draw(*ample_, random) + Vec3(0, kHeightError, 0);
    const auto place = standAt(*walker_, point, 2 * kHeightError + kMaxStandDrop);
    if (!place) continue;
    if (wanted.near && (*place - *wanted.near).norm() > wanted.maxDistance) continue;
    if (wanted.awayFrom && (*place - *wanted.awayFrom).norm() < wanted.minDistance) continue;
    return place;
  }
  return std::nullopt;
}

}  // namespace enfilade::scene
