// What a point lies in.
#pragma once

#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// Whether one of the object's closed solids holds `point` (scene frame, metres) or touches it.
bool holds(const ObjectParts& parts, const Vec3& point);

/// The first still object, in the order of the model, that holds `point`; 0: none does. Builds the
/// parts of objects whose box holds it.
EntityId solidAround(const Scene& scene, const Vec3& point);

}  // namespace enfilade::scene
