// Execution of the orders Jump, Fly, Crouch and DriveJoints.
#include "scene/world/avatars/immediate_orders.hpp"

#include <algorithm>
#include <cmath>

#include "scene/world/avatars/avatar_state.hpp"
#include "scene/world/bodies/physics_bodies.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

// Clearance for standing up, as a fraction of the contact offset. It is below the minimum gap to a
// touched obstacle, 7/8 (collision::ContactOffset), so that such an obstacle does not block.
constexpr double kHeadroomFraction = 0.75;

void startJump(Avatar& avatar, const Jump& jump, const WorldSettings& settings) {
  avatar.jumping = true;
  avatar.grounded = false;
  avatar.groundEntity = 0;
  avatar.fallSpeed = -std::sqrt(2 * settings.gravity * jump.height);
  avatar.walk = {};
  avatar.stalledInAirTime = 0;
}

void setPrismHeight(WorldData& world, Avatar& avatar, std::shared_ptr<const AvatarShape> shape,
                    double height) {
  wakeTouchingBodies(world, avatar);
  avatar.shape = std::move(shape);
  avatar.height = height;
  avatar.eyeHeight = computeEyeHeight(height);
  avatar.dirty = true;
}

/// The entity that overlaps the avatar with this shape; 0: none.
EntityId findBlockingEntity(OrderContext& context, const AvatarShape& shape) {
  const Avatar& avatar = *context.findAvatar();
  const double clearance = kHeadroomFraction * context.world.settings.contactOffset;
  const Aabb box = inflate(placeBox(shape.box, avatar.footPosition), 2 * clearance);
  ObstacleSet obstacles = collectObstaclesInBox(context.world, box, avatar.id);
  EntityId nearest = 0;
  return isClear(shape, avatar.footPosition, clearance, obstacles, context.count, nearest)
             ? 0
             : nearest;
}

/// Error of the order for this chain; "" if it is valid.
std::string validateJointTargets(const Chain& chain, const DriveJoints& drive) {
  if (chain.links.empty()) return "it has no joints; give links when it spawns";
  if (drive.targets.size() > chain.links.size())
    return "to has " + std::to_string(drive.targets.size()) + " values for " +
           std::to_string(chain.links.size()) + " joints";
  for (std::size_t i = 0; i < drive.targets.size(); ++i) {
    const LinkJoint& joint = chain.links[i].joint;
    if (!drive.targets[i] || (*drive.targets[i] >= joint.low && *drive.targets[i] <= joint.high))
      continue;
    return "to[" + std::to_string(i) + "] is " + formatShortNumber(*drive.targets[i]) +
           "; the joint's range is " + formatShortNumber(joint.low) + " to " +
           formatShortNumber(joint.high);
  }
  return "";
}

void startJointMotion(Chain& chain, const DriveJoints& drive, const WorldSettings& settings) {
  for (std::size_t i = 0; i < chain.links.size(); ++i) {
    ChainLink& link = chain.links[i];
    link.target = i < drive.targets.size() && drive.targets[i] ? *drive.targets[i] : link.value;
  }
  chain.speed = drive.speed;
  chain.timeoutLeft = settings.stuckTimeout;
}

bool haveJointsArrived(const Chain& chain) {
  return std::all_of(chain.links.begin(), chain.links.end(),
                     [](const ChainLink& link) { return link.value == link.target; });
}

std::string formatJointValues(const Chain& chain) {
  std::string text = "joints at [";
  for (const ChainLink& link : chain.links)
    text += (text.back() == '[' ? "" : ", ") + formatShortNumber(link.value);
  return text + "]";
}

EntityId findJointBlocker(const Chain& chain) {
  for (const ChainLink& link : chain.links)
    if (link.blockedBy != 0) return link.blockedBy;
  return 0;
}

void stopJoints(Chain& chain) {
  chain.speed = 0;
  for (ChainLink& link : chain.links) link.target = link.value;
}

}  // namespace

