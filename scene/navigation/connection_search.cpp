#include "scene/navigation/connection_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "scene/base/parallel_for.hpp"
#include "scene/navigation/clear_width.hpp"
#include "scene/navigation/mesh/shortest_corridor.hpp"
#include "scene/navigation/mesh_paths.hpp"
#include "scene/navigation/walk/grid_search.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kHeightReach = 0.9;  // metres between both sides of a gap: three steps of 0.3 m
// Metres that a path across a gap is longer than the gap. Longer ones lead around it, but the
// corridor between two islands may bend.
constexpr double kMaxGapDetour = 3, kMaxCorridorDetour = 6;
constexpr double kMaxExitDistance = 6;  // metres from a small island
constexpr double kGridSpacing = 0.12;   // metres
constexpr double kGapMargin = 1.6;      // metres around the beginning of a path across a gap
constexpr double kNearStart = 0.3;      // metres
constexpr double kMaxStraightGap = 1;   // metres
constexpr double kLineSpacing = 0.012;  // metres
// 0.8 m to each side. Next to the gap the closest places are not opposite each other, so no line
// parallel to theirs passes the gap. It is crossed from places of the next 0.5 m.
constexpr int kMaxLines = 134;
// Axes are measured at the middle of the gap and up to 0.3 m aside. A thin prism finds a gap that
// admits an agent from any place within it.
constexpr double kAxisSpacing = 0.1;  // metres
constexpr int kMaxAxes = 6;
constexpr double kSameGap = 0.8;           // metres between ends of connections
constexpr std::size_t kMaxWalks = 60'000;  // on grids, of all gaps: some tenths of a second
// On the grid of one gap. A gap that takes more is given up, so that one gap cannot exhaust the
// total (60 could).
constexpr std::size_t kGapWalks = 1000;
// Of the exits of small islands. Some hundred find an exit nearby, thousands one through a long
// narrow corridor.
constexpr std::size_t kMaxExitWalks = 50'000, kMinExitWalks = 300, kMaxWalksOfExit = 4000;
constexpr std::size_t kMaxRepairWalks = 2000;  // of a path on the scarce mesh
constexpr double kMaxCorridor = 20;            // metres between islands
// More are wasted: earlier connections already join them.
constexpr std::size_t kGapsAtOnce = 32;

std::array<double, 6> makeKey(const Vec3& from, const Vec3& to) {
  return {from.x(), from.y(), from.z(), to.x(), to.y(), to.z()};
}

/// The path back along `path`, or else another one.
std::vector<Vec3> findPathBack(Walker& walker, const std::vector<Vec3>& path, GridSearch search) {
  std::vector<Vec3> back(path.rbegin(), path.rend());
  for (std::size_t i = 1; i < back.size(); ++i) {
    if (walks(walker, back[i - 1], back[i], kHeightError)) continue;
    auto other = findGridPath(walker, path.back(), path.front(), search);
    return other ? std::move(*other) : std::vector<Vec3>{};
  }
  return back;
}

/// The path on the meshes, if it is short.
std::vector<Vec3> findNearPath(const PathFinder& finder, const Vec3& from, const Vec3& to,
                               double maxDetour) {
  NavigationPath path = findPath(finder, from, to);
  return path.length <= (to - from).norm() + maxDetour ? std::move(path.points)
                                                       : std::vector<Vec3>{};
}

/// Metres from the straight line that a path across a gap may come, and what repairs it.
double computeReach(const BoundaryGap& gap, double maxDetour) {
  const double aside = 0.5 * std::sqrt(maxDetour * (2 * (gap.to - gap.from).norm() + maxDetour));
  return aside + kRepairMargin;
}

/// Inputs and results of a collection.
struct Collection {
  const PathFinder& finder;
  const IslandList& islands;
  TriedGaps& tried;
  std::vector<std::uint32_t> scarceParts;
  ConnectionList list;
  std::set<std::pair<std::uint32_t, std::uint32_t>> joined;  ///< islands, in one direction
  std::size_t walksLeft = kMaxWalks;

