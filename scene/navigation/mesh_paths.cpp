#include "scene/navigation/mesh_paths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "scene/navigation/clear_width.hpp"
#include "scene/navigation/mesh/shortest_corridor.hpp"
#include "scene/navigation/walk/shorter_parts.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMaxProposals = 12;  // corridors to try on a mesh
constexpr double kStandOff = 0.1;  // metres before an obstacle: where a path around it begins
constexpr double kNarrowGap =
    0.1;  // metres: a gap that is wider than the agent by more needs no axis
constexpr std::array<double, 2> kRejoinDistances{1, 3};  // metres beyond the obstacle
// Failures at a portal, without a proved path through it meanwhile, after which it is not tried
// again.
constexpr int kRefutations = 8;
constexpr int kMaxRepairs = 12;               // of a leg
constexpr std::size_t kQuickWalks = 300;      // of a repair; those that succeed rarely need more
constexpr std::size_t kMaxQuickWalks = 3000;  // of a path
constexpr double kFarAround = 1.3;            // of the straight line: a way around is long
constexpr std::size_t kMaxImprovementWalks = 5000;  // of a repair
constexpr int kQuickProposals = 4;
constexpr int kMaxImprovements = 3;        // proposals after a path that leads far around
constexpr double kNearlyStraight = 1.005;  // a line that is longer by less is short enough
constexpr double kWorthTrying = 1.015;     // a corridor that is shorter by less is not tried
constexpr double kTight = 1.01;            // of the line of its corridor: a path is short enough
constexpr double kMinClimb = 0.01;         // of the length of a path: less is no reason to search
constexpr double kMeshBendSpacing = 0.05;  // metres: 3 cm takes three times as long
constexpr double kMaxMeshOffset = 0.1;     // metres, across
constexpr double kShortPath = 8;  // metres: of it, some centimetres at each corner are a per cent

/// The axis of a gap that the walker stopped before, or in.
std::optional<GapAxis> findNarrowGap(const PathFinder& finder, const Vec3& stop,
                                     const Vec3& direction) {
  for (int i = 0; i < 3; ++i) {
    const Vec3 place = stop + i * finder.agent.radius * direction;
    const auto axis = measureGapAxis(finder.world, finder.agent, place, direction);
    if (axis && axis->clearWidth < 2 * finder.agent.radius + kNarrowGap) return axis;
  }
  return std::nullopt;
}

/// Walks along the axis of the gap that stopped the walker before `corner`: a corridor that is just
/// wide enough admits no other line. Appends the place before the gap and the one level with the
/// corner, or else one within the gap.
bool passGap(const PathFinder& finder, const WalkOutcome& stop, const Vec3& corner,
             NavigationPath& path, Proof& proof) {
  const Vec3 from = path.points.back();
  const Vec3 toCorner = projectToGround(corner - from);
  if (!(toCorner.norm() > kStandOff)) return false;
  const auto axis = findNarrowGap(finder, stop.footPosition, toCorner.normalized());
  if (!axis) return false;
  const auto onAxis = [&](const Vec3& place) {
    const double along = projectToGround(place - axis->centre).dot(axis->direction);
    Vec3 projected = axis->centre + along * axis->direction;
    projected.y() = place.y();
    return projected;
  };
  const double stopped = computeGroundDistance(from, stop.footPosition);
  const Vec3 before = from + std::max(0.0, stopped - kStandOff) * toCorner.normalized();
  finder.walker.returnTo(from);
  if (finder.walker.walkTo(onAxis(before)).kind != WalkOutcome::Kind::arrived) return false;
  const Vec3 start = finder.walker.footPosition();
  std::vector<Vec3> targets{corner};
  for (const double beyond : kRejoinDistances)
    targets.push_back(stop.footPosition + beyond * toCorner.normalized());
  for (const Vec3& target : targets) {
    finder.walker.returnTo(start);
    const WalkOutcome outcome = finder.walker.walkTo(onAxis(target));
    if (!isThere(outcome, target, kSameFloor)) continue;
    path.points.push_back(start);
    path.points.push_back(outcome.footPosition);
    proof.isRepaired = true;
    return true;
  }
  return false;
}

double computeHorizontalLength(std::vector<Vec3> points) {
  for (Vec3& point : points) point.y() = 0;
  return computeLength(points);
}

/// Metres from the start of a repair over its end to the end of its leg, across.
double computeRepairLength(const std::vector<Vec3>& places, const Vec3& legEnd) {
  return computeHorizontalLength(places) + computeGroundDistance(places.back(), legEnd);
}

