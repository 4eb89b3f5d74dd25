#include "scene/navigation/clear_width.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

/// metres. Places are measured that are closer than the prism is wide.
constexpr double kThinRadius = 0.05, kWidthSpacing = 0.08;

/// Distance that a thin prism at `position` can be moved across `direction`, and its own width,
/// metres.
double measureClearWidth(const WorldData& world, const AvatarShape& shape, const Vec3& position,
                         const Vec3& direction) {
  const WorldSettings& settings = world.settings;
  const Vec3 feet = position + Vec3(0, settings.stepHeight, 0);
  const Vec3 side = Vec3(-direction.z(), 0, direction.x()).normalized();
  double width = 2 * kThinRadius;
  for (const Vec3& move : {Vec3(kMaxSideWidth * side), Vec3(-kMaxSideWidth * side)}) {
    const Aabb box = inflated(collision::sweptAabb(placeBox(shape.box, feet), move), 0.1);
    ObstacleSet obstacles = collectObstaclesInBox(world, box, 0);
    QueryCount count;
    const ShapeCastHit hit =
        castAvatarShape(shape, feet, move, obstacles, makeContactOffset(settings), count);
    width += hit.fraction * kMaxSideWidth + (hit.entity != 0 ? hit.distance : 0);
  }
  return width;
}

}  // namespace

NarrowPlace measureNarrowest(const WorldData& world, const NavigationAgent& agent,
                             const std::vector<Vec3>& points, const Vec3& near,
                             double maxDistance) {
  const auto shape = makeThinShape(world.settings, agent);
  NarrowPlace narrowest{Vec3::Zero(), std::numeric_limits<double>::infinity()};
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3 leg = points[i] - points[i - 1];
    const Vec3 direction = projectToGround(leg);
    if (direction.isZero(0)) continue;
    const int count = std::max(1, static_cast<int>(std::ceil(leg.norm() / kWidthSpacing)));
    for (int k = 0; k <= count; ++k) {
      const Vec3 place = points[i - 1] + (static_cast<double>(k) / count) * leg;
      if ((place - near).norm() > maxDistance) continue;
      const double width = measureClearWidth(world, *shape, place, direction);
      // A thin prism that cannot move to either side stands in an obstacle.
      if (width > 2.5 * kThinRadius && width < narrowest.clearWidth) narrowest = {place, width};
    }
  }
  return narrowest;
}

std::shared_ptr<const AvatarShape> makeThinShape(const WorldSettings& settings,
                                                 const NavigationAgent& agent) {
  const double height = agent.height - settings.stepHeight;
  return makePrismShape(kThinRadius, height, height, settings);
}

ObstacleDistance measureObstacle(const WorldData& world, const NavigationAgent& agent,
                                 const Vec3& footPosition, double maxDistance) {
  constexpr double kPrecision = 1e-4;  // metres
  const auto shape = makeThinShape(world.settings, agent);
  const Vec3 feet = placeThinShape(world.settings, footPosition);
  const double limit = std::max(kPrecision, maxDistance - kThinRadius);
  ObstacleSet obstacles =
      collectObstaclesInBox(world, inflated(placeBox(shape->box, feet), limit), 0);
  // An object that lies only below the step height, as the floor, is no obstacle.
  std::erase_if(obstacles.list,
                [&](const Obstacle& obstacle) { return obstacle.box.max.y() < feet.y(); });
  QueryCount count;
  EntityId nearest = 0;
  if (isClear(*shape, feet, limit, obstacles, count, nearest)) return {maxDistance, 0};
  double clear = 0, near = limit;
  while (near - clear > kPrecision) {
    const double middle = 0.5 * (near + clear);
    (isClear(*shape, feet, middle, obstacles, count, nearest) ? clear : near) = middle;
  }
  return {near + kThinRadius, nearest};
}

}  // namespace enfilade::scene
