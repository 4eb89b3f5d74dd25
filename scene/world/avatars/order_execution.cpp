// The avatars' order queues. Commands are enqueued; the front order of each queue runs until it is
// done. An order that takes no time ends in the tick in which it starts, and the next one starts. A
// Capture holds the avatar for its tick, so that the image shows the requested position.
#include "scene/world/avatars/order_execution.hpp"

#include <algorithm>
#include <cmath>

#include "scene/model/rotation.hpp"
#include "scene/world/avatars/avatar_motion.hpp"
#include "scene/world/avatars/avatar_state.hpp"
#include "scene/world/avatars/immediate_orders.hpp"
#include "scene/world/avatars/order_context.hpp"
#include "scene/world/avatars/spawn.hpp"
#include "scene/world/avatars/turning.hpp"
#include "scene/world/avatars/walk_bodies.hpp"
#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/avatars/yielding.hpp"
#include "scene/world/bodies/physics_bodies.hpp"
#include "scene/world/contacts/avatar_contacts.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinProgress = 0.01;               // metres; less for slow walks
constexpr double kMaxAvatarDepthBelowScene = 10;    // metres below the lowest point of the scene
constexpr double kMaxAvatarDistanceOutside = 1000;  // metres beyond the scene's bounds

/// Distance to `goal`, metres: horizontal, or in space for a flying avatar.
double computeRemainingDistance(const Avatar& avatar, const Vec3& goal) {
  return avatar.flying ? (goal - avatar.footPosition).norm()
                       : computeGroundDistance(avatar.footPosition, goal);
}

/// Suffix of a message; "" for zero orders.
std::string formatDroppedCount(std::size_t orders) {
  if (orders == 0) return "";
  return "; " + std::to_string(orders) +
         (orders == 1 ? " queued order is dropped" : " queued orders are dropped");
}

/// Removes all orders but the first `kept` from a queue and reports each with `cause`. The notices
/// are copies of `notice` with the order's tag. Beyond kMaxNotices, the last one counts the rest.
void dropQueuedOrders(std::deque<QueuedOrder>& queue, std::size_t kept, Notice notice,
                      const std::string& cause, TickReport& report) {
  constexpr std::size_t kMaxNotices = 10'000;  // about 1 MB in a message
  notice.kind = Notice::Kind::dropped;
  notice.text = cause;
  const std::size_t reportedEnd = std::min(queue.size(), kept + kMaxNotices);
  for (std::size_t i = kept; i < reportedEnd; ++i) {
    notice.tag = queue[i].tag;
    if (i + 1 == reportedEnd && reportedEnd < queue.size())
      notice.text += ", and " + std::to_string(queue.size() - reportedEnd) + " more orders";
    report.notices.push_back(notice);
  }
  queue.resize(std::min(queue.size(), kept));
}

/// Removes an avatar from the world; its contacts end and are reported.
void removeAvatar(WorldData& world, OrderQueue& queue, std::vector<ContactEvent>& events) {
  Avatar& avatar = *world.findAvatar(queue.avatar);
  removeAvatarFromSolver(world, avatar);
  endAvatarContacts(world, avatar, ContactEvent::Reason::left, events);
  world.broadPhase.remove(avatar.proxy);
  world.eraseAvatar(queue.avatar);
  queue.avatar = 0;
}

OrderStatus executeOrder(const Spawn& spawn, OrderContext& context) {
  if (context.findAvatar()) {
    context.emitNotice(Notice::Kind::refused, "an avatar of this name is already in the world");
    return OrderStatus::done;
  }
  Avatar avatar;
  std::string message;
  applySpawnShape(spawn, context.world.settings, avatar);
  if (const auto error =
          placeOrSuggest(context.world, spawn.position, avatar, message, context.count)) {
    context.emitNotice(Notice::Kind::refused,
                       *error + formatDroppedCount(context.queue.orders.size() - 1));
    context.report.notices.back().position = spawn.position;
    dropQueuedOrders(context.queue.orders, 1, context.report.notices.back(), "by a refused Spawn",
                     context.report);
    return OrderStatus::done;
  }
  avatar.name = context.queue.name;
  avatar.viewDirection = makeHeadingFromDegrees(spawn.facing);
  avatar.proxy =
      context.world.broadPhase.insert(computeMotionBounds(context.world.settings, avatar));
  context.queue.avatar = context.world.insertAvatar(std::move(avatar));
  context.emitNotice(Notice::Kind::spawned, message);
  return OrderStatus::doneThisTick;
}

