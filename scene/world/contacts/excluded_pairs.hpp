// Excluded pairs: entities that a kinematic body touches or penetrates (d < 2 contactOffset, exact
// verdict) in its initial pose. Examples are a door and its frame, a lift and the shaft's floor, a
// cart and the ground. Such pairs report no contact and no near miss: the model was built that way.
// They depend on the scene alone and are computed on first use.
#pragma once

#include <vector>

#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// True if kinematic body `body` (index into Model::bodies) starts closer than `contact` metres to
/// `other`, a static object or another kinematic body.
bool isExcludedPair(const Scene& scene, std::uint32_t body, EntityId other, double contact);

/// All excluded partners of a body, ascending; empty if it is not kinematic.
std::vector<EntityId> findExcludedPartners(const Scene& scene, std::uint32_t body, double contact);

}  // namespace enfilade::scene
