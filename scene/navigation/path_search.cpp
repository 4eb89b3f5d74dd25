#include "scene/navigation/path_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "collision/assert.hpp"
#include "scene/navigation/mesh_paths.hpp"
#include "scene/navigation/unreachable_reasons.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMaxRefusals = 10;  // searches for the reason; afterwards it is that of the last one
constexpr int kMaxConnectionRoutes = 4;
constexpr double kOnMesh = 0.1;     // metres
constexpr double kMinAim = 1;       // metres from where a path joins the mesh
constexpr double kStraight = 1.01;  // of the straight line: a path is short enough
constexpr const char* kNotFound = "no path was found within the limits of the search";
constexpr std::size_t kMaxThinnedPlaces = 50;  // of a path: of more, single ones are not left out
constexpr double kMaxGridDistance = 3;    // metres between places that are connected without a mesh
constexpr double kMaxKeptGrowth = 5e-4;   // of the length: a new search varies by more
constexpr double kMaxStraightMove = 0.5;  // metres: a longer move may have led around something
constexpr double kMinSaving = 1e-3;       // metres that a shortcut saves
constexpr double kSameStand = 1e-9;       // metres: from there on two walks are the same
constexpr double kMaxKeptMove = 0.01;     // of the length: then another path may be shorter by 2 %
// From the middle of a perforated floor, which has no mesh, to the next one with a mesh.
constexpr double kMaxExit = 5;  // metres
constexpr GridSearch kCoarseGrid{kCoarseSpacing, kMaxExit, 4000};
constexpr GridSearch kFineGrid{0.02, 2.5, 16000};

/// The corners of a line on a mesh.
struct Line {
  std::vector<Vec3> corners;  ///< with the goal, without the start
  std::vector<Vec3> middles;  ///< of its portals, with both ends
};

/// A place on the unobstructed mesh; nullopt: it is not near.
std::optional<MeshPoint> findUnobstructed(const PathFinder& finder, const Vec3& place) {
  return finder.unobstructed().mesh->findNearest(
      place,
      {2 * finder.agent.radius, 0.5 + finder.world.settings.stepHeight, 2 * finder.agent.radius});
}

std::optional<Line> findUnobstructedLine(const PathFinder& finder, const MeshPoint& from,
                                         const MeshPoint& to, const Vec3& goal) {
  const NavigationMesh& mesh = *finder.unobstructed().mesh;
  const auto corridor = mesh.findCorridor(from, to);
  if (!corridor) return std::nullopt;
  Line line{mesh.straighten(*corridor, from.point, to.point), {from.point}};
  line.corners.push_back(goal);
  for (std::size_t i = 1; i < corridor->polygons.size(); ++i)
    line.middles.push_back(mesh.portalMiddle(corridor->polygons[i - 1], corridor->polygons[i]));
  line.middles.push_back(to.point);
  return line;
}

/// The paths to the connections of a route, and through them. Returns the first part that fails, or
/// nullopt: `points` are the whole path.
std::optional<std::size_t> walkRoute(const PathFinder& finder, const ConnectionRoute& route,
                                     const Vec3& start, const Vec3& goal, Proof& proof,
                                     std::vector<Vec3>& points) {
  points = {start};
  const auto append = [&](const std::vector<Vec3>& more) {
    points.insert(points.end(), more.begin() + 1, more.end());
  };
  for (std::size_t i = 0; i <= route.connections.size(); ++i) {
    const bool isLast = i == route.connections.size();
    const std::vector<Vec3>* through =
        isLast ? nullptr : &finder.connections->connections[route.connections[i]].points;
    const Vec3& end = isLast ? goal : through->front();
    if (computeGroundDistance(points.back(), end) > kArrivalDistance) {
      const NavigationPath path = findPathByMeshes(finder, points.back(), end, proof);
      if (!path.found()) return i;
      append(path.points);
    }
    if (through) append(*through);
  }
  return std::nullopt;
}

/// Leaves out places of a path as long as the whole of it can be walked, and the feet move less.
NavigationPath leaveOutPlaces(Walker& walker, NavigationPath path, Proof& proof) {
  for (std::size_t i = 1; i + 1 < path.points.size();) {
    NavigationPath other;
    other.points = path.points;
    other.points.erase(other.points.begin() + static_cast<std::ptrdiff_t>(i));
    if (walksWithoutBumps(walker, other, proof) && other.feetLength < path.feetLength)
      path = std::move(other);
    else
      ++i;
  }
  return path;
}