void startWaypoint(const WorldData& world, const Walk& walk, Avatar& avatar) {
  avatar.walk.minDistance =
      computeRemainingDistance(avatar, walk.waypoints[avatar.walk.waypointIndex]);
  avatar.walk.timeoutLeft = world.settings.stuckTimeout;
  avatar.walk.flowTick = world.tick;
}

OrderStatus executeOrder(const Walk& walk, OrderContext& context) {
  Avatar& avatar = *context.findAvatar();
  avatar.driveVelocity = Vec3::Zero();
  avatar.viewHeld = false;
  if (avatar.walk.minDistance < 0) {
    if (walk.fromFloor && !avatar.flying && !avatar.grounded) {
      if (!updateStalledInAir(avatar, context.world.settings)) return OrderStatus::running;
      avatar.stalledInAirTime = 0;
    }
    startWaypoint(context.world, walk, avatar);
  }
  commandWalkBodies(context.world, walk, avatar);
  return OrderStatus::running;
}

OrderStatus executeOrder(const Look& look, OrderContext& context) {
  Avatar& avatar = *context.findAvatar();
  const Vec3 eyes = avatar.footPosition + Vec3(0, avatar.eyeHeight, 0);
  const double distance = (look.target - eyes).norm();
  if (!(distance > 1e-6)) {
    context.emitNotice(Notice::Kind::refused, "the point to look at is where the eyes are");
    return OrderStatus::done;
  }
  avatar.viewDirection = (look.target - eyes) / distance;
  avatar.viewHeld = !avatar.driveVelocity.isZero(0);
  context.emitNotice(Notice::Kind::done);
  return OrderStatus::done;
}

OrderStatus executeOrder(const Wait& wait, OrderContext& context) {
  Avatar& avatar = *context.findAvatar();
  if (avatar.waitTimeLeft < 0) avatar.waitTimeLeft = wait.seconds;
  if (avatar.waitTimeLeft > kTimeTolerance) {
    avatar.waitTimeLeft -= context.world.settings.tickDuration;
    if (avatar.waitTimeLeft < 0) avatar.waitTimeLeft = 0;
    return OrderStatus::running;
  }
  avatar.waitTimeLeft = -1;
  context.emitNotice(Notice::Kind::done);
  return OrderStatus::done;
}

OrderStatus executeOrder(const Capture& capture, OrderContext& context) {
  context.emitNotice(Notice::Kind::capture, capture.name);
  return OrderStatus::doneThisTick;
}

OrderStatus executeOrder(const Leave&, OrderContext& context) {
  context.emitNotice(Notice::Kind::left);
  removeAvatar(context.world, context.queue, context.report.contacts);
  return OrderStatus::doneThisTick;
}

/// Does nothing: enqueueCommands() executes a Drive.
OrderStatus executeOrder(const Drive&, OrderContext&) {
  return OrderStatus::done;
}