/// A path on the grid to the first target that has one; the last target is the end of the leg.
std::optional<std::vector<Vec3>> findWayToFirst(
    Walker& walker, const Vec3& from, const std::vector<Vec3>& targets, GridSearch& search,
    double maxRepairLength = std::numeric_limits<double>::infinity()) {
  for (const Vec3& target : targets) {
    search.maxLength = maxRepairLength - computeGroundDistance(target, targets.back());
    if (auto places = findGridPath(walker, from, target, search)) return places;
  }
  return std::nullopt;
}

/// As findWayToFirst(): a quick search, or a thorough one on the coarse grid and on the fine one. A
/// narrow place may lie between the lines of the coarse grid, whose way then leads far around.
std::optional<std::vector<Vec3>> findRepair(Walker& walker, const Vec3& from,
                                            const std::vector<Vec3>& targets, Proof& proof) {
  if (proof.isQuick) {
    const std::size_t maxWalks = std::min(kQuickWalks, proof.quickWalks);
    GridSearch quick{kCoarseSpacing, proof.coarse.margin, maxWalks};
    auto places = findWayToFirst(walker, from, targets, quick);
    proof.quickWalks -= maxWalks - quick.maxWalks;
    return places;
  }
  auto places = findWayToFirst(walker, from, targets, proof.coarse);
  if (!places) return findWayToFirst(walker, from, targets, proof.fine);
  const double length = computeRepairLength(*places, targets.back());
  if (length <= kFarAround * computeGroundDistance(from, targets.back())) return places;
  const std::size_t maxWalks = std::min(kMaxImprovementWalks, proof.improvementWalks);
  GridSearch finer{kFineSpacing, proof.fine.margin, maxWalks};
  auto better = findWayToFirst(walker, from, targets, finer, length);
  proof.improvementWalks -= maxWalks - finer.maxWalks;
  return better && computeRepairLength(*better, targets.back()) < length ? better : places;
}

/// Goes around the obstacle that stopped the walker on the leg from the last place of `path` to
/// `corner`. Appends places up to where it joins that leg again, or up to the corner.
bool goAround(const PathFinder& finder, const WalkOutcome& stop, const Vec3& corner,
              NavigationPath& path, Proof& proof) {
  const Vec3 legStart = path.points.back();
  const Vec3 toCorner = projectToGround(corner - legStart);
  const double length = toCorner.norm();
  if (!(length > 0)) return false;
  const Vec3 direction = toCorner / length;
  const double stopped = computeGroundDistance(legStart, stop.footPosition);
  if (stopped > 2 * kStandOff) {  // begin shortly before the obstacle
    finder.walker.returnTo(legStart);
    const Vec3 before = legStart + (stopped - kStandOff) * direction;
    if (finder.walker.walkTo(before).kind == WalkOutcome::Kind::arrived)
      path.points.push_back(finder.walker.footPosition());
  }
  const Vec3 from = path.points.back();
  std::vector<Vec3> targets;
  for (const double beyond : kRejoinDistances) {
    const double along = (stopped + beyond) / length;
    if (along >= 1) break;
    if (const auto place = standNear(finder.walker, legStart + along * (corner - legStart)))
      targets.push_back(*place);
  }
  targets.push_back(corner);
  const auto around = findRepair(finder.walker, from, targets, proof);
  if (!around) return false;
  path.points.insert(path.points.end(), around->begin() + 1, around->end());
  proof.isRepaired = true;
  return true;
}

/// Walks from corner to corner, with repairs. Appends the places to `path`, which has the first
/// one.
bool proveLegs(const PathFinder& finder, std::vector<Vec3> corners, Clearance clearance,
               NavigationPath& path, Proof& proof) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const bool isLast = i + 1 == corners.size();
    for (int repairs = 0;; ++repairs) {
      const Vec3 from = path.points.back();
      if (!isLast && computeGroundDistance(from, corners[i]) < kArrivalDistance) break;
      finder.walker.returnTo(from);
      const WalkOutcome outcome = finder.walker.walkTo(corners[i]);
      if (isThere(outcome, corners[i], kSameFloor)) {
        path.points.push_back(outcome.footPosition);
        break;
      }
      proof.failedAt = outcome.footPosition;
      if (repairs == 0 && !isLast && clearance == Clearance::scarce) {
        const auto place = standNear(finder.walker, corners[i]);
        if (!place) break;  // the next corner may be reached without this one
        corners[i] = *place;
      }
      if (repairs < kMaxRepairs && passGap(finder, outcome, corners[i], path, proof)) {
        if (!isLast && computeGroundDistance(path.points.back(), corners[i]) < kNarrowGap) break;
        continue;
      }
      if (repairs < kMaxRepairs && goAround(finder, outcome, corners[i], path, proof)) continue;
      proof.met.push_back({outcome.obstacle, outcome.footPosition, 0});
      return false;
    }
  }
  return true;
}

