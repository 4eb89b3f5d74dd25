#include "scene/world/avatars/avatar_state.hpp"

namespace enfilade::scene {
namespace {

/// Hashes optional state: one word of flags, and the values that are in use.
void hashOptionalState(const Avatar& avatar, Hasher& hash) {
  const bool isCrouching = avatar.height != avatar.spawnHeight;
  hash.add(std::uint64_t{avatar.grounded} | std::uint64_t{avatar.flying} << 1 |
           std::uint64_t{avatar.jumping} << 2 | std::uint64_t{avatar.blockedReported} << 3 |
           std::uint64_t{isCrouching} << 4 | std::uint64_t{!avatar.chain.links.empty()} << 5);
  if (isCrouching) hash.add(avatar.height);
  if (avatar.chain.links.empty()) return;
  hash.add(avatar.chain.speed);
  hash.add(avatar.chain.timeoutLeft);
  for (const ChainLink& link : avatar.chain.links) {
    hash.add(link.value);
    hash.add(link.target);
  }
}

}  // namespace

void hashAvatar(const Avatar& avatar, Hasher& hash) {
  hash.add(std::uint64_t{avatar.id});
  hash.add(avatar.footPosition);
  hash.add(avatar.viewDirection);
  hash.add(avatar.fallSpeed);
  hash.add(std::uint64_t{avatar.groundEntity});
  hash.add(avatar.driveVelocity);
  hash.add(std::uint64_t{avatar.walk.waypointIndex});
  hash.add(avatar.walk.minDistance);
  hash.add(avatar.walk.timeoutLeft);
  hash.add(avatar.waitTimeLeft);
  hash.add(avatar.stalledInAirTime);
  hashOptionalState(avatar, hash);
  for (const Contact& contact : avatar.contacts)
    hash.add((std::uint64_t{contact.other} << 1) | std::uint64_t{contact.touching});
}

AvatarSnapshot makeAvatarSnapshot(const Avatar& avatar) {
  AvatarSnapshot snapshot;
  snapshot.id = avatar.id;
  snapshot.name = avatar.name;
  snapshot.footPosition = avatar.footPosition;
  snapshot.viewDirection = avatar.viewDirection;
  snapshot.eyeHeight = avatar.eyeHeight;
  snapshot.grounded = avatar.grounded;
  snapshot.shape = avatar.shape;
  snapshot.flying = avatar.flying;
  snapshot.groundEntity = avatar.groundEntity;
  snapshot.height = avatar.height;
  snapshot.spawnHeight = avatar.spawnHeight;
  snapshot.move = {avatar.requestedDisplacement, avatar.lastDisplacement, avatar.blockedBy,
                   avatar.blockingHit};
  for (const ChainLink& link : avatar.chain.links)
    snapshot.joints.push_back({link.value, link.blockedBy, computeLeverArm(link)});
  return snapshot;
}

}  // namespace enfilade::scene