OrderStatus executeOrder(const Jump& jump, OrderContext& context) {
  Avatar& avatar = *context.findAvatar();
  if (!avatar.jumping) {
    if (avatar.flying || (!avatar.grounded && updateStalledInAir(avatar, context.world.settings))) {
      context.emitNotice(Notice::Kind::refused,
                         avatar.flying ? "it flies; end the flight first"
                                       : "it cannot jump: nothing below it is walkable");
      avatar.stalledInAirTime = 0;
      return OrderStatus::done;
    }
    if (!avatar.grounded) return OrderStatus::running;  // as after a spawn: wait until it lands
    startJump(avatar, jump, context.world.settings);
    return OrderStatus::running;
  }
  const bool stuck = !avatar.grounded && updateStalledInAir(avatar, context.world.settings);
  if (!avatar.grounded && !stuck) return OrderStatus::running;
  avatar.jumping = false;
  avatar.walk = {};
  if (stuck) {
    context.emitNotice(Notice::Kind::blocked, "stopped in the air without landing",
                       avatar.blockedBy);
  } else {
    context.emitNotice(Notice::Kind::done);
  }
  return OrderStatus::done;
}

OrderStatus executeOrder(const Fly& fly, OrderContext& context) {
  Avatar& avatar = *context.findAvatar();
  if (fly.on != avatar.flying) {
    avatar.flying = fly.on;
    avatar.grounded = false;  // it falls, at least by the contact offset
    avatar.groundEntity = 0;
    avatar.fallSpeed = 0;
    avatar.dirty = true;
  }
  context.emitNotice(Notice::Kind::done);
  return OrderStatus::done;
}

OrderStatus executeOrder(const Crouch& crouch, OrderContext& context) {
  Avatar& avatar = *context.findAvatar();
  const double height = crouch.height == 0 ? avatar.spawnHeight : crouch.height;
  if (avatar.spawnHeight == 0 || !avatar.chain.links.empty()) {
    context.emitNotice(Notice::Kind::refused,
                       "only a prism can crouch; this shape is made of parts");
    return OrderStatus::done;
  }
  if (!(height >= kMinCrouchFraction * avatar.spawnHeight && height <= avatar.spawnHeight)) {
    context.emitNotice(Notice::Kind::refused,
                       "height is " + formatShortNumber(height) + " m; give " +
                           formatShortNumber(kMinCrouchFraction * avatar.spawnHeight) + " to " +
                           formatShortNumber(avatar.spawnHeight) + " m");
    return OrderStatus::done;
  }
  auto shape = makePrismShape(avatar.radius, height, avatar.spawnHeight, context.world.settings);
  // The lower prism lies inside the higher one, so only growing can cause an overlap.
  const EntityId obstacle = height > avatar.height ? findBlockingEntity(context, *shape) : 0;
  if (obstacle != 0) {
    context.emitNotice(Notice::Kind::refused,
                       "there is no room to be " + formatShortNumber(height) + " m high", obstacle);
    return OrderStatus::done;
  }
  setPrismHeight(context.world, avatar, std::move(shape), height);
  context.emitNotice(Notice::Kind::done);
  return OrderStatus::done;
}

OrderStatus executeOrder(const DriveJoints& drive, OrderContext& context) {
  Chain& chain = context.findAvatar()->chain;
  if (chain.speed == 0) {
    if (const std::string error = validateJointTargets(chain, drive); !error.empty()) {
      context.emitNotice(Notice::Kind::refused, error);
      return OrderStatus::done;
    }
    startJointMotion(chain, drive, context.world.settings);
    if (!haveJointsArrived(chain)) return OrderStatus::running;
  }
  const bool arrived = haveJointsArrived(chain);
  if (!arrived && chain.timeoutLeft > kTimeTolerance) return OrderStatus::running;
  if (arrived) {
    context.emitNotice(Notice::Kind::done, formatJointValues(chain));
  } else {
    context.emitNotice(Notice::Kind::blocked, formatJointValues(chain), findJointBlocker(chain));
  }
  stopJoints(chain);
  return OrderStatus::done;
}

}  // namespace enfilade::scene