/// Makes a path of places whose legs were walked, as short as it can be walked without a stop.
NavigationPath provePath(const PathFinder& finder, const std::vector<Vec3>& places, Proof& proof) {
  std::vector<Vec3> shortened = shortenPath(finder.walker, places, Shortcuts::all);
  std::vector<Vec3> tight = shortened;
  pullTight(finder.walker, tight);
  const std::vector<Vec3> shortest = shortenPath(finder.walker, tight, Shortcuts::tight);
  NavigationPath path =
      proveVersions(finder.walker, std::array{shortest, tight, shortened}, Versions::all, proof);
  if (!path.found()) {
    // A fall from a step may lead past places where the feet would have stood.
    path = proveVersions(finder.walker, std::array{places}, Versions::all, proof);
    if (path.found() && path.points.size() <= kMaxThinnedPlaces)
      path = leaveOutPlaces(finder.walker, std::move(path), proof);
  }
  if (path.found()) tightenBends(finder.walker, path, kFineSpacing, proof);
  return path;
}

NavigationPath findPathByConnections(const PathFinder& finder, const Vec3& start, const Vec3& goal,
                                     Proof& proof) {
  const auto findNear = [&](const Vec3& place) {
    const auto near = finder.ample.findNearest(place, {kOnMesh, kHeightError, kOnMesh});
    return near ? near : finder.ample.findNearest(place, computeMeshReach(finder));
  };
  const auto from = findNear(start), to = findNear(goal);
  if (!finder.connections || !from || !to) return {};
  std::vector<bool> excluded(finder.connections->connections.size(), false);
  for (int i = 0; i < kMaxConnectionRoutes; ++i) {
    const ConnectionRoute route = findConnectionRoute(*finder.connections, *from, *to, excluded);
    if (route.connections.empty()) break;
    std::vector<Vec3> places;
    const auto failed = walkRoute(finder, route, start, goal, proof, places);
    if (!failed) {
      NavigationPath path = provePath(finder, places, proof);
      if (path.found()) return path;
    }
    excluded[route.connections[std::min(failed.value_or(0), route.connections.size() - 1)]] = true;
  }
  return {};
}

NavigationPath findPathOnMeshes(const PathFinder& finder, const Vec3& start, const Vec3& goal,
                                Proof& proof) {
  NavigationPath path = findPathByMeshes(finder, start, goal, proof);
  if (path.found()) return path;
  Proof own(finder.maxRepairWalks);  // the search before may have used up its walks
  return findPathByConnections(finder, start, goal, own);
}

/// Whether a place is on a part of the mesh that is not small. The edge of furniture may be above a
/// polygon of the floor by about a step.
bool isOnMesh(const PathFinder& finder, const Vec3& place) {
  const auto polygon = findPolygonAt(finder.ample, place);
  return polygon && !(finder.connections && finder.connections->isSmallPart(*polygon)) &&
         std::abs(finder.ample.closestPoint(*polygon, place).y() - place.y()) < kMaxMeshHeight;
}

/// Replaces the part of a path that begins and ends on the mesh by one there, if this is shorter.
void rejoinMesh(const PathFinder& finder, std::vector<Vec3>& places) {
  const auto isOn = [&](const Vec3& place) { return isOnMesh(finder, place); };
  const auto first = std::ranges::find_if(places, isOn);
  const auto end = std::find_if(places.rbegin(), places.rend(), isOn).base();  // after the last
  if (end - first < 3) return;
  Proof proof(finder.maxRepairWalks);
  const NavigationPath path = findPathOnMeshes(finder, *first, *std::prev(end), proof);
  if (!path.found() || path.cost() >= computeLength({first, end})) return;
  std::vector<Vec3> rest(end, places.end());
  places.erase(first, places.end());
  places.insert(places.end(), path.points.begin(), path.points.end());
  places.insert(places.end(), rest.begin(), rest.end());
}