OrderStatus executeOrder(const Teleport& teleport, OrderContext& context) {
  Avatar& avatar = *context.findAvatar();
  Avatar moved = avatar;
  std::string message;
  if (teleport.facing) setFacing(moved, *teleport.facing);
  if (const auto error =
          placeOrSuggest(context.world, teleport.position, moved, message, context.count)) {
    context.emitNotice(Notice::Kind::refused, *error);
    return OrderStatus::done;
  }
  wakeTouchingBodies(context.world, avatar);
  moved.grounded = moved.jumping = false;
  moved.groundEntity = 0;
  moved.fallSpeed = moved.stalledInAirTime = 0;
  moved.lastDisplacement = Vec3::Zero();
  moved.dirty = true;
  ++moved.teleports;
  if (teleport.facing) setViewFacing(moved, *teleport.facing);
  avatar = std::move(moved);
  context.emitNotice(Notice::Kind::done, message);
  return OrderStatus::doneThisTick;
}

std::string describeUnknownAvatar(const std::string& name) {
  return "no avatar '" + name + "' is in the world";
}

OrderStatus executeFrontOrder(OrderContext& context) {
  const Order& order = context.queue.orders.front().order;  // valid until runQueue() pops it
  if (!context.findAvatar() && !std::holds_alternative<Spawn>(order)) {
    context.emitNotice(Notice::Kind::refused, describeUnknownAvatar(context.queue.name));
    context.report.notices.back().isAvatarUnknown = true;
    return OrderStatus::done;
  }
  return std::visit([&](const auto& o) { return executeOrder(o, context); }, order);
}

/// Executes orders until one takes time. Bounded by the length of the queue.
void runQueue(OrderContext& context) {
  while (!context.queue.orders.empty()) {
    const OrderStatus status = executeFrontOrder(context);
    if (status == OrderStatus::running) return;
    context.queue.orders.pop_front();
    if (status == OrderStatus::doneThisTick) return;
  }
}

/// Name of an immediate order, as the cause in a notice.
std::string describeCause(const Order& order) {
  return std::holds_alternative<Drive>(order) ? "by a Drive" : "by an immediate DriveJoints";
}

/// The queue of a name; creates it on first use.
OrderQueue& ensureQueue(WorldData& world, const std::string& name) {
  const auto at = std::ranges::lower_bound(world.queues, name, {}, &OrderQueue::name);
  return at != world.queues.end() && at->name == name ? *at
                                                      : *world.queues.insert(at, OrderQueue{name});
}

/// Drops all orders of an avatar, for an immediate order. Returns the avatar; reports and returns
/// null if it is not in the world.
Avatar* dropPendingOrders(WorldData& world, const Command& command, TickReport& report) {
  OrderQueue& queue = ensureQueue(world, command.avatar);
  const std::string droppedText = formatDroppedCount(queue.orders.size());
  Avatar* avatar = world.findAvatar(queue.avatar);
  Notice notice{Notice::Kind::refused, command.avatar, 0, command.tag, Vec3::Zero(), 0, {}};
  if (avatar) notice.id = avatar->id, notice.position = avatar->footPosition;
  dropQueuedOrders(queue.orders, 0, notice, describeCause(command.order), report);
  if (!avatar) {
    notice.text = describeUnknownAvatar(command.avatar) + droppedText;
    notice.isAvatarUnknown = true;
    report.notices.push_back(std::move(notice));
    return nullptr;
  }
  avatar->walk = {};
  avatar->waitTimeLeft = -1;
  avatar->jumping = false;
  avatar->stalledInAirTime = 0;
  avatar->chain.speed = 0;
  avatar->turn = {};
  return avatar;
}

bool isImmediate(const Order& order) {
  const auto* joints = std::get_if<DriveJoints>(&order);
  return std::holds_alternative<Drive>(order) || (joints && joints->immediate);
}

void enqueueCommands(WorldData& world, TickReport& report) {
  for (Command& command : world.pendingCommands) {
    Avatar* avatar = nullptr;
    if (isImmediate(command.order) && !(avatar = dropPendingOrders(world, command, report)))
      continue;
    if (const Drive* drive = std::get_if<Drive>(&command.order)) {
      avatar->driveVelocity = drive->velocity;
      avatar->viewHeld = false;
    } else {
      ensureQueue(world, command.avatar).orders.push_back({std::move(command.order), command.tag});
    }
  }
  world.pendingCommands.clear();
}

