#include "tests/benchmarks/flood_fill.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "scene/navigation/walk/stand.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::benchmarks {

using scene::Vec3;

namespace {

constexpr std::array<std::pair<int, int>, 8> kNeighbours{
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};
constexpr std::size_t kStraightNeighbours = 4;  // the first ones
constexpr double kEvenFloor = 1e-3;             // metres between the heights of two places
constexpr double kSameHeight = 0.01;            // metres between feet at one place
constexpr double kSamePlace = 1e-4;             // metres
constexpr double kSameFloor = 0.06;             // metres between feet 3 cm apart on a slope
constexpr double kLift = FloodFill::kLift;

}  // namespace

FloodFill::FloodFill(const scene::WorldData& world, const scene::NavigationAgent& agent,
                     const std::vector<Vec3>& starts, std::size_t maxPlaces,
                     const std::optional<Vec3>& goal, double shift)
    : stepHeight_(world.settings.stepHeight), walks_(goal.has_value()), step_(stepHeight_ + 2e-3) {
  const scene::Aabb bounds = world.scene->bounds();
  corner_ = bounds.min - Vec3(1 - shift, 0, 1 - shift);
  const Vec3 size = bounds.size() + Vec3(2, 0, 2);
  width_ = static_cast<std::int32_t>(std::ceil(size.x() / kSpacing));
  depth_ = static_cast<std::int32_t>(std::ceil(size.z() / kSpacing));
  first_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(depth_), -1);
  std::vector<scene::Walker> walkers;
  for (int i = 0; i < threads_.threadCount(); ++i) walkers.emplace_back(world, agent);
  std::int32_t component = 0;
  for (const Vec3& start : starts) {
    if (places_.size() >= maxPlaces) return;
    const std::int32_t column = computeColumn(start.x(), start.z());
    if (column < 0 || findNearest(start) >= 0) continue;
    const Vec3 centre = computePosition(add(column, start.y(), component));
    const auto standing = stepTo(walkers[0], centre, centre.x(), centre.z());
    if (!standing) {
      first_[static_cast<std::size_t>(column)] = places_.back().next;
      places_.pop_back();
      continue;
    }
    places_.back().height = static_cast<float>(standing->y());
    fill(walkers, static_cast<std::int32_t>(places_.size()) - 1, maxPlaces, goal);
    if (places_.size() >= maxPlaces) unfinished_ = component;
    ++component;
  }
}

std::int32_t FloodFill::computeColumn(double x, double z) const {
  const double column = std::floor((x - corner_.x()) / kSpacing);
  const double row = std::floor((z - corner_.z()) / kSpacing);
  if (!(column >= 1 && row >= 1 && column < width_ - 1 && row < depth_ - 1)) return -1;
  return static_cast<std::int32_t>(row) * width_ + static_cast<std::int32_t>(column);
}

Vec3 FloodFill::computePosition(std::int32_t place) const {
  const Place& at = places_[static_cast<std::size_t>(place)];
  return {corner_.x() + (at.column % width_ + 0.5) * kSpacing, at.height,
          corner_.z() + (at.column / width_ + 0.5) * kSpacing};
}

/// The place of a column that is closest to `height`, and at most `reach` metres from it; -1: none.
std::int32_t FloodFill::findPlace(std::int32_t column, double height, double reach) const {
  std::int32_t best = -1;
  double minDifference = reach;
  for (std::int32_t at = first_[static_cast<std::size_t>(column)]; at >= 0;
       at = places_[static_cast<std::size_t>(at)].next) {
    const double difference = std::abs(places_[static_cast<std::size_t>(at)].height - height);
    if (difference > minDifference) continue;
    minDifference = difference;
    best = at;
  }
  return best;
}

std::int32_t FloodFill::findNearest(const Vec3& point) const {
  const std::int32_t column = computeColumn(point.x(), point.z());
  if (column < 0) return -1;
  if (const std::int32_t here = findPlace(column, point.y(), kSameFloor); here >= 0) return here;
  std::int32_t best = -1;
  double minDistance = 0.03;
  for (const auto& [dx, dz] : kNeighbours) {
    const std::int32_t place = findPlace(column + dx + dz * width_, point.y(), kSameFloor);
    if (place < 0) continue;
    const Vec3 away = computePosition(place) - point;
    const double distance = std::hypot(away.x(), away.z());
    if (distance >= minDistance) continue;
    minDistance = distance;
    best = place;
  }
  return best;
}

