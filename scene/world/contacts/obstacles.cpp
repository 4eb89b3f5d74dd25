#include "scene/world/contacts/obstacles.hpp"

#include <algorithm>

namespace enfilade::scene {
namespace {

constexpr double kCollectMargin =
    0.15;  // metres: obstacles are collected for several ticks at once

/// Appends the parts of static object `object` that may overlap `bounds`.
void collectStaticObstacles(const Scene& scene, std::uint32_t object, const Aabb& bounds,
                            std::vector<Obstacle>& obstacles) {
  const CollisionGeometry& geometry = scene.collisionGeometry(object);
  thread_local std::vector<std::uint32_t> found;
  found.clear();
  geometry.query(bounds, found);
  for (const std::uint32_t part : found) {
    Obstacle obstacle;
    obstacle.entity = object + 1;
    obstacle.part = part;
    obstacle.box = geometry.box(part);
    obstacle.convex = geometry.convex(part);
    obstacles.push_back(obstacle);
  }
}

/// All parts of a body; triggers are not solid.
void appendBodyParts(const WorldData& world, std::uint32_t index,
                     std::vector<Obstacle>& obstacles) {
  const Body& body = world.bodies[index];
  if (isTrigger(body.spec->kind)) return;
  for (std::uint32_t part = 0; part < getPartCount(body); ++part) {
    Obstacle obstacle;
    obstacle.entity = body.id;
    obstacle.part = part;
    obstacle.bodyIndex = index;
    obstacles.push_back(obstacle);
  }
}

/// Sorts ascending, and takes over the caches of the last tick by merging.
void sortAndKeepCaches(std::vector<Obstacle>& obstacles, std::vector<Obstacle>& last) {
  // Proxy ids are reused, so their order is not that of the entities.
  const auto key = [](const Obstacle& o) { return std::pair(o.entity, o.part); };
  std::sort(obstacles.begin(), obstacles.end(),
            [&](const Obstacle& a, const Obstacle& b) { return key(a) < key(b); });
  auto old = last.begin();
  for (Obstacle& obstacle : obstacles) {
    while (old != last.end() && key(*old) < key(obstacle)) ++old;
    if (old != last.end() && key(*old) == key(obstacle)) {
      obstacle.cache = old->cache;
      obstacle.moreCaches = std::move(old->moreCaches);
    }
  }
}

/// Stationary bodies are treated as static.
bool mayMove(const WorldData& world, collision::ProxyId proxy) {
  const std::uint32_t index = world.findBodyByProxy(proxy);
  if (index == kNoBody) return true;
  const Body& body = world.bodies[index];
  return body.moved || (isDynamic(body.spec->kind) && !body.asleep);
}

/// Appends the parts of a body that overlap `bounds`, at their current pose.
void collectBodyObstacles(const WorldData& world, std::uint32_t body, const Aabb& bounds,
                          std::vector<Obstacle>& obstacles) {
  if (!overlaps(world.bodies[body].motionBounds, bounds)) return;
  std::vector<Obstacle> all;
  appendBodyParts(world, body, all);
  for (Obstacle& obstacle : all) {
    updateObstaclePose(world, obstacle);
    if (overlaps(obstacle.box, bounds)) obstacles.push_back(obstacle);
  }
}

}  // namespace

ShapeCastHit castAvatarShape(const AvatarShape& shape, const Vec3& footPosition,
                             const Vec3& displacement, std::vector<Obstacle>& obstacles,
                             const collision::ContactOffset& contactOffset, QueryCount& count) {
  ShapeCastHit hit;
  Vec3 rest = displacement;  // only the displacement before the earliest hit so far matters
  for (std::size_t i = 0; i < shape.parts.size(); ++i) {
    const Aabb start = placeBox(shape.parts[i].box, footPosition);
    Aabb sweptBox = inflated(collision::sweptAabb(start, rest), contactOffset.rest);
    for (Obstacle& obstacle : obstacles) {
      if (!overlaps(sweptBox, obstacle.box)) continue;
      const collision::ShapeCastResult result =
          collision::castShape(placeAvatarPart(shape.parts[i], footPosition), rest, obstacle.convex,
                               contactOffset, obstacle.cacheFor(i));
      count.add(result);
      const double fraction = hit.fraction * result.fraction;
      if (!result.stopped || (hit.entity != 0 && fraction >= hit.fraction)) continue;
      hit = {fraction, obstacle.entity, -result.separationAtStop.normal,
             result.separationAtStop.distance, result.separationAtStop};
      if (fraction == 0) return hit;
      rest = fraction * displacement;
      sweptBox = inflated(collision::sweptAabb(start, rest), contactOffset.rest);
    }
  }
  return hit;
}

bool isClear(const AvatarShape& shape, const Vec3& footPosition, double clearance,
             std::vector<Obstacle>& obstacles, QueryCount& count, EntityId& nearest) {
  for (std::size_t i = 0; i < shape.parts.size(); ++i) {
    const Aabb box = inflated(placeBox(shape.parts[i].box, footPosition), clearance);
    for (Obstacle& obstacle : obstacles) {
      if (!overlaps(box, obstacle.box)) continue;
      ++count.narrow;
      const auto separation =
          collision::computeSeparationWithin(placeAvatarPart(shape.parts[i], footPosition),
                                             obstacle.convex, clearance, obstacle.cacheFor(i));
      if (!separation) continue;
      if (separation->certificate == collision::Certificate::rational) ++count.rational;
      nearest = obstacle.entity;
      return false;
    }
  }
  return true;
}

double computeClipFraction(const Aabb& footBounds, const Vec3& footPosition,
                           const Vec3& displacement) {
  double fraction = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double step = displacement[axis];
    const double remaining =
        (step > 0 ? footBounds.max[axis] : footBounds.min[axis]) - footPosition[axis];
    if (step != 0) fraction = std::min(fraction, std::max(0.0, remaining / step));
  }
  return fraction;
}

