#include "scene/navigation/passage_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "scene/navigation/clear_width.hpp"
#include "scene/navigation/walk/grid_search.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kHeightReach = 0.6;    // metres between both sides of a gap
constexpr double kMaxGapDetour = 6;     // metres: a longer way around a gap does not pass it
constexpr double kSpacing = 0.12;       // metres
constexpr double kGapMargin = 1.6;      // metres around the beginning of a way across a gap
constexpr double kNearStart = 0.3;      // metres
constexpr double kMaxStraightGap = 1;   // metres
constexpr double kLineSpacing = 0.012;  // metres
// 0.8 m to each side. Next to the gap the closest places face each other askew, and no parallel of
// their line passes: it is crossed from places of the next 0.5 m.
constexpr int kMaxLines = 134;
// Axes are measured at the middle of the gap and up to 0.3 m aside: a thin prism finds a gap that
// admits an agent from any place within it.
constexpr double kAxisSpacing = 0.1;  // metres
constexpr int kMaxAxes = 6;
constexpr double kSameGap = 0.8;           // metres between ends of passages
constexpr std::size_t kMaxWalks = 60'000;  // on grids, of all gaps: some tenths of a second
// On the grid of one gap. A gap that takes more is given up, so that one does not use up the walks
// of all: 60 such gaps do.
constexpr std::size_t kGapWalks = 1000;
// Of the exits of small islands. Some hundred find an exit nearby, thousands one through a long
// narrow way.
constexpr std::size_t kMaxExitWalks = 50'000, kMinExitWalks = 300, kMaxWalksOfExit = 4000;
constexpr std::size_t kMaxRepairWalks = 2000;  // of a way on the scarce mesh

std::array<double, 6> makeKey(const Vec3& from, const Vec3& to) {
  return {from.x(), from.y(), from.z(), to.x(), to.y(), to.z()};
}

/// The way back along a way, or else another one.
std::vector<Vec3> findWayBack(Walker& walker, const std::vector<Vec3>& way, GridSearch search) {
  std::vector<Vec3> back(way.rbegin(), way.rend());
  for (std::size_t i = 1; i < back.size(); ++i) {
    if (walks(walker, back[i - 1], back[i], kHeightError)) continue;
    auto other = findGridPath(walker, way.back(), way.front(), search);
    return other ? std::move(*other) : std::vector<Vec3>{};
  }
  return back;
}

/// The way on the meshes, if it is short.
std::vector<Vec3> findNearPath(const PathFinder& finder, const Vec3& from, const Vec3& to) {
  NavigationPath path = findPath(finder, from, to);
  return path.length <= (to - from).norm() + kMaxGapDetour ? std::move(path.points)
                                                           : std::vector<Vec3>{};
}

/// Inputs and results of a collection.
struct Collection {
  const PathFinder& finder;
  const IslandList& islands;
  TriedGaps& tried;
  std::vector<std::uint32_t> scarceParts;
  PassageList list;
  std::set<std::pair<std::uint32_t, std::uint32_t>> joined;  ///< islands, in one direction
  std::size_t walksLeft = kMaxWalks;

  std::uint32_t getIsland(std::uint32_t polygon) const { return islands.numberOf[polygon]; }
  std::optional<std::uint32_t> findPolygon(const Vec3& place) const {
    if (const auto polygon = findPolygonAt(finder.ample, place)) return polygon;
    const auto near = finder.ample.findNearest(place, Vec3::Constant(finder.agent.radius));
    return near ? std::optional(near->polygon) : std::nullopt;
  }
};

/// Whether passages lead across a gap next to this one, in both directions.
bool hasPassageAt(const PassageList& list, const RimGap& gap) {
  const auto isAt = [&](const Vec3& end, std::uint32_t polygon, const Vec3& place,
                        std::uint32_t other) {
    return (end - place).norm() < kSameGap && list.partOf[polygon] == list.partOf[other];
  };
  const auto leads = [&](const Vec3& from, std::uint32_t fromPolygon, const Vec3& to,
                         std::uint32_t toPolygon) {
    return std::ranges::any_of(list.passages, [&](const Passage& one) {
      return isAt(one.points.front(), one.fromPolygon, from, fromPolygon) &&
             isAt(one.points.back(), one.toPolygon, to, toPolygon);
    });
  };
  return leads(gap.from, gap.fromPolygon, gap.to, gap.toPolygon) &&
         leads(gap.to, gap.toPolygon, gap.from, gap.fromPolygon);
}

bool isOnScarceMesh(const Collection& all, const RimGap& gap) {
  const Vec3 extent(all.finder.agent.radius, 0.5, all.finder.agent.radius);
  const auto a = all.finder.scarce.findNearest(gap.from, extent),
             b = all.finder.scarce.findNearest(gap.to, extent);
  return a && b && all.scarceParts[a->polygon] == all.scarceParts[b->polygon];
}