/// Walks along the line of the mesh for anything thinner and without bodies. Finds what is in the
/// way, or, where the agent passes a place that is too narrow for its own meshes, the path.
NavigationPath findUnobstructedPath(const PathFinder& finder, const Vec3& from, const Vec3& to,
                                    Proof& proof) {
  NavigationPath path;
  const auto first = findUnobstructed(finder, from), last = findUnobstructed(finder, to);
  const auto line = first && last ? findUnobstructedLine(finder, *first, *last, to) : std::nullopt;
  if (!line) {
    if (first && last && explainGaps(finder, *first, *last, path)) return path;
    path.reason = "no floor, step or stair leads there";
    if (!proof.met.empty()) path.obstruction = proof.met.front();
    return path;
  }
  std::vector<Vec3> places{from};
  for (const Vec3& corner : line->corners) {
    const auto place =
        &corner == &line->corners.back() ? std::optional(to) : standNear(finder.walker, corner);
    if (!place) continue;
    GridSearch search{kCoarseSpacing, 1, 20'000};
    finder.walker.returnTo(places.back());
    const WalkOutcome outcome = finder.walker.walkTo(*place);
    if (isThere(outcome, *place, kSameFloor)) {
      places.push_back(finder.walker.footPosition());
      continue;
    }
    const auto around = findGridPath(finder.walker, places.back(), *place, search);
    if (!around) {
      path.reason = kNotFound;  // it may stand above or below the corner
      if (outcome.kind != WalkOutcome::Kind::arrived) {
        const Vec3 direction = projectToGround(*place - places.back()).normalized();
        explainStop(finder, outcome, places.back(),
                    outcome.footPosition + 2 * finder.agent.radius * direction, line->middles,
                    path);
      }
      return path;
    }
    places.insert(places.end(), around->begin() + 1, around->end());
  }
  path.reason = kNotFound;
  if (std::abs(places.back().y() - to.y()) > kHeightError) return path;
  rejoinMesh(finder, places);
  NavigationPath proved = provePath(finder, places, proof);
  if (proved.found()) return proved;
  path.obstruction = proof.met.back();
  return path;
}

using Places = std::optional<std::vector<Vec3>>;

/// A path on the coarse grid, else on the fine one.
Places findPathOnGrids(Walker& walker, const Vec3& from, const Vec3& to) {
  GridSearch coarse = kCoarseGrid, fine = kFineGrid;
  Places places = findGridPath(walker, from, to, coarse);
  return places ? places : findGridPath(walker, from, to, fine);
}

/// A path on the grids to the mesh, on the side of `toward`. If the coarse search in that direction
/// takes all its walks, as among many holes, it leads to the closest place of the mesh.
Places findPathToMesh(const PathFinder& finder, const Vec3& place, const Vec3& toward) {
  const auto isOn = [&](const Vec3& at) { return isOnMesh(finder, at); };
  if (isOn(place)) return std::vector<Vec3>{place};
  GridSearch coarse = kCoarseGrid, nearest = kCoarseGrid, fine = kFineGrid;
  Places places = findGridPathOut(finder.walker, place, {isOn, {}, toward}, coarse);
  if (!places && coarse.maxWalks == 0)
    places = findGridPathOut(finder.walker, place, {isOn}, nearest);
  return places ? places : findGridPathOut(finder.walker, place, {isOn, {}, toward}, fine);
}

/// The parts of a path off the mesh.
struct Exits {
  Vec3 aimOfStart, aimOfGoal;            ///< places that they lead towards
  std::optional<Vec3> start, goal = {};  ///< where they join the mesh
};

/// The first place of a path that is over kMinAim metres from its beginning, across, or its end.
template <class Iterator>
Vec3 findAim(Iterator first, Iterator end) {
  const auto isFar = [&](const Vec3& place) {
    return computeGroundDistance(*first, place) > kMinAim;
  };
  const auto far = std::find_if(first, end, isFar);
  return far == end ? *std::prev(end) : *far;
}

/// A path from the start to the mesh, on it, and to the goal. Sets `exits` to its own, which aim at
/// its part on the mesh. No path if they are as before.
NavigationPath findPathOverMesh(const PathFinder& finder, const Vec3& start, const Vec3& goal,
                                Exits& exits, Proof& proof) {
  Places places = findPathToMesh(finder, start, exits.aimOfStart);
  // A walk may lead down where none leads up: the path back from the mesh is walked, too.
  const Places fromGoal = places ? findPathToMesh(finder, goal, exits.aimOfGoal) : std::nullopt;
  if (!fromGoal) return {};
  const bool isAsBefore = exits.start == places->back() && exits.goal == fromGoal->back();
  const Places last =
      isAsBefore ? std::nullopt : findPathOnGrids(finder.walker, fromGoal->back(), goal);
  if (!last) return {};
  const NavigationPath middle = findPathOnMeshes(finder, places->back(), last->front(), proof);
  if (!middle.found()) return {};
  exits = {findAim(middle.points.begin(), middle.points.end()),
           findAim(middle.points.rbegin(), middle.points.rend()), places->back(), fromGoal->back()};
  places->insert(places->end(), middle.points.begin() + 1, middle.points.end());
  places->insert(places->end(), last->begin() + 1, last->end());
  return provePath(finder, *places, proof);
}

/// Walks on a grid connect places without a mesh (such as narrow ones on furniture), or on a small
/// part of one, with it. Places that are near are connected with one another.
NavigationPath findPathOffMeshes(const PathFinder& finder, const Vec3& start, const Vec3& goal) {
  Walker& walker = finder.walker;
  Proof proof(finder.maxRepairWalks);
  if (isOnMesh(finder, start) && isOnMesh(finder, goal)) return {};
  if (walks(walker, start, goal, kHeightError)) {
    NavigationPath straight = provePath(finder, {start, goal}, proof);
    if (straight.found()) return straight;
  }
  NavigationPath best;
  if (computeGroundDistance(start, goal) < kMaxGridDistance)
    if (const Places places = findPathOnGrids(walker, start, goal))
      best = provePath(finder, *places, proof);
  // The mesh may lead around walls: its path shows which way the ends lead.
  Exits exits{goal, start, {}, {}};
  for (int i = 0; i < 2; ++i) {
    if (best.found() && best.cost() <= kStraight * (goal - start).norm()) break;
    NavigationPath path = findPathOverMesh(finder, start, goal, exits, proof);
    if (!path.found()) break;
    if (!best.found() || path.feetLength < best.feetLength) best = std::move(path);
  }
  return best;
}

/// Whether no other path is much shorter. The lines pass corners more closely than an agent.
bool isNearLine(double length, const MeshLines& lines) {
  const auto isNear = [&](const auto& line) { return !line || length <= 1.02 * *line + 0.1; };
  return (lines[0] || lines[1]) && std::ranges::all_of(lines, isNear);
}

/// Whether against a line on a mesh a kept path would be longer than when it was found. `moved`:
/// metres by which the lines may be shorter.
bool isLonger(const KeptPath& kept, double length, const MeshLines& lines, double moved) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].has_value() != kept.lines[i].has_value()) return true;
    const double excess = length - (lines[i].value_or(0) - moved);
    if (lines[i] && excess > kept.excess[i] + 0.01 + kMaxKeptGrowth * length) return true;
  }
  return false;
}

