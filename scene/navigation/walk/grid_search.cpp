#include "scene/navigation/walk/grid_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <utility>

#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kLayerHeight = 1;       // metres: places of a cell closer than this are one place
constexpr double kMaxEvenExcess = 0.05;  // metres: of feet over thresholds and rough floor
constexpr double kMinPull = 0.01;        // metres
constexpr std::size_t kMaxLeftOut = 4;   // places in a row of a tight path; some are within a fall

struct Cell {
  int x = 0, z = 0, storey = 0;
  auto operator<=>(const Cell&) const = default;
};

struct Place {
  Vec3 footPosition = Vec3::Zero();
  double cost = 0;
  Cell parent;
  bool done = false;
};

constexpr std::array<std::pair<int, int>, 8> kDirections{
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};

struct Grid {
  Vec3 origin;
  double spacing = 0;

  Vec3 centre(int x, int z) const { return origin + Vec3(x * spacing, 0, z * spacing); }
  Cell computeCell(const Vec3& footPosition, int x, int z) const {
    return {x, z, static_cast<int>(std::lround((footPosition.y() - origin.y()) / kLayerHeight))};
  }
};

std::vector<Vec3> collectPlaces(const std::map<Cell, Place>& places, Cell last) {
  std::vector<Vec3> path;
  for (Cell at = last;; at = places.at(at).parent) {
    path.push_back(places.at(at).footPosition);
    if (places.at(at).parent == at) break;
  }
  std::reverse(path.begin(), path.end());
  return path;
}

/// The place that a search looks for.
struct Target {
  Aabb window;                                  ///< that the path may not leave
  std::function<double(const Vec3&)> estimate;  ///< metres to the end, at most those of the path
  PlaceTest isReachedAt;                        ///< the path ends there
  PlaceTest isOpen;                             ///< it may lead on from there; null: anywhere
};

std::optional<std::vector<Vec3>> searchGrid(Walker& walker, const Vec3& from, const Target& end,
                                            GridSearch& search) {
  const Grid grid{from, search.spacing};
  std::map<Cell, Place> places;
  using Entry = std::pair<double, Cell>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const Cell start = grid.computeCell(from, 0, 0);
  places[start] = {from, 0, start, false};
  open.push({0, start});
  while (!open.empty()) {
    const Cell cell = open.top().second;
    open.pop();
    Place& here = places[cell];
    if (here.done) continue;
    here.done = true;
    const Vec3 footPosition = here.footPosition;
    const double cost = here.cost;
    if (end.isReachedAt(footPosition)) return collectPlaces(places, cell);
    if (end.isOpen && !end.isOpen(footPosition)) continue;
    for (const auto& [dx, dz] : kDirections) {
      const int x = cell.x + dx, z = cell.z + dz;
      const Vec3 target = grid.centre(x, z);
      if (target.x() < end.window.min.x() || target.x() > end.window.max.x() ||
          target.z() < end.window.min.z() || target.z() > end.window.max.z())
        continue;
      double next = cost + computeGroundDistance(footPosition, target);
      if (next + end.estimate(target) > search.maxLength) continue;
      const auto known = places.find({x, z, cell.storey});
      if (known != places.end() && known->second.cost <= next) continue;
      if (search.maxWalks == 0) return std::nullopt;
      --search.maxWalks;
      walker.returnTo(footPosition);
      if (walker.walkTo(target).kind != WalkOutcome::Kind::arrived) continue;
      const Vec3 reached = walker.footPosition();
      if (search.countsHeights) next = std::max(next, cost + walker.travel().length());
      if (next + end.estimate(reached) > search.maxLength) continue;
      const Cell to2 = grid.computeCell(reached, x, z);
      const auto [at, isNew] = places.try_emplace(to2, Place{reached, next, cell, false});
      if (!isNew) {
        if (at->second.done || at->second.cost <= next) continue;
        at->second = {reached, next, cell, false};
      }
      open.push({next + end.estimate(reached), to2});
    }
  }
  return std::nullopt;
}