  std::uint32_t getIsland(std::uint32_t polygon) const { return islands.numberOf[polygon]; }
  std::optional<std::uint32_t> findPolygon(const Vec3& place) const {
    if (const auto polygon = findPolygonAt(finder.ample, place)) return polygon;
    const auto near = finder.ample.findNearest(place, Vec3::Constant(finder.agent.radius));
    return near ? std::optional(near->polygon) : std::nullopt;
  }
};

/// Whether connections lead across a gap next to this one, in both directions.
bool hasConnectionAt(const ConnectionList& list, const BoundaryGap& gap) {
  const auto isAt = [&](const Vec3& end, std::uint32_t polygon, const Vec3& place,
                        std::uint32_t other) {
    return (end - place).norm() < kSameGap && list.partOf[polygon] == list.partOf[other];
  };
  const auto leads = [&](const Vec3& from, std::uint32_t fromPolygon, const Vec3& to,
                         std::uint32_t toPolygon) {
    return std::ranges::any_of(list.connections, [&](const OffMeshConnection& one) {
      return isAt(one.points.front(), one.fromPolygon, from, fromPolygon) &&
             isAt(one.points.back(), one.toPolygon, to, toPolygon);
    });
  };
  return leads(gap.from, gap.fromPolygon, gap.to, gap.toPolygon) &&
         leads(gap.to, gap.toPolygon, gap.from, gap.fromPolygon);
}

/// Whether the scarce mesh leads through the gap, and not around it. Portals that searches closed
/// count as open: the result does not depend on earlier searches.
bool isOnScarceMesh(const Collection& all, const BoundaryGap& gap, double maxDetour) {
  const NavigationMesh& scarce = all.finder.scarce;
  const Vec3 extent(all.finder.agent.radius, 0.5, all.finder.agent.radius);
  const auto a = scarce.findNearest(gap.from, extent), b = scarce.findNearest(gap.to, extent);
  if (!a || !b || all.scarceParts[a->polygon] != all.scarceParts[b->polygon]) return false;
  const double maxLength = (gap.to - gap.from).norm() + maxDetour;
  return a->polygon == b->polygon ||
         findShortestCorridor(scarce, *a, *b, maxLength, ClosedPortals::open);
}

/// Where one path was found, the other one leads back along it.
GapPaths completePaths(Walker& walker, GapPaths paths, const GridSearch& limits) {
  if (paths.back.empty() && !paths.there.empty())
    paths.back = findPathBack(walker, paths.there, limits);
  if (paths.there.empty() && !paths.back.empty())
    paths.there = findPathBack(walker, paths.back, limits);
  return paths;
}

GapPaths crossOnScarceMesh(const Collection& all, const BoundaryGap& gap, double maxDetour) {
  Walker& walker = all.finder.walker;
  const auto start = standNear(walker, gap.from), goal = standNear(walker, gap.to);
  if (!start || !goal) return {};
  return completePaths(walker,
                       {findNearPath(all.finder, *start, *goal, maxDetour),
                        findNearPath(all.finder, *goal, *start, maxDetour)},
                       {kGridSpacing, kGapMargin, kGapWalks});
}

/// Offset i of the sequence 0, +d, -d, +2d, -2d, ... in metres; d is `spacing`.
double computeOffset(int i, double spacing) {
  return (i % 2 == 0 ? -1 : 1) * ((i + 1) / 2) * spacing;
}

GapPaths crossAlong(Walker& walker, const Vec3& start, const Vec3& end) {
  const auto from = standAt(walker, start + Vec3(0, kHeightError, 0), 2 * kHeightError);
  if (!from) return {};
  walker.returnTo(*from);
  if (!walker.isPathClear(end)) return {};
  const Vec3 to = walker.footPosition();
  if (!walks(walker, to, *from, kHeightError)) return {};
  return {.there = {*from, to}, .back = {to, *from}};
}