std::int32_t FloodFill::add(std::int32_t column, double height, std::int32_t component) {
  std::int32_t& first = first_[static_cast<std::size_t>(column)];
  places_.push_back({column, static_cast<float>(height), component, first});
  first = static_cast<std::int32_t>(places_.size()) - 1;
  return first;
}

/// Where an avatar stands at (x, z) that comes from `from` over at most a step. It is put down a
/// little above the floor, so that a low ceiling does not stop it, and higher where that fails. Up
/// or down a step it must also walk there.
std::optional<Vec3> FloodFill::stepTo(scene::Walker& walker, const Vec3& from, double x,
                                      double z) const {
  for (const double lift : {kLift, 0.03, 0.1, 0.5 * stepHeight_, stepHeight_}) {
    const auto standing = scene::standAt(walker, {x, from.y() + lift, z}, lift + stepHeight_);
    if (!standing) continue;
    const double climb = std::abs(standing->y() - from.y());
    if (climb > stepHeight_ + 1e-3) continue;
    // An obstacle may push it aside on its fall.
    if (std::hypot(standing->x() - x, standing->z() - z) > kSamePlace) continue;
    // It must be a place of its own, not only the end of a fall next to an obstacle.
    if (!scene::standAt(walker, *standing + Vec3(0, kLift, 0), stepHeight_)) continue;
    if (climb < kEvenFloor && !walks_) return standing;
    walker.returnTo(from);
    const bool isWalked = walker.walkTo(*standing).kind == scene::WalkOutcome::Kind::arrived &&
                          std::abs(walker.footPosition().y() - standing->y()) < kSameHeight;
    return isWalked ? standing : std::nullopt;
  }
  return std::nullopt;
}

/// Where an avatar stands that steps from each of `front` to its neighbour in `direction`, unless
/// that is known; in the order of `front`.
std::vector<Vec3> FloodFill::stepToAll(std::vector<scene::Walker>& walkers,
                                       const std::vector<std::int32_t>& front,
                                       const std::pair<int, int>& direction) {
  std::vector<std::optional<Vec3>> standings(front.size());
  const auto [dx, dz] = direction;
  const auto step = [&](scene::Walker& walker, std::size_t i) {
    const Vec3 from = computePosition(front[i]);
    const double x = from.x() + dx * kSpacing, z = from.z() + dz * kSpacing;
    const std::int32_t column = computeColumn(x, z);
    if (column >= 0 && findPlace(column, from.y(), step_) < 0)
      standings[i] = stepTo(walker, from, x, z);
  };
  const std::size_t shares = walkers.size();  // of the front, one for each walker
  threads_.parallelFor(shares, 1, [&](std::size_t from, std::size_t to) {
    for (std::size_t share = from; share < to; ++share)
      for (std::size_t i = front.size() * share / shares; i < front.size() * (share + 1) / shares;
           ++i)
        step(walkers[share], i);
  });
  std::vector<Vec3> found;
  for (const std::optional<Vec3>& standing : standings)
    if (standing) found.push_back(*standing);
  return found;
}

void FloodFill::fill(std::vector<scene::Walker>& walkers, std::int32_t start, std::size_t maxPlaces,
                     const std::optional<Vec3>& goal) {
  const std::int32_t component = places_[static_cast<std::size_t>(start)].component;
  std::vector<std::int32_t> front{start};
  while (!front.empty()) {
    std::vector<std::int32_t> next;
    for (std::size_t k = 0; k < kStraightNeighbours; ++k)
      for (const Vec3& standing : stepToAll(walkers, front, kNeighbours[k])) {
        if (places_.size() >= maxPlaces) return;
        const std::int32_t column = computeColumn(standing.x(), standing.z());
        if (findPlace(column, standing.y(), step_) >= 0) continue;  // from another place of `front`
        next.push_back(add(column, standing.y(), component));
        if (goal && (standing - *goal).squaredNorm() < kSpacing * kSpacing &&
            findComponent(*goal).has_value())
          return;
      }
    front = std::move(next);
  }
}

