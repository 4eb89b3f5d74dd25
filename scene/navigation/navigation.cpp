#include "scene/navigation/navigation.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <thread>
#include <utility>

#include "scene/navigation/grid_search.hpp"
#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMaxStandDrop = 0.6;  // metres: a place given with the height of the eyes is not
                                       // one
constexpr double kSearchLift = 0.3;    // metres: heights of polygons are those of voxels
constexpr int kMaxProposals = 12;      // corridors to try on a mesh
constexpr std::size_t kMaxRepairWalks = 100'000;              // of a path: some tenths of a second
constexpr double kCoarseSpacing = 0.12, kFineSpacing = 0.03;  // metres
constexpr double kStandOff = 0.1;  // metres before an obstacle: where a way around it begins
constexpr std::array<double, 2> kRejoinDistances{1, 3};  // metres beyond the obstacle
constexpr int kMaxRepairs = 12;                          // of a leg
constexpr double kWorthTrying = 1.02;  // a corridor that is shorter by less is not tried
/// The clear width is measured with a thin prism, at places that are closer than it is wide.
constexpr double kThinRadius = 0.05, kWidthSpacing = 0.08, kMaxSideWidth = 3;  // metres
constexpr double kMaxWidthDistance = 1.5;  // metres from where the walker stopped
constexpr int kMaxRandomTries = 200;

double computeLength(const std::vector<Vec3>& points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

void setBodyPoses(WorldData& world, const Snapshot& snapshot) {
  for (const BodySnapshot& body : *snapshot.bodies) {
    Body& own = world.bodies[body.index];
    setBodyPose(own, body.pose.translation, body.pose.rotation);
    own.motionBounds = own.boxes.whole;
  }
}

}  // namespace

/// What a search has spent and met.
struct Navigation::Proof {
  GridSearch coarse{kCoarseSpacing, 1.5, kMaxRepairWalks};
  GridSearch fine{kFineSpacing, 0.7, kMaxRepairWalks};
  Vec3 failedAt = Vec3::Zero();  ///< where the last proof failed
  std::vector<Obstruction> met;
};

Navigation::Navigation(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
                       const NavigationAgent& agent, const Snapshot* snapshot, int threads,
                       const Progress& progress)
    : agent_(agent),
      world_(std::move(scene), settings),
      grid_(makeTileGrid(world_.scene().bounds(), agent)),
      walker_(world_.data(), agent) {
  if (snapshot) setBodyPoses(world_.data(), *snapshot);
  buildMeshes(threads, progress);
}

Navigation::~Navigation() = default;

void Navigation::buildMeshes(int threads, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  const int count = grid_.tilesX * grid_.tilesZ;
  const std::vector<Clearance> clearances{Clearance::ample, Clearance::scarce};
  std::vector<TileMesh> ample(static_cast<std::size_t>(count)), scarce(ample);
  std::atomic<int> next{0}, done{0};
  std::exception_ptr failure;
  std::mutex failureMutex;
  const auto build = [&](bool reports) {
    try {
      for (int i = next++; i < count; i = next++) {
        auto tiles = buildTileMeshes(world_.data(), agent_, grid_, i % grid_.tilesX,
                                     i / grid_.tilesX, clearances);
        ample[static_cast<std::size_t>(i)] = std::move(tiles[0]);
        scarce[static_cast<std::size_t>(i)] = std::move(tiles[1]);
        ++done;
        if (reports && progress) progress(static_cast<double>(done) / count);
      }
    } catch (...) {
      const std::lock_guard lock(failureMutex);
      failure = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int i = 1; i < threads; ++i) workers.emplace_back(build, false);
    build(true);
  }
  if (failure) std::rethrow_exception(failure);
  ample_.emplace(grid_, std::move(ample));
  scarce_.emplace(grid_, std::move(scarce));
  islands_ = ample_->findIslands();
  double area = 0;
  for (std::uint32_t i = 0; i < ample_->polygonCount(); ++i)
    areaUpTo_.push_back(area += ample_->polygonArea(i));
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  report_ = {
      ample_->polygonCount(), area,
      islands_.empty() ? 0 : *std::max_element(islands_.begin(), islands_.end()) + std::size_t{1},
      ample_->memoryBytes() + scarce_->memoryBytes(), seconds.count()};
}

