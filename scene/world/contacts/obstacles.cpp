#include "scene/world/contacts/obstacles.hpp"

#include <algorithm>

#include "collision/assert.hpp"
#include "scene/world/contacts/dense_obstacles.hpp"

namespace enfilade::scene {
namespace {

constexpr double kPrefetchDistance = 3, kPrefetchSeconds = 1;  // metres, seconds
constexpr std::size_t kMaxScannedDenseObjects = 4096;          // above, the broad phase finds them
constexpr double kCollectMargin =
    0.15;  // metres: obstacles are collected for several ticks at once

/// Appends the parts of static object `object` that may overlap `bounds`, or the whole object if it
/// is dense.
void collectStaticObstacles(const Scene& scene, std::uint32_t object, const Aabb& bounds,
                            ObstacleSet& obstacles) {
  const CollisionGeometry& geometry = scene.collisionGeometry(object);
  if (geometry.size() > kMaxListedParts) {
    obstacles.dense.push_back({object + 1, &geometry});
    return;
  }
  thread_local std::vector<std::uint32_t> found;
  found.clear();
  geometry.query(bounds, found);
  for (const std::uint32_t part : found) {
    Obstacle obstacle;
    obstacle.entity = object + 1;
    obstacle.part = part;
    obstacle.box = geometry.box(part);
    obstacle.convex = geometry.convex(part);
    obstacles.list.push_back(obstacle);
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

/// The same for dense objects; caches of parts outside of `bounds` are dropped.
void sortAndKeepDenseCaches(ObstacleSet& obstacles, ObstacleSet& last, const Aabb& bounds) {
  std::ranges::sort(obstacles.dense, {}, &DenseObject::entity);
  std::erase_if(last.denseCaches, [&](const auto& entry) {
    const DenseObject* object = obstacles.findDense(entry.first.entity);
    return !object || !overlaps(object->geometry->box(entry.first.part), bounds);
  });
  obstacles.denseCaches = std::move(last.denseCaches);
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

/// Calls each(index into Scene::solidObjects()) for every dense object that overlaps `box`.
template <class Each>
void forEachDenseIndex(const WorldData& world, const Aabb& box, const Each& each) {
  const Scene& scene = *world.scene;
  const std::vector<std::uint32_t>& dense = scene.denseIndices();
  if (dense.size() <= kMaxScannedDenseObjects) {
    for (const std::uint32_t i : dense)
      if (overlaps(box, scene.staticBoxes()[i])) each(i);
    return;
  }
  ENFILADE_ASSERT(std::ranges::is_sorted(dense));
  for (const collision::StaticId i : world.broadPhase.overlapStatic(box))
    if (std::ranges::binary_search(dense, i)) each(i);
}

/// True if the obstacles of earlier ticks suffice.
bool hasAllObstacles(const Avatar& avatar) {
  return !avatar.pairsChanged && contains(avatar.cachedBounds, avatar.motionBounds);
}

/// The cast of one part of an avatar's shape. Each hit shortens the rest of the motion.
class PartCast {
 public:
  PartCast(const AvatarPart& part, const Vec3& footPosition, const Vec3& displacement,
           const collision::ContactOffset& contactOffset, Vec3& rest, ShapeCastHit& hit,
           QueryCount& count)
      : part_(placeAvatarPart(part, footPosition)),
        start_(placeBox(part.box, footPosition)),
        displacement_(displacement),
        contactOffset_(contactOffset),
        rest_(rest),
        hit_(hit),
        count_(count),
        planes_(part_, rest, contactOffset.min) {
    updateSweptBox();
  }

  bool reaches(const Aabb& box) const { return overlaps(sweptBox_, box); }

  void castAgainst(EntityId entity, const collision::PlacedConvex& obstacle,
                   collision::FeatureCache& cache) {
    const collision::MotionResult result =
        collision::castShape(part_, rest_, obstacle, contactOffset_, cache);
    count_.add(result);
    const double fraction = hit_.fraction * result.lo;
    if (result.isClear() || (hit_.entity != 0 && fraction >= hit_.fraction)) return;
    hit_ = {fraction, entity, -result.separation.normal, result.separation.distance,
            result.separation};
    rest_ = fraction * displacement_;
    updateSweptBox();
    planes_.reduceTo(rest_, contactOffset_.min);
  }

  void castAgainst(const DenseObject& object, std::uint32_t avatarPart, DenseCaches& caches) {
    forEachNearPart(
        object, avatarPart, start_, planes_,
        [&](const Aabb& box) { return hit_.fraction > 0 && reaches(box); }, caches, count_,
        [&](const collision::PlacedConvex& obstacle, collision::FeatureCache& cache) {
          castAgainst(object.entity, obstacle, cache);
        });
  }

 private:
  void updateSweptBox() {
    sweptBox_ = inflate(collision::computeSweptAabb(start_, rest_), contactOffset_.rest);
  }

  const collision::PlacedConvex part_;
  const Aabb start_;
  const Vec3& displacement_;
  const collision::ContactOffset& contactOffset_;
  Vec3& rest_;
  ShapeCastHit& hit_;
  QueryCount& count_;
  collision::SeparatingPlanes planes_;
  Aabb sweptBox_;
};

}  // namespace

ShapeCastHit castAvatarShape(const AvatarShape& shape, const Vec3& footPosition,
                             const Vec3& displacement, ObstacleSet& obstacles,
                             const collision::ContactOffset& contactOffset, QueryCount& count) {
  ShapeCastHit hit;
  Vec3 rest = displacement;  // only the displacement before the earliest hit so far matters
  for (std::uint32_t i = 0; i < shape.parts.size(); ++i) {
    PartCast cast(shape.parts[i], footPosition, displacement, contactOffset, rest, hit, count);
    for (Obstacle& obstacle : obstacles.list) {
      if (!cast.reaches(obstacle.box)) continue;
      ++count.partsLookedAt;
      cast.castAgainst(obstacle.entity, obstacle.convex, obstacle.cacheFor(i));
      if (hit.fraction == 0) return hit;
    }
    for (const DenseObject& object : obstacles.dense) {
      cast.castAgainst(object, i, obstacles.denseCaches);
      if (hit.fraction == 0) return hit;
    }
  }
  return hit;
}

bool isClear(const AvatarShape& shape, const Vec3& footPosition, double clearance,
             ObstacleSet& obstacles, QueryCount& count, EntityId& nearest) {
  for (std::uint32_t i = 0; i < shape.parts.size(); ++i) {
    const Aabb box = inflate(placeBox(shape.parts[i].box, footPosition), clearance);
    const collision::PlacedConvex part = placeAvatarPart(shape.parts[i], footPosition);
    bool clear = true;
    const auto query = [&](EntityId entity, const collision::PlacedConvex& obstacle,
                           collision::FeatureCache& cache) {
      ++count.narrow;
      const auto separation = collision::computeSeparationWithin(part, obstacle, clearance, cache);
      if (!separation) return;
      if (separation->certificate == collision::Certificate::rational) ++count.rational;
      nearest = entity;
      clear = false;
    };
    for (Obstacle& obstacle : obstacles.list) {
      if (!overlaps(box, obstacle.box)) continue;
      ++count.partsLookedAt;
      query(obstacle.entity, obstacle.convex, obstacle.cacheFor(i));
      if (!clear) return false;
    }
    for (const DenseObject& object : obstacles.dense) {
      collision::SeparatingPlanes planes(part, Vec3::Zero(), clearance);
      forEachNearPart(
          object, i, box, planes, [&](const Aabb& other) { return clear && overlaps(box, other); },
          obstacles.denseCaches, count,
          [&](const collision::PlacedConvex& obstacle, collision::FeatureCache& cache) {
            query(object.entity, obstacle, cache);
          });
      if (!clear) return false;
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
  return inflate(Aabb{bounds.min - shapeBox.min, bounds.max - shapeBox.max}, -clearance);
}

void updateObstaclePose(const WorldData& world, Obstacle& obstacle) {
  if (obstacle.bodyIndex != kNoBody) {
    const Body& body = world.bodies[obstacle.bodyIndex];
    obstacle.box = getPartBox(body, obstacle.part);
    obstacle.convex = makePlacedPart(body, obstacle.part);
    // The box where the body will stand: the solver moves it after the avatars.
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
  return std::ranges::none_of(
      world.broadPhase.getDynamicOverlaps(avatar.proxy),
      [&](const collision::ProxyOverlap& overlap) { return mayMove(world, overlap.id); });
}

void refreshDynamicObstacles(const WorldData& world, Avatar& avatar) {
  for (std::size_t i = avatar.obstacles.list.size(); i-- > 0;) {
    Obstacle& obstacle = avatar.obstacles.list[i];
    // Avatars come last, bodies anywhere.
    if (!avatar.hasBodyObstacles && obstacle.entity < world.firstAvatarId()) return;
    updateObstaclePose(world, obstacle);
  }
}

void prefetchSurroundings(const WorldData& world) {
  const Scene& scene = *world.scene;
  if (scene.denseIndices().empty()) return;
  const auto ticksPerLook =
      static_cast<std::uint64_t>(std::max(1.0, kPrefetchSeconds / world.settings.tickDuration));
  std::vector<std::uint32_t> objects;
  for (const Avatar& avatar : world.avatars) {
    const bool isNew = avatar.cachedBounds.empty();
    if (!isNew && (world.tick + avatar.id) % ticksPerLook != 0) continue;
    const double distance =
        kPrefetchDistance + 2 * kPrefetchSeconds * avatar.desiredVelocity.norm();
    const Aabb around = inflate(avatar.motionBounds, distance);
    forEachDenseIndex(world, around,
                      [&](std::uint32_t i) { objects.push_back(scene.solidObjects()[i]); });
  }
  if (!objects.empty()) scene.prefetchCollisionGeometry(objects);
}

void prepareBodyObstacles(WorldData& world, const Avatar& avatar) {
  if (hasAllObstacles(avatar)) return;
  for (const auto& overlap : world.broadPhase.getDynamicOverlaps(avatar.proxy))
    if (const std::uint32_t body = world.findBodyByProxy(overlap.id); body != kNoBody)
      makePartBoxes(world.bodies[body]);
}

void collectObstacles(const WorldData& world, Avatar& avatar) {
  const bool complete = hasAllObstacles(avatar);
  avatar.pairsChanged = false;
  if (complete) return refreshDynamicObstacles(world, avatar);
  ObstacleSet& obstacles = avatar.obstacles;
  ObstacleSet last;
  std::swap(last, obstacles);
  avatar.hasBodyObstacles = false;
  avatar.cachedBounds = inflate(avatar.motionBounds, kCollectMargin);
  for (const auto& overlap : world.broadPhase.getOverlaps(avatar.proxy)) {
    if (!overlap.isDynamic) {
      collectStaticObstacles(*world.scene, world.scene->solidObjects()[overlap.id],
                             avatar.cachedBounds, obstacles);
    } else if (const std::uint32_t body = world.findBodyByProxy(overlap.id); body != kNoBody) {
      appendBodyParts(world, body, obstacles.list);
      avatar.hasBodyObstacles = true;
    } else {
      const Avatar& other = *world.findAvatarByProxy(overlap.id);
      for (std::uint32_t part = 0; part < other.shape->parts.size(); ++part) {
        obstacles.list.emplace_back();
        obstacles.list.back().entity = other.id;
        obstacles.list.back().part = part;
      }
    }
  }
  sortAndKeepCaches(obstacles.list, last.list);
  sortAndKeepDenseCaches(obstacles, last, avatar.cachedBounds);
  refreshDynamicObstacles(world, avatar);
}

ObstacleSet collectObstaclesInBox(const WorldData& world, const Aabb& box, EntityId except) {
  ObstacleSet obstacles;
  for (const collision::StaticId staticId : world.broadPhase.overlapStatic(box))
    collectStaticObstacles(*world.scene, world.scene->solidObjects()[staticId], box, obstacles);
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i)
    collectBodyObstacles(world, i, box, obstacles.list);
  for (const Avatar& other : world.avatars) {
    if (other.id == except) continue;
    for (std::uint32_t part = 0; part < other.shape->parts.size(); ++part) {
      Obstacle obstacle;
      obstacle.entity = other.id;
      obstacle.part = part;
      obstacle.box = placeBox(other.shape->parts[part].box, other.footPosition);
      obstacle.convex = placeAvatarPart(other.shape->parts[part], other.footPosition);
      if (overlaps(obstacle.box, box)) obstacles.list.push_back(obstacle);
    }
  }
  return obstacles;
}

}  // namespace enfilade::scene
