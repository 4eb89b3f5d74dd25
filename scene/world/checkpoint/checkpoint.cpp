#include "scene/world/checkpoint/checkpoint.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "scene/world/checkpoint/checkpoint_validation.hpp"
#include "scene/world/checkpoint/layouts.hpp"

namespace enfilade::scene {
namespace {

constexpr std::string_view kMagic = "EnfWorld";
constexpr std::size_t kWord = 8;                          // bytes
constexpr std::size_t kHead = kMagic.size() + 3 * kWord;  // version, scene, length
constexpr std::size_t kLeastSize = kHead + kWord;         // and the checksum

std::string hexadecimal(std::uint64_t hash) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(hash));
  return text.data();
}

/// Of bytes in words of eight; any single byte that changes changes it.
std::uint64_t checksumOf(std::span<const std::uint8_t> bytes) {
  Hasher hash;
  hash.add(std::uint64_t{bytes.size()});
  for (std::size_t at = 0; at < bytes.size(); at += kWord) {
    std::uint64_t word = 0;
    for (std::size_t i = at; i < std::min(at + kWord, bytes.size()); ++i)
      word |= std::uint64_t{bytes[i]} << (8 * (i - at));
    hash.add(word);
  }
  return hash.value();
}

// ---- free bodies -------------------------------------------------------------------------------

/// Its name may have gone to another one since.
bool isThere(const WorldState& world, EntityId avatar) {
  const auto at = world.avatars.find(world.avatarNames[avatar - world.firstAvatarId()]);
  return at != world.avatars.end() && at->second.id == avatar;
}

/// It stands where it was when it was first met, and nothing is known of it.
bool isStill(const WorldState& world, EntityId entity) {
  return entity < world.firstAvatarId() && !world.bodyOfId.contains(entity);
}

/// Whether the solid of an avatar's part has the shape that the avatar has now: one that crouched
/// since then it was last met has another.
bool isUpToDate(const WorldState& world, const Solid& solid, EntityId entity, std::uint32_t part) {
  const std::string& name = world.avatarNames[entity - world.firstAvatarId()];
  return solid.hull == world.avatars.at(name).shape->parts[part].hull;
}

/// How many solids the entity may have.
std::size_t partsWithSolids(const WorldState& world, EntityId entity) {
  if (entity < world.firstAvatarId()) return entity == 0 ? 0 : 1;
  const std::size_t number = entity - world.firstAvatarId();
  if (number >= world.avatarNames.size()) return 0;
  const auto avatar = world.avatars.find(world.avatarNames[number]);
  if (avatar == world.avatars.end() || avatar->second.id != entity) return 0;
  return avatar->second.shape->parts.size();
}

/// Solids without their state, at the indices that they had.
void makeSolids(const Reader& a, WorldState& world) {
  RigidStage& stage = world.rigids;
  const std::size_t count = stage.solids.size() + stage.vacant.size();
  std::vector<Solid>& solids = stage.dynamics.solids;
  solids.clear();
  solids.resize(count);
  stage.entities.assign(count, 0);
  stage.bodyOf.assign(count, kNoRigid);
  stage.solidOf.assign(world.bodies.size(), kNoRigid);
  std::vector<std::uint8_t> taken(count, 0);
  const auto take = [&](std::uint32_t index) {
    if (index >= count || taken[index] != 0) a.refuse("two solids are one");
    taken[index] = 1;
  };
  for (const std::uint32_t index : stage.vacant) take(index);
  for (const auto& [key, index] : stage.solids) {
    const auto& [entity, part] = key;
    take(index);
    if (part >= partsWithSolids(world, entity)) a.refuse("a solid is of nobody");
    solids[index] = unmetSolid(world, entity, part);
    stage.entities[index] = entity;
    const auto body = world.bodyOfId.find(entity);
    if (body == world.bodyOfId.end()) continue;
    stage.solidOf[body->second] = index;
    stage.bodyOf[index] = body->second;
  }
}