/// Closes portals of a mesh during a search. If it refutes, those that failed often, and never led
/// to a proved path meanwhile, stay closed.
class PortalClosures {
 public:
  PortalClosures(NavigationMesh& mesh, bool refutes) : mesh_(mesh), refutes_(refutes) {}
  ~PortalClosures() {
    for (const auto& [from, to] : closed_) mesh_.openPortal(from, to);
  }
  PortalClosures(const PortalClosures&) = delete;
  PortalClosures& operator=(const PortalClosures&) = delete;

  /// Closes the portal of a corridor that is closest to a failure; false: the corridor has none.
  /// `counts`: the failure may refute the portal.
  bool closeNearest(const Corridor& corridor, const Vec3& failure, bool counts) {
    const auto& polygons = corridor.polygons;
    if (polygons.size() < 2) return false;
    std::size_t at = 0;
    double minDistance = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < polygons.size(); ++i) {
      const double distance =
          (mesh_.portalMiddle(polygons[i], polygons[i + 1]) - failure).squaredNorm();
      if (distance < minDistance) minDistance = distance, at = i;
    }
    mesh_.closePortal(polygons[at], polygons[at + 1]);
    if (!refutes_ || !counts || mesh_.countFailure(polygons[at], polygons[at + 1]) < kRefutations)
      closed_.emplace_back(polygons[at], polygons[at + 1]);
    return true;
  }

 private:
  NavigationMesh& mesh_;
  const bool refutes_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> closed_;
};

/// A* through the middles of portals is quick. Where its line bends, another corridor may have a
/// shorter one.
std::optional<Corridor> findCorridor(const NavigationMesh& mesh, const MeshPoint& from,
                                     const MeshPoint& to) {
  std::optional<Corridor> corridor = mesh.findCorridor(from, to);
  if (!corridor) return corridor;
  const std::vector<Vec3> line = mesh.straighten(*corridor, from.point, to.point);
  const double length = computeHorizontalLength(line);
  if (length < kNearlyStraight * computeHorizontalLength({from.point, to.point})) return corridor;
  std::optional<Corridor> other = findShortestCorridor(mesh, from, to, length / kNearlyStraight);
  if (other && computeLength(mesh.straighten(*other, from.point, to.point)) < computeLength(line))
    return other;
  return corridor;
}

/// Whether a place is where the mesh is. Furniture may be above the floor's mesh, or next to it.
bool isAt(const MeshPoint& onMesh, const Vec3& place) {
  return computeGroundDistance(onMesh.point, place) < kMaxMeshOffset &&
         std::abs(onMesh.point.y() - place.y()) < kMaxMeshHeight;
}

/// Proves the line `corners`, and shortens what was repaired.
NavigationPath proveCorridor(const PathFinder& finder, Clearance clearance, const Vec3& from,
                             std::vector<Vec3> corners, double lineLength, Proof& proof) {
  NavigationPath path;
  path.points = {from};
  finder.walker.takeCrossedSteps();
  proof.isRepaired = false;
  proof.bump.reset();
  if (!proveLegs(finder, std::move(corners), clearance, path, proof)) return {};
  path.points =
      shortenPath(finder.walker, path.points, proof.isRepaired ? Shortcuts::all : Shortcuts::free);
  path.length = computeLength(path.points);
  const std::vector<Vec3> loose = path.points;
  if (path.length < kShortPath || (proof.isRepaired && path.length > kTight * lineLength))
    pullTight(finder.walker, path.points);
  path.length = computeLength(path.points);
  if (!finder.walker.takeCrossedSteps()) return path;
  return proveVersions(finder.walker, std::array{path.points, loose}, Versions::untilLevel, proof);
}

