#include "scene/navigation/unreachable_reasons.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <queue>
#include <string>
#include <utility>

#include "collision/assert.hpp"
#include "scene/navigation/clear_width.hpp"
#include "scene/navigation/mesh/off_mesh_connections.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMaxWidthDistance = 1.5;  // metres from where the walker stopped
constexpr double kMaxGap = 2.1;            // metres: a thick wall, and the agent on both sides
constexpr double kMaxGapHeight = 3;        // metres: a storey
constexpr double kMinAcross = 0.05;        // metres: less has no direction
constexpr double kRoomReach = 0.5;         // metres from an end of a gap to where an agent fits
constexpr double kBoundarySpacing = 0.5;   // metres along the boundary
constexpr double kMaxRise = 1.2;           // metres: higher obstacles are walls, not steps
constexpr double kMaxDepth = 10;           // metres: deeper falls have no number
constexpr double kMinHeadroom = 0.6;       // metres: less is no passage to stoop through
constexpr double kMinRadius = 0.01;        // metres: a thinner agent gets through cracks
constexpr double kPassageError = 1e-4;     // metres
constexpr double kOntoObstacle = 0.15;     // metres from where the agent touches it

template <class... Numbers>
std::string format(const char* text, Numbers... numbers) {
  std::array<char, 96> buffer{};
  std::snprintf(buffer.data(), buffer.size(), text, numbers...);
  return buffer.data();
}

/// The height above the walker's feet of the floor that it would reach on the obstacle; nullopt:
/// the agent cannot stand there.
std::optional<double> measureRise(const PathFinder& finder, const WalkOutcome& stop,
                                  const Vec3& direction) {
  const Vec3 above = stop.footPosition + kOntoObstacle * direction + Vec3(0, kMaxRise, 0);
  const auto place = standAt(finder.walker, above, kMaxRise);
  if (!place || finder.walker.groundEntity() != stop.obstacle) return std::nullopt;
  const double rise = place->y() - stop.footPosition.y();
  return rise > finder.world.settings.stepHeight ? std::optional(rise) : std::nullopt;
}

/// The largest size from `min` to `max` with which an agent walks straight from the stop to
/// `beyond`. `max`: all do; nullopt: not even `min`. `resize` sets the size of an agent.
template <class Resize>
std::optional<double> measurePassage(const PathFinder& finder, const WalkOutcome& stop,
                                     const Vec3& beyond, double min, double max,
                                     const Resize& resize) {
  const auto passes = [&](double size) {
    NavigationAgent smaller = finder.agent;
    resize(smaller, size);
    Walker walker(finder.world, smaller);
    return standAt(walker, stop.footPosition).has_value() &&
           walker.walkTo(beyond).kind == WalkOutcome::Kind::arrived;
  };
  double low = min, high = max;
  if (high <= low || !passes(low)) return std::nullopt;
  if (passes(high)) return high;
  while (high - low > kPassageError) {
    const double middle = 0.5 * (low + high);
    (passes(middle) ? low : high) = middle;
  }
  return low;
}

/// The greatest height of an agent that gets past the obstacle; nullopt: none does.
std::optional<double> measureHeadroom(const PathFinder& finder, const WalkOutcome& stop,
                                      const Vec3& beyond) {
  const auto height =
      measurePassage(finder, stop, beyond, kMinHeadroom, finder.agent.height,
                     [](NavigationAgent& agent, double size) { agent.height = size; });
  if (!height || *height == finder.agent.height) return std::nullopt;
  return *height + 2 * finder.world.settings.contactOffset;  // below the feet and above the head
}

/// The width of the widest agent that gets straight past the obstacle, in metres. 0: not even a
/// thin one does; nullopt: the agent itself does.
std::optional<double> measureGapAhead(const PathFinder& finder, const WalkOutcome& stop,
                                      const Vec3& beyond) {
  const auto radius =
      measurePassage(finder, stop, beyond, kMinRadius, finder.agent.radius,
                     [](NavigationAgent& agent, double size) { agent.radius = size; });
  if (!radius) return 0;
  if (*radius == finder.agent.radius) return std::nullopt;
  return 2 * *radius;
}