template <class A>
void archiveSolid(A& a, Held<A, WorldState>& world, EntityId entity, std::uint32_t part,
                  Held<A, Solid>& solid) {
  if (isStill(world, entity)) return;
  if (entity >= world.firstAvatarId()) {
    bool upToDate = isUpToDate(world, solid, entity, part);
    a(upToDate);
    if constexpr (!A::kWrites)
      if (!upToDate) solid = {};  // gets its shape when it is met next
  }
  a(solid);
}

/// What is not written follows from the scene and from what is: `bodies`, `bodyAt`, `entities`,
/// `bodyOf`, `solidOf`; who works is no part of the state; `seeds` are found before they are asked
/// for, and `last` is only told in the tick that made it.
template <class A>
void archiveRigids(A& a, Held<A, WorldState>& world) {
  auto& [dynamics, bodies, solidOfEntity, entities, vacant, bodyOf, solidOf, bodyAt, workers,
         workersAsked, threads, seeds, last, metByAvatars] = world.rigids;
  auto& [solids, joints, pairs] = dynamics;
  if (!joints.empty()) throw std::logic_error("a world has joints, which no checkpoint tells");
  a(solidOfEntity, vacant);
  if constexpr (!A::kWrites) makeSolids(a, world);
  for (const auto& [key, index] : solidOfEntity)
    archiveSolid(a, world, key.first, key.second, solids[index]);
  a(pairs);
}

// ---- the world ---------------------------------------------------------------------------------

template <class A>
void archiveRoll(A& a, Held<A, collision::SortAndSweep::Roll>& roll) {
  auto& [free, leaving, updated] = roll;
  a(free, leaving, updated);
}

/// Boxes, and who is whose; the pairs follow.
void restoreMovers(const Reader& a, WorldState& world, const collision::SortAndSweep::Roll& roll) {
  std::vector<std::pair<collision::MoverId, Box>> there;
  for (const Body& body : world.bodies) there.emplace_back(body.mover, body.reach);
  for (const auto& [name, avatar] : world.avatars) {
    there.emplace_back(avatar.mover, avatar.reach);
    world.avatarOfMover[avatar.mover] = name;
  }
  if (roll.updated != (world.tick > 0)) a.refuse("its boxes are of another tick");
  try {
    world.broadPhase.restore(there, roll);
  } catch (const std::invalid_argument& why) {
    a.refuse(why.what());
  }
}

/// What is near an avatar points at what it is part of.
void relateObstacles(WorldState& world) {
  for (auto& [name, avatar] : world.avatars) {
    for (Obstacle& obstacle : avatar.obstacles) {
      const auto body = world.bodyOfId.find(obstacle.entity);
      if (body != world.bodyOfId.end()) {
        obstacle.ofBody = body->second;
      } else if (obstacle.entity < world.firstAvatarId()) {
        const ObjectParts& parts = world.scene->parts(obstacle.entity - 1);
        obstacle.box = parts.box(obstacle.part);
        obstacle.body = parts.body(obstacle.part);
        continue;
      } else if (!isThere(world, obstacle.entity)) {
        continue;
      }
      placeObstacle(world, obstacle);
    }
  }
}

void archiveBodies(Writer& a, const std::vector<Body>& bodies) {
  a(bodies);
}
/// They are there already, as in any world of the scene.
void archiveBodies(Reader& a, std::vector<Body>& bodies) {
  if (a.count() != bodies.size()) a.refuse("the scene has another number of bodies");
  for (Body& body : bodies) a(body);
}

