#include "scene/navigation/path_finder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "scene/navigation/mesh_paths.hpp"
#include "scene/navigation/reasons.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMaxRefusals = 10;  // searches for the reason; afterwards it is that of the last one
constexpr int kMaxPassageRoutes = 4;
constexpr double kOnMesh = 0.1;  // metres
constexpr const char* kNotFound = "no way was found within the limits of the search";
constexpr double kMaxConnection = 3;  // metres between places that are connected without a mesh
constexpr GridSearch kCoarseConnection{kCoarseSpacing, 2.5, 4000};
constexpr GridSearch kFineConnection{0.02, 2.5, 16000};

/// The corners of a line on a mesh.
struct Line {
  std::vector<Vec3> corners;  ///< with the goal, without the start
  std::vector<Vec3> middles;  ///< of its portals, with both ends
};

/// A place on the unobstructed mesh; nullopt: it is not near.
std::optional<MeshPoint> findUnobstructed(const PathFinder& finder, const Vec3& place) {
  return finder.unobstructed().mesh.findNearest(
      place,
      {2 * finder.agent.radius, 0.5 + finder.world.settings.stepHeight, 2 * finder.agent.radius});
}

std::optional<Line> findUnobstructedLine(const PathFinder& finder, const MeshPoint& from,
                                         const MeshPoint& to, const Vec3& goal) {
  const NavigationMesh& mesh = finder.unobstructed().mesh;
  const auto corridor = mesh.findCorridor(from, to);
  if (!corridor) return std::nullopt;
  Line line{mesh.straighten(*corridor, from.point, to.point), {from.point}};
  line.corners.push_back(goal);
  for (std::size_t i = 1; i < corridor->polygons.size(); ++i)
    line.middles.push_back(mesh.portalMiddle(corridor->polygons[i - 1], corridor->polygons[i]));
  line.middles.push_back(to.point);
  return line;
}

/// The ways to the passages of a route, and through them. Returns the first part that fails, or
/// nullopt: `points` are the whole way.
std::optional<std::size_t> walkRoute(const PathFinder& finder, const PassageRoute& route,
                                     const Vec3& start, const Vec3& goal, Proof& proof,
                                     std::vector<Vec3>& points) {
  points = {start};
  const auto append = [&](const std::vector<Vec3>& more) {
    points.insert(points.end(), more.begin() + 1, more.end());
  };
  for (std::size_t i = 0; i <= route.passages.size(); ++i) {
    const bool isLast = i == route.passages.size();
    const std::vector<Vec3>* through =
        isLast ? nullptr : &finder.passages->passages[route.passages[i]].points;
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

/// Makes a path of a way of which each leg was walked, as short as it can be walked without a stop.
NavigationPath proveWay(const PathFinder& finder, const std::vector<Vec3>& way, Proof& proof) {
  std::vector<Vec3> shortened = shortenPath(finder.walker, way, Shortcuts::all);
  std::vector<Vec3> tight = shortened;
  pullTight(finder.walker, tight);
  NavigationPath path;
  for (const std::vector<Vec3>* points : {&std::as_const(tight), &std::as_const(shortened), &way}) {
    if (!walksOn(finder.walker, *points, proof)) continue;
    path.points = *points;
    path.length = computeLength(path.points);
    break;
  }
  return path;
}

NavigationPath findPathByPassages(const PathFinder& finder, const Vec3& start, const Vec3& goal,
                                  Proof& proof) {
  const auto findNear = [&](const Vec3& place) {
    const auto near = finder.ample.findNearest(place, {kOnMesh, kHeightError, kOnMesh});
    return near ? near : finder.ample.findNearest(place, computeMeshReach(finder));
  };
  const auto from = findNear(start), to = findNear(goal);
  if (!finder.passages || !from || !to) return {};
  std::vector<bool> excluded(finder.passages->passages.size(), false);
  for (int i = 0; i < kMaxPassageRoutes; ++i) {
    const PassageRoute route = findPassageRoute(*finder.passages, *from, *to, excluded);
    if (route.passages.empty()) break;
    std::vector<Vec3> way;
    const auto failed = walkRoute(finder, route, start, goal, proof, way);
    if (!failed) {
      NavigationPath path = proveWay(finder, way, proof);
      if (path.found()) return path;
    }
    excluded[route.passages[std::min(failed.value_or(0), route.passages.size() - 1)]] = true;
  }
  return {};
}

NavigationPath findPathOnMeshes(const PathFinder& finder, const Vec3& start, const Vec3& goal,
                                Proof& proof) {
  NavigationPath path = findPathByMeshes(finder, start, goal, proof);
  if (path.found()) return path;
  Proof own(finder.maxRepairWalks);  // the search before may have used up its walks
  return findPathByPassages(finder, start, goal, own);
}

/// Whether a place is on a part of the mesh that is not small. The rim of furniture may be above a
/// polygon of the floor by about a step.
bool isOnMesh(const PathFinder& finder, const Vec3& place) {
  const auto polygon = findPolygonAt(finder.ample, place);
  return polygon && !(finder.passages && finder.passages->isSmallPart(*polygon)) &&
         std::abs(finder.ample.closestPoint(*polygon, place).y() - place.y()) < kMaxMeshHeight;
}

/// Replaces the part of a way that begins and ends on the mesh by a path there, if this is shorter.
void rejoinMesh(const PathFinder& finder, std::vector<Vec3>& way) {
  const auto isOn = [&](const Vec3& place) { return isOnMesh(finder, place); };
  const auto first = std::ranges::find_if(way, isOn);
  const auto end = std::find_if(way.rbegin(), way.rend(), isOn).base();  // after the last
  if (end - first < 3) return;
  Proof proof(finder.maxRepairWalks);
  const NavigationPath path = findPathOnMeshes(finder, *first, *std::prev(end), proof);
  if (!path.found() || path.length >= computeLength({first, end})) return;
  std::vector<Vec3> rest(end, way.end());
  way.erase(first, way.end());
  way.insert(way.end(), path.points.begin(), path.points.end());
  way.insert(way.end(), rest.begin(), rest.end());
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
      if (outcome.kind != WalkOutcome::Kind::arrived)
        explainStop(finder, outcome, projectToGround(*place - places.back()).normalized(),
                    line->middles, path);
      return path;
    }
    places.insert(places.end(), around->begin() + 1, around->end());
  }
  path.reason = kNotFound;
  if (std::abs(places.back().y() - to.y()) > kHeightError) return path;
  rejoinMesh(finder, places);
  NavigationPath proved = proveWay(finder, places, proof);
  if (proved.found()) return proved;
  path.obstruction = proof.met.back();
  return path;
}

