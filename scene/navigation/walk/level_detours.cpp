#include "scene/navigation/walk/level_detours.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "scene/navigation/walk/grid_search.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kPiece = 0.1;       // metres between places where the height is compared
constexpr double kMinChange = 0.01;  // metres of height between two of them
constexpr double kMinSaving = 0.01;  // metres
constexpr int kMaxDetours = 4;       // of a path
constexpr GridSearch kAround{0.12, 1, 3000};

/// The part of a leg that leads up and down again.
struct Bump {
  Vec3 before, after;  ///< places of the feet
  double length = 0;   ///< metres that the feet move between them
};

std::optional<Bump> findBump(Walker& walker, const Vec3& from, const Vec3& to) {
  const int pieces = static_cast<int>(std::ceil(computeGroundDistance(from, to) / kPiece));
  std::optional<Bump> bump;
  double start = 0;
  walker.returnTo(from);
  for (int i = 1; i <= pieces; ++i) {
    const Vec3 before = walker.footPosition();
    const FeetTravel travel = walker.travel();
    const Vec3 goal = from + static_cast<double>(i) / pieces * (to - from);
    if (walker.walkTo(goal).kind != WalkOutcome::Kind::arrived) return std::nullopt;
    if (walker.travel().climb - travel.climb < kMinChange) continue;
    if (!bump) {
      bump = Bump{before, before};
      start = travel.length;
    }
    bump->after = walker.footPosition();
    bump->length = walker.travel().length - start;
  }
  return bump;
}

/// The places of a shorter way around the bump of a leg; empty: none was found.
std::vector<Vec3> findWayAround(Walker& walker, const Vec3& from, const Vec3& to) {
  const auto bump = findBump(walker, from, to);
  if (!bump) return {};
  GridSearch around = kAround;
  around.maxLength = bump->length - kMinSaving;
  return findGridPath(walker, bump->before, bump->after, around).value_or(std::vector<Vec3>());
}

double measureLength(Walker& walker, const std::vector<Vec3>& places) {
  double length = 0;
  for (std::size_t i = 1; i < places.size(); ++i)
    length += measureTravel(walker, places[i - 1], places[i]).length;
  return length;
}

}  // namespace

bool goAroundBumps(Walker& walker, std::vector<Vec3>& places) {
  std::vector<Vec3> level{places.front()};
  int detours = 0;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const Vec3 &from = places[i - 1], &to = places[i];
    if (detours < kMaxDetours &&
        measureTravel(walker, from, to).climb > std::abs(to.y() - from.y()) + kMinBump) {
      const auto way = findWayAround(walker, from, to);
      level.insert(level.end(), way.begin(), way.end());
      detours += way.empty() ? 0 : 1;
    }
    level.push_back(to);
  }
  if (detours == 0) return false;
  level = shortenPath(walker, level, Shortcuts::all);
  pullTight(walker, level);
  if (measureLength(walker, level) > measureLength(walker, places) - kMinSaving) return false;
  places = std::move(level);
  return true;
}

}  // namespace enfilade::scene