/// Where one way was found, the other one leads back along it.
GapWays completeWays(Walker& walker, GapWays ways, const GridSearch& limits) {
  if (ways.back.empty() && !ways.there.empty()) ways.back = findWayBack(walker, ways.there, limits);
  if (ways.there.empty() && !ways.back.empty()) ways.there = findWayBack(walker, ways.back, limits);
  return ways;
}

GapWays crossOnScarceMesh(const Collection& all, const RimGap& gap) {
  Walker& walker = all.finder.walker;
  const auto start = standNear(walker, gap.from), goal = standNear(walker, gap.to);
  if (!start || !goal) return {};
  return completeWays(
      walker, {findNearPath(all.finder, *start, *goal), findNearPath(all.finder, *goal, *start)},
      {kSpacing, kGapMargin, kGapWalks});
}

GapWays crossAlong(Walker& walker, const Vec3& start, const Vec3& end) {
  const auto from = standAt(walker, start + Vec3(0, kHeightError, 0), 2 * kHeightError);
  if (!from) return {};
  walker.returnTo(*from);
  if (!walker.isPathClear(end)) return {};
  const Vec3 to = walker.footPosition();
  if (!walks(walker, to, *from, kHeightError)) return {};
  return {{*from, to}, {to, *from}};
}

/// Walks through the middle of the gap: it may be wider than the agent by a centimetre, and the
/// rims of the mesh do not face each other along its walls.
GapWays crossAlongAxis(const PathFinder& finder, const RimGap& gap, const Vec3& across,
                       const Vec3& aside) {
  if (across.isZero(0)) return {};
  const double half = 0.5 * across.norm();
  for (int i = 0; i <= kMaxAxes; ++i) {
    const double offset = (i % 2 == 0 ? -1 : 1) * ((i + 1) / 2) * kAxisSpacing;
    const Vec3 place = 0.5 * (gap.from + gap.to) + offset * aside;
    const auto axis = measureGapAxis(finder.world, finder.agent, place, across.normalized());
    if (!axis) continue;
    Vec3 start = axis->centre - half * axis->direction, end = axis->centre + half * axis->direction;
    start.y() = gap.from.y(), end.y() = gap.to.y();
    GapWays ways = crossAlong(finder.walker, start, end);
    if (!ways.there.empty()) return ways;
  }
  return {};
}

/// Walks straight across, along the axis of the gap or along lines that are close together: a gap
/// may be wider than the agent by less than any grid sees.
GapWays crossStraight(const PathFinder& finder, const RimGap& gap) {
  const Vec3 across = projectToGround(gap.to - gap.from);
  const Vec3 aside = Vec3(-across.z(), 0, across.x()).normalized();
  GapWays ways = crossAlongAxis(finder, gap, across, aside);
  for (int i = 0; i <= kMaxLines && ways.there.empty(); ++i) {
    const double offset = (i % 2 == 0 ? -1 : 1) * ((i + 1) / 2) * kLineSpacing;
    ways = crossAlong(finder.walker, gap.from + offset * aside, gap.to + offset * aside);
  }
  return ways;
}

/// Searches on a grid off the mesh, from the higher side, since some ways lead down alone: the way
/// soon comes to an end at a wall.
GapWays crossOnGrid(Collection& all, RimGap gap) {
  if (gap.from.y() < gap.to.y()) {
    std::swap(gap.from, gap.to);
    std::swap(gap.fromPolygon, gap.toPolygon);
  }
  const NavigationMesh& mesh = all.finder.ample;
  const auto start = standNear(all.finder.walker, gap.from);
  if (!start) return {};
  const auto isWanted = [&](const Vec3& feet) {
    const auto polygon = findPolygonAt(mesh, feet);
    return polygon && all.getIsland(*polygon) != kNoIsland &&
           all.list.partOf[*polygon] != all.list.partOf[gap.fromPolygon];
  };
  const auto isOpen = [&](const Vec3& feet) {
    const auto polygon = findPolygonAt(mesh, feet);
    return !polygon || all.getIsland(*polygon) == kNoIsland ||
           computeGroundDistance(feet, *start) < kNearStart;
  };
  const std::size_t limit = std::min(kGapWalks, all.walksLeft);
  const GridSearch limits{kSpacing, kGapMargin, limit};
  GridSearch search = limits;
  auto way = findGridPathOut(all.finder.walker, *start, {isWanted, isOpen, gap.to}, search);
  all.walksLeft -= limit - search.maxWalks;
  if (!way) return {};
  std::vector<Vec3> back = findWayBack(all.finder.walker, *way, limits);
  return {std::move(*way), std::move(back)};
}

