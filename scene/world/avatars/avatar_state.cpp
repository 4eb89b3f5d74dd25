#include "scene/world/avatars/avatar_state.hpp"

#include <algorithm>
#include <cmath>

#include "scene/world/avatars/order_context.hpp"

namespace enfilade::scene {
namespace {

/// Hashes optional state: one word of flags, and the values that are in use.
void hashOptionalState(const Avatar& avatar, Hasher& hash) {
  const bool isCrouching = avatar.height != avatar.spawnHeight;
  hash.add(std::uint64_t{avatar.grounded} | std::uint64_t{avatar.flying} << 1 |
           std::uint64_t{avatar.jumping} << 2 | std::uint64_t{avatar.blockedReported} << 3 |
           std::uint64_t{isCrouching} << 4 | std::uint64_t{!avatar.chain.links.empty()} << 5 |
           std::uint64_t{avatar.viewHeld} << 6 | std::uint64_t{avatar.turn.rate > 0} << 7 |
           std::uint64_t{avatar.teleports} << 32);
  if (isCrouching) hash.add(avatar.height);
  if (avatar.turn.rate > 0) {
    hash.add(avatar.turn.heading);
    hash.add(avatar.turn.left);
    hash.add(avatar.turn.timeoutLeft);
  }
  // The initial facing is part of the commands, as the parts are.
  if (turnsShape(avatar) && avatar.facing != avatar.spawnOrder->facing) hash.add(avatar.facing);
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
  if (avatar.walk.calls != 0 || avatar.walk.waitsFor != 0)  // hashes of other walks stay the same
    hash.add((std::uint64_t{avatar.walk.calls} << 32) | avatar.walk.waitsFor);
  hash.add(avatar.waitTimeLeft);
  hash.add(avatar.stalledInAirTime);
  hashOptionalState(avatar, hash);
  for (const Contact& contact : avatar.contacts)
    hash.add((std::uint64_t{contact.other} << 1) | std::uint64_t{contact.touching});
}

double computeTurnRadius(const Avatar& avatar) {
  if (!turnsShape(avatar)) return 0;
  double radius = 0;
  const auto& parts = avatar.chain.links.empty() ? avatar.shape->parts : avatar.baseParts;
  if (avatar.spawnHeight == 0)
    for (const AvatarPart& part : parts) radius = std::max(radius, part.hull->radius);
  for (const ChainLink& link : avatar.chain.links) {
    if (link.parent >= 0) continue;
    const bool isPrismatic = link.joint.kind == LinkJoint::Kind::prismatic;
    const double travel =
        isPrismatic ? std::max(std::abs(link.joint.low), std::abs(link.joint.high)) : 0;
    radius = std::max(radius, link.joint.anchor.norm() + travel + link.maxRadius);
  }
  return radius;
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
  snapshot.facing = avatar.facing;
  snapshot.turnRadius = computeTurnRadius(avatar);
  snapshot.teleports = avatar.teleports;
  snapshot.lastStoppedTick = avatar.lastStoppedTick;
  return snapshot;
}

bool updateStalledInAir(Avatar& avatar, const WorldSettings& settings) {
  const bool moved = avatar.lastDisplacement.norm() > settings.contactOffset;
  avatar.stalledInAirTime = moved ? 0 : avatar.stalledInAirTime + settings.tickDuration;
  return avatar.stalledInAirTime >= settings.stuckTimeout - kTimeTolerance;
}

}  // namespace enfilade::scene