Aabb computeAvatarFootBounds(const WorldSettings& settings, const Avatar& avatar) {
  const double clearance = computeContactQueryMargin(settings) +
                           computeMaxChainDisplacement(avatar.chain, settings.tickDuration);
  const Aabb &bounds = avatar.motionBounds, &shapeBox = avatar.shape->box;
  return inflated(Aabb{bounds.min - shapeBox.min, bounds.max - shapeBox.max}, -clearance);
}

void updateObstaclePose(const WorldData& world, Obstacle& obstacle) {
  if (obstacle.bodyIndex != kNoBody) {
    const Body& body = world.bodies[obstacle.bodyIndex];
    obstacle.box = getPartBox(body, obstacle.part);
    obstacle.convex = makePlacedPart(body, obstacle.part);
    // Where the body will stand: the solver moves it after the avatars.
    obstacle.box.min.y() += body.pendingLift, obstacle.box.max.y() += body.pendingLift;
    obstacle.convex.translation.y() += body.pendingLift;
  } else if (obstacle.entity >= world.firstAvatarId()) {
    const Avatar& other = *world.findAvatar(obstacle.entity);
    const AvatarPart& part = other.shape->parts[obstacle.part];
    obstacle.box = placeBox(part.box, other.footPosition);
    obstacle.convex = placeAvatarPart(part, other.footPosition);
  }
}

bool areNeighboursStationary(const WorldData& world, const Avatar& avatar) {
  const auto overlapping = world.broadPhase.overlapsOf(avatar.proxy);
  for (std::size_t i = overlapping.size();
       i-- > 0 && overlapping[i].isDynamic;)  // dynamic proxies come last
    if (mayMove(world, overlapping[i].id)) return false;
  return true;
}

void refreshDynamicObstacles(const WorldData& world, Avatar& avatar) {
  for (std::size_t i = avatar.obstacles.size(); i-- > 0;) {
    Obstacle& obstacle = avatar.obstacles[i];
    // Avatars come last, bodies anywhere.
    if (!avatar.hasBodyObstacles && obstacle.entity < world.firstAvatarId()) return;
    updateObstaclePose(world, obstacle);
  }
}

void collectObstacles(WorldData& world, Avatar& avatar) {
  const bool complete = !avatar.pairsChanged && contains(avatar.cachedBounds, avatar.motionBounds);
  avatar.pairsChanged = false;
  if (complete) return refreshDynamicObstacles(world, avatar);
  std::vector<Obstacle> last;
  last.swap(avatar.obstacles);
  avatar.hasBodyObstacles = false;
  avatar.cachedBounds = inflated(avatar.motionBounds, kCollectMargin);
  for (const auto& overlap : world.broadPhase.overlapsOf(avatar.proxy)) {
    if (!overlap.isDynamic) {
      collectStaticObstacles(*world.scene, world.scene->solidObjects()[overlap.id],
                             avatar.cachedBounds, avatar.obstacles);
    } else if (const std::uint32_t body = world.findBodyByProxy(overlap.id); body != kNoBody) {
      makePartBoxes(world.bodies[body]);
      appendBodyParts(world, body, avatar.obstacles);
      avatar.hasBodyObstacles = true;
    } else {
      const Avatar& other = *world.findAvatarByProxy(overlap.id);
      for (std::uint32_t part = 0; part < other.shape->parts.size(); ++part) {
        avatar.obstacles.emplace_back();
        avatar.obstacles.back().entity = other.id;
        avatar.obstacles.back().part = part;
      }
    }
  }
  sortAndKeepCaches(avatar.obstacles, last);
  refreshDynamicObstacles(world, avatar);
}

std::vector<Obstacle> collectObstaclesInBox(const WorldData& world, const Aabb& box,
                                            EntityId except) {
  std::vector<Obstacle> obstacles;
  for (const collision::StaticId staticId : world.broadPhase.overlapStatic(box))
    collectStaticObstacles(*world.scene, world.scene->solidObjects()[staticId], box, obstacles);
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i)
    collectBodyObstacles(world, i, box, obstacles);
  for (const Avatar& other : world.avatars) {
    if (other.id == except) continue;
    for (std::uint32_t part = 0; part < other.shape->parts.size(); ++part) {
      Obstacle obstacle;
      obstacle.entity = other.id;
      obstacle.part = part;
      obstacle.box = placeBox(other.shape->parts[part].box, other.footPosition);
      obstacle.convex = placeAvatarPart(other.shape->parts[part], other.footPosition);
      if (overlaps(obstacle.box, box)) obstacles.push_back(obstacle);
    }
  }
  return obstacles;
}

}  // namespace enfilade::scene
