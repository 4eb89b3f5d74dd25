// The physics bodies of entities in the solver: created when first needed, updated and removed.
#pragma once

#include <cstdint>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// The physics body of an entity's part as it is when the solver first uses it. An avatar's part
/// has its hull, but no pose yet.
PhysicsBody makeInitialPhysicsBody(const WorldData& world, EntityId entity, std::uint32_t part);

/// Index of the physics body of `body`, an index into WorldData::bodies.
std::uint32_t ensureSceneBody(WorldData& world, std::uint32_t body);

/// Index of the physics body of an object of the model.
std::uint32_t ensureStaticObject(WorldData& world, std::uint32_t object);

/// Moves the physics body of an avatar's part to the avatar's pose, bit for bit. Returns its index.
std::uint32_t ensureAvatarPart(WorldData& world, const Avatar& avatar, std::uint32_t index);

/// The physics body of `body`, which must exist.
PhysicsBody& findPhysicsBody(DynamicBodies& dynamicBodies, std::uint32_t body);

/// Wakes the rigid bodies that touch an avatar; called when it moves or changes its shape.
void wakeTouchingBodies(WorldData& world, const Avatar& avatar);

/// Removes all physics bodies of an avatar.
void removeAvatarFromSolver(WorldData& world, const Avatar& avatar);

}  // namespace enfilade::scene
