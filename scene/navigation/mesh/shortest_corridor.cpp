#include "scene/navigation/mesh/shortest_corridor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <queue>
#include <utility>
#include <vector>

namespace enfilade::scene {
namespace {

// Intervals: some megabytes. A search that needs more ends without a corridor, so that of A* stays.
// It bounds the time of a query, and paths may be longer.
constexpr std::size_t kMaxNodes = 50'000;
constexpr std::uint32_t kNoNode = ~0u;
constexpr double kSamePlace = 1e-5;  // metres: vertices are binary32
constexpr double kRounding = 1e-9;   // metres, in sums of lengths

double cross(const Vec3& a, const Vec3& b) {
  return a.x() * b.z() - a.z() * b.x();
}

double length(const Vec3& v) {
  return std::hypot(v.x(), v.z());
}

/// All lines that come from `root` and leave the last polygon through a part of a portal. From the
/// root the part is seen from `low` to `high`, with a positive cross product.
struct Interval {
  Vec3 root = Vec3::Zero(), low = Vec3::Zero(), high = Vec3::Zero();
  bool lowIsCorner = true;  ///< an end of the portal on the boundary: a line may bend there
  bool highIsCorner = true;
  double toRoot = 0;          ///< metres from the start
  std::uint32_t polygon = 0;  ///< beyond the portal
  std::uint32_t parent = kNoNode;
  bool isGoal = false;  ///< the goal was reached through the interval
};

/// The least length from the root through the interval to the goal; exact for a goal in the polygon
/// beyond.
double computeRest(const Interval& interval, Vec3 goal) {
  const Vec3 along = interval.high - interval.low;
  const double side = cross(along, goal - interval.low);
  if (side > 0) {  // on this side of the portal: no line is shorter than one to the mirror image
    const double scale = 2 * side / (along.x() * along.x() + along.z() * along.z());
    goal += scale * Vec3(along.z(), 0, -along.x());
  }
  const Vec3& root = interval.root;
  if (cross(interval.low - root, goal - root) < 0)
    return length(interval.low - root) + length(goal - interval.low);
  if (cross(interval.high - root, goal - root) > 0)
    return length(interval.high - root) + length(goal - interval.high);
  return length(goal - root);
}

class CorridorSearch {
 public:
  CorridorSearch(const NavigationMesh& mesh, const MeshPoint& from, const MeshPoint& to,
                 double bound, ClosedPortals closed)
      : mesh_(mesh), from_(from), to_(to), bound_(bound), closed_(closed) {}

  std::optional<Corridor> run() {
    shortestToRoot_[key(from_.point)] = 0;
    for (const Portal& portal : mesh_.portals(from_.polygon)) {
      if (isOpen(portal))
        push({.root = from_.point,
              .low = portal.low,
              .high = portal.high,
              .lowIsCorner = portal.lowIsOnBoundary,
              .highIsCorner = portal.highIsOnBoundary,
              .polygon = portal.to});
    }
    while (!open_.empty() && nodes_.size() < kMaxNodes) {
      const auto [estimate, index] = open_.top();
      open_.pop();
      const Interval interval = nodes_[index];
      if (interval.isGoal) return makeCorridor(index, estimate);
      if (isDetour(interval)) continue;
      if (interval.polygon == to_.polygon) {
        nodes_.push_back(interval);
        nodes_.back().isGoal = true;
        open_.push({estimate, static_cast<std::uint32_t>(nodes_.size() - 1)});
      } else {
        expand(interval, index);
      }
    }
    return std::nullopt;
  }

 private:
  using Key = std::array<double, 3>;
  using Entry = std::pair<double, std::uint32_t>;  // least length of a whole line, node

  static Key key(const Vec3& point) { return {point.x(), point.y(), point.z()}; }

  bool isOpen(const Portal& portal) const {
    return !portal.closed || closed_ == ClosedPortals::open;
  }

  bool isDetour(const Interval& interval) const {
    const auto found = shortestToRoot_.find(key(interval.root));
    return found != shortestToRoot_.end() && interval.toRoot > found->second + kRounding;
  }

