#include "scene/navigation/walk/shorter_parts.hpp"

#include <algorithm>
#include <array>
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
constexpr double kBendLength = 2.5;   // metres that the feet move
constexpr double kMinBend = 0.01;     // of that length
constexpr double kBendMargin = 0.5;   // metres around a bend
constexpr std::size_t kMaxBendWalks = 12'000;
constexpr int kMaxPasses = 3;  // over the bends of a path

/// For ways around a bump, tried in turn.
constexpr std::array kBumpGrids{GridSearch{kCoarseSpacing, 1, 2000, true},
                                GridSearch{kFineSpacing, 0.7, 12'000, true}};

/// A part of a path: its first and its last sample.
using Part = std::pair<std::size_t, std::size_t>;

/// A place of a walk.
struct Sample {
  Vec3 footPosition;
  FeetTravel travel;          ///< since the start of the walk
  std::size_t nextPlace = 0;  ///< index of the next place of the path, or of this one
  bool isStanding = true;     ///< not in a fall
};

/// Walks a path tick by tick, in short pieces. At the edge of furniture the path of the feet may be
/// longer than that of a wider walker. nullopt: an obstacle stopped the walk, or it ended at
/// another height.
std::optional<std::vector<Sample>> sampleWalk(Walker& walker, const std::vector<Vec3>& places) {
  walker.returnTo(places.front());
  std::vector<Sample> samples{{places.front(), {}, 1}};
  for (std::size_t leg = 1; leg < places.size(); ++leg) {
    const auto measureRest = [&] {
      return computeGroundDistance(walker.footPosition(), places[leg]);
    };
    for (double rest = measureRest(), before = rest + kPiece; rest > kArrivalDistance;) {
      if (walker.walkOn(places[leg], kPiece).kind != WalkOutcome::Kind::arrived)
        return std::nullopt;
      samples.push_back({walker.footPosition(), walker.travel(), leg, walker.isStanding()});
      before = std::exchange(rest, measureRest());
      if (rest >= before) return std::nullopt;  // it slides to and fro
    }
  }
  if (std::abs(walker.footPosition().y() - places.back().y()) > kSameHeight) return std::nullopt;
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

std::size_t findSampleBefore(const std::vector<Sample>& samples, std::size_t i, double length) {
  const double start = samples[i].travel.length() - length;
  while (i > 0 && samples[i].travel.length() > start) --i;
  return i;
}

std::size_t findSampleAfter(const std::vector<Sample>& samples, std::size_t i, double length) {
  const double end = samples[i].travel.length() + length;
  while (i + 1 < samples.size() && samples[i].travel.length() < end) ++i;
  return i;
}

/// The first and the last sample of the next bump at or after sample `first`.
std::optional<Part> findNextBump(const std::vector<Sample>& samples, std::size_t first) {
  for (std::size_t i = first; i + 1 < samples.size(); ++i) {
    if (std::abs(samples[i + 1].footPosition.y() - samples[i].footPosition.y()) < kMinChange)
      continue;
    if (const auto end = findEndOfBump(samples, i)) return Part(i, *end);
  }
  return std::nullopt;
}

bool isKnown(const PartEnds& known, const Vec3& before, const Vec3& after) {
  return std::ranges::any_of(known, [&](const auto& bump) {
    return (bump.first - before).norm() < kSameBump && (bump.second - after).norm() < kSameBump;
  });
}

/// The first bend at or after sample `first`: a part along which the feet move farther than
/// straight from its first to its last sample.
std::optional<Part> findNextBend(const std::vector<Sample>& samples, std::size_t first) {
  for (std::size_t i = first; i + 1 < samples.size(); ++i) {
    const std::size_t last = findSampleAfter(samples, i, kBendLength);
    const Vec3 move = samples[last].footPosition - samples[i].footPosition;
    const double length = samples[last].travel.length() - samples[i].travel.length();
    if (length - projectToGround(move).norm() - std::abs(move.y()) > kMinBend * length)
      return Part(i, last);
  }
  return std::nullopt;
}

/// A shorter way between two samples of a path, found on a grid; empty if no way is shorter.
std::vector<Vec3> findShorterWay(Walker& walker, const Sample& first, const Sample& last,
                                 GridSearch grid, std::size_t& maxWalks) {
  const double length = last.travel.length() - first.travel.length();
  const std::size_t walks = grid.maxWalks = std::min(grid.maxWalks, maxWalks);
  grid.maxLength = kGridExcess * length;
  const auto way = findGridPath(walker, first.footPosition, last.footPosition, grid);
  maxWalks -= walks - grid.maxWalks;
  if (!way) return {};
  std::vector<Vec3> shorter = shortenPath(walker, *way, Shortcuts::all);
  pullTight(walker, shorter);
  const auto walked = sampleWalk(walker, shorter);
  return walked && walked->back().travel.length() < length - kMinSaving ? shorter
                                                                        : std::vector<Vec3>();
}

/// Replaces parts of a path, from its start to its end.
class PartReplacement {
 public:
  PartReplacement(Walker& walker, const std::vector<Vec3>& places,
                  const std::vector<Sample>& samples)
      : walker_(walker), places_(places), samples_(samples), path_{places.front()} {}

  /// Replaces the path between two samples, or from the end of the last way if that is later. A
  /// sample in a fall is not an end: the part is longer then.
  bool replace(Part part, const GridSearch& grid, std::size_t& maxWalks) {
    part.first = std::max(part.first, end_);
    while (part.first > end_ && !samples_[part.first].isStanding) --part.first;
    while (part.second + 1 < samples_.size() && !samples_[part.second].isStanding) ++part.second;
    if (part.first >= part.second) return false;
    const Sample &first = samples_[part.first], &last = samples_[part.second];
    const std::vector<Vec3> way = findShorterWay(walker_, first, last, grid, maxWalks);
    if (way.empty()) return false;
    for (; next_ < first.nextPlace; ++next_) path_.push_back(places_[next_]);
    path_.insert(path_.end(), way.begin(), way.end());
    next_ = last.nextPlace;
    end_ = part.second;
    return true;
  }

  std::vector<Vec3> finish() {
    path_.insert(path_.end(), places_.begin() + static_cast<std::ptrdiff_t>(next_), places_.end());
    return shortenPath(walker_, path_, Shortcuts::all);
  }

 private:
  Walker& walker_;
  const std::vector<Vec3>& places_;
  const std::vector<Sample>& samples_;
  std::vector<Vec3> path_;
  std::size_t next_ = 1;  ///< the place that is appended next
  std::size_t end_ = 0;   ///< the sample where the last way ends
};

}  // namespace

std::optional<Vec3> findBump(Walker& walker, const std::vector<Vec3>& places) {
  const auto samples = sampleWalk(walker, places);
  const auto bump = samples ? findNextBump(*samples, 0) : std::nullopt;
  if (!bump) return std::nullopt;
  return (*samples)[(bump->first + bump->second) / 2].footPosition;
}

PartEnds goAroundBumps(Walker& walker, std::vector<Vec3>& places, BumpSearch& search) {
  const auto samples = sampleWalk(walker, places);
  if (!samples) return {};
  PartEnds replaced;
  PartReplacement replacement(walker, places, *samples);
  std::size_t next = 0;
  for (int i = 0; i < kMaxBumps; ++i) {
    const auto bump = findNextBump(*samples, next);
    if (!bump) break;
    next = bump->second;
    const std::pair ends((*samples)[bump->first].footPosition,
                         (*samples)[bump->second].footPosition);
    if (isKnown(search.known, ends.first, ends.second)) continue;
    const Part part(findSampleBefore(*samples, bump->first, kApproach),
                    findSampleAfter(*samples, bump->second, kApproach));
    const bool isReplaced = std::ranges::any_of(kBumpGrids, [&](const GridSearch& grid) {
      return replacement.replace(part, grid, search.maxWalks);
    });
    if (isReplaced) next = part.second;
    (isReplaced ? replaced : search.known).push_back(ends);
  }
  if (!replaced.empty()) places = replacement.finish();
  return replaced;
}

bool shortenBends(Walker& walker, std::vector<Vec3>& places, double spacing,
                  std::size_t& maxWalks) {
  const GridSearch grid{spacing, kBendMargin, kMaxBendWalks, true};
  bool isAnyShorter = false;
  PartEnds known;  // without a shorter way
  auto samples = sampleWalk(walker, places);
  for (int pass = 0; samples && pass < kMaxPasses; ++pass) {
    bool isReplaced = false;
    PartReplacement replacement(walker, places, *samples);
    std::size_t next = 0;
    while (const auto bend = findNextBend(*samples, next)) {
      const auto [first, last] = *bend;
      const std::pair ends((*samples)[first].footPosition, (*samples)[last].footPosition);
      next = (first + last + 1) / 2;  // of overlapping parts one may be replaced
      if (isKnown(known, ends.first, ends.second)) continue;
      if (replacement.replace(*bend, grid, maxWalks)) {
        isReplaced = true;
        next = last;
      } else {
        known.push_back(ends);
      }
    }
    if (!isReplaced) break;
    // The ways can be walked. The whole may not be, since a fall from a step may end elsewhere.
    std::vector<Vec3> shorter = replacement.finish();
    auto walked = sampleWalk(walker, shorter);
    if (!walked || walked->back().travel.length() >= samples->back().travel.length()) break;
    places = std::move(shorter);
    samples = std::move(walked);
    isAnyShorter = true;
  }
  return isAnyShorter;
}

}  // namespace enfilade::scene
