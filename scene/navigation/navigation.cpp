#include "scene/navigation/navigation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "scene/model/shapes/space_solid.hpp"
#include "scene/navigation/link_routes.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinFloorArea = 5;  // square metres; less may be furniture
// Draws until one fits: where one place in 50 does, 200 draws find none in 2 % of the queries.
constexpr int kMaxRandomTries = 200;
// Of options of queries, of which a program uses few. Each set keeps its drops and lifts in memory;
// a fifth one drops the oldest, which is then searched again.
constexpr std::size_t kMaxLinkSets = 4;

/// A world that never ticks, with bodies as in `snapshot`; null: as authored.
World makeWorld(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
                const Snapshot* snapshot) {
  World world(std::move(scene), settings);
  if (!snapshot) return world;
  for (const BodySnapshot& body : *snapshot->bodies)
    placeBody(world.data().bodies[body.index], body.pose);
  return world;
}

}  // namespace

Navigation::Navigation(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
                       const NavigationAgent& agent, const Snapshot* snapshot, int threads,
                       const Progress& progress)
    : agent_(agent),
      world_(makeWorld(std::move(scene), settings, snapshot)),
      bodies_(snapshot ? std::make_shared<const Snapshot>(*snapshot) : world_.snapshot()),
      meshes_(world_.data(), agent, threads, progress) {}

Navigation::Navigation(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
                       const NavigationAgent& agent, std::span<const std::uint8_t> saved,
                       int threads, const Progress& progress)
    : agent_(agent),
      world_(std::move(scene), settings),
      bodies_(world_.snapshot()),
      meshes_(world_.data(), agent, saved, threads, progress) {}

Navigation::~Navigation() = default;

std::vector<std::uint8_t> Navigation::save() {
  const std::lock_guard lock(mutex_);
  return meshes_.save();
}

std::size_t Navigation::update(const Snapshot& snapshot, int threads, const Progress& progress) {
  const std::lock_guard lock(mutex_);
  const std::size_t built = meshes_.update(snapshot, threads, progress);
  bodies_ = std::make_shared<const Snapshot>(snapshot);
  return built;
}

std::uint64_t Navigation::stateNumber() {
  const std::lock_guard lock(mutex_);
  return now().number;
}

NavigationReport Navigation::report() {
  const std::lock_guard lock(mutex_);
  NavigationReport report{
      now().ample->polygonCount(), now().area, {}, meshes_.memoryBytes(), meshes_.buildSeconds()};
  for (const Island& island : now().islands.islands) report.islandAreas.push_back(island.area);
  return report;
}

PathFinder Navigation::makeFinder(std::function<const UnobstructedMesh&()> unobstructed) {
  PathFinder finder{world_.data(), agent_,        walker(),
                    *now().ample,  *now().scarce, std::move(unobstructed)};
  finder.connections = &now().connections;
  return finder;
}