/// From a place straight to the second point of a path, or to the farthest one in clear sight, and
/// along it. Empty: the second point cannot be reached so.
std::vector<Vec3> leadOnto(Walker& walker, const Vec3& start, const std::vector<Vec3>& path) {
  std::size_t joined = 1;
  if (path.size() < 2 || !walks(walker, start, path[joined], kSameHeight)) return {};
  const bool isAt = computeGroundDistance(start, path[joined]) < kArrivalDistance;
  if (isAt && joined + 1 < path.size() && walks(walker, start, path[joined + 1], kSameHeight))
    ++joined;
  const auto isShorterTo = [&](std::size_t next) {
    const double length = (path[joined] - start).norm() + (path[next] - path[joined]).norm();
    if (length - (path[next] - start).norm() < kMinSaving) return false;
    return isWalkClear(walker, start, path[next]);
  };
  while (joined + 1 < path.size() && isShorterTo(joined + 1)) ++joined;
  std::vector<Vec3> points{start};
  points.insert(points.end(), path.begin() + static_cast<std::ptrdiff_t>(joined), path.end());
  return points;
}

/// Walks a path tick by tick, up to the first point where the feet stand as in the walk of `stood`.
/// Before it, `stood` is overwritten. False: an obstacle stops the walk; `stood` is then
/// unspecified.
bool walkUntilJoined(Walker& walker, const std::vector<Vec3>& points,
                     std::vector<std::optional<Vec3>>& stood) {
  ENFILADE_ASSERT(stood.size() == points.size());
  walker.returnTo(points.front());
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (walker.walkOn(points[i]).kind != WalkOutcome::Kind::arrived) return false;
    const bool isSame =
        walker.isStanding() && stood[i] && (walker.footPosition() - *stood[i]).norm() <= kSameStand;
    if (isSame) return true;
    stood[i] = walker.isStanding() ? std::optional(walker.footPosition()) : std::nullopt;
  }
  return true;
}

}  // namespace