/// Walks through the middle of the gap. The gap may be wider than the agent by a centimetre, and
/// the boundaries of the mesh do not face each other along its walls.
GapPaths crossAlongAxis(const WorldData& world, Walker& walker, const BoundaryGap& gap,
                        const Vec3& across, const Vec3& aside) {
  if (across.isZero(0)) return {};
  const double half = 0.5 * across.norm();
  for (int i = 0; i <= kMaxAxes; ++i) {
    const double offset = computeOffset(i, kAxisSpacing);
    const Vec3 place = 0.5 * (gap.from + gap.to) + offset * aside;
    const auto axis = measureGapAxis(world, walker.agent(), place, across.normalized());
    if (!axis) continue;
    Vec3 start = axis->centre - half * axis->direction, end = axis->centre + half * axis->direction;
    start.y() = gap.from.y(), end.y() = gap.to.y();
    GapPaths paths = crossAlong(walker, start, end);
    if (!paths.there.empty()) return paths;
  }
  return {};
}

/// Walks straight across, along the axis of the gap or along lines that are close together. A gap
/// may be wider than the agent by less than any grid sees.
/// Nothing for gaps that are too wide.
GapPaths crossStraight(const WorldData& world, Walker& walker, const BoundaryGap& gap) {
  if (!(computeGroundDistance(gap.from, gap.to) < kMaxStraightGap)) return {};
  const Vec3 across = projectToGround(gap.to - gap.from);
  const Vec3 aside = Vec3(-across.z(), 0, across.x()).normalized();
  GapPaths paths = crossAlongAxis(world, walker, gap, across, aside);
  for (int i = 0; i <= kMaxLines && paths.there.empty(); ++i) {
    const double offset = computeOffset(i, kLineSpacing);
    paths = crossAlong(walker, gap.from + offset * aside, gap.to + offset * aside);
  }
  return paths;
}

/// Searches on a grid off the mesh, from the higher side, since some paths lead down alone. The
/// search soon comes to an end at a wall. Subtracts the walks from `maxWalks`.
GapPaths crossOnGrid(const Collection& all, Walker& walker, BoundaryGap gap,
                     std::size_t& maxWalks) {
  if (gap.from.y() < gap.to.y()) {
    std::swap(gap.from, gap.to);
    std::swap(gap.fromPolygon, gap.toPolygon);
  }
  const NavigationMesh& mesh = all.finder.ample;
  const auto start = standNear(walker, gap.from);
  if (!start) return {};
  const auto isWanted = [&](const Vec3& footPosition) {
    const auto polygon = findPolygonAt(mesh, footPosition);
    return polygon && all.getIsland(*polygon) != kNoIsland &&
           all.list.partOf[*polygon] != all.list.partOf[gap.fromPolygon];
  };
  const auto isOpen = [&](const Vec3& footPosition) {
    const auto polygon = findPolygonAt(mesh, footPosition);
    return !polygon || all.getIsland(*polygon) == kNoIsland ||
           computeGroundDistance(footPosition, *start) < kNearStart;
  };
  const GridSearch limits{kGridSpacing, kGapMargin, maxWalks};
  GridSearch search = limits;
  auto path = findGridPathOut(walker, *start, {isWanted, isOpen, gap.to}, search);
  maxWalks = search.maxWalks;
  if (!path) return {};
  std::vector<Vec3> back = findPathBack(walker, *path, limits);
  return {.there = std::move(*path), .back = std::move(back)};
}

/// The result of a gap that was tried off the scarce mesh.
struct GapTrial {
  GapPaths paths;
  std::size_t walks = 0;  ///< on the grid
};