/// A path along a corridor. A repair may lead far around: then other corridors are tried whose
/// lines are shorter than the path.
NavigationPath findPathOn(const PathFinder& finder, NavigationMesh& mesh, Clearance clearance,
                          const Vec3& from, const Vec3& to, Proof& proof) {
  const Vec3 extent = computeMeshReach(finder);
  const auto start = mesh.findNearest(from, extent), goal = mesh.findNearest(to, extent);
  NavigationPath best;
  if (!start || !goal) return best;
  // Quick repairs refute nothing, nor does the path off furniture.
  PortalClosures closures(mesh, !proof.isQuick && isAt(*start, from) && isAt(*goal, to));
  int proposals = proof.isQuick ? kQuickProposals : kMaxProposals;
  while (proposals-- > 0) {
    const auto corridor = findCorridor(mesh, *start, *goal);
    if (!corridor) break;
    std::vector<Vec3> corners = mesh.straighten(*corridor, start->point, goal->point);
    const double lineLength = computeLength(corners);
    if (best.found() && lineLength * kWorthTrying > best.cost()) break;
    proof.shortestLine = std::min(proof.shortestLine, lineLength);
    if (corners.size() > 1) corners.erase(corners.begin(), corners.begin() + 1);
    if (!corners.empty()) corners.pop_back();
    corners.push_back(to);
    NavigationPath path =
        proveCorridor(finder, clearance, from, std::move(corners), lineLength, proof);
    const bool isProved = path.found();
    if (isProved) {
      for (std::size_t i = 1; i < corridor->polygons.size(); ++i)
        mesh.forgetFailures(corridor->polygons[i - 1], corridor->polygons[i]);
      const double cost = path.cost();
      const bool isShort = cost <= kWorthTrying * lineLength || !(proof.isRepaired || proof.bump);
      if (!best.found()) proposals = std::min(proposals, kMaxImprovements);
      if (!best.found() || cost < best.cost()) best = std::move(path);
      if (isShort) break;
    }
    if (!proof.isQuick && (proof.coarse.maxWalks == 0 || proof.fine.maxWalks == 0))
      break;  // a search that ended at its limits does not refute the corridor
    const Vec3& place = isProved && proof.bump ? *proof.bump : proof.failedAt;
    if (!closures.closeNearest(*corridor, place, !isProved)) break;
  }
  return best;
}

NavigationPath findPathByProposals(const PathFinder& finder, const Vec3& start, const Vec3& goal,
                                   Proof& proof) {
  NavigationPath best = findPathOn(finder, finder.ample, Clearance::ample, start, goal, proof);
  const Vec3 extent(finder.agent.radius, 0.5 + finder.world.settings.stepHeight,
                    finder.agent.radius);
  const auto first = finder.scarce.findNearest(start, extent),
             last = finder.scarce.findNearest(goal, extent);
  const auto shortcut = first && last ? findCorridor(finder.scarce, *first, *last) : std::nullopt;
  if (shortcut && (!best.found() ||
                   computeLength(finder.scarce.straighten(*shortcut, first->point, last->point)) *
                           kWorthTrying <
                       best.cost())) {
    NavigationPath other = findPathOn(finder, finder.scarce, Clearance::scarce, start, goal, proof);
    if (other.found() && (!best.found() || other.cost() < best.cost())) best = std::move(other);
  }
  return best;
}

}  // namespace

Proof::Proof(std::size_t maxRepairWalks)
    : coarse{kCoarseSpacing, kRepairMargin, maxRepairWalks},
      fine{kFineSpacing, 0.7, maxRepairWalks},
      quickWalks(std::min(kMaxQuickWalks, maxRepairWalks)),
      improvementWalks(maxRepairWalks),
      bendWalks(maxRepairWalks),
      bumps{maxRepairWalks} {}

Vec3 computeMeshReach(const PathFinder& finder) {
  return {3 * finder.agent.radius, 0.5 + finder.world.settings.stepHeight, 3 * finder.agent.radius};
}

bool isThere(const WalkOutcome& outcome, const Vec3& goal, double heightError) {
  return outcome.kind == WalkOutcome::Kind::arrived &&
         std::abs(outcome.footPosition.y() - goal.y()) <= heightError;
}

bool walksOn(Walker& walker, const std::vector<Vec3>& points, Proof& proof) {
  walker.returnTo(points.front());
  const auto walksEvenlyTo = [&](const Vec3& point) { return walker.walkEvenly(point); };
  if (std::all_of(points.begin() + 1, points.end(), walksEvenlyTo)) return true;
  // On bumpy ground a walk that begins a fraction of a millimetre aside may end elsewhere.
  walker.returnTo(points.front());
  for (std::size_t i = 1; i < points.size(); ++i) {
    const WalkOutcome outcome = walker.walkOn(points[i]);
    if (outcome.kind == WalkOutcome::Kind::arrived) continue;
    proof.failedAt = outcome.footPosition;
    proof.met.push_back({outcome.obstacle, outcome.footPosition, 0});
    return false;
  }
  return true;
}