NavigationMesh Navigation::buildMesh(Clearance clearance) const {
  std::vector<TileMesh> tiles;
  for (int z = 0; z < grid_.tilesZ; ++z)
    for (int x = 0; x < grid_.tilesX; ++x)
      tiles.push_back(
          std::move(buildTileMeshes(world_.data(), agent_, grid_, x, z, {clearance})[0]));
  return NavigationMesh(grid_, std::move(tiles));
}

std::optional<Vec3> Navigation::standAt(const Vec3& point, double maxDrop) {
  if (walker_.place(point, maxDrop)) return std::nullopt;
  return walker_.footPosition();
}

/// A place close to a corner of a mesh whose polygons are too close to walls, or not exactly at the
/// floor's height.
std::optional<Vec3> Navigation::standNear(const Vec3& point) {
  constexpr std::array<double, 5> kRings{0.05, 0.1, 0.2, 0.3, 0.4};  // metres
  constexpr int kDirections = 8;
  const auto place = [&](const Vec3& aside) {
    const Vec3 above = point + aside + Vec3(0, kSearchLift, 0);
    auto found = standAt(above, 2 * kSearchLift);
    if (found && std::abs(found->y() - point.y()) > kSearchLift) found.reset();
    return found;
  };
  if (const auto found = place(Vec3::Zero())) return found;
  for (const double ring : kRings) {
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2 * std::numbers::pi / kDirections * i;
      if (const auto found = place(ring * Vec3(std::cos(angle), 0, std::sin(angle)))) return found;
    }
  }
  return std::nullopt;
}

/// Goes around what stopped the walker on the way from the last place of `path` to `corner`, and
/// appends places up to where it joins that way again, or up to the corner.
bool Navigation::goAround(const WalkOutcome& stop, const Vec3& corner, NavigationPath& path,
                          Proof& proof) {
  const Vec3 legStart = path.points.back();
  const Vec3 way = projectToGround(corner - legStart);
  const double length = way.norm();
  if (!(length > 0)) return false;
  const Vec3 direction = way / length;
  const double stopped = computeGroundDistance(legStart, stop.footPosition);
  if (stopped > 2 * kStandOff) {  // begin shortly before the obstacle
    walker_.returnTo(legStart);
    const Vec3 before = legStart + (stopped - kStandOff) * direction;
    if (walker_.walkTo(before).kind == WalkOutcome::Kind::arrived)
      path.points.push_back(walker_.footPosition());
  }
  const Vec3 from = path.points.back();
  std::vector<Vec3> targets;
  for (const double beyond : kRejoinDistances) {
    const double along = (stopped + beyond) / length;
    if (along >= 1) break;
    if (const auto place = standNear(legStart + along * (corner - legStart)))
      targets.push_back(*place);
  }
  targets.push_back(corner);
  for (GridSearch* search : {&proof.coarse, &proof.fine}) {
    for (const Vec3& target : targets) {
      auto places = findGridPath(walker_, from, target, *search);
      if (!places) continue;
      path.points.insert(path.points.end(), places->begin() + 1, places->end());
      return true;
    }
  }
  return false;
}

/// Walks from corner to corner, with repairs. Appends the places to `path`, which has the first
/// one.
bool Navigation::proveLegs(std::vector<Vec3> corners, Clearance clearance, NavigationPath& path,
                           Proof& proof) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const bool isLast = i + 1 == corners.size();
    for (int repairs = 0;; ++repairs) {
      const Vec3 from = path.points.back();
      if (!isLast && computeGroundDistance(from, corners[i]) < kArrivalDistance) break;
      walker_.returnTo(from);
      const WalkOutcome outcome = walker_.walkTo(corners[i]);
      const bool isHigh = std::abs(outcome.footPosition.y() - corners[i].y()) > 1;
      if (outcome.kind == WalkOutcome::Kind::arrived && !isHigh) {
        path.points.push_back(outcome.footPosition);
        break;
      }
      proof.failedAt = outcome.footPosition;
      if (repairs == 0 && !isLast && clearance == Clearance::scarce) {
        const auto place = standNear(corners[i]);
        if (!place) break;  // the next corner may be reached without this one
        corners[i] = *place;
      }
      if (repairs < kMaxRepairs && goAround(outcome, corners[i], path, proof)) continue;
      proof.met.push_back({outcome.obstacle, outcome.footPosition, 0});
      return false;
    }
  }
  return true;
}

