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
constexpr double kMinSaving = 0.01;   // metres
constexpr double kSameBump = 0.3;     // metres
constexpr int kMaxBumps = 4;          // of a path
constexpr GridSearch kCoarseAround{kCoarseSpacing, 1, 2000, true};
constexpr GridSearch kFineAround{kFineSpacing, 0.7, 12'000, true};

/// A place of a walk.
struct Sample {
  Vec3 footPosition;
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
/// sinks. The result is nullopt if it is not back within a short way.
std::optional<std::size_t> findEndOfBump(const std::vector<Sample>& samples, std::size_t first) {
  const Sample& start = samples[first];
  for (std::size_t i = first + 2; i < samples.size(); ++i) {
    if (samples[i].travel.length() - start.travel.length() > kMaxBumpLength) break;
    if (std::abs(samples[i].footPosition.y() - start.footPosition.y()) > kSameLevel) continue;
    if (samples[i].travel.climb - start.travel.climb >= kMinBump) return i;
  }
  return std::nullopt;
}

std::size_t findSampleBefore(const std::vector<Sample>& samples, std::size_t i) {
  const double start = samples[i].travel.length() - kApproach;
  while (i > 0 && samples[i].travel.length() > start) --i;
  return i;
}

std::size_t findSampleAfter(const std::vector<Sample>& samples, std::size_t i) {
  const double end = samples[i].travel.length() + kApproach;
  while (i + 1 < samples.size() && samples[i].travel.length() < end) ++i;
  return i;
}

/// The first and the last sample of the next bump at or after sample `first`.
std::optional<std::pair<std::size_t, std::size_t>> findNextBump(const std::vector<Sample>& samples,
                                                                std::size_t first) {
  for (std::size_t i = first; i + 1 < samples.size(); ++i) {
    if (std::abs(samples[i + 1].footPosition.y() - samples[i].footPosition.y()) < kMinChange)
      continue;
    if (const auto end = findEndOfBump(samples, i)) return std::pair(i, *end);
  }
  return std::nullopt;
}

bool isKnown(const BumpList& known, const Vec3& before, const Vec3& after) {
  return std::ranges::any_of(known, [&](const auto& bump) {
    return (bump.first - before).norm() < kSameBump && (bump.second - after).norm() < kSameBump;
  });
}

/// A part of a path with a way around a bump from `first` to `last`; empty: none is shorter.
std::vector<Vec3> findLevelPart(Walker& walker, const std::vector<Vec3>& part, const Sample& first,
                                const Sample& last, std::size_t& maxWalks) {
  const double length = measureLength(walker, part);
  for (GridSearch grid : {kCoarseAround, kFineAround}) {
    const std::size_t walks = grid.maxWalks = std::min(grid.maxWalks, maxWalks);
    grid.maxLength = kGridExcess * (last.travel.length() - first.travel.length());
    const auto way = findGridPath(walker, first.footPosition, last.footPosition, grid);
    maxWalks -= walks - grid.maxWalks;
    if (!way) continue;
    std::vector<Vec3> level{part.front()};
    level.insert(level.end(), way->begin(), way->end());
    level = shortenPath(walker, level, Shortcuts::all);
    pullTight(walker, level);
    if (measureLength(walker, level) < length - kMinSaving) return level;
  }
  return {};
}

}  // namespace

std::optional<Vec3> findBump(Walker& walker, const std::vector<Vec3>& places) {
  const auto samples = sampleWalk(walker, places);
  const auto bump = samples ? findNextBump(*samples, 0) : std::nullopt;
  if (!bump) return std::nullopt;
  return (*samples)[(bump->first + bump->second) / 2].footPosition;
}

BumpList goAroundBumps(Walker& walker, std::vector<Vec3>& places, BumpSearch& search) {
  const auto samples = sampleWalk(walker, places);
  if (!samples) return {};
  BumpList replaced;
  std::vector<Vec3> level{places.front()};
  std::size_t next = 1;   // the place of the path that is appended next
  std::size_t begin = 0;  // the sample where the last way around ends
  auto bump = findNextBump(*samples, 0);
  for (int i = 0; bump && i < kMaxBumps; ++i, bump = findNextBump(*samples, bump->second)) {
    const std::pair ends((*samples)[bump->first].footPosition,
                         (*samples)[bump->second].footPosition);
    if (isKnown(search.known, ends.first, ends.second)) continue;
    const Sample& first = (*samples)[std::max(findSampleBefore(*samples, bump->first), begin)];
    const std::size_t end = findSampleAfter(*samples, bump->second);
    const Sample& last = (*samples)[end];
    for (; next < first.nextPlace; ++next) level.push_back(places[next]);
    std::vector<Vec3> part{level.back()};
    for (std::size_t k = next; k < last.nextPlace; ++k) part.push_back(places[k]);
    part.push_back(last.footPosition);
    const std::vector<Vec3> around = findLevelPart(walker, part, first, last, search.maxWalks);
    if (around.empty()) {
      search.known.push_back(ends);
      continue;
    }
    replaced.push_back(ends);
    level.insert(level.end(), around.begin() + 1, around.end());
    next = last.nextPlace;
    begin = bump->second = end;
  }
  if (replaced.empty()) return replaced;
  level.insert(level.end(), places.begin() + static_cast<std::ptrdiff_t>(next), places.end());
  places = shortenPath(walker, level, Shortcuts::all);
  return replaced;
}

}  // namespace enfilade::scene
