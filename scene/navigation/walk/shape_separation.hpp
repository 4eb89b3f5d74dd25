// Exact separation of an entity and a hypothetical avatar shape, which is in no world.
#pragma once

#include <optional>

#include "scene/world/data/avatar_shape.hpp"
#include "scene/world/queries/entity_index.hpp"

namespace enfilade::scene {

/// The separation of `shape` at `footPosition` from an entity of a snapshot, from the shape to it.
/// nullopt: the entity is not solid, or too complex.
std::optional<collision::SeparationResult> computeSeparationFromShape(
    EntityIndex& index, const Snapshot& snapshot, std::shared_ptr<const AvatarShape> shape,
    const Vec3& footPosition, EntityId entity);

}  // namespace enfilade::scene