  void push(const Interval& interval) {
    const double estimate = interval.toRoot + computeRest(interval, to_.point);
    if (!(estimate < bound_) || isDetour(interval)) return;
    const Vec3 &root = interval.root, &low = interval.low, &high = interval.high;
    // Intervals around a corner come back to where they began.
    const auto [known, isNew] =
        shortestTo_.try_emplace({root.x(), root.y(), root.z(), low.x(), low.z(), high.x(), high.z(),
                                 static_cast<double>(interval.polygon)},
                                interval.toRoot);
    if (!isNew && known->second <= interval.toRoot) return;
    known->second = interval.toRoot;
    double& shortest = shortestToRoot_.try_emplace(key(root), interval.toRoot).first->second;
    shortest = std::min(shortest, interval.toRoot);
    open_.push({estimate, static_cast<std::uint32_t>(nodes_.size())});
    nodes_.push_back(interval);
  }

  /// Splits each portal of the polygon into two kinds of parts. One is seen from the root, the
  /// other reached by a line that bends at an end of the interval.
  void expand(const Interval& interval, std::uint32_t index) {
    const Vec3 root = interval.root;
    const Vec3 toLow = interval.low - root, toHigh = interval.high - root;
    const std::uint32_t before =
        interval.parent == kNoNode ? from_.polygon : nodes_[interval.parent].polygon;
    for (const Portal& portal : mesh_.portals(interval.polygon)) {
      if (!isOpen(portal) || portal.to == before) continue;
      // The portal runs from its low to its high end as seen from inside of the polygon. The part
      // beyond the ray through the interval's low end comes first, that beyond its high end last.
      const double first = crossing(toLow, portal.low - root, portal.high - root);
      const double last = 1 - crossing(-toHigh, portal.high - root, portal.low - root);
      const auto at = [&](double t) -> Vec3 {
        if (t <= 0) return portal.low;
        if (t >= 1) return portal.high;
        return portal.low + t * (portal.high - portal.low);
      };
      Interval next{.toRoot = interval.toRoot, .polygon = portal.to, .parent = index};
      if (first < last) {
        next.root = root;
        next.low = at(first), next.high = at(last);
        next.lowIsCorner = first <= 0 && portal.lowIsOnBoundary;
        next.highIsCorner = last >= 1 && portal.highIsOnBoundary;
        push(next);
      }
      if (first > 0 && interval.lowIsCorner) {
        next.root = interval.low;
        next.toRoot = interval.toRoot + length(toLow);
        next.low = portal.low, next.high = at(first);
        next.lowIsCorner = portal.lowIsOnBoundary;
        next.highIsCorner = first >= 1 && portal.highIsOnBoundary;
        push(next);
      }
      if (last < 1 && interval.highIsCorner) {
        next.root = interval.high;
        next.toRoot = interval.toRoot + length(toHigh);
        next.low = at(last), next.high = portal.high;
        next.lowIsCorner = last <= 0 && portal.lowIsOnBoundary;
        next.highIsCorner = portal.highIsOnBoundary;
        push(next);
      }
    }
  }

  /// The share of the segment a-b, from a, that lies to the negative side of a ray.
  static double crossing(const Vec3& ray, const Vec3& a, const Vec3& b) {
    const double across = length(ray);
    if (across < kSamePlace) return 0;  // the root is the end of the interval
    const double atA = cross(ray, a) / across, atB = cross(ray, b) / across;
    if (std::max(atA, atB) <= kSamePlace && std::min(atA, atB) < -kSamePlace) return 1;
    if (atA >= -kSamePlace) return 0;
    return atA / (atA - atB);
  }

  Corridor makeCorridor(std::uint32_t index, double cost) const {
    Corridor corridor;
    corridor.cost = cost;
    for (; index != kNoNode; index = nodes_[index].parent)
      corridor.polygons.push_back(nodes_[index].polygon);
    corridor.polygons.push_back(from_.polygon);
    std::reverse(corridor.polygons.begin(), corridor.polygons.end());
    return corridor;
  }

  const NavigationMesh& mesh_;
  const MeshPoint from_, to_;
  const double bound_;
  const ClosedPortals closed_;
  std::vector<Interval> nodes_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
  std::map<Key, double> shortestToRoot_;
  std::map<std::array<double, 8>, double> shortestTo_;  ///< by interval
};

}  // namespace

std::optional<Corridor> findShortestCorridor(const NavigationMesh& mesh, const MeshPoint& from,
                                             const MeshPoint& to, double bound,
                                             ClosedPortals closed) {
  if (from.polygon == to.polygon) return std::nullopt;  // a corridor of one polygon is the shortest
  return CorridorSearch(mesh, from, to, bound, closed).run();
}

}  // namespace enfilade::scene