NavigationPath Navigation::findPathOn(NavigationMesh& mesh, Clearance clearance, const Vec3& from,
                                      const Vec3& to, Proof& proof) {
  const Vec3 extent(3 * agent_.radius, 0.5 + world_.settings().stepHeight, 3 * agent_.radius);
  const auto start = mesh.findNearest(from, extent), goal = mesh.findNearest(to, extent);
  NavigationPath path;
  if (!start || !goal) return path;
  for (int proposal = 0; proposal < kMaxProposals; ++proposal) {
    const auto corridor = mesh.findCorridor(*start, *goal);
    if (!corridor) return path;
    std::vector<Vec3> corners = mesh.straighten(*corridor, start->point, goal->point);
    if (corners.size() > 1) corners.erase(corners.begin(), corners.begin() + 1);
    if (!corners.empty()) corners.pop_back();
    corners.push_back(to);
    path.points = {from};
    if (proveLegs(corners, clearance, path, proof)) {
      path.points = shortenPath(walker_, path.points);
      path.length = computeLength(path.points);
      return path;
    }
    path.points.clear();
    // Close the portal of the corridor that is closest to the failure.
    const auto& polygons = corridor->polygons;
    const auto failed = mesh.findNearest(proof.failedAt, extent);
    if (polygons.size() < 2 || !failed) return path;
    std::size_t at = 0;
    double least = 1e300;
    for (std::size_t i = 0; i + 1 < polygons.size(); ++i) {
      const double distance =
          (mesh.portalMiddle(polygons[i], polygons[i + 1]) - proof.failedAt).squaredNorm();
      if (distance < least) least = distance, at = i;
    }
    if (proof.coarse.maxWalks == 0 || proof.fine.maxWalks == 0) return path;  // proves nothing
    mesh.closePortal(polygons[at], polygons[at + 1]);
  }
  return path;
}

NavigationPath Navigation::findPath(const Vec3& from, const Vec3& to) {
  const std::lock_guard lock(mutex_);
  NavigationPath none;
  if (const auto error = walker_.place(from, kMaxStandDrop)) {
    none.reason = "at the start " + *error;
    return none;
  }
  const Vec3 start = walker_.footPosition();
  if (const auto error = walker_.place(to, kMaxStandDrop)) {
    none.reason = "at the goal " + *error;
    return none;
  }
  const Vec3 goal = walker_.footPosition();
  Proof proof;
  NavigationPath best = findPathOn(*ample_, Clearance::ample, start, goal, proof);
  const Vec3 extent(agent_.radius, 0.5 + world_.settings().stepHeight, agent_.radius);
  const auto first = scarce_->findNearest(start, extent), last = scarce_->findNearest(goal, extent);
  const auto shortcut = first && last ? scarce_->findCorridor(*first, *last) : std::nullopt;
  if (shortcut &&
      (!best.found() ||
       computeLength(scarce_->straighten(*shortcut, first->point, last->point)) * kWorthTrying <
           best.length)) {
    NavigationPath other = findPathOn(*scarce_, Clearance::scarce, start, goal, proof);
    if (other.found() && (!best.found() || other.length < best.length)) best = std::move(other);
  }
  if (!best.found()) {
    if (!proof.met.empty()) best.obstruction = proof.met.front();
    explain(start, goal, best);
  }
  return best;
}