/// Not written: `scene` and `lengths` make the world that is read into; `bodyOfId`, `kinematics`,
/// `triggers`, `bodyOfMover` come with it; `mounted` and `goingBodies` are found before they are
/// asked for; `avatarOfMover` and `snapshot` follow from the rest; `audit` is no part of the state.
template <class A>
void archiveWorld(A& a, Held<A, WorldState>& world) {
  auto& [scene, lengths, ticks, hash, incoming, waiting, queues, avatars, avatarNames,
         incomingForBodies, bodies, bodyOfId, bodyContacts, mounted, kinematics, triggers,
         goingBodies, rigids, broadPhase, avatarOfMover, bodyOfMover, snapshot, audit] = world;
  a(ticks, hash, waiting, avatarNames, queues, incoming, incomingForBodies);
  archiveBodies(a, bodies);
  a(avatars, bodyContacts);
  if constexpr (!A::kWrites) checkRead(world);
  archiveRigids(a, world);
  if constexpr (!A::kWrites) checkRigids(world);
  collision::SortAndSweep::Roll roll;
  if constexpr (A::kWrites) roll = broadPhase.roll();
  archiveRoll(a, roll);
  if constexpr (!A::kWrites) restoreMovers(a, world, roll);
}

}  // namespace

std::vector<std::uint8_t> checkpointOf(const World& world) {
  Writer content;
  content(world.lengths());
  archiveWorld(content, world.state());
  Writer all;
  all.bytes.reserve(kLeastSize + content.bytes.size());
  all.bytes.assign(kMagic.begin(), kMagic.end());
  all.fixed(kCheckpointVersion);
  all.fixed(world.scene().hash());
  all.fixed(content.bytes.size());
  all.bytes.insert(all.bytes.end(), content.bytes.begin(), content.bytes.end());
  all.fixed(checksumOf(all.bytes));
  return std::move(all.bytes);
}

void sealCheckpoint(std::vector<std::uint8_t>& bytes) {
  Writer sealed;
  sealed.bytes.assign(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(kWord));
  sealed.fixed(checksumOf(sealed.bytes));
  bytes = std::move(sealed.bytes);
}

std::uint32_t checkpointVersion(std::span<const std::uint8_t> checkpoint) {
  if (checkpoint.size() < kLeastSize ||
      !std::equal(kMagic.begin(), kMagic.end(), checkpoint.begin()))
    return 0;
  return static_cast<std::uint32_t>(Reader(checkpoint.subspan(kMagic.size())).fixed());
}

World worldFrom(std::shared_ptr<const Scene> scene, std::span<const std::uint8_t> checkpoint) {
  const auto word = [&](std::size_t at) { return Reader(checkpoint.subspan(at)).fixed(); };
  const std::uint32_t version = checkpointVersion(checkpoint);
  if (version == 0) throw CheckpointError("this is no checkpoint of a world");
  if (version != kCheckpointVersion || word(kMagic.size()) != kCheckpointVersion)
    throw CheckpointError("the checkpoint is of version " + std::to_string(version) +
                          "; this program reads version " + std::to_string(kCheckpointVersion));
  if (word(kMagic.size() + 2 * kWord) != checkpoint.size() - kLeastSize)
    throw CheckpointError("the checkpoint is cut off, or something follows it");
  const auto checked = checkpoint.first(checkpoint.size() - kWord);
  if (word(checked.size()) != checksumOf(checked))
    throw CheckpointError("the checkpoint is not as it was written (its checksum differs)");
  if (word(kMagic.size() + kWord) != scene->hash())
    throw CheckpointError("the checkpoint is of another scene: that has hash " +
                          hexadecimal(word(kMagic.size() + kWord)) + ", this one " +
                          hexadecimal(scene->hash()));
  Reader content(checked.subspan(kHead));
  content(content.lengths);
  if (const auto why = lengthsProblem(content.lengths)) content.refuse(*why);
  World world(std::move(scene), content.lengths);
  archiveWorld(content, world.state());
  if (content.left() > 0) content.refuse("something follows the world");
  relateObstacles(world.state());
  world.state().snapshot.reset();  // its views may not be taken over
  world.state().snapshot = makeSnapshot(world.state());
  return world;
}

}  // namespace enfilade::scene
