#include "scene/world/queries/motion_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace enfilade::scene {

bool standsOnDynamicBody(const SceneAt& sceneAt, const AvatarSnapshot& avatar) {
  const BodySnapshot* ground = findBodySnapshot(sceneAt, avatar.groundEntity);
  return ground && isDynamic(sceneAt.scene().model().bodies[ground->index].kind);
}

double sumJointSpeeds(const AvatarSnapshot& avatar, const WorldSettings& settings) {
  double speed = settings.maxJointSpeed * avatar.turnRadius;
  for (const JointSnapshot& joint : avatar.joints) speed += settings.maxJointSpeed * joint.leverArm;
  return speed;
}

double computeBodySpeedLimit(const BodySpec& spec, double radius, const WorldSettings& settings) {
  if (isDynamic(spec.kind)) return std::numeric_limits<double>::infinity();
  if (isTrigger(spec.kind)) return 0;
  return std::max(settings.maxSpeed, spec.speed * computeMaxPointSpeed(spec, radius));
}

double computeAvatarSpeedLimit(const AvatarSnapshot& avatar, const WorldSettings& settings) {
  // Metres a tick: restored contact offsets, and a step of a grounded avatar.
  const double offsets = 16 * settings.contactOffset;
  const double grounded =
      2 * settings.maxSpeed + (settings.stepHeight + offsets) / settings.tickDuration;
  // A jump may rise faster than the limit of commands.
  const double jumping = settings.maxSpeed +
                         std::sqrt(2 * settings.gravity * settings.maxJumpHeight) +
                         offsets / settings.tickDuration;
  return std::max(grounded, jumping) + sumJointSpeeds(avatar, settings);
}

double computeGrowthLimit(const AvatarSnapshot& avatar) {
  return avatar.spawnHeight - avatar.height;
}

double computeAvatarSpeedWithin(const AvatarSnapshot& avatar, std::span<const AvatarPusher> pushers,
                                bool onDynamicBody, const WorldSettings& settings, double seconds) {
  const double ownSpeed = computeAvatarSpeedLimit(avatar, settings);
  const Aabb box = placeBoxOutward(avatar.shape->box, avatar.footPosition);
  // Bodies push and carry within the contact threshold; twice that exceeds the rounding of boxes.
  const double margin = computeGrowthLimit(avatar) + 2 * computeContactThreshold(settings);
  double speed = ownSpeed;
  // Each pass adds a pusher at least, because a faster avatar reaches all that a slower one does.
  for (std::size_t pass = 0; pass <= pushers.size(); ++pass) {
    double reached = ownSpeed;
    for (const AvatarPusher& pusher : pushers)
      if (onDynamicBody || computeGap(box, pusher.box) <= (speed + pusher.speed) * seconds + margin)
        reached += kMaxPushFactor * pusher.speed;
    if (!(reached > speed)) break;
    speed = reached;
  }
  return speed;
}

}  // namespace enfilade::scene