/// Velocity requested by the front order or, without one, by Drive, m/s.
Vec3 computeDesiredVelocity(const WorldData& world, const Avatar& avatar,
                            const std::deque<QueuedOrder>& queue) {
  const Vec3 driveVelocity =
      avatar.flying ? avatar.driveVelocity : projectToGround(avatar.driveVelocity);
  if (queue.empty()) return driveVelocity;
  const Order& order = queue.front().order;
  if (const Walk* walk = std::get_if<Walk>(&order))
    return avatar.walk.minDistance < 0 || avatar.walk.waitsFor != 0
               ? Vec3(Vec3::Zero())
               : computeWalkVelocity(avatar.footPosition,
                                     walk->waypoints[avatar.walk.waypointIndex], avatar.flying,
                                     walk->speed, world.settings.tickDuration);
  if (const Jump* jump = std::get_if<Jump>(&order); jump && avatar.jumping)
    return jump->velocity ? projectToGround(*jump->velocity) : driveVelocity;
  const bool keepsDriving =
      std::holds_alternative<DriveJoints>(order) || std::holds_alternative<Turn>(order);
  return keepsDriving ? driveVelocity : Vec3(Vec3::Zero());
}

void endWalk(OrderContext& context, Notice::Kind kind, std::string text = {},
             EntityId obstacle = 0) {
  context.emitNotice(kind, std::move(text), obstacle);
  context.findAvatar()->walk = {};
  context.queue.orders.pop_front();
}

std::string describeBlocking(const OrderContext& context, const Vec3& goal) {
  const double up = goal.y() - context.findAvatar()->footPosition.y();
  if (!context.findAvatar()->flying &&
      computeGroundDistance(context.findAvatar()->footPosition, goal) <= kArrivalDistance)
    return "the waypoint lies " + formatShortNumber(std::abs(up)) + " m " +
           (up > 0 ? "above" : "below");
  return "no progress for " + formatShortNumber(context.world.settings.stuckTimeout) + " s";
}

void updateWalk(const Walk& walk, OrderContext& context) {
  Avatar& avatar = *context.findAvatar();
  const Vec3& goal = walk.waypoints[avatar.walk.waypointIndex];
  const double distance = computeRemainingDistance(avatar, goal);
  const bool isLast = avatar.walk.waypointIndex + 1 == walk.waypoints.size();
  if (avatar.walk.waitsFor != 0) {
    avatar.walk.timeoutLeft -= context.world.settings.tickDuration;
    if (avatar.walk.timeoutLeft <= kTimeTolerance)
      endWalk(context, Notice::Kind::blocked, describeWait(context.world, walk, avatar),
              avatar.walk.waitsFor);
    return;
  }
  const auto isPassedEarly = [&] {
    return !isLast && walk.rides.empty() &&
           mayPassEarly(context.world, avatar, distance,
                        walk.waypoints[avatar.walk.waypointIndex + 1], context.count);
  };
  if (hasReachedHeight(goal, avatar, context.world.settings) &&
      (distance <= kArrivalDistance || isPassedEarly())) {
    ++avatar.walk.waypointIndex;
    if (!isLast) return startWaypoint(context.world, walk, avatar);
    return endWalk(context, Notice::Kind::arrived);
  }
  const double maxWalkDistance = walk.speed * context.world.settings.stuckTimeout;
  if (distance < avatar.walk.minDistance - std::min(kMinProgress, 0.5 * maxWalkDistance)) {
    avatar.walk.minDistance = distance;
    avatar.walk.timeoutLeft = context.world.settings.stuckTimeout;
    return;
  }
  if (isQueueing(context.world, avatar)) return;
  avatar.walk.timeoutLeft -= context.world.settings.tickDuration;
  if (avatar.walk.timeoutLeft > kTimeTolerance) return;
  emitBlocked(context.world, avatar, context.report, context.count);
  endWalk(context, Notice::Kind::blocked, describeBlocking(context, goal), avatar.blockedBy);
}

