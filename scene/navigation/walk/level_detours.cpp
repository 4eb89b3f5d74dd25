#include "scene/navigation/walk/level_detours.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "scene/navigation/walk/grid_search.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kPiece = 0.1;        // metres between places where heights are compared
constexpr double kMinChange = 0.01;   // metres of height between two of them
constexpr double kSameLevel = 0.03;   // metres
constexpr double kMaxBumpLength = 6;  // metres that the feet move
constexpr double kApproach = 0.7;     // metres before and after a bump that a way around replaces
constexpr double kGridExcess = 1.08;  // of a shortest path on a grid, before it is pulled tight
constexpr double kMinSaving = 0.01;   // metres
constexpr double kSameBump = 0.3;     // metres
constexpr int kMaxBumps = 4;          // of a path
constexpr GridSearch kCoarseAround{0.12, 1, 2000, true}, kFineAround{0.03, 0.7, 12'000, true};

/// A place of a walk.
struct Sample {
  Vec3 feet;
  FeetTravel travel;          ///< since the start of the walk
  std::size_t nextPlace = 0;  ///< index of the next place of the path, or of this one
};

/// Walks in short pieces; nullopt: an obstacle stopped the walk.
std::optional<std::vector<Sample>> sampleWalk(Walker& walker, const std::vector<Vec3>& places) {
  walker.returnTo(places.front());
  std::vector<Sample> samples{{places.front(), {}, 1}};
  for (std::size_t leg = 1; leg < places.size(); ++leg) {
    const Vec3 from = walker.footPosition(), &to = places[leg];
    const int pieces =
        std::max(1, static_cast<int>(std::ceil(computeGroundDistance(from, to) / kPiece)));
    for (int i = 1; i <= pieces; ++i) {
      const Vec3 goal = from + static_cast<double>(i) / pieces * (to - from);
      if (walker.walkTo(goal).kind != WalkOutcome::Kind::arrived) return std::nullopt;
      samples.push_back({walker.footPosition(), walker.travel(), leg});
    }
  }
  return samples;
}

/// The sample where the walk is back at the height of sample `first`, after which it rises or
/// sinks; nullopt: it does not within a short way.
std::optional<std::size_t> findEndOfBump(const std::vector<Sample>& samples, std::size_t first) {
  const Sample& start = samples[first];
  for (std::size_t i = first + 2; i < samples.size(); ++i) {
    if (samples[i].travel.length - start.travel.length > kMaxBumpLength) break;
    if (std::abs(samples[i].feet.y() - start.feet.y()) > kSameLevel) continue;
    if (samples[i].travel.climb - start.travel.climb >= kMinBump) return i;
  }
  return std::nullopt;
}

std::size_t findSampleBefore(const std::vector<Sample>& samples, std::size_t i) {
  const double start = samples[i].travel.length - kApproach;
  while (i > 0 && samples[i].travel.length > start) --i;
  return i;
}

std::size_t findSampleAfter(const std::vector<Sample>& samples, std::size_t i) {
  const double end = samples[i].travel.length + kApproach;
  while (i + 1 < samples.size() && samples[i].travel.length < end) ++i;
  return i;
}

std::optional<std::vector<Vec3>> findWayAround(Walker& walker, const Sample& first,
                                               const Sample& last) {
  for (GridSearch search : {kCoarseAround, kFineAround}) {
    search.maxLength = kGridExcess * (last.travel.length - first.travel.length);
    if (auto way = findGridPath(walker, first.feet, last.feet, search)) return way;
  }
  return std::nullopt;
}

double measureLength(Walker& walker, const std::vector<Vec3>& places) {
  double length = 0;
  for (std::size_t i = 1; i < places.size(); ++i)
    length += measureTravel(walker, places[i - 1], places[i]).length;
  return length;
}

bool isKnown(const BumpList& known, const Vec3& before, const Vec3& after) {
  return std::ranges::any_of(known, [&](const auto& bump) {
    return (bump.first - before).norm() < kSameBump && (bump.second - after).norm() < kSameBump;
  });
}

/// A part of a path, between two of its places, with a way around a bump; empty: none is shorter.
std::vector<Vec3> levelPart(Walker& walker, const std::vector<Vec3>& part, const Sample& first,
                            const Sample& last) {
  const auto way = findWayAround(walker, first, last);
  if (!way) return {};
  std::vector<Vec3> level{part.front()};
  level.insert(level.end(), way->begin(), way->end());
  level.push_back(part.back());
  level = shortenPath(walker, level, Shortcuts::all);
  pullTight(walker, level);
  if (measureLength(walker, level) > measureLength(walker, part) - kMinSaving) return {};
  return level;
}

}  // namespace

std::optional<Vec3> findBump(Walker& walker, const std::vector<Vec3>& places) {
  const auto samples = sampleWalk(walker, places);
  if (!samples) return std::nullopt;
  for (std::size_t i = 0; i + 1 < samples->size(); ++i) {
    if (std::abs((*samples)[i + 1].feet.y() - (*samples)[i].feet.y()) < kMinChange) continue;
    if (const auto end = findEndOfBump(*samples, i)) return (*samples)[(i + *end) / 2].feet;
  }
  return std::nullopt;
}

bool goAroundBumps(Walker& walker, std::vector<Vec3>& places, BumpList& known) {
  const auto samples = sampleWalk(walker, places);
  if (!samples) return false;
  std::vector<Vec3> level{places.front()};
  std::size_t next = 1;   // the place of the path that is appended next
  std::size_t begin = 0;  // the sample where the last way around ends
  int bumps = 0;
  bool isChanged = false;
  for (std::size_t i = 0; i + 1 < samples->size() && bumps < kMaxBumps; ++i) {
    if (std::abs((*samples)[i + 1].feet.y() - (*samples)[i].feet.y()) < kMinChange) continue;
    const auto end = findEndOfBump(*samples, i);
    if (!end) continue;
    if (isKnown(known, (*samples)[i].feet, (*samples)[*end].feet)) {
      i = *end - 1;
      continue;
    }
    ++bumps;
    const Sample& first = (*samples)[std::max(findSampleBefore(*samples, i), begin)];
    const Sample& last = (*samples)[findSampleAfter(*samples, *end)];
    for (; next < first.nextPlace; ++next) level.push_back(places[next]);
    std::vector<Vec3> part{level.back()};
    for (std::size_t k = next; k <= last.nextPlace; ++k) part.push_back(places[k]);
    const std::vector<Vec3> around = levelPart(walker, part, first, last);
    if (around.empty()) {
      known.emplace_back((*samples)[i].feet, (*samples)[*end].feet);
      i = *end - 1;
      continue;
    }
    level.insert(level.end(), around.begin() + 1, around.end());
    next = last.nextPlace + 1;
    while (i + 1 < samples->size() && (*samples)[i + 1].nextPlace < next) ++i;
    begin = i;
    isChanged = true;
  }
  if (!isChanged) return false;
  level.insert(level.end(), places.begin() + static_cast<std::ptrdiff_t>(next), places.end());
  places = std::move(level);
  return true;
}

}  // namespace enfilade::scene