/// Places without a mesh, as narrow ones on furniture, or on a small part of one, are connected
/// with it by walks on a grid. Places that are near are connected with one another.
NavigationPath findPathOffMeshes(const PathFinder& finder, const Vec3& start, const Vec3& goal) {
  Walker& walker = finder.walker;
  Proof proof(finder.maxRepairWalks);
  const auto isOn = [&](const Vec3& place) { return isOnMesh(finder, place); };
  NavigationPath path;
  if (isOn(start) && isOn(goal)) return path;
  const auto search = [](const auto& find) {
    std::optional<std::vector<Vec3>> way;
    for (GridSearch grid : {kCoarseConnection, kFineConnection})
      if (!way) way = find(grid);
    return way;
  };
  const auto connect = [&](const Vec3& from, const Vec3& to) {
    return search([&](GridSearch& grid) { return findGridPath(walker, from, to, grid); });
  };
  const auto leave = [&](const Vec3& place, const Vec3& toward) {
    if (isOn(place)) return std::optional(std::vector<Vec3>{place});
    return search([&](GridSearch& grid) {
      return findGridPathOut(walker, place, {isOn, {}, toward}, grid);
    });
  };
  std::optional<std::vector<Vec3>> way;
  if (computeGroundDistance(start, goal) < kMaxConnection) way = connect(start, goal);
  if (!way) {
    way = leave(start, goal);
    // A walk may lead down where none leads up: the way back from the mesh is walked, too.
    const auto fromGoal = way ? leave(goal, start) : std::nullopt;
    const auto last = fromGoal ? connect(fromGoal->back(), goal) : std::nullopt;
    if (!last) return path;
    const NavigationPath middle = findPathOnMeshes(finder, way->back(), last->front(), proof);
    if (!middle.found()) return path;
    way->insert(way->end(), middle.points.begin() + 1, middle.points.end());
    way->insert(way->end(), last->begin() + 1, last->end());
  }
  return proveWay(finder, *way, proof);
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

NavigationPath findWayOut(Walker& walker, const Vec3& from,
                          const std::function<bool(const Vec3&)>& isWanted) {
  NavigationPath path;
  if (const auto error = walker.place(from, kMaxStandDrop)) {
    path.reason = "at the start " + *error;
    return path;
  }
  GridSearch search{kCoarseSpacing, 2, 20'000};
  const auto way = findGridPathOut(walker, walker.footPosition(), {isWanted}, search);
  if (!way) return path;
  path.points = shortenPath(walker, *way, Shortcuts::all);
  path.length = computeLength(path.points);
  path.seconds = path.length / walker.agent().speed;
  path.legs.push_back({PathLeg::Kind::aside, 0, path.length, path.seconds});
  return path;
}

}  // namespace enfilade::scene