/// Distance that a thin prism at `position` can be moved along `direction`, metres.
double Navigation::measureClearWidth(const Vec3& position, const Vec3& direction) {
  const WorldSettings& settings = world_.settings();
  const double height = agent_.height - settings.stepHeight;
  const auto shape = makePrismShape(kThinRadius, height, height, settings);
  const Vec3 feet = position + Vec3(0, settings.stepHeight, 0);
  const Vec3 side = Vec3(-direction.z(), 0, direction.x()).normalized();
  double width = 2 * kThinRadius;
  for (const Vec3& move : {Vec3(kMaxSideWidth * side), Vec3(-kMaxSideWidth * side)}) {
    const Aabb box = inflated(collision::sweptAabb(placeBox(shape->box, feet), move), 0.1);
    ObstacleSet obstacles = collectObstaclesInBox(world_.data(), box, 0);
    QueryCount count;
    const ShapeCastHit hit =
        castAvatarShape(*shape, feet, move, obstacles, makeContactOffset(settings), count);
    width += hit.fraction * kMaxSideWidth + (hit.entity != 0 ? hit.distance : 0);
  }
  return width;
}

/// The least clear width along a line of places; infinite width: none was measured.
NarrowPlace Navigation::measureNarrowest(const std::vector<Vec3>& points, const Vec3& near,
                                         double maxDistance) {
  NarrowPlace narrowest{Vec3::Zero(), std::numeric_limits<double>::infinity()};
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3 leg = points[i] - points[i - 1];
    const Vec3 direction = projectToGround(leg);
    if (direction.isZero(0)) continue;
    const int count = std::max(1, static_cast<int>(std::ceil(leg.norm() / kWidthSpacing)));
    for (int k = 0; k <= count; ++k) {
      const Vec3 place = points[i - 1] + (static_cast<double>(k) / count) * leg;
      if ((place - near).norm() > maxDistance) continue;
      const double width = measureClearWidth(place, direction);
      // A thin prism that cannot move to either side stands in an obstacle.
      if (width > 2.5 * kThinRadius && width < narrowest.clearWidth) narrowest = {place, width};
    }
  }
  return narrowest;
}

/// Finds what is in the way on the mesh for anything thinner and without bodies.
void Navigation::explain(const Vec3& from, const Vec3& to, NavigationPath& path) {
  if (!unobstructed_) unobstructed_.emplace(buildMesh(Clearance::none));
  const Vec3 extent(2 * agent_.radius, 0.5 + world_.settings().stepHeight, 2 * agent_.radius);
  const auto first = unobstructed_->findNearest(from, extent);
  const auto last = unobstructed_->findNearest(to, extent);
  const auto corridor = first && last ? unobstructed_->findCorridor(*first, *last) : std::nullopt;
  if (!corridor) {
    path.reason = "no floor, step or stair leads there";
    return;
  }
  std::vector<Vec3> corners = unobstructed_->straighten(*corridor, first->point, last->point);
  corners.push_back(to);
  Vec3 at = from;
  for (const Vec3& corner : corners) {
    const auto place = standNear(corner);
    if (!place) continue;
    GridSearch search{kCoarseSpacing, 1, 20'000};
    walker_.returnTo(at);
    const WalkOutcome outcome = walker_.walkTo(*place);
    if (outcome.kind == WalkOutcome::Kind::arrived || findGridPath(walker_, at, *place, search)) {
      at = *place;
      continue;
    }
    path.obstruction = Obstruction{outcome.obstacle, outcome.footPosition, 0};
    std::vector<Vec3> middles{first->point};
    for (std::size_t i = 1; i < corridor->polygons.size(); ++i)
      middles.push_back(
          unobstructed_->portalMiddle(corridor->polygons[i - 1], corridor->polygons[i]));
    middles.push_back(last->point);
    const double width =
        measureNarrowest(middles, outcome.footPosition, kMaxWidthDistance).clearWidth;
    if (width < 2 * agent_.radius + 0.05) path.obstruction->clearWidth = width;
    break;
  }
  if (!path.obstruction) {
    path.reason = "no way was found within the limits of the search";
    return;
  }
  const std::string name = findEntityName(path.obstruction->entity);
  path.reason = (name.empty() ? std::string("the floor ends") : name + " is in the way");
  if (path.obstruction->clearWidth > 0) {
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), ": clear width %.3f m, needs %.3f",
                  path.obstruction->clearWidth, 2 * agent_.radius);
    path.reason += text.data();
  }
}

