#include "scene/navigation/link_routes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <utility>
#include <vector>

#include "scene/navigation/mesh_paths.hpp"
#include "scene/navigation/path_search.hpp"
#include "scene/navigation/walk/stand.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMaxRoutes = 12;  // sequences of links to try

/// A link by the polygon of its first point, and its number there.
using LinkKey = std::pair<std::uint32_t, std::size_t>;

struct RouteStep {
  LinkKey key;
  PathLink link;
};

struct Node {
  double seconds = std::numeric_limits<double>::infinity();
  Vec3 point = Vec3::Zero();
  std::uint32_t parent = 0;
  std::optional<std::size_t> link;  ///< number of the link from `parent`
  bool done = false;
};

/// Seconds until a lift has come to a stop from a joint position.
double computeLiftWait(const BodySpec& lift, double position, std::uint32_t stop) {
  return computeMotionSeconds(lift, lift.stops[stop] - position);
}

/// The sequence of links of the quickest route that uses no excluded one; nullopt: no route. Empty:
/// a walk.
std::optional<std::vector<RouteStep>> findRoute(const PathFinder& finder, Links& links,
                                                const Snapshot& bodies, const MeshPoint& from,
                                                const MeshPoint& to,
                                                const std::vector<LinkKey>& excluded) {
  const NavigationMesh& mesh = finder.ample;
  const double speed = finder.agent.speed;
  std::map<std::uint32_t, Node> nodes;
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  nodes[from.polygon] = {0, from.point, from.polygon, {}, false};
  open.push({0, from.polygon});
  const auto reach = [&](std::uint32_t polygon, double seconds, const Vec3& point,
                         std::uint32_t parent, std::optional<std::size_t> link) {
    Node& next = nodes[polygon];
    if (next.done || !(seconds < next.seconds)) return;
    next = {seconds, point, parent, link, false};
    open.push({seconds, polygon});
  };
  while (!open.empty()) {
    const std::uint32_t polygon = open.top().second;
    open.pop();
    if (std::exchange(nodes[polygon].done, true)) continue;
    if (polygon == to.polygon) break;
    const Node here = nodes[polygon];
    for (const Portal& portal : mesh.portals(polygon))
      if (!portal.closed)
        reach(portal.to, here.seconds + (portal.middle() - here.point).norm() / speed,
              portal.middle(), polygon, {});
    if (finder.connections)
      for (const OffMeshConnection& connection : finder.connections->findConnectionsFrom(polygon))
        reach(connection.toPolygon,
              here.seconds +
                  ((connection.points.front() - here.point).norm() + connection.length) / speed,
              connection.points.back(), polygon, {});
    const std::vector<PathLink>& found = links.from(polygon, finder.walker);
    for (std::size_t i = 0; i < found.size(); ++i) {
      const PathLink& link = found[i];
      if (std::ranges::find(excluded, LinkKey{polygon, i}) != excluded.end()) continue;
      double seconds =
          here.seconds + (link.points.front() - here.point).norm() / speed + link.seconds;
      if (link.kind == PathLink::Kind::lift)
        seconds += computeLiftWait(finder.world.scene->model().bodies[link.body],
                                   (*bodies.bodies)[link.body].jointPosition, link.fromStop);
      reach(link.to, seconds, link.points.back(), polygon, i);
    }
  }
  if (!nodes[to.polygon].done) return std::nullopt;
  std::vector<RouteStep> route;
  for (std::uint32_t at = to.polygon; at != from.polygon || nodes[at].link; at = nodes[at].parent)
    if (const auto link = nodes[at].link) {
      const std::uint32_t parent = nodes[at].parent;
      route.push_back({{parent, *link}, links.from(parent, finder.walker)[*link]});
    }
  std::reverse(route.begin(), route.end());
  return route;
}

/// Whether an agent that walks along the points enters the box of a lift as it stands now.
bool entersBox(const std::vector<Vec3>& points, const Aabb& box, const NavigationAgent& agent) {
  constexpr double kSpacing = 0.1;  // metres
  const Aabb near = inflate(box, agent.radius);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3 leg = points[i] - points[i - 1];
    const int count = std::max(1, static_cast<int>(std::ceil(leg.norm() / kSpacing)));
    for (int k = 0; k <= count; ++k) {
      const Vec3 at = points[i - 1] + (static_cast<double>(k) / count) * leg;
      if (contains(near, {at, at})) return true;
    }
  }
  return false;
}

