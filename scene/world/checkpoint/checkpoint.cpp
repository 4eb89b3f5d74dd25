#include "scene/world/checkpoint/checkpoint.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "scene/model/hasher.hpp"
#include "scene/world/bodies/physics_bodies.hpp"
#include "scene/world/checkpoint/checkpoint_validation.hpp"
#include "scene/world/checkpoint/layouts.hpp"
#include "scene/world/contacts/obstacles.hpp"
#include "scene/world/data/validation.hpp"
#include "scene/world/tick.hpp"

namespace enfilade::scene {
namespace {

constexpr std::string_view kMagic = "EnfWorld";
constexpr std::size_t kWordBytes = 8;                                 // bytes
constexpr std::size_t kHeaderBytes = kMagic.size() + 3 * kWordBytes;  // version, scene hash, length
constexpr std::size_t kMinBytes = kHeaderBytes + kWordBytes;          // and the checksum

std::string toHexadecimal(std::uint64_t hash) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(hash));
  return text.data();
}

/// Hashes 8-byte words; every change of a single byte changes the result.
std::uint64_t computeChecksum(std::span<const std::uint8_t> bytes) {
  Hasher hash;
  hash.add(std::uint64_t{bytes.size()});
  for (std::size_t at = 0; at < bytes.size(); at += kWordBytes) {
    std::uint64_t word = 0;
    for (std::size_t i = at; i < std::min(at + kWordBytes, bytes.size()); ++i)
      word |= std::uint64_t{bytes[i]} << (8 * (i - at));
    hash.add(word);
  }
  return hash.value();
}

// ---- dynamic bodies ----------------------------------------------------------------------------

/// A static entity stands where it was first encountered and has no state.
bool isStaticEntity(const WorldData& world, EntityId entity) {
  return entity < world.firstAvatarId() && !world.bodyIndexById.contains(entity);
}

/// True if the physics body of an avatar's part has the avatar's current shape. An avatar that
/// crouched after the last encounter has another one.
bool hasCurrentShape(const WorldData& world, const PhysicsBody& body, EntityId entity,
                     std::uint32_t part) {
  return body.hull == world.findAvatar(entity)->shape->parts[part].hull;
}

/// Maximum number of physics bodies of the entity.
std::size_t countPhysicsParts(const WorldData& world, EntityId entity) {
  if (entity < world.firstAvatarId()) return entity == 0 ? 0 : 1;
  const Avatar* avatar = world.findAvatar(entity);
  return avatar ? avatar->shape->parts.size() : 0;
}

/// Creates the physics bodies at their old indices, without their state.
void restorePhysicsBodies(const Reader& a, WorldData& world) {
  DynamicBodies& dynamicBodies = world.dynamicBodies;
  const std::size_t count = dynamicBodies.physicsBodyByPart.size() + dynamicBodies.freeSlots.size();
  std::vector<PhysicsBody>& physicsBodies = dynamicBodies.physicsWorld.bodies;
  physicsBodies.clear();
  physicsBodies.resize(count);
  dynamicBodies.entities.assign(count, 0);
  dynamicBodies.partFronts.clear();
  dynamicBodies.sceneBodyOf.assign(count, kNoBody);
  dynamicBodies.physicsBodyOf.assign(world.bodies.size(), kNoBody);
  std::vector<std::uint8_t> claimed(count, 0);
  const auto claim = [&](std::uint32_t index) {
    if (index >= count || claimed[index] != 0) a.refuse("two physics bodies share an index");
    claimed[index] = 1;
  };
  for (const std::uint32_t index : dynamicBodies.freeSlots) claim(index);
  for (const auto& [key, index] : dynamicBodies.physicsBodyByPart) {
    const auto& [entity, part] = key;
    claim(index);
    if (part >= countPhysicsParts(world, entity)) a.refuse("a physics body belongs to no entity");
    physicsBodies[index] = makeInitialPhysicsBody(world, entity, part);
    dynamicBodies.entities[index] = entity;
    const auto body = world.bodyIndexById.find(entity);
    if (body == world.bodyIndexById.end()) continue;
    dynamicBodies.physicsBodyOf[body->second] = index;
    dynamicBodies.sceneBodyOf[index] = body->second;
  }
}