/// Several may be tried at once. Where a walker arrives depends on its caches in the last digits,
/// so each has a new one.
GapTrial tryGap(const Collection& all, const BoundaryGap& gap, std::size_t maxWalks) {
  Walker walker(all.finder.world, all.finder.agent);
  GapTrial trial;
  std::size_t left = maxWalks;
  trial.paths = crossOnGrid(all, walker, gap, left);
  trial.walks = maxWalks - left;
  if (trial.paths.there.empty()) trial.paths = crossStraight(all.finder.world, walker, gap);
  return trial;
}

/// Searches on a grid from a small island, where this comes to an end soon, for a path to another
/// one and back.
GapPaths leaveIsland(const Collection& all, std::uint32_t island) {
  Walker walker(all.finder.world, all.finder.agent);
  const Vec3& place = all.islands.islands[island].place;
  const std::size_t share = kMaxExitWalks / all.islands.islands.size();
  const GridSearch limits{kGridSpacing, kMaxExitDistance,
                          std::clamp(share, kMinExitWalks, kMaxWalksOfExit)};
  const auto isOther = [&](const Vec3& footPosition) {
    const auto polygon = findPolygonAt(all.finder.ample, footPosition);
    const auto other = polygon ? all.getIsland(*polygon) : kNoIsland;
    return other != kNoIsland && other != island;
  };
  GridSearch out = limits;
  auto path = findGridPathOut(walker, place, {isOther}, out);
  if (!path) return {};
  std::vector<Vec3> back = findPathBack(walker, *path, limits);
  return {.there = std::move(*path), .back = std::move(back)};
}

void addConnections(Collection& all, const GapPaths& paths) {
  if (paths.there.empty()) return;
  const auto from = all.findPolygon(paths.there.front()), to = all.findPolygon(paths.there.back());
  if (!from || !to || all.getIsland(*from) == kNoIsland || all.getIsland(*to) == kNoIsland) return;
  const auto add = [&](std::uint32_t start, std::uint32_t end, const std::vector<Vec3>& points) {
    if (points.empty()) return;
    all.list.connections.push_back({start, end, points, computeLength(points)});
    all.joined.emplace(all.getIsland(start), all.getIsland(end));
  };
  add(*from, *to, paths.there);
  add(*to, *from, paths.back);
}

bool isOpen(const Collection& all, const BoundaryGap& gap) {
  return all.getIsland(gap.fromPolygon) != kNoIsland && all.getIsland(gap.toPolygon) != kNoIsland &&
         !hasConnectionAt(all.list, gap);
}

/// Other gaps of joined islands are found by searches on the scarce mesh.
bool isJoined(const Collection& all, const BoundaryGap& gap) {
  const std::uint32_t a = all.getIsland(gap.fromPolygon), b = all.getIsland(gap.toPolygon);
  return all.joined.contains({a, b}) && all.joined.contains({b, a});
}

/// Whether a gap off the scarce mesh is so narrow that a path may lead across it.
bool isNarrow(const BoundaryGap& gap) {
  return computeGroundDistance(gap.from, gap.to) <= kGapMargin;
}

/// `trial`: with kGapWalks walks; nullopt: not made.
void crossGap(Collection& all, const BoundaryGap& gap, double maxDetour,
              std::optional<GapTrial> trial) {
  if (!isOpen(all, gap)) return;
  const auto key = makeKey(gap.from, gap.to);
  if (const auto known = all.tried.find(key); known != all.tried.end())
    return addConnections(all, known->second);
  const bool isOnScarce = isOnScarceMesh(all, gap, maxDetour);
  if (isOnScarce ? isJoined(all, gap) : !isNarrow(gap)) return;
  GapPaths paths;
  if (isOnScarce) {
    paths = crossOnScarceMesh(all, gap, maxDetour);
    if (paths.there.empty()) paths = crossStraight(all.finder.world, all.finder.walker, gap);
    paths.reach = computeReach(gap, maxDetour);
  } else if (all.walksLeft > 0) {  // a gap that is given up counts as tried
    if (!trial || trial->walks > all.walksLeft)
      trial = tryGap(all, gap, std::min(kGapWalks, all.walksLeft));
    all.walksLeft -= trial->walks;
    paths = std::move(trial->paths);
    paths.reach = kGapMargin;
  }
  addConnections(all, all.tried.emplace(key, std::move(paths)).first->second);
}

