// One tick of a driven chain. The joints move one after the other, starting at the base. Each joint
// moves its link and all descendants as one rigid body (rigid_step.hpp): a revolute joint by a
// rotational shape cast, a prismatic joint by a linear one. Each stops about one contact offset
// before an obstacle; the following joints still move.
#include "scene/world/avatars/joint_motion.hpp"

#include <algorithm>
#include <cmath>

#include "scene/world/avatars/rigid_step.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinProgressFraction = 1e-6;  // of a joint's step: minimum that counts as progress

RigidStep makeJointStep(const Avatar& avatar, std::size_t joint, double delta) {
  const Chain& chain = avatar.chain;
  const ChainLink& link = chain.links[joint];
  const LinkPose pose = computeLinkPoses(chain)[joint];
  RigidStep step;
  for (std::size_t i = joint; i < chain.links.size(); ++i)
    if (doesJointMoveLink(chain, joint, i))
      step.movedParts |= std::uint64_t{1} << (avatar.baseParts.size() + i);
  step.delta = delta;
  step.isRotation = link.joint.kind == LinkJoint::Kind::revolute;
  step.pivot = avatar.footPosition + pose.origin;
  step.axis = pose.axis;
  step.maxDisplacement = std::abs(delta) * (step.isRotation ? link.maxRadius : 1);
  return step;
}

/// Moves one joint by `delta`, or up to the first hit. Returns whether it made progress.
bool moveJoint(const WorldSettings& settings, Avatar& avatar, std::size_t joint, double delta,
               QueryCount& count) {
  ChainLink& link = avatar.chain.links[joint];
  const RigidStepHit hit =
      castRigidStep(settings, avatar, makeJointStep(avatar, joint, delta), count);
  link.blockedBy = hit.entity;
  recordStepHit(avatar, hit);
  const double before = link.value;
  const bool reachesTarget = hit.fraction == 1 && before + delta == link.target;
  link.value = reachesTarget ? link.target : before + hit.fraction * delta;
  if (link.value == before) return false;
  avatar.shape = makeChainShape(avatar.baseParts, avatar.chain);
  return hit.fraction > kMinProgressFraction;
}

}  // namespace

void moveJoints(const WorldData& world, Avatar& avatar, QueryCount& count) {
  Chain& chain = avatar.chain;
  const double maxDelta = chain.speed * world.settings.tickDuration;
  bool moved = false;
  for (std::size_t i = 0; i < chain.links.size(); ++i) {
    const double remaining = chain.links[i].target - chain.links[i].value;
    if (remaining == 0) continue;
    const double delta = std::max(-maxDelta, std::min(maxDelta, remaining));
    if (moveJoint(world.settings, avatar, i, delta, count)) moved = true;
  }
  chain.timeoutLeft =
      moved ? world.settings.stuckTimeout : chain.timeoutLeft - world.settings.tickDuration;
}

}  // namespace enfilade::scene
