// One tick of a driven chain. The joints move one after the other, starting at the base. Each joint
// moves its link and all descendants as one rigid body (rigid_step.hpp). A revolute joint uses a
// rotational shape cast, a prismatic joint a linear one. Each stops about one contact offset before
// an obstacle; the following joints still move.
#include "scene/world/avatars/joint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "scene/world/avatars/rigid_step.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinProgressFraction = 1e-6;  // of a joint's step: minimum that counts as progress

/// The link of the joint and its descendants; bit i: link i.
std::uint64_t findMovedLinks(const Chain& chain, std::size_t joint) {
  std::uint64_t moved = std::uint64_t{1} << joint;
  for (std::size_t i = joint + 1; i < chain.links.size(); ++i)  // parents come before their links
    if (const std::int32_t parent = chain.links[i].parent; parent >= 0)
      moved |= (moved >> parent & 1) << i;
  return moved;
}

RigidStep makeJointStep(const Avatar& avatar, std::size_t joint, const LinkPose& pose,
                        double delta) {
  const Chain& chain = avatar.chain;
  const ChainLink& link = chain.links[joint];
  RigidStep step;
  step.movedParts = findMovedLinks(chain, joint) << avatar.baseParts.size();
  step.delta = delta;
  step.isRotation = link.joint.kind == LinkJoint::Kind::revolute;
  step.pivot = avatar.footPosition + pose.origin;
  step.axis = pose.axis;
  step.maxDisplacement = std::abs(delta) * (step.isRotation ? link.maxRadius : 1);
  return step;
}

/// The motion of a chain within a tick. The shape, with the boxes of the links, follows the joints
/// only where an obstacle is in reach, and at the end.
class ChainMotion {
 public:
  ChainMotion(const WorldSettings& settings, Avatar& avatar, QueryCount& count)
      : settings_(settings), avatar_(avatar), count_(count) {
    poses_.reserve(avatar.chain.links.size());
  }

  /// Moves the next joint by up to `maxDelta` towards its target, or up to the first hit. Returns
  /// whether it made progress.
  bool moveNextJoint(double maxDelta) {
    const std::size_t joint = poses_.size();
    const ChainLink& link = avatar_.chain.links[joint];
    poses_.push_back(computeLinkPose(avatar_.chain, joint, poses_));
    const double remaining = link.target - link.value;
    if (remaining == 0) return false;
    const double before = link.value;
    const bool moved = moveJoint(joint, std::max(-maxDelta, std::min(maxDelta, remaining)));
    if (link.value != before) poses_[joint] = computeLinkPose(avatar_.chain, joint, poses_);
    return moved;
  }

  void updateShape() {
    if (movedLinks_ == 0) return;
    avatar_.shape = updateChainShape(*avatar_.shape, movedLinks_, avatar_.chain, avatar_.boxWork);
    movedLinks_ = 0;
    displacement_ = 0;
  }

 private:
  bool moveJoint(std::size_t joint, double delta) {
    ChainLink& link = avatar_.chain.links[joint];
    const RigidStep step = makeJointStep(avatar_, joint, poses_[joint], delta);
    const RigidStepHit hit = castStep(step);
    link.blockedBy = hit.entity;
    recordStepHit(avatar_, hit);
    const double before = link.value;
    const bool reachesTarget = hit.fraction == 1 && before + delta == link.target;
    link.value = reachesTarget ? link.target : before + hit.fraction * delta;
    if (link.value == before) return false;
    movedLinks_ |= step.movedParts >> avatar_.baseParts.size();
    displacement_ += step.maxDisplacement;
    return hit.fraction > kMinProgressFraction;
  }

  /// One box for all parts that a step moves: their boxes before the motion, and how far they have
  /// come since. One contact offset is the cast's, another exceeds all rounding.
  Aabb computeReach(const RigidStep& step) const {
    Aabb box;
    for (std::size_t part = 0; part < avatar_.shape->parts.size(); ++part)
      if ((step.movedParts >> part & 1) != 0) box.include(avatar_.shape->parts[part].box);
    return inflate(placeBox(box, avatar_.footPosition),
                   displacement_ + step.maxDisplacement + 2 * settings_.contactOffset);
  }

  RigidStepHit castStep(const RigidStep& step) {
    if (!mayHit(avatar_, computeReach(step))) return {};
    updateShape();
    return castRigidStep(settings_, avatar_, step, count_);
  }

  const WorldSettings& settings_;
  Avatar& avatar_;
  QueryCount& count_;
  std::vector<LinkPose> poses_;   ///< of the links up to the joint that moves: those after it wait
  std::uint64_t movedLinks_ = 0;  ///< since `shape` was made; bit i: link i
  double displacement_ = 0;       ///< metres: bound for every point of them
};

}  // namespace

void moveJoints(const WorldData& world, Avatar& avatar, QueryCount& count) {
  Chain& chain = avatar.chain;
  const double maxDelta = chain.speed * world.settings.tickDuration;
  ChainMotion motion(world.settings, avatar, count);
  bool moved = false;
  for (std::size_t i = 0; i < chain.links.size(); ++i)
    if (motion.moveNextJoint(maxDelta)) moved = true;
  motion.updateShape();
  chain.timeoutLeft =
      moved ? world.settings.stuckTimeout : chain.timeoutLeft - world.settings.tickDuration;
}

}  // namespace enfilade::scene