std::optional<NarrowPlace> Navigation::findNarrowest(const std::vector<Vec3>& points) {
  const std::lock_guard lock(mutex_);
  const NarrowPlace narrowest =
      measureNarrowest(points, Vec3::Zero(), std::numeric_limits<double>::infinity());
  return narrowest.clearWidth < kMaxSideWidth ? std::optional(narrowest) : std::nullopt;
}

std::optional<Vec3> Navigation::findPlaceIn(const Aabb& box) {
  const std::lock_guard lock(mutex_);
  const Vec3 centre(box.centre().x(), box.min.y(), box.centre().z());
  const auto isInside = [&](const Vec3& place) {
    return collision::contains(inflated(box, kSearchLift), {place, place});
  };
  if (const auto place = standAt(centre + Vec3(0, kSearchLift, 0), 2 * kSearchLift);
      place && isInside(*place))
    return place;
  std::vector<std::pair<double, Vec3>> candidates;
  for (const std::uint32_t polygon : ample_->findPolygons(box.centre(), 0.5 * box.size())) {
    for (const Vec3& point : {ample_->centre(polygon), ample_->closestPoint(polygon, centre)})
      candidates.emplace_back(computeGroundDistance(point, centre), point);
  }
  std::ranges::sort(candidates, {}, &std::pair<double, Vec3>::first);
  for (const auto& [distance, point] : candidates)
    if (const auto place = standNear(point); place && isInside(*place)) return place;
  return std::nullopt;
}

std::optional<Vec3> Navigation::snap(const Vec3& point, double maxDistance) {
  const std::lock_guard lock(mutex_);
  if (const auto place = standAt(point, kMaxStandDrop))
    if ((*place - point).norm() <= maxDistance) return place;
  const auto nearest = ample_->findNearest(point, Vec3::Constant(maxDistance));
  if (!nearest) return std::nullopt;
  const auto place = standNear(nearest->point);
  return place && (*place - point).norm() <= maxDistance ? place : std::nullopt;
}

std::optional<std::uint32_t> Navigation::islandOf(const Vec3& point) {
  const std::lock_guard lock(mutex_);
  const auto nearest = ample_->findNearest(
      point, Vec3(2 * agent_.radius, 0.5 + world_.settings().stepHeight, 2 * agent_.radius));
  if (!nearest) return std::nullopt;
  return islands_[nearest->polygon];
}

std::optional<Vec3> Navigation::findRandomPlace(std::mt19937_64& random,
                                                const RandomPlace& wanted) {
  const std::lock_guard lock(mutex_);
  std::vector<std::uint32_t> polygons;
  std::vector<double> areas;
  if (wanted.near || wanted.island) {
    double area = 0;
    std::vector<std::uint32_t> all(ample_->polygonCount());
    for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    if (wanted.near) all = ample_->findPolygons(*wanted.near, Vec3::Constant(wanted.maxDistance));
    for (const std::uint32_t polygon : all) {
      if (wanted.island && islands_[polygon] != *wanted.island) continue;
      polygons.push_back(polygon);
      areas.push_back(area += ample_->polygonArea(polygon));
    }
  }
  const bool isPart = wanted.near || wanted.island;
  const std::vector<double>& upTo = isPart ? areas : areaUpTo_;
  if (upTo.empty()) return std::nullopt;
  // 53 bits: the same numbers on every platform, unlike std::uniform_real_distribution.
  const auto draw = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (int i = 0; i < kMaxRandomTries; ++i) {
    const auto at = static_cast<std::size_t>(
        std::upper_bound(upTo.begin(), upTo.end(), draw() * upTo.back()) - upTo.begin());
    const auto index = std::min(at, upTo.size() - 1);
    const std::uint32_t polygon = isPart ? polygons[index] : static_cast<std::uint32_t>(index);
    const double s = draw(), t = draw();
    const Vec3 point = ample_->pointInPolygon(polygon, s, t) + Vec3(0, kSearchLift, 0);
    const auto place = standAt(point, 2 * kSearchLift + kMaxStandDrop);
    if (!place) continue;
    if (wanted.near && (*place - *wanted.near).norm() > wanted.maxDistance) continue;
    if (wanted.awayFrom && (*place - *wanted.awayFrom).norm() < wanted.minDistance) continue;
    return place;
  }
  return std::nullopt;
}

}  // namespace enfilade::scene