/// A place for the agent at the end of a gap.
std::optional<Vec3> standAtEnd(const PathFinder& finder, const Vec3& end) {
  if (const auto place = standNear(finder.walker, end)) return place;
  const auto room = finder.scarce.findNearest(end, Vec3::Constant(kRoomReach));
  return room ? standNear(finder.walker, room->point) : std::nullopt;
}

/// The walker has fallen by about a step.
std::string explainEnd(const PathFinder& finder, const WalkOutcome& stop, const Vec3& direction) {
  const double step = finder.world.settings.stepHeight;
  const Vec3 across = 2 * finder.agent.radius * direction;
  const Vec3 above = stop.footPosition + Vec3(0, 2 * step, 0);
  const auto before = standAt(finder.walker, above - across, 3 * step);
  const auto beyond = standAt(finder.walker, stop.footPosition + across, kMaxDepth);
  const double depth = before && beyond ? before->y() - beyond->y() : 0;
  if (depth <= step) return "the floor ends";
  return format("the floor ends: the next one is %.2f m lower", depth);
}

/// Of each two parts of a mesh that are near each other, the places that are closest.
std::vector<PartGap> findClosestGaps(const NavigationMesh& mesh,
                                     const std::vector<std::uint32_t>& partOf,
                                     const NavigationMesh& walkable) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, PartGap> closest;
  const auto hasRoomOn = [&](std::uint32_t part, const Vec3& place) {
    const auto polygons = walkable.findPolygons(place, Vec3::Constant(kRoomReach));
    return std::ranges::any_of(polygons, [&](std::uint32_t polygon) {
      const auto below = findPolygonAt(mesh, walkable.closestPoint(polygon, place));
      return below && partOf[*below] == part;
    });
  };
  const auto addGapsAt = [&](const BoundaryEdge& edge, const Vec3& from) {
    for (const std::uint32_t other : mesh.findPolygons(from, {kMaxGap, kMaxGapHeight, kMaxGap})) {
      PartGap gap{partOf[edge.polygon], partOf[other], from, mesh.closestPoint(other, from),
                  edge.outward};
      if (gap.fromPart == gap.toPart) continue;
      const Vec3 across = projectToGround(gap.to - from);
      if (across.norm() > kMinAcross) gap.across = across.normalized();
      const auto parts = std::minmax(gap.fromPart, gap.toPart);
      const auto known = closest.find(parts);
      if (known != closest.end() && gap.cost() >= known->second.cost()) continue;
      gap.hasRoom = hasRoomOn(gap.fromPart, gap.from) && hasRoomOn(gap.toPart, gap.to);
      if (known == closest.end())
        closest.emplace(parts, gap);
      else if (gap.cost() < known->second.cost())
        known->second = gap;
    }
  };
  forEachBoundaryPlace(mesh, kBoundarySpacing, addGapsAt);
  std::vector<PartGap> gaps;
  for (const auto& [parts, gap] : closest) {
    gaps.push_back(gap);
    gaps.push_back(gap.reversed());
  }
  std::ranges::stable_sort(gaps, {}, &PartGap::fromPart);
  return gaps;
}