bool walksWithoutBumps(Walker& walker, NavigationPath& path, Proof& proof) {
  if (!walksOn(walker, path.points, proof)) return false;
  const double rise = std::abs(path.points.back().y() - path.points.front().y());
  double climb = 0;
  const auto measure =
      [&] {  // at once after the walk over the whole path: searches reset its travel
        climb = walker.travel().climb - rise;
        path.feetLength = walker.travel().length();
        path.length = computeLength(path.points);
      };
  measure();
  proof.bump.reset();
  const auto isSmall = [&] { return climb < std::max(kMinBump, kMinClimb * path.length); };
  if (isSmall()) return true;
  std::vector<Vec3> level = path.points;
  if (const PartEnds replaced = goAroundBumps(walker, level, proof.bumps); !replaced.empty()) {
    const Vec3 failedAt = proof.failedAt;
    const std::vector<Obstruction> met = proof.met;
    if (walksOn(walker, level, proof)) {
      path.points = std::move(level);
      measure();
    } else {
      proof.bumps.known.insert(proof.bumps.known.end(), replaced.begin(), replaced.end());
      proof.failedAt = failedAt;
      proof.met = met;
    }
  }
  proof.bump = findBump(walker, path.points);
  path.bumpClimb = isSmall() ? 0 : climb;
  return true;
}

NavigationPath proveVersions(Walker& walker, std::span<const std::vector<Vec3>> versions,
                             Versions tried, Proof& proof) {
  NavigationPath best;
  std::optional<Vec3> bump;
  for (std::size_t i = 0; i < versions.size(); ++i) {
    if (i > 0 && versions[i] == versions[i - 1]) continue;
    NavigationPath path;
    path.points = versions[i];
    if (!walksWithoutBumps(walker, path, proof)) continue;
    if (best.found() && path.feetLength >= best.feetLength) continue;
    best = std::move(path);
    bump = proof.bump;
    if (tried == Versions::untilLevel && best.bumpClimb == 0) break;
  }
  proof.bump = bump;
  return best;
}

void tightenBends(Walker& walker, NavigationPath& path, double spacing, Proof& proof) {
  NavigationPath shorter;
  shorter.points = path.points;
  if (!shortenBends(walker, shorter.points, spacing, proof.bendWalks)) return;
  const std::optional<Vec3> bump = proof.bump;
  const bool isMeasured = path.feetLength > 0;  // else shortenBends() compared both
  if (walksWithoutBumps(walker, shorter, proof) &&
      (!isMeasured || shorter.feetLength < path.feetLength))
    path = std::move(shorter);
  else
    proof.bump = bump;
}

/// On the scarce mesh A* through the middles of portals suffices: its line shows whether a narrow
/// gap makes a path much shorter.
MeshLines measureLines(const PathFinder& finder, const Vec3& from, const Vec3& to) {
  const Vec3 reach = computeMeshReach(finder);
  MeshLines lines;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const NavigationMesh& mesh = i == 0 ? finder.ample : finder.scarce;
    const auto start = mesh.findNearest(from, reach), goal = mesh.findNearest(to, reach);
    if (!start || !goal) continue;
    const auto corridor =
        i == 0 ? findCorridor(mesh, *start, *goal) : mesh.findCorridor(*start, *goal);
    if (corridor)
      lines[i] = (start->point - from).norm() + (goal->point - to).norm() +
                 computeLength(mesh.straighten(*corridor, start->point, goal->point));
  }
  return lines;
}

/// A repair that fails takes long, and the next proposal may be as short: first all are tried with
/// quick repairs.
NavigationPath findPathByMeshes(const PathFinder& finder, const Vec3& start, const Vec3& goal,
                                Proof& proof) {
  proof.isQuick = true;
  proof.shortestLine = std::numeric_limits<double>::infinity();
  NavigationPath quick = findPathByProposals(finder, start, goal, proof);
  proof.isQuick = false;
  if (quick.found() && quick.cost() <= kTight * proof.shortestLine) return quick;
  NavigationPath best = findPathByProposals(finder, start, goal, proof);
  if (quick.found() && (!best.found() || quick.cost() < best.cost())) best = std::move(quick);
  if (best.found() && best.cost() > kTight * proof.shortestLine)
    tightenBends(finder.walker, best, kMeshBendSpacing, proof);
  return best;
}

}  // namespace enfilade::scene
