#include "scene/navigation/walk/path_steps.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

constexpr double kFloorSpacing = 0.01;    // metres between places where the floor is measured
constexpr double kMinStep = 0.02;         // metres
constexpr double kHeightRounding = 1e-3;  // metres
constexpr double kFeetFraction = 0.7;     // of a step, by which the feet rise or sink around it
constexpr double kFeetMargin = 0.2;       // metres around the feet
constexpr double kSteepestStair = 1.5;    // rise over run

/// The floor below a place of a walk.
struct FloorPlace {
  Vec3 floor = Vec3::Zero();  ///< scene frame, metres
  double footHeight = 0;
  double along = 0;          ///< metres across from the start of the walk
  bool isSteep = false;      ///< the floor cannot be walked there, as on a riser
  bool isAfterHole = false;  ///< the place before it has no floor
};

/// Measures the floor along a walk by casts of a point. They begin a step above the feet, and end
/// where the floor is below the middle of wide feet on a stair.
class FloorProbe {
 public:
  FloorProbe(const WorldData& world, double radius)
      : world_(world),
        up_(world.settings.stepHeight),
        down_(2 * world.settings.stepHeight + kSteepestStair * radius),
        point_(makeAvatarShape({makeAvatarPart(std::make_shared<const collision::Hull>(
            collision::buildHull(std::vector{Vec3(0, 0, 0)})))})) {}

  /// Appends the places from `from` to `to`, without the last.
  void measure(const Vec3& from, const Vec3& to) {
    const double length = computeGroundDistance(from, to);
    const int count = static_cast<int>(std::ceil(length / kFloorSpacing));
    Aabb box{from.cwiseMin(to), from.cwiseMax(to)};
    box.min.y() -= down_;
    box.max.y() += up_;
    ObstacleSet obstacles = collectObstaclesInBox(world_, inflate(box, kFloorSpacing), 0);
    for (int i = 0; i < count; ++i) {
      const double fraction = static_cast<double>(i) / count;
      measurePlace(from + fraction * (to - from), along_ + fraction * length, obstacles);
    }
    along_ += length;
  }

  std::vector<FloorPlace> places;

 private:
  void measurePlace(const Vec3& footPosition, double along, ObstacleSet& obstacles) {
    const Vec3 fall(0, -(up_ + down_), 0);
    QueryCount count;
    const ShapeCastHit hit = castAvatarShape(*point_, footPosition + Vec3(0, up_, 0), fall,
                                             obstacles, makeContactOffset(world_.settings), count);
    const bool isHole = hit.entity == 0;
    if (!isHole) {
      const double height = footPosition.y() + up_ + hit.fraction * fall.y() - hit.distance;
      places.push_back({{footPosition.x(), height, footPosition.z()},
                        footPosition.y(),
                        along,
                        hit.normal.y() < world_.settings.walkableNormalY,
                        wasHole_});
    }
    wasHole_ = isHole;
  }

  const WorldData& world_;
  double up_, down_;  ///< metres from the feet
  std::shared_ptr<const AvatarShape> point_;
  double along_ = 0;
  bool wasHole_ = false;
};

/// Fills gaps of the floor into which feet of this radius do not sink: a closing, as of images.
void fillNarrowGaps(std::vector<FloorPlace>& places, double radius) {
  const auto slide = [&](const auto& isBetter) {
    std::vector<double> heights;
    for (std::size_t i = 0, first = 0; i < places.size(); ++i) {
      while (places[i].along - places[first].along > radius) ++first;
      double best = places[i].floor.y();
      for (std::size_t k = first; k < places.size(); ++k) {
        if (places[k].along - places[i].along > radius) break;
        if (isBetter(places[k].floor.y(), best)) best = places[k].floor.y();
      }
      heights.push_back(best);
    }
    for (std::size_t i = 0; i < places.size(); ++i) places[i].floor.y() = heights[i];
  };
  slide(std::greater<>());
  slide(std::less<>());
}

/// Whether the floor from a place to the next one is no ground that can be walked.
bool isSteep(const FloorPlace& from, const FloorPlace& to, const WorldSettings& settings) {
  const Vec3 between = to.floor - from.floor;
  if (std::abs(between.y()) <= kHeightRounding) return false;
  return from.isSteep || to.isSteep || to.isAfterHole ||
         computeGroundDistance(from.floor, to.floor) < settings.walkableNormalY * between.norm();
}

/// The change of the height of the feet from `reach` metres before a place to `reach` metres behind
/// another one.
double computeFeetRange(const std::vector<FloorPlace>& places, std::size_t first, std::size_t last,
                        double reach) {
  double lowest = places[first].footHeight, highest = lowest;
  for (const FloorPlace& place : places) {
    if (place.along < places[first].along - reach || place.along > places[last].along + reach)
      continue;
    lowest = std::min(lowest, place.footHeight);
    highest = std::max(highest, place.footHeight);
  }
  return highest - lowest;
}

}  // namespace

std::vector<PathStep> findSteps(const WorldData& world, const NavigationAgent& agent,
                                const std::vector<Vec3>& traced) {
  FloorProbe probe(world, agent.radius);
  for (std::size_t i = 1; i < traced.size(); ++i) probe.measure(traced[i - 1], traced[i]);
  std::vector<FloorPlace>& places = probe.places;
  fillNarrowGaps(places, agent.radius);
  const auto computeRise = [&](std::size_t i) {
    return isSteep(places[i - 1], places[i], world.settings)
               ? places[i].floor.y() - places[i - 1].floor.y()
               : 0;
  };
  const double minRise = kMinStep - kHeightRounding;
  const double maxRise = world.settings.stepHeight + kHeightRounding;
  std::vector<PathStep> steps;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const std::size_t first = i;
    PathStep step{places[i - 1].floor, computeRise(i)};
    // An inclined riser is several places wide.
    while (step.rise != 0 && i + 1 < places.size() && step.rise * computeRise(i + 1) > 0)
      step.rise += computeRise(++i);
    const double height = std::abs(step.rise);
    if (height < minRise || height > maxRise) continue;
    const double reach = agent.radius + kFeetMargin;
    if (computeFeetRange(places, first - 1, i, reach) < kFeetFraction * height) continue;
    steps.push_back(step);
  }
  return steps;
}

}  // namespace enfilade::scene
