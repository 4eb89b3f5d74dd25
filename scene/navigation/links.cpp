#include "scene/navigation/links.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "collision/sine_cosine.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kDropError = 0.005;   // metres, of landings
constexpr double kEdgeSpacing = 0.75;  // metres between places along an edge
/// Metres of the landing beyond a place at the edge of a mesh, in addition to twice the radius. The
/// mesh ends up to two cells further from the drop than the radius.
constexpr std::array<double, 2> kLandings{0.25, 0.6};
constexpr int kPhases = 3;             // starts of a drop within the length of a tick
constexpr double kSameLanding = 0.01;  // metres, height
constexpr int kExitDirections = 16;    // out of a lift
constexpr std::size_t kMaxExits = 4;   // of a lift at a stop
constexpr std::size_t kMaxStops = 64;  // a lift with more is not used
constexpr double kStandRoom = 1e-3;    // metres above the floor: where a place is put to the test
constexpr double kExitRoom = 0.1;      // metres between a waiting agent and a lift
constexpr double kPlatformStep = 0.2;  // metres between heights at which a platform is looked for
constexpr double kPlatformRoom = 0.5;  // of half its size: how far from its middle

/// The places of an agent at one stop of a lift.
struct Stop {
  Vec3 inside = Vec3::Zero();
  std::vector<Vec3> outside;
};

/// Returns the place where an agent stands on a lift.
std::optional<Vec3> findPlatform(const Body& lift, Walker& walker) {
  const Aabb& box = lift.boxes.whole;
  const Vec3 middle = box.centre(), half = 0.5 * kPlatformRoom * box.size();
  for (double y = box.min.y() + kPlatformStep; y < box.max.y() + kMaxStandDrop; y += kPlatformStep)
    for (const auto& [x, z] :
         std::array<std::pair<int, int>, 5>{{{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}}}) {
      const auto place =
          standAt(walker, {middle.x() + x * half.x(), y, middle.z() + z * half.z()}, kMaxStandDrop);
      if (place && walker.groundEntity() == lift.id) return place;
    }
  return std::nullopt;
}

/// Returns the metres along `direction` from a place until an agent is clear of a box.
double computeExitDistance(const Aabb& box, const Vec3& place, const Vec3& direction, double room) {
  const Aabb grown = inflate(box, room);
  double distance = box.size().norm() + 2 * room;
  for (const int axis : {0, 2}) {
    if (std::abs(direction[axis]) < 1e-9) continue;
    const double side = direction[axis] > 0 ? grown.max[axis] : grown.min[axis];
    distance = std::min(distance, (side - place[axis]) / direction[axis]);
  }
  return distance;
}

/// Whether an agent that stands at a place stands on this body. After a walk over even floor the
/// walker does not know.
bool isStandingOn(const Body& body, const Vec3& place, Walker& walker) {
  return standAt(walker, place + Vec3(0, kStandRoom, 0)) && walker.groundEntity() == body.id;
}

/// Places before a lift from which the agent walks in, and to which it walks out.
std::vector<Vec3> findExits(const Body& lift, const Vec3& inside, Walker& walker) {
  std::vector<Vec3> exits;
  const double room = walker.agent().radius + kExitRoom;
  for (int i = 0; i < kExitDirections && exits.size() < kMaxExits; ++i) {
    const int turn = (i * 4) % kExitDirections + i / 4;  // the four sides first
    const auto [sine, cosine] =
        collision::computeSineCosineOfDegrees(360.0 / kExitDirections * turn);
    const Vec3 direction(cosine, 0, sine);
    walker.returnTo(inside);
    const WalkOutcome out = walker.walkTo(
        inside + computeExitDistance(lift.boxes.whole, inside, direction, room) * direction);
    if (out.kind != WalkOutcome::Kind::arrived || isStandingOn(lift, out.footPosition, walker))
      continue;
    walker.returnTo(out.footPosition);
    const WalkOutcome back = walker.walkTo(inside);
    if (back.kind == WalkOutcome::Kind::arrived && isStandingOn(lift, back.footPosition, walker))
      exits.push_back(out.footPosition);
  }
  return exits;
}

void placeAtStop(Body& lift, double stop) {
  placeBody(lift, computeBodyPose(*lift.spec, computeJointPose(*lift.spec, stop)));
}

std::vector<Stop> findStops(WorldData& world, Body& lift, const NavigationAgent& agent) {
  std::vector<Stop> stops(lift.spec->stops.size());
  std::optional<std::pair<std::size_t, Vec3>> first;  // the stop where the platform was found
  for (std::size_t i = 0; i < stops.size(); ++i) {
    placeAtStop(lift, lift.spec->stops[i]);
    Walker walker(world, agent);  // one that has met the lift nowhere else
    std::optional<Vec3> inside;
    if (first) {
      const double travel = lift.spec->stops[i] - lift.spec->stops[first->first];
      inside = standAt(walker, first->second + travel * lift.spec->axis + Vec3(0, kStandRoom, 0));
      if (inside && walker.groundEntity() != lift.id) inside.reset();
    } else if ((inside = findPlatform(lift, walker))) {
      first = {i, *inside};
    }
    if (inside) stops[i] = {*inside, findExits(lift, *inside, walker)};
  }
  return stops;
}

}  // namespace