/// Reports avatars that are blocked while driven or moving joints, once per block.
void reportBlockedDrives(WorldData& world, TickReport& report, QueryCount& count) {
  for (const OrderQueue& queue : world.queues) {
    Avatar* avatar = world.findAvatar(queue.avatar);
    if (!avatar) continue;
    const bool driven = !avatar->driveVelocity.isZero(0) && queue.orders.empty();
    const bool blocked = (driven || changesShape(*avatar)) && avatar->blockedBy != 0;
    if (blocked && !avatar->blockedReported) emitBlocked(world, *avatar, report, count);
    avatar->blockedReported = blocked;
  }
}

/// Reason to remove an avatar from the world; "" if it is inside its limits.
std::string describeOutOfScene(const WorldData& world, const Avatar& avatar) {
  const Aabb& bounds = world.scene->bounds();
  if (avatar.footPosition.y() < bounds.min.y() - kMaxAvatarDepthBelowScene)
    return "fell out of the scene";
  if (!contains(inflate(bounds, kMaxAvatarDistanceOutside),
                {avatar.footPosition, avatar.footPosition}))
    return "is " + formatShortNumber(kMaxAvatarDistanceOutside) + " m out of the scene";
  return "";
}

/// Removes avatars that fell or flew out of the scene, and drops their queues.
void removeLostAvatars(WorldData& world, TickReport& report) {
  for (OrderQueue& queue : world.queues) {
    const Avatar* avatar = world.findAvatar(queue.avatar);
    const std::string reason = avatar ? describeOutOfScene(world, *avatar) : "";
    if (reason.empty()) continue;
    const Notice notice{Notice::Kind::left,
                        queue.name,
                        avatar->id,
                        0,
                        avatar->footPosition,
                        0,
                        reason + "; its queued orders are dropped"};
    report.notices.push_back(notice);
    dropQueuedOrders(queue.orders, 0, notice, "as the avatar left the scene", report);
    removeAvatar(world, queue, report.contacts);
  }
}

}  // namespace

std::size_t computeOrderCost(const Order& order) {
  const Walk* walk = std::get_if<Walk>(&order);
  return 1 + (walk ? walk->waypoints.size() + walk->opens.size() + walk->rides.size() : 0);
}

void runOrders(WorldData& world, TickReport& report, QueryCount& count) {
  enqueueCommands(world, report);
  for (OrderQueue& queue : world.queues) {
    OrderContext context{world, report, count, queue};
    runQueue(context);
    Avatar* avatar = context.findAvatar();
    if (!avatar) continue;
    avatar->desiredVelocity = computeDesiredVelocity(world, *avatar, queue.orders);
    if (const double speed = avatar->desiredVelocity.norm(); speed > 0 && !avatar->viewHeld)
      avatar->viewDirection = avatar->desiredVelocity / speed;
  }
  yieldToWalkersAhead(world);
  std::erase_if(world.queues,
                [](const OrderQueue& queue) { return queue.orders.empty() && queue.avatar == 0; });
  if (world.queuedOrderCount == 0) return;
  world.queuedOrderCount = 0;
  for (const OrderQueue& queue : world.queues)
    for (const QueuedOrder& queued : queue.orders)
      world.queuedOrderCount += computeOrderCost(queued.order);
}

void updateWalkProgress(WorldData& world, TickReport& report, QueryCount& count) {
  for (OrderQueue& queue : world.queues) {
    OrderContext context{world, report, count, queue};
    const Avatar* avatar = context.findAvatar();
    if (queue.orders.empty() || !avatar || avatar->walk.minDistance < 0) continue;
    if (const Walk* walk = std::get_if<Walk>(&queue.orders.front().order))
      updateWalk(*walk, context);
  }
  reportBlockedDrives(world, report, count);
  removeLostAvatars(world, report);
}

}  // namespace enfilade::scene