/// FeetTravel::length() along a path. Each leg is walked when it is first asked for.
class LegLengths {
 public:
  LegLengths(Walker& walker, const std::vector<Vec3>& places)
      : walker_(walker), places_(places), lengths_(places.size() - 1, kUnknown) {}

  /// Metres from place `first` to place `last`.
  double measure(std::size_t first, std::size_t last) {
    double sum = 0;
    for (std::size_t leg = first; leg < last; ++leg) {
      if (lengths_[leg] == kUnknown)
        lengths_[leg] = measureLength(walker_, std::span(places_).subspan(leg, 2));
      sum += lengths_[leg];
    }
    return sum;
  }

 private:
  static constexpr double kUnknown = -1;
  Walker& walker_;
  const std::vector<Vec3>& places_;
  std::vector<double> lengths_;
};

/// Whether feet that moved by `length` metres between two places rose or sank.
bool isUneven(double length, const Vec3& from, const Vec3& to) {
  return length > (to - from).norm() + kMaxEvenExcess;
}

}  // namespace

bool walks(Walker& walker, const Vec3& from, const Vec3& to, double heightError) {
  walker.returnTo(from);
  return walker.walkTo(to).kind == WalkOutcome::Kind::arrived &&
         std::abs(walker.footPosition().y() - to.y()) <= heightError;
}

bool isWalkClear(Walker& walker, const Vec3& from, const Vec3& to) {
  walker.returnTo(from);
  return walker.isPathClear(to) && std::abs(walker.footPosition().y() - to.y()) < kSameHeight;
}

double measureLength(Walker& walker, std::span<const Vec3> places) {
  double length = 0;
  for (std::size_t i = 1; i < places.size(); ++i) {
    walker.returnTo(places[i - 1]);
    if (walker.walkTo(places[i]).kind != WalkOutcome::Kind::arrived)
      return std::numeric_limits<double>::infinity();
    length += walker.travel().length();
  }
  return length;
}

std::optional<std::vector<Vec3>> findGridPath(Walker& walker, const Vec3& from, const Vec3& to,
                                              GridSearch& search) {
  Aabb window;
  window.include(from);
  window.include(to);
  const Target end{inflate(window, search.margin),
                   [&](const Vec3& at) { return computeGroundDistance(at, to); },
                   [&](const Vec3& at) {
                     return computeGroundDistance(at, to) < 1.5 * search.spacing &&
                            walks(walker, at, to, kSameHeight);
                   },
                   {}};
  auto path = searchGrid(walker, from, end, search);
  if (path) path->push_back(to);
  return path;
}

std::optional<std::vector<Vec3>> findGridPathOut(Walker& walker, const Vec3& from,
                                                 const PathOut& out, GridSearch& search) {
  const Target end{
      inflate(Aabb{from, from}, search.margin),
      [&](const Vec3& at) { return out.toward ? computeGroundDistance(*out.toward, at) : 0.0; },
      out.isWanted, out.isOpen};
  return searchGrid(walker, from, end, search);
}

