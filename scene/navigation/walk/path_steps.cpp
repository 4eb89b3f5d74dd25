#include "scene/navigation/walk/path_steps.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

constexpr double kFloorSpacing = 0.01;  // metres between places where the floor is measured
constexpr double kMinStep = 0.02;       // metres: more than a slope that can be walked rises there
constexpr double kHeightRounding = 1e-3;  // metres: feet keep some rounding above the floor
constexpr double kShareOfFeet = 0.7;      // of a step, by which the feet rise or sink around it
constexpr double kAround = 0.1;           // metres from the edge of the feet

/// The floor below a place of a walk.
struct FloorPlace {
  Vec3 floor = Vec3::Zero();  ///< scene frame, metres
  double feet = 0;            ///< height of the feet there
  double along = 0;           ///< metres across from the start of the walk
};

/// Measures the floor between two places by casts of a point, from a step above the feet to one
/// below them. Holes are left out.
void measureFloor(const WorldData& world, const AvatarShape& point, const Vec3& from,
                  const Vec3& to, double along, std::vector<FloorPlace>& places) {
  const double reach = world.settings.stepHeight;
  const Vec3 up(0, reach, 0);
  const double length = computeGroundDistance(from, to);
  const int count = static_cast<int>(std::ceil(length / kFloorSpacing));
  Aabb box{from.cwiseMin(to) - up, from.cwiseMax(to) + up};
  ObstacleSet obstacles = collectObstaclesInBox(world, inflated(box, kFloorSpacing), 0);
  QueryCount queries;
  for (int i = 0; i < count; ++i) {
    const double share = static_cast<double>(i) / count;
    const Vec3 feet = from + share * (to - from);
    const ShapeCastHit hit = castAvatarShape(point, feet + up, -2 * up, obstacles,
                                             makeContactOffset(world.settings), queries);
    if (hit.entity == 0) continue;
    const double height = feet.y() + (1 - 2 * hit.fraction) * reach - hit.distance;
    places.push_back({{feet.x(), height, feet.z()}, feet.y(), along + share * length});
  }
}

/// Whether the ground between two places is steeper than what can be walked.
bool isSteep(const Vec3& from, const Vec3& to, const WorldSettings& settings) {
  const Vec3 between = to - from;
  return std::abs(between.y()) > kHeightRounding &&
         computeGroundDistance(from, to) < settings.walkableNormalY * between.norm();
}

/// The change of the height of the feet up to `reach` metres before and behind a place.
double computeRange(const std::vector<FloorPlace>& places, std::size_t at, double reach) {
  double lowest = places[at].feet, highest = lowest;
  const auto include = [&](const FloorPlace& place) {
    lowest = std::min(lowest, place.feet);
    highest = std::max(highest, place.feet);
    return std::abs(place.along - places[at].along) < reach;
  };
  for (std::size_t i = at; i-- > 0 && include(places[i]);) continue;
  for (std::size_t i = at; i < places.size() && include(places[i]); ++i) continue;
  return highest - lowest;
}

}  // namespace

std::vector<PathStep> findSteps(const WorldData& world, const NavigationAgent& agent,
                                const std::vector<Vec3>& traced) {
  const auto point = makeAvatarShape({makeAvatarPart(
      std::make_shared<const collision::Hull>(collision::buildHull(std::vector{Vec3(0, 0, 0)})))});
  std::vector<FloorPlace> places;
  double along = 0;
  for (std::size_t i = 1; i < traced.size(); ++i) {
    measureFloor(world, *point, traced[i - 1], traced[i], along, places);
    along += computeGroundDistance(traced[i - 1], traced[i]);
  }
  std::vector<PathStep> steps;
  const double maxRise = world.settings.stepHeight + kHeightRounding;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const Vec3& before = places[i - 1].floor;
    if (!isSteep(before, places[i].floor, world.settings)) continue;
    const double rise = places[i].floor.y() - before.y();
    if (std::abs(rise) < kMinStep || std::abs(rise) > maxRise) continue;
    if (computeRange(places, i, agent.radius + kAround) < kShareOfFeet * std::abs(rise)) continue;
    steps.push_back({before, rise});
  }
  return steps;
}

}  // namespace enfilade::scene
