// Obstacles of an avatar in a tick: hulls and triangles of static objects, parts of bodies, hulls
// of other avatars. Also the avatar's shape casts against them.
#pragma once

#include <vector>

#include "collision/motion/shape_cast.hpp"
#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Earliest hit of a shape cast.
struct ShapeCastHit {
  double fraction = 1;                     ///< 0..1 of the displacement that is free
  EntityId entity = 0;                     ///< 0: no hit
  Vec3 normal = Vec3::Zero();              ///< unit, from the obstacle to the avatar
  double distance = 0;                     ///< metres, at the hit
  collision::SeparationResult separation;  ///< from the avatar to the obstacle
};

/// Casts the shape at `footPosition` by `displacement` against `obstacles`.
ShapeCastHit castAvatarShape(const AvatarShape& shape, const Vec3& footPosition,
                             const Vec3& displacement, ObstacleSet& obstacles,
                             const collision::ContactOffset& contactOffset, QueryCount& count);

/// True if the shape at `footPosition` keeps at least `clearance` metres from every obstacle.
/// Otherwise `nearest` is an entity that is closer (not necessarily the closest).
bool isClear(const AvatarShape& shape, const Vec3& footPosition, double clearance,
             ObstacleSet& obstacles, QueryCount& count, EntityId& nearest);

/// A move stops at a distance of about `rest`; only an obstacle that would come closer than `min`
/// stops it.
inline collision::ContactOffset makeContactOffset(const WorldSettings& settings) {
  return {7.0 / 8 * settings.contactOffset, (1 + 1.0 / 32) * settings.contactOffset};
}

/// Fraction of a displacement, 0..1, that keeps the feet inside `footBounds`.
double computeClipFraction(const Aabb& footBounds, const Vec3& footPosition,
                           const Vec3& displacement);

/// Region that the feet must not leave in this tick, so that the avatar stays inside its motion
/// bounds, with the displacement of its joints.
Aabb computeAvatarFootBounds(const WorldSettings& settings, const Avatar& avatar);

/// Has the collision geometry around avatars built before they get there. Looks around each avatar
/// about once a second, and at those that spawned.
void prefetchSurroundings(const WorldData& world);

/// Makes the boxes of parts of bodies that the next collectObstacles() of the avatar needs. It
/// changes the bodies, so avatars are prepared one by one.
void prepareBodyObstacles(WorldData& world, const Avatar& avatar);

/// Collects the obstacles inside the avatar's motion bounds, unless the cached ones suffice.
/// Changes the avatar alone.
void collectObstacles(const WorldData& world, Avatar& avatar);

/// All obstacles that overlap `box`, without the avatar `except`.
ObstacleSet collectObstaclesInBox(const WorldData& world, const Aabb& box, EntityId except);

/// True if none of the avatar's neighbours in the broad phase moved or can move in this tick.
bool areNeighboursStationary(const WorldData& world, const Avatar& avatar);

/// Updates the cached obstacles of avatars and bodies to their current poses.
void refreshDynamicObstacles(const WorldData& world, Avatar& avatar);

/// Moves an obstacle of an avatar or body to its current pose; static ones stay unchanged.
void updateObstaclePose(const WorldData& world, Obstacle& obstacle);

}  // namespace enfilade::scene
