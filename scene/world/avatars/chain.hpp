// A chain of links: convex pieces on revolute and prismatic joints, in a tree on an avatar's base.
// What a chain is and where its links are; joint_motion.cpp moves it.
#pragma once

#include <memory>
#include <vector>

#include "scene/world/avatars/avatar_shape.hpp"
#include "scene/world/avatars/orders.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

struct ChainLink {
  std::int32_t parent = -1;
  LinkJoint joint;  ///< its axis a unit vector
  std::shared_ptr<const collision::Hull> hull;
  double reach = 0;  ///< metres from the joint's axis that no point of what it moves exceeds, ever

  double value = 0;   ///< radians or metres
  double target = 0;  ///< where it is driven to
  EntityId stoppedBy = 0;
};

struct Chain {
  std::vector<ChainLink> links;
  Mat3 avatarFromBase = Mat3::Identity();  ///< as `facing` turned it
  bool selfContact = false;
  double speed = 0;         ///< radians or metres per second; 0: not driven
  double patienceLeft = 0;  ///< seconds
};

/// Where a link's frame is: `rotation` is avatarFromLink.
struct LinkPose {
  Mat3 rotation = Mat3::Identity();
  Vec3 origin = Vec3::Zero();  ///< metres, in the avatar's frame
  Vec3 axis = Vec3::UnitY();   ///< of its joint, unit, in the avatar's frame
};

/// The links of a spawn order that order_refusals.cpp found no fault in.
Chain chainOf(const Spawn& order, const Mat3& avatarFromBase);

/// Poses of all links for the joints' values.
std::vector<LinkPose> posesOf(const Chain& chain);

/// `base` and the links of the chain as they are now; the base's parts first.
std::shared_ptr<const AvatarShape> shapeWith(const std::vector<AvatarPart>& base,
                                             const Chain& chain);

/// Whether joint `joint` moves link `link`: it is the link itself or one it hangs on.
bool moves(const Chain& chain, std::size_t joint, std::size_t link);

/// Metres: no point that the joint moves goes farther as its value changes by 1.
double leverOf(const ChainLink& link);

/// Metres: no point of the chain moves farther in one tick of `tick` seconds.
double chainReach(const Chain& chain, double tick);

}  // namespace enfilade::scene