/// Crosses all gaps in their order. The next ones are tried at once on several threads; connections
/// and the walks that are left decide afterwards, so that threads change no result.
void crossGaps(Collection& all, std::span<const BoundaryGap> gaps, int threads,
               const std::function<void()>& report) {
  for (std::size_t first = 0; first < gaps.size(); first += kGapsAtOnce) {
    const auto block = gaps.subspan(first, std::min(kGapsAtOnce, gaps.size() - first));
    std::vector<std::optional<GapTrial>> trials(block.size());
    if (all.walksLeft > 0 && threads > 1)
      parallelFor(block.size(), threads, {}, [&](std::size_t i) {
        const BoundaryGap& gap = block[i];
        if (isOpen(all, gap) && isNarrow(gap) && !all.tried.contains(makeKey(gap.from, gap.to)) &&
            !isOnScarceMesh(all, gap, kMaxGapDetour))
          trials[i] = tryGap(all, gap, kGapWalks);
      });
    for (std::size_t i = 0; i < block.size(); ++i) {
      crossGap(all, block[i], kMaxGapDetour, std::move(trials[i]));
      report();
    }
  }
}

/// The path from a polygon of the scarce mesh to the closest island.
struct IslandReach {
  double distance = std::numeric_limits<double>::infinity();  ///< metres
  std::uint32_t source = 0;                                   ///< polygon of the ample mesh there
};

double measureStep(const NavigationMesh& mesh, std::uint32_t from, std::uint32_t to) {
  return (mesh.centre(to) - mesh.centre(from)).norm();
}

/// By polygon of the scarce mesh, by Dijkstra's algorithm from all islands at once. Portals that
/// searches closed count as open: the result does not depend on earlier searches.
std::vector<IslandReach> reachFromIslands(const Collection& all) {
  const NavigationMesh &ample = all.finder.ample, &scarce = all.finder.scarce;
  std::vector<IslandReach> reached(scarce.polygonCount());
  std::set<std::pair<double, std::uint32_t>> queue;
  for (std::uint32_t polygon = 0; polygon < ample.polygonCount(); ++polygon) {
    if (all.getIsland(polygon) == kNoIsland) continue;
    const auto at = findPolygonAt(scarce, ample.centre(polygon));
    if (!at || reached[*at].distance == 0) continue;
    reached[*at] = {0, polygon};
    queue.emplace(0, *at);
  }
  while (!queue.empty()) {
    const auto [distance, polygon] = *queue.begin();
    queue.erase(queue.begin());
    for (const Portal& portal : scarce.portals(polygon)) {
      const double next = distance + measureStep(scarce, polygon, portal.to);
      if (next > kMaxCorridor || !(next < reached[portal.to].distance)) continue;
      queue.erase({reached[portal.to].distance, portal.to});
      reached[portal.to] = {next, reached[polygon].source};
      queue.emplace(next, portal.to);
    }
  }
  return reached;
}

/// Pairs of islands that a corridor of the scarce mesh joins, as gaps between polygons of the ample
/// mesh at its ends; the shortest first. Ends of a long corridor do not face each other as a gap.
std::vector<BoundaryGap> findLongGaps(const Collection& all) {
  const NavigationMesh &ample = all.finder.ample, &scarce = all.finder.scarce;
  const std::vector<IslandReach> reached = reachFromIslands(all);
  std::map<std::pair<std::uint32_t, std::uint32_t>, MeasuredGap> shortest;  // by islands
  for (std::uint32_t polygon = 0; polygon < scarce.polygonCount(); ++polygon)
    for (const Portal& portal : scarce.portals(polygon)) {
      const IslandReach &from = reached[polygon], &to = reached[portal.to];
      const double length = from.distance + to.distance + measureStep(scarce, polygon, portal.to);
      const std::uint32_t a = all.getIsland(from.source), b = all.getIsland(to.source);
      if (!(length < kMaxCorridor) || a >= b || !(length < shortest[{a, b}].length)) continue;
      shortest[{a, b}] = {
          length, {from.source, to.source, ample.centre(from.source), ample.centre(to.source)}};
    }
  return listByLength(shortest);
}