std::optional<FloodFill::Component> FloodFill::findComponent(const Vec3& place) const {
  const std::int32_t at = findNearest(place);
  if (at < 0) return std::nullopt;
  const std::int32_t number = places_[static_cast<std::size_t>(at)].component;
  return Component{number, number != unfinished_};
}

/// A* over the filled places; with both ends, or empty.
std::vector<std::int32_t> FloodFill::findWay(std::int32_t from, std::int32_t to) const {
  const auto index = [](std::int32_t place) { return static_cast<std::size_t>(place); };
  const Vec3 goal = computePosition(to);
  std::vector<double> lengths(places_.size(), std::numeric_limits<double>::infinity());
  std::vector<std::int32_t> before(places_.size(), -1);
  lengths[index(from)] = 0;
  using Entry = std::pair<double, std::int32_t>;  // length through the place, place
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  open.emplace((goal - computePosition(from)).norm(), from);
  while (!open.empty() && open.top().second != to) {
    const auto [through, at] = open.top();
    open.pop();
    const Vec3 here = computePosition(at);
    const double length = lengths[index(at)];
    if (through > length + (goal - here).norm() + 1e-9) continue;  // a longer way to it
    for (const auto& [dx, dz] : kNeighbours) {
      const std::int32_t next =
          findPlace(places_[index(at)].column + dx + dz * width_, here.y(), step_);
      if (next < 0) continue;
      const Vec3 there = computePosition(next);
      const double longer = length + (there - here).norm();
      if (lengths[index(next)] <= longer) continue;
      lengths[index(next)] = longer;
      before[index(next)] = at;
      open.emplace(longer + (goal - there).norm(), next);
    }
  }
  std::vector<std::int32_t> way;
  if (open.empty()) return way;
  for (std::int32_t at = to; at >= 0; at = before[index(at)]) way.push_back(at);
  std::reverse(way.begin(), way.end());
  return way;
}

bool FloodFill::isStraight(const Vec3& from, const Vec3& to) const {
  const int count = std::max(1, static_cast<int>(std::ceil((to - from).norm() / (0.5 * kSpacing))));
  double height = from.y();
  for (int i = 0; i <= count; ++i) {
    const Vec3 at = from + (to - from) * (static_cast<double>(i) / count);
    const std::int32_t column = computeColumn(at.x(), at.z());
    const std::int32_t place = column < 0 ? -1 : findPlace(column, height, step_);
    if (place < 0) return false;
    height = places_[static_cast<std::size_t>(place)].height;
  }
  return std::abs(height - to.y()) <= step_;  // not below or above it
}

std::vector<Vec3> FloodFill::findShortest(const Vec3& from, const Vec3& to) const {
  const std::int32_t start = findNearest(from), goal = findNearest(to);
  if (start < 0 || goal < 0) return {};
  const std::vector<std::int32_t> way = findWay(start, goal);
  if (way.empty()) return {};
  std::vector<Vec3> points{from};
  const std::size_t stride = std::max<std::size_t>(1, way.size() / 200);
  for (std::size_t i = stride; i + 1 < way.size(); i += stride)
    points.push_back(computePosition(way[i]));
  points.push_back(to);
  // The shortest chain of points of which neighbours see each other.
  std::vector<double> best(points.size(), std::numeric_limits<double>::infinity());
  std::vector<std::size_t> before(points.size(), 0);
  best[0] = 0;
  for (std::size_t j = 1; j < points.size(); ++j)
    for (std::size_t i = j; i-- > 0;) {
      const double length = best[i] + (points[j] - points[i]).norm();
      if (length >= best[j] || (i + 1 != j && !isStraight(points[i], points[j]))) continue;
      best[j] = length;
      before[j] = i;
    }
  std::vector<Vec3> chain;
  for (std::size_t at = points.size() - 1; at > 0; at = before[at]) chain.push_back(points[at]);
  chain.push_back(from);
  std::reverse(chain.begin(), chain.end());
  return chain;
}

}  // namespace enfilade::benchmarks
