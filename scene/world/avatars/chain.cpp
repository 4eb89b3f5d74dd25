#include "scene/world/avatars/chain.hpp"

#include <algorithm>
#include <cmath>

#include "collision/motion/moving_pose.hpp"

namespace enfilade::scene {
namespace {

/// Greatest distance of a link's point from its frame's origin.
double radiusOf(const ChainLink& link) {
  return link.hull->radius;
}

/// The farthest that the joint's anchor or a point beyond gets from the joint at `link`'s origin.
double reachBeyond(const Chain& chain, std::size_t link) {
  double reach = radiusOf(chain.links[link]);
  for (std::size_t child = link + 1; child < chain.links.size(); ++child) {
    if (chain.links[child].parent != static_cast<std::int32_t>(link)) continue;
    const LinkJoint& joint = chain.links[child].joint;
    const bool slides = joint.kind == LinkJoint::Kind::prismatic;
    const double travel = slides ? std::max(std::abs(joint.low), std::abs(joint.high)) : 0;
    reach = std::max(reach, joint.anchor.norm() + travel + chain.links[child].reach);
  }
  return reach;
}

}  // namespace

Chain chainOf(const Spawn& order, const Mat3& avatarFromBase) {
  Chain chain;
  chain.avatarFromBase = avatarFromBase;
  chain.selfContact = order.selfContact;
  for (const Link& link : order.links) {
    ChainLink made;
    made.parent = link.parent;
    made.joint = link.joint;
    made.joint.axis = link.joint.axis.normalized();
    made.hull = std::make_shared<const collision::Hull>(collision::buildHull(link.points));
    made.value = made.target = link.value;
    chain.links.push_back(std::move(made));
  }
  for (std::size_t i = chain.links.size(); i-- > 0;) chain.links[i].reach = reachBeyond(chain, i);
  return chain;
}

std::vector<LinkPose> posesOf(const Chain& chain) {
  std::vector<LinkPose> poses;
  poses.reserve(chain.links.size());
  for (const ChainLink& link : chain.links) {
    LinkPose parent;
    parent.rotation = chain.avatarFromBase;
    if (link.parent >= 0) parent = poses[static_cast<std::size_t>(link.parent)];
    LinkPose pose;
    pose.axis = parent.rotation * link.joint.axis;
    pose.origin = parent.origin + parent.rotation * link.joint.anchor;
    if (link.joint.kind == LinkJoint::Kind::prismatic) {
      pose.rotation = parent.rotation;
      pose.origin += link.value * pose.axis;
    } else {
      pose.rotation = collision::turned(parent.rotation, link.value * pose.axis, 1);
    }
    poses.push_back(pose);
  }
  return poses;
}

std::shared_ptr<const AvatarShape> shapeWith(const std::vector<AvatarPart>& base,
                                             const Chain& chain) {
  std::vector<AvatarPart> parts = base;
  const std::vector<LinkPose> poses = posesOf(chain);
  for (std::size_t i = 0; i < poses.size(); ++i)
    parts.push_back(placedPart(chain.links[i].hull, poses[i].origin, poses[i].rotation));
  return shapeOf(std::move(parts));
}

bool moves(const Chain& chain, std::size_t joint, std::size_t link) {
  // Parents come before their links, so the walk to the base ends.
  for (auto at = static_cast<std::int32_t>(link); at >= 0;
       at = chain.links[static_cast<std::size_t>(at)].parent)
    if (at == static_cast<std::int32_t>(joint)) return true;
  return false;
}

double leverOf(const ChainLink& link) {
  return link.joint.kind == LinkJoint::Kind::revolute ? link.reach : 1;
}

double chainReach(const Chain& chain, double tick) {
  double reach = 0;
  for (const ChainLink& link : chain.links) {
    const double step = std::min(std::abs(link.target - link.value), chain.speed * tick);
    reach += step * leverOf(link);
  }
  return reach;
}

}  // namespace enfilade::scene