/// Puts together the points and legs of a path.
class PathBuilder {
 public:
  PathBuilder(const PathFinder& finder, const Snapshot& bodies, const Vec3& start)
      : finder_(finder), bodies_(bodies), start_(start) {
    path_.points = {start};
  }
  const Vec3& end() const { return path_.points.back(); }

  /// Appends a proved walk to a place; false: none was found, or it leads over a lift that the path
  /// has moved away.
  bool walk(const Vec3& to) {
    if ((to - end()).norm() < 1e-3) return true;
    const NavigationPath walk = findPath(finder_, end(), to);
    if (!walk.found()) return false;
    for (const auto& [body, stop] : lifts_)
      if (entersBox(walk.points, finder_.world.bodies[body].boxes.whole, finder_.agent))
        return false;
    appendLeg(PathLeg::Kind::walk, walk.length, walk.length / finder_.agent.speed, kNoBody);
    path_.points.insert(path_.points.end(), walk.points.begin() + 1, walk.points.end());
    return true;
  }

  void use(const PathLink& link) {
    const double speed = finder_.agent.speed;
    if (link.kind == PathLink::Kind::drop) {
      appendLeg(PathLeg::Kind::drop, link.length, link.seconds, kNoBody);
      path_.points.push_back(link.points[1]);
      return;
    }
    const BodySpec& spec = finder_.world.scene->model().bodies[link.body];
    const auto known = lifts_.find(link.body);
    const double position = known == lifts_.end() ? (*bodies_.bodies)[link.body].jointPosition
                                                  : spec.stops[known->second];
    const double in = (link.points[1] - link.points[0]).norm();
    const double out = (link.points[3] - link.points[2]).norm();
    appendLeg(PathLeg::Kind::walk, in, in / speed, kNoBody);
    path_.points.push_back(link.points[1]);
    appendLeg(PathLeg::Kind::lift, 0,
              computeLiftWait(spec, position, link.fromStop) +
                  computeMotionSeconds(spec, spec.stops[link.toStop] - spec.stops[link.fromStop]),
              link.body);
    path_.legs.back().fromLevel = link.fromStop;
    path_.legs.back().toLevel = link.toStop;
    path_.points.push_back(link.points[2]);
    appendLeg(PathLeg::Kind::walk, out, out / speed, kNoBody);
    path_.points.push_back(link.points[3]);
    lifts_[link.body] = link.toStop;
  }

  NavigationPath take() { return std::move(path_); }

 private:
  void appendLeg(PathLeg::Kind kind, double length, double seconds, std::uint32_t body) {
    path_.length += length;
    path_.seconds += seconds;
    if (kind == PathLeg::Kind::walk && !path_.legs.empty() && path_.legs.back().kind == kind) {
      path_.legs.back().length += length;
      path_.legs.back().seconds += seconds;
      return;
    }
    path_.legs.push_back({kind, path_.points.size() - 1, length, seconds, body});
  }

  const PathFinder& finder_;
  const Snapshot& bodies_;
  const Vec3 start_;
  NavigationPath path_;
  std::map<std::uint32_t, std::uint32_t> lifts_;  ///< where the path has left each lift: stop
};

}  // namespace

NavigationPath findLinkedPath(const PathFinder& finder, Links& links, const Snapshot& bodies,
                              const Vec3& from, const Vec3& to, NavigationPath walked) {
  const Vec3 extent = computeMeshReach(finder);
  const auto start = standAt(finder.walker, from), goal = standAt(finder.walker, to);
  if (!start || !goal) return walked;
  const auto first = finder.ample.findNearest(*start, extent),
             last = finder.ample.findNearest(*goal, extent);
  if (!first || !last) return walked;
  std::vector<LinkKey> excluded;
  for (int attempt = 0; attempt < kMaxRoutes; ++attempt) {
    const auto route = findRoute(finder, links, bodies, *first, *last, excluded);
    if (!route || route->empty()) return walked;
    PathBuilder builder(finder, bodies, *start);
    bool isWalked = true;
    for (std::size_t i = 0; i <= route->size() && isWalked; ++i) {
      isWalked = builder.walk(i < route->size() ? (*route)[i].link.points.front() : *goal);
      if (!isWalked) excluded.push_back((*route)[std::min(i, route->size() - 1)].key);
      if (isWalked && i < route->size()) builder.use((*route)[i].link);
    }
    if (!isWalked) continue;
    NavigationPath path = builder.take();
    return walked.found() && walked.seconds <= path.seconds ? walked : path;
  }
  return walked;
}

}  // namespace enfilade::scene
