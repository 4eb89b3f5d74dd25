#include "scene/world/bodies/physics_bodies.hpp"

#include "collision/floating_point.hpp"

namespace enfilade::scene {
namespace {

PhysicsBody makePhysicsBody(const Body& body) {
  PhysicsBody physicsBody;
  for (const collision::Hull& hull : body.shape->parts)
    physicsBody.parts.push_back(makeConvexPart(hull));
  physicsBody.radius = body.shape->radius;
  physicsBody.motion.friction = body.spec->friction;
  physicsBody.motion.centre = body.position;
  physicsBody.motion.rotation = body.orientation;
  if (isDynamic(body.spec->kind)) {
    physicsBody.motion.inverseMass = 1 / body.shape->mass;
    physicsBody.motion.inertia = body.shape->inertia;
    physicsBody.motion.inverseInertia = body.shape->inertia.inverse();
    physicsBody.motion.restitution = body.spec->restitution;
    physicsBody.motion.velocity = body.velocity,
    physicsBody.motion.angularVelocity = body.angularVelocity;
  }
  updateTransform(physicsBody);
  return physicsBody;
}

/// Index of the physics body of an entity's part; `make` creates it on first use.
template <class Make>
std::uint32_t ensurePhysicsBody(DynamicBodies& dynamicBodies, EntityId entity, std::uint32_t part,
                                Make make) {
  const auto [entry, isNew] = dynamicBodies.physicsBodyByPart.try_emplace({entity, part}, 0);
  if (!isNew) return entry->second;
  if (dynamicBodies.freeSlots.empty()) {
    entry->second = static_cast<std::uint32_t>(dynamicBodies.physicsWorld.bodies.size());
    dynamicBodies.physicsWorld.bodies.emplace_back();
    dynamicBodies.entities.emplace_back();
    dynamicBodies.sceneBodyOf.push_back(kNoBody);
  } else {
    entry->second = dynamicBodies.freeSlots.back();
    dynamicBodies.freeSlots.pop_back();
  }
  dynamicBodies.physicsWorld.bodies[entry->second] = make();
  dynamicBodies.entities[entry->second] = entity;
  return entry->second;
}

/// Gives the physics body of an avatar's part its shape.
void assignShape(PhysicsBody& physicsBody, const std::shared_ptr<const collision::Hull>& hull) {
  physicsBody.hull = hull;
  physicsBody.parts = {makeConvexPart(*hull)};
  physicsBody.radius = hull->radius;
}

}  // namespace

std::uint32_t ensureSceneBody(WorldData& world, std::uint32_t body) {
  DynamicBodies& dynamicBodies = world.dynamicBodies;
  std::uint32_t& physicsBody = dynamicBodies.physicsBodyOf[body];
  if (physicsBody == kNoBody) {
    physicsBody = ensurePhysicsBody(dynamicBodies, world.bodies[body].id, 0,
                                    [&] { return makePhysicsBody(world.bodies[body]); });
    dynamicBodies.sceneBodyOf[physicsBody] = body;
  }
  return physicsBody;
}

PhysicsBody& findPhysicsBody(DynamicBodies& dynamicBodies, std::uint32_t body) {
  return dynamicBodies.physicsWorld.bodies[dynamicBodies.physicsBodyOf[body]];
}

std::uint32_t ensureStaticObject(WorldData& world, std::uint32_t object) {
  return ensurePhysicsBody(world.dynamicBodies, object + 1, 0,
                           [&] { return makeStaticBody(world.scene->collisionGeometry(object)); });
}

std::uint32_t ensureAvatarPart(WorldData& world, const Avatar& avatar, std::uint32_t index) {
  DynamicBodies& dynamicBodies = world.dynamicBodies;
  const AvatarPart& part = avatar.shape->parts[index];
  const std::uint32_t physicsBodyIndex =
      ensurePhysicsBody(dynamicBodies, avatar.id, index, [] { return PhysicsBody{}; });
  PhysicsBody& physicsBody = dynamicBodies.physicsWorld.bodies[physicsBodyIndex];
  const Vec3 before = physicsBody.position;
  if (physicsBody.hull != part.hull) {
    assignShape(physicsBody, part.hull);
    erasePairs(dynamicBodies.physicsWorld, physicsBodyIndex);
  }
  const collision::PlacedConvex placed = placeAvatarPart(part, avatar.footPosition);
  physicsBody.position = physicsBody.motion.centre = placed.translation;
  if (part.rotation != physicsBody.rotation)
    physicsBody.teleportedDistance += 2 * physicsBody.radius;
  physicsBody.rotation = part.rotation;
  physicsBody.motion.rotation = collision::Quat(part.rotation);
  physicsBody.teleportedDistance +=
      (physicsBody.position - before).norm() * collision::kRoundUpFactor;
  const Vec3& velocity = avatar.desiredVelocity;
  physicsBody.targetVelocity = velocity;
  physicsBody.maxPushForce = velocity.isZero(0) ? 0 : world.settings.maxPushForce;
  // A body in contact with a moving avatar does not sleep; with a resting one it may.
  physicsBody.preventsSleep =
      !(velocity.isZero(0) && avatar.lastDisplacement.isZero(0) && !changesShape(avatar));
  return physicsBodyIndex;
}

PhysicsBody makeInitialPhysicsBody(const WorldData& world, EntityId entity, std::uint32_t part) {
  if (const auto body = world.bodyIndexById.find(entity); body != world.bodyIndexById.end())
    return makePhysicsBody(world.bodies[body->second]);
  if (entity < world.firstAvatarId())
    return makeStaticBody(world.scene->collisionGeometry(entity - 1));
  PhysicsBody physicsBody;
  assignShape(physicsBody, world.findAvatar(entity)->shape->parts[part].hull);
  return physicsBody;
}

void wakeTouchingBodies(WorldData& world, const Avatar& avatar) {
  for (const Contact& contact : avatar.contacts) {
    const auto found = world.bodyIndexById.find(contact.other);
    if (found == world.bodyIndexById.end()) continue;
    Body& body = world.bodies[found->second];
    if (!isDynamic(body.spec->kind) || body.outOfWorld) continue;
    PhysicsBody& physicsBody = findPhysicsBody(world.dynamicBodies, found->second);
    body.asleep = physicsBody.asleep = false;
    physicsBody.sleepTimer = 0;
  }
}

void removeAvatarFromSolver(WorldData& world, const Avatar& avatar) {
  wakeTouchingBodies(world, avatar);
  DynamicBodies& dynamicBodies = world.dynamicBodies;
  const auto first = dynamicBodies.physicsBodyByPart.lower_bound({avatar.id, 0});
  const auto end = dynamicBodies.physicsBodyByPart.lower_bound({avatar.id + 1, 0});
  for (auto entry = first; entry != end; ++entry) {
    erasePairs(dynamicBodies.physicsWorld, entry->second);
    dynamicBodies.physicsWorld.bodies[entry->second] = {};
    dynamicBodies.entities[entry->second] = 0;
    dynamicBodies.freeSlots.push_back(entry->second);
  }
  dynamicBodies.physicsBodyByPart.erase(first, end);
}

}  // namespace enfilade::scene