namespace {

/// Moves place `i` towards the line between its neighbours as far as this can be walked.
bool pullPlace(Walker& walker, std::vector<Vec3>& places, std::size_t i) {
  const Vec3 &before = places[i - 1], &after = places[i + 1], here = places[i];
  const Vec3 line = projectToGround(after - before);
  const double squaredLength = line.squaredNorm();
  if (!(squaredLength > 0)) return false;
  const double share = std::clamp(line.dot(here - before) / squaredLength, 0.0, 1.0);
  const Vec3 aside = projectToGround(before + share * line - here);
  for (double part = 1; part * aside.norm() > kMinPull; part *= 0.5) {
    walker.returnTo(before);
    if (walker.walkTo(here + part * aside).kind != WalkOutcome::Kind::arrived) continue;
    const Vec3 reached = walker.footPosition();
    const double first = walker.travel().length();
    if (!walks(walker, reached, after, kSameHeight)) continue;
    const double second = walker.travel().length();
    if ((isUneven(first, before, reached) || isUneven(second, reached, after)) &&
        first + second > measureLength(walker, std::array{before, here, after}))
      continue;
    places[i] = reached;
    return true;
  }
  return false;
}

/// Replaces place `i`, which cannot be pulled, by two on its legs, as near to their other ends as
/// this can be walked.
bool cutCorner(Walker& walker, std::vector<Vec3>& places, std::size_t i) {
  const Vec3 before = places[i - 1], here = places[i], after = places[i + 1];
  const double first = (before - here).norm(), second = (after - here).norm();
  for (double along = 0.5 * std::min(first, second); along > kMinPull; along *= 0.5) {
    const Vec3 from = here + along / first * (before - here);
    const Vec3 to = here + along / second * (after - here);
    if (2 * along - (to - from).norm() < kMinPull) return false;
    walker.returnTo(before);
    if (walker.walkTo(from).kind != WalkOutcome::Kind::arrived) continue;
    const Vec3 start = walker.footPosition();
    if (walker.walkTo(to).kind != WalkOutcome::Kind::arrived) continue;
    const Vec3 end = walker.footPosition();
    if (walker.walkTo(after).kind != WalkOutcome::Kind::arrived) continue;
    if (std::abs(walker.footPosition().y() - after.y()) > kSameHeight) continue;
    const double length = walker.travel().length();
    if (length > measureLength(walker, std::array{before, here, after})) continue;
    places[i] = start;
    places.insert(places.begin() + static_cast<std::ptrdiff_t>(i) + 1, end);
    return true;
  }
  return false;
}

}  // namespace

void pullTight(Walker& walker, std::vector<Vec3>& places) {
  // A place moves once a pass. More passes make shorter paths, but each walks all legs again.
  constexpr int kMaxPasses = 4;
  bool isMoved = true;
  for (int pass = 0; pass < kMaxPasses && isMoved; ++pass) {
    isMoved = false;
    for (std::size_t i = 1; i + 1 < places.size(); ++i) {
      if (pullPlace(walker, places, i)) {
        isMoved = true;
      } else if (cutCorner(walker, places, i)) {
        isMoved = true;
        ++i;
      }
    }
  }
}

std::vector<Vec3> shortenPath(Walker& walker, const std::vector<Vec3>& places, Shortcuts kind) {
  LegLengths legs(walker, places);
  const auto isShortcut = [&](std::size_t first, std::size_t last) {
    const Vec3 &from = places[first], &to = places[last];
    if (kind != Shortcuts::free) {
      if (!walks(walker, from, to, kSameHeight)) return false;
      const double length = walker.travel().length();
      const double excess = kind == Shortcuts::tight ? 1 : kGridExcess;
      return !isUneven(length, from, to) || excess * length <= legs.measure(first, last);
    }
    return isWalkClear(walker, from, to);
  };
  std::vector<Vec3> path{places.front()};
  for (std::size_t at = 0; at + 1 < places.size();) {
    std::size_t reached = at + 1, failed = places.size();
    if (kind == Shortcuts::tight) {
      reached = std::min(at + kMaxLeftOut + 1, places.size() - 1);
      while (reached > at + 1 && !isShortcut(at, reached)) --reached;
      failed = reached + 1;
    }
    // The farthest place that is found by doubling the distance, then by halving.
    for (std::size_t step = 2; reached + 1 < failed; step *= 2) {
      const std::size_t next = std::min(at + step, failed - 1);
      if (next <= reached) break;
      (isShortcut(at, next) ? reached : failed) = next;
    }
    while (failed < places.size() && reached + 1 < failed) {
      const std::size_t middle = (reached + failed) / 2;
      (isShortcut(at, middle) ? reached : failed) = middle;
    }
    at = reached;
    const bool isLast = at + 1 == places.size();
    if ((places[at] - path.back()).norm() < kArrivalDistance) {
      if (!isLast) continue;
      if (path.size() > 1) path.pop_back();
    }
    path.push_back(places[at]);
  }
  return path;
}

}  // namespace enfilade::scene