template <class A>
void archivePhysicsBody(A& a, MaybeConst<A, WorldData>& world, EntityId entity, std::uint32_t part,
                        MaybeConst<A, PhysicsBody>& body) {
  if (isStaticEntity(world, entity)) return;
  if (entity >= world.firstAvatarId()) {
    bool upToDate = hasCurrentShape(world, body, entity, part);
    a(upToDate);
    if constexpr (!A::kWrites)
      if (!upToDate) body = {};  // gets its shape at the next encounter
  }
  a(body);
}

/// Members that are not written follow from the scene and the written ones: `bodyIndices`,
/// `entities`, `sceneBodyOf`, `physicsBodyOf`. `partFronts` are not part of the state.
/// `activeBodies` are found before use, and `lastReport` is reported only in the tick that produced
/// it.
template <class A>
void archiveDynamicBodies(A& a, MaybeConst<A, WorldData>& world) {
  auto& [physicsWorld, bodyIndices, physicsBodyByPart, entities, freeSlots, sceneBodyOf,
         physicsBodyOf, activeBodies, partFronts, lastReport, avatarBodyPairs] =
      world.dynamicBodies;
  auto& [physicsBodies, pairs] = physicsWorld;
  a(physicsBodyByPart, freeSlots);
  if constexpr (!A::kWrites) restorePhysicsBodies(a, world);
  for (const auto& [key, index] : physicsBodyByPart)
    archivePhysicsBody(a, world, key.first, key.second, physicsBodies[index]);
  a(pairs);
}

// ---- the world ---------------------------------------------------------------------------------

template <class A>
void archiveProxyTable(A& a, MaybeConst<A, collision::SortAndSweep::ProxyTable>& table) {
  auto& [freeIds, removed, updated] = table;
  a(freeIds, removed, updated);
}

/// Restores the AABBs and owners of all proxies; the overlapping pairs follow.
void restoreProxies(const Reader& a, WorldData& world,
                    const collision::SortAndSweep::ProxyTable& table) {
  std::vector<std::pair<collision::ProxyId, Aabb>> active;
  for (const Body& body : world.bodies) active.emplace_back(body.proxy, body.motionBounds);
  for (const Avatar& avatar : world.avatars) active.emplace_back(avatar.proxy, avatar.motionBounds);
  if (table.updated != (world.tick > 0)) a.refuse("its proxies belong to another tick");
  try {
    world.broadPhase.restoreProxies(active, table);
  } catch (const std::invalid_argument& error) {
    a.refuse(error.what());
  }
  for (Avatar& avatar : world.avatars) world.setAvatarProxy(avatar, avatar.proxy);
}

/// Restores the pointers from an avatar's obstacles into their entities.
void restoreObstacles(WorldData& world) {
  for (Avatar& avatar : world.avatars) {
    for (DenseObject& object : avatar.obstacles.dense)
      object.geometry = &world.scene->collisionGeometry(object.entity - 1);
    for (Obstacle& obstacle : avatar.obstacles.list) {
      const auto body = world.bodyIndexById.find(obstacle.entity);
      if (body != world.bodyIndexById.end()) {
        obstacle.bodyIndex = body->second;
      } else if (obstacle.entity < world.firstAvatarId()) {
        const CollisionGeometry& geometry = world.scene->collisionGeometry(obstacle.entity - 1);
        obstacle.box = geometry.box(obstacle.part);
        obstacle.convex = geometry.convex(obstacle.part);
        continue;
      } else if (!world.findAvatar(obstacle.entity)) {
        continue;
      }
      updateObstaclePose(world, obstacle);
    }
  }
}

void archiveBodies(Writer& a, const std::vector<Body>& bodies) {
  a(bodies);
}
/// The bodies already exist, as in any world of the scene.
void archiveBodies(Reader& a, std::vector<Body>& bodies) {
  if (a.readCount() != bodies.size()) a.refuse("the scene has a different number of bodies");
  for (Body& body : bodies) a(body);
}