Links::Links(WorldData& world, const NavigationAgent& agent, const NavigationMesh& mesh,
             const PathOptions& options)
    : settings_(world.settings), agent_(agent), mesh_(mesh), options_(options) {
  if (options_.maxDrop > settings_.stepHeight) collectEdges();
  if (options_.lifts) collectLifts(world);
  const std::size_t drop = sizeof(PathLink) + 2 * sizeof(Vec3);
  const std::size_t ride = sizeof(PathLink) + 4 * sizeof(Vec3);
  for (const auto& [polygon, edges] : edges_) bytes_ += edges.size() * (sizeof(Edge) + drop);
  for (const auto& [polygon, links] : links_) bytes_ += links.size() * ride;
}

std::optional<std::uint32_t> Links::findPolygon(const Vec3& place) const {
  const auto found = mesh_.findNearest(
      place, Vec3(3 * agent_.radius, 0.5 + settings_.stepHeight, 3 * agent_.radius));
  return found ? std::optional(found->polygon) : std::nullopt;
}

void Links::collectEdges() {
  const double beyond = 2 * agent_.radius + kLandings.front();
  const double low = settings_.stepHeight, high = options_.maxDrop + kHeightError;
  const Vec3 extent(agent_.radius, 0.5 * (high - low), agent_.radius);
  for (const BoundaryEdge& edge : mesh_.collectBoundary()) {
    const Vec3 along = edge.to - edge.from;
    const int count =
        std::max(1, static_cast<int>(std::hypot(along.x(), along.z()) / kEdgeSpacing));
    for (int i = 0; i < count; ++i) {
      const Vec3 place = edge.from + ((i + 0.5) / count) * along;
      const Vec3 below = place + beyond * edge.outward - Vec3(0, 0.5 * (low + high), 0);
      if (!mesh_.findPolygons(below, extent).empty())
        edges_[edge.polygon].push_back({place, edge.outward});
    }
  }
}

std::optional<PathLink> Links::proveDrop(const Edge& edge, Walker& walker) const {
  const auto place = standNear(walker, edge.place);
  if (!place) return std::nullopt;
  const double stride = agent_.speed * settings_.tickDuration;
  for (const double room : kLandings) {
    const Vec3 goal = *place + (2 * agent_.radius + room) * edge.outward;
    PathLink link{.points = {*place}};
    for (int phase = 0; phase < kPhases; ++phase) {
      walker.returnTo(*place);
      if (phase > 0) walker.walkTo(*place + (stride * phase / kPhases) * edge.outward);
      const double height = walker.footPosition().y();
      const WalkOutcome outcome = walker.dropTo(goal, options_.maxDrop);
      const double fall = height - outcome.footPosition.y();  // the walker may land far lower
      if (outcome.kind != WalkOutcome::Kind::arrived || fall <= settings_.stepHeight ||
          fall > options_.maxDrop + kDropError ||
          (phase > 0 &&
           std::abs(outcome.footPosition.y() - link.points.back().y()) > kSameLanding)) {
        link.points.resize(1);
        break;
      }
      if (phase > 0) continue;
      link.points.push_back(outcome.footPosition);
      link.seconds = outcome.ticks * settings_.tickDuration;
    }
    if (link.points.size() < 2) continue;
    const auto polygon = findPolygon(link.points.back());
    if (!polygon) continue;
    link.to = *polygon;
    link.length = computeGroundDistance(*place, link.points.back());
    return link;
  }
  return std::nullopt;
}

void Links::collectLifts(WorldData& world) {
  for (Body& lift : world.bodies) {
    const std::vector<double>& positions = lift.spec->stops;
    if (!getTraits(lift.spec->kind).takesStops || positions.size() > kMaxStops) continue;
    const auto body = static_cast<std::uint32_t>(&lift - world.bodies.data());
    const collision::Pose before{lift.orientation, lift.position};
    const std::vector<Stop> stops = findStops(world, lift, agent_);
    placeBody(lift, before);
    Walker rider(world, agent_);
    const auto canRide = [&](const Stop& from, const Stop& to) {
      return !from.outside.empty() && !to.outside.empty() &&
             rider.isRideFree(from.inside, to.inside, lift.id);
    };
    for (std::uint32_t a = 0; a < stops.size(); ++a)
      for (std::uint32_t b = 0; b < stops.size(); ++b) {
        if (a == b || !canRide(stops[a], stops[b])) continue;
        for (const Vec3& from : stops[a].outside)
          for (const Vec3& to : stops[b].outside) {
            const auto start = findPolygon(from), end = findPolygon(to);
            if (!start || !end) continue;
            PathLink link{PathLink::Kind::lift, {from, stops[a].inside, stops[b].inside, to}};
            link.to = *end;
            link.length = computeGroundDistance(from, stops[a].inside) +
                          computeGroundDistance(stops[b].inside, to);
            link.seconds = link.length / agent_.speed +
                           computeMotionSeconds(*lift.spec, positions[b] - positions[a]);
            link.body = body;
            link.fromStop = a;
            link.toStop = b;
            links_[*start].push_back(std::move(link));
          }
      }
  }
}

const std::vector<PathLink>& Links::from(std::uint32_t polygon, Walker& walker) {
  static const std::vector<PathLink> kNone;
  if (const auto edges = edges_.find(polygon); edges != edges_.end()) {
    for (const Edge& edge : edges->second)
      if (auto link = proveDrop(edge, walker)) links_[polygon].push_back(std::move(*link));
    edges_.erase(edges);
  }
  const auto found = links_.find(polygon);
  return found == links_.end() ? kNone : found->second;
}

}  // namespace enfilade::scene