/// Searches on a grid from a small island, where this comes to an end soon, for a way to another
/// one and back.
GapWays leaveIsland(const Collection& all, std::uint32_t island) {
  const Vec3& place = all.islands.islands[island].place;
  const std::size_t share = kMaxExitWalks / all.islands.islands.size();
  const GridSearch limits{kSpacing, kMaxGapDetour,
                          std::clamp(share, kMinExitWalks, kMaxWalksOfExit)};
  const auto isOther = [&](const Vec3& feet) {
    const auto polygon = findPolygonAt(all.finder.ample, feet);
    const auto other = polygon ? all.getIsland(*polygon) : kNoIsland;
    return other != kNoIsland && other != island;
  };
  GridSearch out = limits;
  auto way = findGridPathOut(all.finder.walker, place, {isOther}, out);
  if (!way) return {};
  std::vector<Vec3> back = findWayBack(all.finder.walker, *way, limits);
  return {std::move(*way), std::move(back)};
}

void addPassages(Collection& all, const GapWays& ways) {
  if (ways.there.empty()) return;
  const auto from = all.findPolygon(ways.there.front()), to = all.findPolygon(ways.there.back());
  if (!from || !to || all.getIsland(*from) == kNoIsland || all.getIsland(*to) == kNoIsland) return;
  const auto add = [&](std::uint32_t start, std::uint32_t end, const std::vector<Vec3>& points) {
    if (points.empty()) return;
    all.list.passages.push_back({start, end, points, computeLength(points)});
    all.joined.emplace(all.getIsland(start), all.getIsland(end));
  };
  add(*from, *to, ways.there);
  add(*to, *from, ways.back);
}

void crossGap(Collection& all, const RimGap& gap) {
  const std::uint32_t a = all.getIsland(gap.fromPolygon), b = all.getIsland(gap.toPolygon);
  if (a == kNoIsland || b == kNoIsland || hasPassageAt(all.list, gap)) return;
  const auto key = makeKey(gap.from, gap.to);
  auto known = all.tried.find(key);
  if (known == all.tried.end()) {
    const double width = computeGroundDistance(gap.from, gap.to);
    const bool isOnScarce = isOnScarceMesh(all, gap);
    // The other gaps of joined islands are found by searches on the scarce mesh.
    if (isOnScarce ? all.joined.contains({a, b}) && all.joined.contains({b, a})
                   : all.walksLeft == 0 || width > kGapMargin)
      return;
    GapWays ways = isOnScarce ? crossOnScarceMesh(all, gap) : crossOnGrid(all, gap);
    if (ways.there.empty() && width < kMaxStraightGap) ways = crossStraight(all.finder, gap);
    known = all.tried.emplace(key, std::move(ways)).first;
  }
  addPassages(all, known->second);
}

}  // namespace

PassageList collectPassages(PathFinder finder, const IslandList& islands, TriedGaps& tried,
                            const std::function<void(double)>& progress) {
  finder.maxRepairWalks = kMaxRepairWalks;
  Collection all{finder, islands, tried, finder.scarce.findIslands(), listParts(finder.ample), {}};
  for (std::uint32_t polygon = 0; polygon < islands.numberOf.size(); ++polygon)
    if (all.getIsland(polygon) == kNoIsland) all.list.areas[all.list.partOf[polygon]] = 0;
  const std::vector<RimGap> gaps = findRimGaps(
      finder.ample, all.list.partOf, kWallAndDoor + 2 * finder.agent.radius, kHeightReach);
  const std::size_t count = gaps.size() + islands.islands.size();
  std::size_t done = 0;
  const auto report = [&] {
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(count));
  };
  for (const RimGap& gap : gaps) {
    crossGap(all, gap);
    report();
  }
  std::set<std::uint32_t> left;  // islands with a way to another one and back
  for (const auto& [from, to] : all.joined)
    if (from != to && all.joined.contains({to, from})) left.insert(from);
  for (std::uint32_t island = 1; island < islands.islands.size(); ++island) {
    report();
    const Vec3& place = islands.islands[island].place;
    if (left.contains(island) || islands.islands[island].area > kMaxSmallArea) continue;
    const auto key = makeKey(place, place);
    if (!tried.contains(key)) tried.emplace(key, leaveIsland(all, island));
    addPassages(all, tried.at(key));
  }
  std::ranges::stable_sort(all.list.passages, {}, &Passage::fromPolygon);
  return std::move(all.list);
}

void forgetGaps(TriedGaps& tried, const Aabb& box) {
  std::erase_if(tried, [&](const auto& one) {
    const auto& [key, ways] = one;
    const Vec3 from(key[0], key[1], key[2]), to(key[3], key[4], key[5]);
    const Aabb around{from.cwiseMin(to), from.cwiseMax(to)};
    return overlaps(inflated(around, kMaxGapDetour + 1), box);
  });
}

}  // namespace enfilade::scene
