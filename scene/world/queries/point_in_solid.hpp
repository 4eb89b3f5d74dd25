// Point-in-solid queries.
#pragma once

#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// True if one of the object's closed solids contains `point` (scene frame, metres) or touches it.
bool containsPoint(const CollisionGeometry& geometry, const Vec3& point);

/// The first static object, in model order, that contains `point`; 0: none. Builds the collision
/// geometry of objects whose AABB contains the point.
EntityId findObjectContaining(const Scene& scene, const Vec3& point);

}  // namespace enfilade::scene