NavigationPath Navigation::searchPath(const Vec3& from, const Vec3& to, const PathOptions& options,
                                      const Progress& progress) {
  const auto unobstructed = [&]() -> const UnobstructedMesh& {
    return meshes_.unobstructed(progress);
  };
  PathFinder finder = makeFinder(unobstructed);
  const auto first = islandAt(from), last = islandAt(to);
  // On furniture one failed search proves nothing about its neighbours.
  const auto isFloor = [&](std::uint32_t island) {
    return now().islands.islands[island].area >= kMinFloorArea;
  };
  if (first && last && first != last && isFloor(*first) && isFloor(*last))
    finder.refusals = &now().refusals[{*first, *last}];
  NavigationPath path = scene::findPath(finder, from, to);
  finder.refusals = nullptr;
  if (path.found()) {
    path.seconds = path.length / agent_.speed;
    path.legs.push_back({PathLeg::Kind::walk, 0, path.length, path.seconds});
  }
  if (options == PathOptions()) return path;
  auto links = std::ranges::find(now().links, options, &Links::options);
  if (links == now().links.end()) {
    if (now().links.size() == kMaxLinkSets) now().links.pop_front();
    links = now().links.emplace(now().links.end(), world_.data(), agent_, *now().ample, options);
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
  const bool mayServe = kept && kept->goal == to && kept->meshState == now().number;
  if (mayServe && rejoinPath(makeFinder({}), *kept, from)) return kept->path;
  NavigationPath path = searchPath(from, to, {}, progress);
  kept.reset();
  if (!path.found()) return path;
  kept = keepPath(makeFinder({}), path, to);
  kept->meshState = now().number;
  return path;
}

NavigationPath Navigation::findPathOut(const Vec3& from,
                                       const std::function<bool(const Vec3&)>& isWanted) {
  const std::lock_guard lock(mutex_);
  return scene::findPathOut(walker(), from, isWanted);
}

std::optional<NarrowPlace> Navigation::findNarrowest(const std::vector<Vec3>& points) {
  const std::lock_guard lock(mutex_);
  const NarrowPlace narrowest =
      measureNarrowest(world_.data(), agent_, traceFeet(walker(), points), Vec3::Zero(),
                       std::numeric_limits<double>::infinity());
  return narrowest.clearWidth < kMaxSideWidth ? std::optional(narrowest) : std::nullopt;
}

std::vector<PathStep> Navigation::findSteps(const std::vector<Vec3>& points) {
  const std::lock_guard lock(mutex_);
  return scene::findSteps(world_.data(), agent_, traceFeet(walker(), points));
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
  if (const auto place = standAt(walker(), centre + Vec3(0, kHeightError, 0), 2 * kHeightError)) {
    const auto number = islandAt(*place);
    const bool isWanted =
        island ? number == island : number && now().islands.islands[*number].isDrawn;
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
  for (const std::uint32_t polygon : now().ample->findPolygons(box.centre(), extents)) {
    const std::uint32_t number = now().islands.numberOf[polygon];
    if (island && number != *island) continue;
    const bool isAside = number == kNoIsland || !now().islands.islands[number].isDrawn;
    const auto add = [&](const Vec3& point) {
      candidates.push_back({isAside, computeGroundDistance(point, centre), point});
    };
    add(now().ample->centre(polygon));
    for (const Vec3& aim : aims) add(now().ample->closestPoint(polygon, aim));
  }
  std::ranges::stable_sort(
      candidates, {}, [](const Candidate& one) { return std::pair(one.isAside, one.distance); });
  for (const Candidate& one : candidates)
    if (const auto place = standNear(walker(), one.point); place && isInside(*place)) return place;
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
  const auto standing = start ? standAt(walker(), *start) : std::nullopt;
  if (const auto island = standing ? islandAt(*standing) : std::nullopt)
    if (const auto found = findOn(island)) return found;
  return findOn(std::nullopt);
}

std::optional<Vec3> Navigation::snap(const Vec3& point, double maxDistance) {
  const std::lock_guard lock(mutex_);
  if (const auto place = standAt(walker(), point))
    if ((*place - point).norm() <= maxDistance) return place;
  const auto nearest = now().ample->findNearest(point, Vec3::Constant(maxDistance));
  if (!nearest) return std::nullopt;
  const auto place = standNear(walker(), nearest->point);
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
    if (const auto place = standAt(walker(), point); place && (*place - point).norm() <= kExact)
      return place;
  const Aabb box{point - wanted.extents, point + wanted.extents};
  std::vector<std::pair<double, Vec3>> candidates;
  for (const std::uint32_t polygon : now().ample->findPolygons(point, wanted.extents)) {
    const std::uint32_t number = now().islands.numberOf[polygon];
    if (number == kNoIsland || (wanted.island && number != *wanted.island) ||
        (wanted.isDrawn && !now().islands.islands[number].isDrawn))
      continue;
    const Vec3 closest = now().ample->closestPoint(polygon, point);
    candidates.emplace_back((closest - point).norm(), closest);
  }
  std::ranges::stable_sort(candidates, {}, &std::pair<double, Vec3>::first);
  candidates.resize(std::min(candidates.size(), kMaxCandidates));
  for (const auto& [distance, closest] : candidates) {
    const auto place = standNear(walker(), closest);
    if (place && std::abs(place->y() - closest.y()) < kHeightError &&
        collision::contains(box, {*place, *place}))
      return place;
  }
  return std::nullopt;
}

std::optional<Vec3> Navigation::tryStep(const Vec3& from, const Vec3& to, bool slides) {
  const std::lock_guard lock(mutex_);
  if (!standAt(walker(), from)) return std::nullopt;
  return (slides ? walker().slideTo(to) : walker().walkTo(to)).footPosition;
}

std::optional<ObstacleDistance> Navigation::findObstacle(const Vec3& point, double maxDistance) {
  const std::lock_guard lock(mutex_);
  const auto place = standAt(walker(), point);
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
  const double lowest = height - tolerance,
               highest = height + tolerance + meshes_.grid().cellHeight;
  const auto measureFloor = [&](const Vec3& onMesh, double top) {
    const Vec3 above(onMesh.x(), top + kHeightError, onMesh.z());
    const auto place = standAt(walker(), above, above.y() - onMesh.y() + kHeightError);
    return place ? place->y() : onMesh.y();
  };
  for (std::uint32_t polygon = 0; polygon < now().ample->polygonCount(); ++polygon)
    if (now().islands.numberOf[polygon] != kNoIsland)
      now().ample->rasterize(polygon, grid, lowest, highest, measureFloor, map.cells);
  return map;
}

std::vector<Vec3> Navigation::collectTriangles(const std::optional<std::uint32_t>& island) {
  const std::lock_guard lock(mutex_);
  std::vector<Vec3> triangles;
  for (std::uint32_t polygon = 0; polygon < now().ample->polygonCount(); ++polygon) {
    const std::uint32_t number = now().islands.numberOf[polygon];
    if (number == kNoIsland || (island && number != *island)) continue;
    const std::vector<Vec3> own = now().ample->makeTriangles(polygon);
    triangles.insert(triangles.end(), own.begin(), own.end());
  }
  return triangles;
}

std::optional<std::uint32_t> Navigation::islandAt(const Vec3& place) {
  return findIslandAt(*now().ample, now().islands, walker(), place);
}

std::optional<std::uint32_t> Navigation::findIsland(const Vec3& place) {
  const std::lock_guard lock(mutex_);
  return islandAt(place);
}

std::vector<Island> Navigation::islands() {
  const std::lock_guard lock(mutex_);
  return now().islands.islands;
}

std::vector<IslandNeighbour> Navigation::findIslandNeighbours(std::uint32_t island) {
  const std::lock_guard lock(mutex_);
  std::vector<IslandNeighbour> neighbours =
      findNeighbours(*now().ample, now().islands, island, kWallAndDoor + 2 * agent_.radius,
                     0.5 + world_.settings().stepHeight);
  std::erase_if(neighbours, [&](IslandNeighbour& near) {
    const auto from = standNear(walker(), near.from), to = standNear(walker(), near.to);
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
      candidates = now().ample->findPolygons(*wanted.near, Vec3::Constant(wanted.maxDistance));
    } else {
      candidates.resize(now().ample->polygonCount());
      std::iota(candidates.begin(), candidates.end(), 0u);
    }
    for (const std::uint32_t polygon : candidates) {
      if (now().islands.numberOf[polygon] == kNoIsland ||
          (wanted.island && now().islands.numberOf[polygon] != *wanted.island))
        continue;
      part.add(*now().ample, polygon);
    }
  }
  const PolygonSampler& sampler = isPart ? part : now().drawn;
  if (sampler.empty()) return std::nullopt;
  for (int i = 0; i < kMaxRandomTries; ++i) {
    const Vec3 point = sampler.draw(*now().ample, random) + Vec3(0, kHeightError, 0);
    const auto place = standAt(walker(), point, 2 * kHeightError + kMaxStandDrop);
    if (!place) continue;
    if (wanted.near && (*place - *wanted.near).norm() > wanted.maxDistance) continue;
    if (wanted.awayFrom && (*place - *wanted.awayFrom).norm() < wanted.minDistance) continue;
    return place;
  }
  return std::nullopt;
}

}  // namespace enfilade::scene