/// Small islands without a path to another one and back.
std::vector<std::uint32_t> listClosedIslands(const Collection& all) {
  std::set<std::uint32_t> left;
  for (const auto& [from, to] : all.joined)
    if (from != to && all.joined.contains({to, from})) left.insert(from);
  std::vector<std::uint32_t> closed;
  for (std::uint32_t island = 1; island < all.islands.islands.size(); ++island)
    if (!left.contains(island) && all.islands.islands[island].area <= kMaxSmallArea)
      closed.push_back(island);
  return closed;
}

}  // namespace

std::size_t measureBytes(const TriedGaps& tried) {
  constexpr std::size_t kNode = 4 * sizeof(void*);  // of a std::map
  std::size_t bytes = tried.size() * (kNode + sizeof(TriedGaps::value_type));
  for (const auto& [key, paths] : tried)
    bytes += (paths.there.size() + paths.back.size()) * sizeof(Vec3);
  return bytes;
}

ConnectionList collectConnections(PathFinder finder, const IslandList& islands, TriedGaps& tried,
                                  int threads, const std::function<void(double)>& progress) {
  finder.maxRepairWalks = kMaxRepairWalks;
  Collection all{finder, islands, tried, finder.scarce.findIslands(), listParts(finder.ample), {}};
  for (std::uint32_t polygon = 0; polygon < islands.numberOf.size(); ++polygon)
    if (all.getIsland(polygon) == kNoIsland) all.list.areas[all.list.partOf[polygon]] = 0;
  const std::vector<BoundaryGap> gaps = findBoundaryGaps(
      finder.ample, all.list.partOf, kWallAndDoor + 2 * finder.agent.radius, kHeightReach);
  const std::size_t count = gaps.size() + islands.islands.size();
  std::size_t done = 0;
  const auto report = [&] {
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(count));
  };
  if (progress) progress(0);
  crossGaps(all, gaps, threads, report);
  for (const BoundaryGap& gap : findLongGaps(all))
    crossGap(all, gap, kMaxCorridorDetour, std::nullopt);
  const std::vector<std::uint32_t> closed = listClosedIslands(all);
  std::vector<GapPaths> exits(closed.size());
  const auto makeExitKey = [&](std::size_t i) {
    const Vec3& place = islands.islands[closed[i]].place;
    return makeKey(place, place);
  };
  parallelFor(closed.size(), threads, {}, [&](std::size_t i) {
    if (tried.contains(makeExitKey(i))) return;
    exits[i] = leaveIsland(all, closed[i]);
    exits[i].reach = kMaxExitDistance;
  });
  for (std::size_t i = 0; i < closed.size(); ++i)
    addConnections(all, tried.emplace(makeExitKey(i), std::move(exits[i])).first->second);
  if (progress) progress(1);
  std::ranges::stable_sort(all.list.connections, {}, &OffMeshConnection::fromPolygon);
  return std::move(all.list);
}

void forgetGaps(TriedGaps& tried, const Aabb& box, const NavigationAgent& agent) {
  constexpr double kMargin = 0.5;  // metres that a walk looks around
  std::erase_if(tried, [&](const auto& one) {
    const auto& [key, paths] = one;
    const Vec3 from(key[0], key[1], key[2]), to(key[3], key[4], key[5]);
    const Aabb around{from.cwiseMin(to), from.cwiseMax(to)};
    return overlaps(inflate(around, paths.reach + agent.radius + kMargin), box);
  });
}

}  // namespace enfilade::scene
