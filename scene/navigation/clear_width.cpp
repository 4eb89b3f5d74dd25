#include "scene/navigation/clear_width.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "collision/sine_cosine.hpp"
#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

/// metres. Places are measured that are closer than the prism is wide.
constexpr double kThinRadius = 0.05, kWidthSpacing = 0.08;

// A thin prism that cannot move to either side stands in an obstacle.
constexpr double kMinMeasuredWidth = 2.5 * kThinRadius;

Vec3 turnToSide(const Vec3& direction) {
  return {-direction.z(), 0, direction.x()};
}

/// Distances that a thin prism at `position` can be moved to both sides of `direction`, a
/// horizontal unit vector, each up to `maxWidth`. They are in metres from its middle.
std::array<double, 2> measureSides(const WorldData& world, const AvatarShape& shape,
                                   const Vec3& position, const Vec3& direction, double maxWidth) {
  const WorldSettings& settings = world.settings;
  const Vec3 footPosition = position + Vec3(0, settings.stepHeight, 0);
  const Vec3 side = turnToSide(direction);
  std::array<double, 2> widths{};
  for (std::size_t i = 0; i < 2; ++i) {
    const Vec3 move = (i == 0 ? maxWidth : -maxWidth) * side;
    const Aabb box =
        inflate(collision::computeSweptAabb(placeBox(shape.box, footPosition), move), 0.1);
    ObstacleSet obstacles = collectObstaclesInBox(world, box, 0);
    QueryCount count;
    const ShapeCastHit hit =
        castAvatarShape(shape, footPosition, move, obstacles, makeContactOffset(settings), count);
    widths[i] = kThinRadius + hit.fraction * maxWidth + (hit.entity != 0 ? hit.distance : 0);
  }
  return widths;
}

/// Parts of a leg, each as long as the spacing of places at most.
int countParts(const Vec3& leg) {
  return std::max(1, static_cast<int>(std::ceil(leg.norm() / kWidthSpacing)));
}

}  // namespace

std::vector<Vec3> traceFeet(Walker& walker, const std::vector<Vec3>& points) {
  std::vector<Vec3> traced;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3 leg = points[i] - points[i - 1];
    const int count = countParts(leg);
    traced.push_back(points[i - 1]);
    walker.returnTo(points[i - 1]);
    for (int k = 1; k < count; ++k) {
      Vec3 place = points[i - 1] + (static_cast<double>(k) / count) * leg;
      const Vec3 stood = walker.footPosition();
      if (walker.walkTo(place).kind != WalkOutcome::Kind::arrived) {
        walker.returnTo(stood);  // a walk passes places where it cannot stand, as on a riser
        continue;
      }
      place.y() = walker.footPosition().y();
      traced.push_back(place);
    }
  }
  if (!points.empty()) traced.push_back(points.back());
  return traced;
}

NarrowPlace measureNarrowest(const WorldData& world, const NavigationAgent& agent,
                             const std::vector<Vec3>& points, const Vec3& near,
                             double maxDistance) {
  const auto shape = makeThinShape(world.settings, agent);
  NarrowPlace narrowest{Vec3::Zero(), std::numeric_limits<double>::infinity()};
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3 leg = points[i] - points[i - 1];
    const Vec3 direction = projectToGround(leg);
    if (direction.isZero(0)) continue;
    const int count = countParts(leg);
    const int end = i + 1 == points.size() ? count + 1 : count;  // the next leg begins at its end
    for (int k = 0; k < end; ++k) {
      const Vec3 place = points[i - 1] + (static_cast<double>(k) / count) * leg;
      if ((place - near).norm() > maxDistance) continue;
      const auto [left, right] =
          measureSides(world, *shape, place, direction.normalized(), kMaxSideWidth);
      const double width = left + right;
      if (width > kMinMeasuredWidth && width < narrowest.clearWidth) narrowest = {place, width};
    }
  }
  return narrowest;
}

std::optional<GapAxis> measureGapAxis(const WorldData& world, const NavigationAgent& agent,
                                      const Vec3& place, const Vec3& direction) {
  constexpr double kMaxWidth = 1;      // metres to each side: a wider gap needs no axis
  constexpr double kSameWidth = 0.01;  // metres
  const auto shape = makeThinShape(world.settings, agent);
  GapAxis axis{place, direction, std::numeric_limits<double>::infinity()};
  // Ever closer around the best angle so far: 30 degrees in steps of 10, then a third of each.
  for (double degrees = 10; degrees > 0.06; degrees /= 3) {
    const Vec3 middle = axis.direction;
    for (int i = -3; i <= 3; ++i) {
      const auto [sine, cosine] = collision::computeSineCosineOfDegrees(i * degrees);
      const Vec3 turned = cosine * middle + sine * turnToSide(middle);
      const auto [left, right] = measureSides(world, *shape, place, turned, kMaxWidth);
      if (left + right < 2 * agent.radius) return std::nullopt;
      if (left + right < axis.clearWidth)
        axis = {place + 0.5 * (left - right) * turnToSide(turned), turned, left + right};
    }
  }
  if (!(axis.clearWidth < 2 * kMaxWidth)) return std::nullopt;
  // The width changes little with the angle: the middle at another place of a long gap is better.
  for (const double along : {1.0, -1.0, 0.5, -0.5, 0.25, -0.25}) {
    const Vec3 other = axis.centre + along * axis.direction;
    const auto [left, right] = measureSides(world, *shape, other, axis.direction, kMaxWidth);
    if (std::abs(left + right - axis.clearWidth) > kSameWidth) continue;
    const Vec3 middle = other + 0.5 * (left - right) * turnToSide(axis.direction);
    axis.direction = (middle - axis.centre).normalized() * (along > 0 ? 1 : -1);
    break;
  }
  return axis;
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
  const Vec3 raised = placeThinShape(world.settings, footPosition);
  const double limit = std::max(kPrecision, maxDistance - kThinRadius);
  ObstacleSet obstacles =
      collectObstaclesInBox(world, inflate(placeBox(shape->box, raised), limit), 0);
  // An object that lies only below the step height, as the floor, is no obstacle.
  std::erase_if(obstacles.list,
                [&](const Obstacle& obstacle) { return obstacle.box.max.y() < raised.y(); });
  QueryCount count;
  EntityId nearest = 0;
  if (isClear(*shape, raised, limit, obstacles, count, nearest)) return {maxDistance, 0};
  double clear = 0, near = limit;
  while (near - clear > kPrecision) {
    const double middle = 0.5 * (near + clear);
    (isClear(*shape, raised, middle, obstacles, count, nearest) ? clear : near) = middle;
  }
  return {near + kThinRadius, nearest};
}

}  // namespace enfilade::scene