/// Not written: `scene` and `settings` create the world that is read into, with
/// `bodyIndexById`, `bodyIndexByName`, `kinematicBodies`, `triggers` and `bodyIndexByProxy`.
/// `excludedPairCache` and `movingBodies` are computed before use. `avatarByProxy` and `snapshot`
/// follow from the rest; `auditCursor` and `threads` are not part of the state.
template <class A>
void archiveWorld(A& a, MaybeConst<A, WorldData>& world) {
  auto& [scene, settings, tick, hash, pendingCommands, queuedOrderCount, queues, avatars,
         avatarNames, avatarIndices, pendingBodyCommands, bodies, bodyIndexById, bodyIndexByName,
         bodyContacts, excludedPairCache, kinematicBodies, triggers, movingBodies, dynamicBodies,
         broadPhase, avatarByProxy, bodyIndexByProxy, snapshot, auditCursor, threads] = world;
  a(tick, hash, queuedOrderCount, avatarNames, queues, pendingCommands, pendingBodyCommands);
  archiveBodies(a, bodies);
  a(avatars, bodyContacts);
  if constexpr (!A::kWrites) {
    validateAvatarOrder(world);
    world.linkAvatars();
    validateRestoredWorld(world);
  }
  archiveDynamicBodies(a, world);
  if constexpr (!A::kWrites) validateDynamicBodies(world);
  collision::SortAndSweep::ProxyTable table;
  if constexpr (A::kWrites) table = broadPhase.saveProxies();
  archiveProxyTable(a, table);
  if constexpr (!A::kWrites) restoreProxies(a, world, table);
}

}  // namespace

std::vector<std::uint8_t> makeCheckpoint(const World& world) {
  Writer content;
  content(world.settings());
  archiveWorld(content, world.data());
  Writer all;
  all.bytes.reserve(kMinBytes + content.bytes.size());
  all.bytes.assign(kMagic.begin(), kMagic.end());
  all.writeFixed64(kCheckpointVersion);
  all.writeFixed64(world.scene().hash());
  all.writeFixed64(content.bytes.size());
  all.bytes.insert(all.bytes.end(), content.bytes.begin(), content.bytes.end());
  all.writeFixed64(computeChecksum(all.bytes));
  return std::move(all.bytes);
}

void recomputeChecksum(std::vector<std::uint8_t>& bytes) {
  Writer sealed;
  sealed.bytes.assign(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(kWordBytes));
  sealed.writeFixed64(computeChecksum(sealed.bytes));
  bytes = std::move(sealed.bytes);
}

std::uint32_t readCheckpointVersion(std::span<const std::uint8_t> checkpoint) {
  if (checkpoint.size() < kMinBytes ||
      !std::equal(kMagic.begin(), kMagic.end(), checkpoint.begin()))
    return 0;
  return static_cast<std::uint32_t>(Reader(checkpoint.subspan(kMagic.size())).readFixed64());
}

World restoreWorld(std::shared_ptr<const Scene> scene, std::span<const std::uint8_t> checkpoint) {
  const auto word = [&](std::size_t at) { return Reader(checkpoint.subspan(at)).readFixed64(); };
  const std::uint32_t version = readCheckpointVersion(checkpoint);
  if (version == 0) throw CheckpointError("not a checkpoint of a world");
  if (version != kCheckpointVersion || word(kMagic.size()) != kCheckpointVersion)
    throw CheckpointError("the checkpoint has version " + std::to_string(version) +
                          "; this program reads version " + std::to_string(kCheckpointVersion));
  if (word(kMagic.size() + 2 * kWordBytes) != checkpoint.size() - kMinBytes)
    throw CheckpointError("the checkpoint is truncated, or extra data follows it");
  const auto checked = checkpoint.first(checkpoint.size() - kWordBytes);
  if (word(checked.size()) != computeChecksum(checked))
    throw CheckpointError("the checkpoint is damaged (its checksum differs)");
  if (word(kMagic.size() + kWordBytes) != scene->hash())
    throw CheckpointError("the checkpoint belongs to another scene: that has hash " +
                          toHexadecimal(word(kMagic.size() + kWordBytes)) + ", this one " +
                          toHexadecimal(scene->hash()));
  Reader content(checked.subspan(kHeaderBytes));
  content(content.settings);
  if (const auto error = validateWorldSettings(content.settings)) content.refuse(*error);
  World world(std::move(scene), content.settings);
  archiveWorld(content, world.data());
  if (content.remaining() > 0) content.refuse("extra data follows the world");
  restoreObstacles(world.data());
  world.data().snapshot.reset();  // its lists must not be reused
  world.data().snapshot = makeSnapshot(world.data());
  return world;
}

}  // namespace enfilade::scene
