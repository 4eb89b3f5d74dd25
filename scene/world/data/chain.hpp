// A kinematic chain: convex links on revolute and prismatic joints, as a tree on an avatar's base.
// This file has its data and forward kinematics; joint_motion.cpp moves it.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "scene/world/data/avatar_shape.hpp"
#include "scene/world/data/orders.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

struct ChainLink {
  std::int32_t parent = -1;
  LinkJoint joint;  ///< `axis` has unit length
  TurningHull turning;
  double maxRadius = 0;  ///< metres: bound on the distance of moved points from the joint

  double value = 0;   ///< radians or metres
  double target = 0;  ///< of the motion, in units of `value`
  EntityId blockedBy = 0;
};

struct Chain {
  std::vector<ChainLink> links;
  Mat3 avatarFromBase = Mat3::Identity();  ///< rotation by Spawn::facing
  bool selfContact = false;
  double speed = 0;        ///< rad/s or m/s; 0: not driven
  double timeoutLeft = 0;  ///< seconds
};

/// Pose of a link's frame; `rotation` is avatarFromLink.
struct LinkPose {
  Mat3 rotation = Mat3::Identity();
  Vec3 origin = Vec3::Zero();  ///< metres, avatar frame
  Vec3 axis = Vec3::UnitY();   ///< of its joint, unit length, avatar frame
};

/// Builds the chain of a spawn order that validateCommandFields() accepted.
Chain makeChain(const Spawn& order, const Mat3& avatarFromBase);

/// Forward kinematics: pose of a link for its current joint value and its parent's pose. The latter
/// is one of `before`, the poses of all links before it.
LinkPose computeLinkPose(const Chain& chain, std::size_t link, std::span<const LinkPose> before);

/// Shape of `base` and the links at their current poses; the parts of the base come first. Of the
/// chain only the extremal vertices change.
std::shared_ptr<const AvatarShape> makeChainShape(const std::vector<AvatarPart>& base, Chain& chain,
                                                  BoxWork& work);

/// As makeChainShape(), from the shape before a motion of the links in `moved` (bit i: link i). All
/// other parts and their boxes stay.
std::shared_ptr<const AvatarShape> updateChainShape(const AvatarShape& before, std::uint64_t moved,
                                                    Chain& chain, BoxWork& work);

/// Bound on the displacement of any point that the joint moves, metres per unit of its value.
double computeLeverArm(const ChainLink& link);

/// Bound on the displacement of any point of the chain in one tick of `tick` seconds, metres.
double computeMaxChainDisplacement(const Chain& chain, double tick);

}  // namespace enfilade::scene