NavigationPath findPath(const PathFinder& finder, const Vec3& from, const Vec3& to) {
  NavigationPath none;
  if (const auto error = finder.walker.place(from, kMaxStandDrop)) {
    none.reason = "at the start " + *error;
    return none;
  }
  const Vec3 start = finder.walker.footPosition();
  if (const auto error = finder.walker.place(to, kMaxStandDrop)) {
    none.reason = "at the goal " + *error;
    return none;
  }
  const Vec3 goal = finder.walker.footPosition();
  Proof proof(finder.maxRepairWalks);
  NavigationPath best = findPathOnMeshes(finder, start, goal, proof);
  if (best.found() || !finder.unobstructed) return best;
  best = findPathOffMeshes(finder, start, goal);
  if (best.found()) return best;
  Refusals* refusals = finder.refusals;
  // From places off the mesh an agent may get farther than from the islands next to them.
  if (refusals && refusals->count >= kMaxRefusals && isOnMesh(finder, start) &&
      isOnMesh(finder, goal))
    return refusals->last;
  best = findUnobstructedPath(finder, start, goal, proof);
  if (refusals) *refusals = best.found() ? Refusals() : Refusals{refusals->count + 1, best};
  return best;
}

KeptPath keepPath(const PathFinder& finder, NavigationPath path, const Vec3& goal) {
  KeptPath kept;
  kept.goal = goal;
  kept.searchedFrom = path.points.front();
  kept.lines = measureLines(finder, path.points.front(), path.points.back());
  for (std::size_t i = 0; i < kept.lines.size(); ++i)
    kept.excess[i] = path.length - kept.lines[i].value_or(0);
  kept.isNearLine = isNearLine(path.length, kept.lines);
  if (path.feetLength > 0) {  // it may lead over steps
    finder.walker.takeCrossedSteps();
    kept.stood.resize(path.points.size());
    if (!walkUntilJoined(finder.walker, path.points, kept.stood))
      kept.stood.assign(path.points.size(), std::nullopt);
    else if (!finder.walker.takeCrossedSteps())
      kept.stood.clear();
  }
  kept.path = std::move(path);
  return kept;
}

bool rejoinPath(const PathFinder& finder, KeptPath& kept, const Vec3& from) {
  Walker& walker = finder.walker;
  if (walker.place(from, kMaxStandDrop)) return false;
  const Vec3 start = walker.footPosition();
  if (!kept.isNearLine && (start - kept.searchedFrom).norm() > kMaxKeptMove * kept.path.length)
    return false;
  walker.takeCrossedSteps();
  std::vector<Vec3> points = leadOnto(walker, start, kept.path.points);
  if (points.empty()) return false;
  std::vector<std::optional<Vec3>> stood;
  if (!kept.stood.empty()) {
    stood = {start};
    stood.insert(stood.end(), kept.stood.end() - static_cast<std::ptrdiff_t>(points.size() - 1),
                 kept.stood.end());
  } else if (walker.takeCrossedSteps()) {
    stood.resize(points.size());
  }
  if (!stood.empty() && !walkUntilJoined(walker, points, stood)) return false;
  const double length = computeLength(points);
  // A line is at most as much shorter as the agent moved since it was measured.
  const double move = (start - kept.path.points.front()).norm();
  kept.moved += move;
  if (move > kMaxStraightMove || isLonger(kept, length, kept.lines, kept.moved)) {
    const MeshLines lines = measureLines(finder, start, points.back());
    if (isLonger(kept, length, lines, 0)) return false;
    if (kept.isNearLine && !isNearLine(length, lines)) return false;
    kept.lines = lines;
    kept.moved = 0;
    for (std::size_t i = 0; i < lines.size(); ++i)
      kept.excess[i] = std::min(kept.excess[i], length - lines[i].value_or(0));
  }
  kept.path.points = std::move(points);
  kept.stood = std::move(stood);
  kept.path.length = length;
  kept.path.seconds = length / finder.agent.speed;
  kept.path.legs = {{PathLeg::Kind::walk, 0, length, kept.path.seconds}};
  return true;
}

NavigationPath findPathOut(Walker& walker, const Vec3& from,
                           const std::function<bool(const Vec3&)>& isWanted) {
  NavigationPath path;
  if (const auto error = walker.place(from, kMaxStandDrop)) {
    path.reason = "at the start " + *error;
    return path;
  }
  GridSearch search{kCoarseSpacing, 2, 20'000};
  const auto places = findGridPathOut(walker, walker.footPosition(), {isWanted}, search);
  if (!places) return path;
  path.points = shortenPath(walker, *places, Shortcuts::all);
  path.length = computeLength(path.points);
  path.seconds = path.length / walker.agent().speed;
  path.legs.push_back({PathLeg::Kind::aside, 0, path.length, path.seconds});
  return path;
}

}  // namespace enfilade::scene