/// The shortest sequence of gaps from one part to another; empty: none leads there.
std::vector<PartGap> findGapsTo(const UnobstructedMesh& unobstructed, std::uint32_t from,
                                std::uint32_t to) {
  struct Reached {
    double length = std::numeric_limits<double>::infinity();
    const PartGap* last = nullptr;
  };
  std::vector<Reached> parts(1 + *std::ranges::max_element(unobstructed.partOf));
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  ENFILADE_ASSERT(std::ranges::is_sorted(unobstructed.gaps, {}, &PartGap::fromPart));
  parts[from].length = 0;
  open.push({0, from});
  while (!open.empty() && open.top().second != to) {
    const auto [length, part] = open.top();
    open.pop();
    if (length > parts[part].length) continue;
    const auto first = std::ranges::lower_bound(unobstructed.gaps, part, {}, &PartGap::fromPart);
    for (auto gap = first; gap != unobstructed.gaps.end() && gap->fromPart == part; ++gap) {
      const double sum = length + gap->cost();
      if (!(sum < parts[gap->toPart].length)) continue;
      parts[gap->toPart] = {sum, &*gap};
      open.push({sum, gap->toPart});
    }
  }
  std::vector<PartGap> gaps;
  for (const PartGap* gap = parts[to].last; gap != nullptr; gap = parts[gap->fromPart].last)
    gaps.push_back(*gap);
  std::ranges::reverse(gaps);
  return gaps;
}

}  // namespace

double PartGap::cost() const {
  constexpr double kWithoutRoom = 10;  // metres: a route along the gaps of rooms is no longer
  return (to - from).norm() + (hasRoom ? 0 : kWithoutRoom);
}

UnobstructedMesh makeUnobstructedMesh(std::shared_ptr<const NavigationMesh> mesh,
                                      const NavigationMesh& walkable) {
  std::vector<std::uint32_t> partOf = mesh->findIslands();
  std::vector<PartGap> gaps = findClosestGaps(*mesh, partOf, walkable);
  return {std::move(mesh), std::move(partOf), std::move(gaps)};
}

void explainStop(const PathFinder& finder, const WalkOutcome& stop, const Vec3& from,
                 const Vec3& beyond, const std::vector<Vec3>& line, NavigationPath& path) {
  const Vec3 direction = projectToGround(beyond - from).normalized();
  path.obstruction = Obstruction{stop.obstacle, stop.footPosition, 0};
  if (stop.obstacle == 0) {
    path.reason = explainEnd(finder, stop, direction);
    return;
  }
  const std::string name = finder.world.findEntityName(stop.obstacle);
  path.reason = (name.empty() ? "an object without a name" : name) + " is in the way";
  const double width =
      measureNarrowest(finder.world, finder.agent, line, stop.footPosition, kMaxWidthDistance)
          .clearWidth;
  if (width < 2 * finder.agent.radius) {
    path.obstruction->clearWidth = width;
    path.reason += format(": clear width %.3f m, needs %.3f", width, 2 * finder.agent.radius);
  } else if (const auto headroom = measureHeadroom(finder, stop, beyond)) {
    path.reason += format(": clear height %.3f m, needs %.3f", *headroom, finder.agent.height);
  } else if (const auto rise = measureRise(finder, stop, direction)) {
    path.reason +=
        format(": a step of %.3f m, climbs %.3f", *rise, finder.world.settings.stepHeight);
  } else if (const auto gap = measureGapAhead(finder, stop, beyond)) {
    path.reason += *gap > 0 ? format(": %.3f m are free straight ahead", *gap) : ": no gap";
    path.reason += format(", needs %.3f m", 2 * finder.agent.radius);
  }
}

bool explainGaps(const PathFinder& finder, const MeshPoint& from, const MeshPoint& to,
                 NavigationPath& path) {
  const UnobstructedMesh& unobstructed = finder.unobstructed();
  for (PartGap gap : findGapsTo(unobstructed, unobstructed.partOf[from.polygon],
                                unobstructed.partOf[to.polygon])) {
    auto start = standAtEnd(finder, gap.from);
    if (!start) {  // the other side has the same obstacle
      gap = gap.reversed();
      start = standAtEnd(finder, gap.from);
    }
    if (!start) continue;
    const double length = (gap.to - *start).dot(gap.across) + 2 * finder.agent.radius;
    const Vec3 goal = *start + length * gap.across;
    finder.walker.returnTo(*start);
    const WalkOutcome outcome = finder.walker.walkTo(goal);
    if (outcome.kind == WalkOutcome::Kind::arrived) continue;
    explainStop(finder, outcome, *start, goal, {*start, goal}, path);
    return true;
  }
  return false;
}

}  // namespace enfilade::scene
