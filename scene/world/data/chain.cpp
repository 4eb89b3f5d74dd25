#include "scene/world/data/chain.hpp"

#include <algorithm>
#include <cmath>

#include "collision/motion/moving_pose.hpp"

namespace enfilade::scene {
namespace {

/// Maximum distance of the link's points from the origin of its frame, metres.
double computeLinkRadius(const ChainLink& link) {
  return link.turning.hull->radius;
}

/// Bound on the distance of any point of `link` and its descendants from the link's origin, metres.
double computeMaxRadius(const Chain& chain, std::size_t link) {
  double maxRadius = computeLinkRadius(chain.links[link]);
  for (std::size_t child = link + 1; child < chain.links.size(); ++child) {
    if (chain.links[child].parent != static_cast<std::int32_t>(link)) continue;
    const LinkJoint& joint = chain.links[child].joint;
    const bool isPrismatic = joint.kind == LinkJoint::Kind::prismatic;
    const double travel = isPrismatic ? std::max(std::abs(joint.low), std::abs(joint.high)) : 0;
    maxRadius = std::max(maxRadius, joint.anchor.norm() + travel + chain.links[child].maxRadius);
  }
  return maxRadius;
}

/// Poses of all links for the current joint values.
std::vector<LinkPose> computeLinkPoses(const Chain& chain) {
  std::vector<LinkPose> poses;
  poses.reserve(chain.links.size());
  for (std::size_t i = 0; i < chain.links.size(); ++i)
    poses.push_back(computeLinkPose(chain, i, poses));
  return poses;
}

}  // namespace

Chain makeChain(const Spawn& order, const Mat3& avatarFromBase) {
  Chain chain;
  chain.avatarFromBase = avatarFromBase;
  chain.selfContact = order.selfContact;
  for (const Link& link : order.links) {
    ChainLink chainLink;
    chainLink.parent = link.parent;
    chainLink.joint = link.joint;
    chainLink.joint.axis = link.joint.axis.normalized();
    collision::Hull hull = collision::buildHull(link.points);
    const collision::AabbMethod method = collision::chooseAabbMethod(hull);
    chainLink.turning = makeTurningHull(std::move(hull), method);
    chainLink.value = chainLink.target = link.value;
    chain.links.push_back(std::move(chainLink));
  }
  for (std::size_t i = chain.links.size(); i-- > 0;)
    chain.links[i].maxRadius = computeMaxRadius(chain, i);
  return chain;
}

LinkPose computeLinkPose(const Chain& chain, std::size_t link, std::span<const LinkPose> before) {
  const ChainLink& own = chain.links[link];
  LinkPose parent;
  parent.rotation = chain.avatarFromBase;
  if (own.parent >= 0) parent = before[static_cast<std::size_t>(own.parent)];
  LinkPose pose;
  pose.axis = parent.rotation * own.joint.axis;
  pose.origin = parent.origin + parent.rotation * own.joint.anchor;
  if (own.joint.kind == LinkJoint::Kind::prismatic) {
    pose.rotation = parent.rotation;
    pose.origin += own.value * pose.axis;
  } else {
    pose.rotation = collision::integrateRotation(parent.rotation, own.value * pose.axis, 1);
  }
  return pose;
}

std::shared_ptr<const AvatarShape> makeChainShape(const std::vector<AvatarPart>& base, Chain& chain,
                                                  BoxWork& work) {
  std::vector<AvatarPart> parts = base;
  const std::vector<LinkPose> poses = computeLinkPoses(chain);
  for (std::size_t i = 0; i < poses.size(); ++i)
    parts.push_back(
        placeTurningHull(chain.links[i].turning, poses[i].origin, poses[i].rotation, work));
  return makeAvatarShape(std::move(parts));
}

std::shared_ptr<const AvatarShape> updateChainShape(const AvatarShape& before, std::uint64_t moved,
                                                    Chain& chain, BoxWork& work) {
  std::vector<AvatarPart> parts = before.parts;
  const std::vector<LinkPose> poses = computeLinkPoses(chain);
  const std::size_t base = parts.size() - poses.size();
  for (std::size_t i = 0; i < poses.size(); ++i)
    if ((moved >> i & 1) != 0)
      parts[base + i] =
          placeTurningHull(chain.links[i].turning, poses[i].origin, poses[i].rotation, work);
  return makeAvatarShape(std::move(parts));
}

double computeLeverArm(const ChainLink& link) {
  return link.joint.kind == LinkJoint::Kind::revolute ? link.maxRadius : 1;
}

double computeMaxChainDisplacement(const Chain& chain, double tick) {
  double displacement = 0;
  for (const ChainLink& link : chain.links) {
    const double step = std::min(std::abs(link.target - link.value), chain.speed * tick);
    displacement += step * computeLeverArm(link);
  }
  return displacement;
}

}  // namespace enfilade::scene
