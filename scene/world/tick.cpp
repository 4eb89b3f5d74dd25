#include "scene/world/tick.hpp"

#include <algorithm>
#include <chrono>
#include <tuple>
#include <utility>

#include "collision/assert.hpp"
#include "scene/world/audit.hpp"
#include "scene/world/avatars/avatar_motion.hpp"
#include "scene/world/avatars/avatar_state.hpp"
#include "scene/world/avatars/order_execution.hpp"
#include "scene/world/bodies/body_state.hpp"
#include "scene/world/bodies/dynamic_bodies.hpp"
#include "scene/world/bodies/kinematic_drive.hpp"
#include "scene/world/bodies/kinematic_motion.hpp"
#include "scene/world/contacts/body_contacts.hpp"
#include "scene/world/contacts/contacts.hpp"
#include "scene/world/contacts/obstacles.hpp"
#include "scene/world/contacts/triggers.hpp"

namespace enfilade::scene {
namespace {

/// Records the wall time of consecutive stages in the report.
class Stopwatch {
 public:
  explicit Stopwatch(TickReport& report) : report_(report) {}
  void recordStage(Stage stage) { report_.stageSeconds[static_cast<std::size_t>(stage)] = lap(); }
  /// Seconds since the last lap.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double> seconds = now - last_;
    last_ = now;
    return seconds.count();
  }

 private:
  TickReport& report_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Proxies whose pairs changed at the last update of the broad phase, ascending.
std::vector<collision::ProxyId> collectChangedProxies(const collision::SortAndSweep& broadPhase) {
  std::vector<collision::ProxyId> changed;
  for (const auto& pairs : {broadPhase.addedPairs(), broadPhase.removedPairs()}) {
    for (const collision::ProxyPair& pair : pairs) {
      changed.push_back(pair.proxy);
      if (pair.otherIsDynamic) changed.push_back(pair.other);
    }
  }
  std::sort(changed.begin(), changed.end());
  return changed;
}

void updateBroadPhase(WorldData& world) {
  for (Avatar& avatar : world.avatars) {
    avatar.motionBounds = computeMotionBounds(world.settings, avatar);
    if (!world.movingBodies.empty())
      avatar.motionBounds = inflated(avatar.motionBounds, computePushMargin(world, avatar));
    world.broadPhase.move(avatar.proxy, avatar.motionBounds);
  }
  world.broadPhase.update();
  const std::vector<collision::ProxyId> changed = collectChangedProxies(world.broadPhase);
  for (Avatar& avatar : world.avatars)
    if (std::binary_search(changed.begin(), changed.end(), avatar.proxy))
      avatar.pairsChanged = true;
}

void moveAvatars(WorldData& world, QueryCount& count) {
  for (Avatar& avatar : world.avatars) {
    avatar.narrowQueries = avatar.partsLookedAt = 0;
    avatar.blockedBy = 0;
    for (ChainLink& link : avatar.chain.links) link.blockedBy = 0;
    avatar.requestedDisplacement = Vec3::Zero();
    avatar.idle = avatar.grounded && avatar.lastDisplacement.isZero(0) &&
                  avatar.desiredVelocity.isZero(0) && !avatar.dirty && avatar.chain.speed == 0 &&
                  avatar.turn.left == 0 && !avatar.pairsChanged &&
                  areNeighboursStationary(world, avatar);
    if (avatar.idle) continue;
    collectObstacles(world, avatar);
    const AvatarWorkCounter counter(avatar, count);
    moveAvatar(world, avatar, count);
  }
}

void hashState(WorldData& world) {
  Hasher hash(world.hash);
  hash.add(world.tick);
  for (const Avatar& avatar : world.avatars) hashAvatar(avatar, hash);
  for (const OrderQueue& queue : world.queues) {
    hash.add(std::string_view(queue.name));
    hash.add(std::uint64_t{queue.orders.size()});
  }
  hashBodies(world, hash);
  if (!world.dynamicBodies.activeBodies.empty() || !world.movingBodies.empty())
    for (const auto& [key, contact] : world.bodyContacts)
      hash.add((std::uint64_t{key.first} << 32) | std::uint64_t{key.second});
  world.hash = hash.value();
}

void reportBoxWork(WorldData& world, TickReport& report) {
  for (Body& body : world.bodies) {
    report.verticesLookedAt += std::exchange(body.boxes.verticesLookedAt, 0);
    report.partBoxesMade += std::exchange(body.boxes.partBoxesMade, 0);
  }
  for (Avatar& avatar : world.avatars)
    report.verticesLookedAt += std::exchange(avatar.chain.verticesLookedAt, 0);
}

void reportAvatarWork(const WorldData& world, TickReport& report) {
  AvatarWork& costliest = report.costliestAvatar;
  for (const Avatar& avatar : world.avatars)
    if (avatar.narrowQueries > costliest.narrowQueries)
      costliest = {avatar.id, avatar.narrowQueries, avatar.partsLookedAt, avatar.footPosition};
}

/// True if the avatar is falling, or driven by a client.
bool isAvatarBusy(const Avatar& avatar) {
  return !avatar.driveVelocity.isZero(0) ||
         (!avatar.grounded && !avatar.lastDisplacement.isZero(0));
}

bool isWorldIdle(const WorldData& world) {
  for (const OrderQueue& queue : world.queues)
    if (!queue.orders.empty()) return false;
  for (const Avatar& avatar : world.avatars)
    if (isAvatarBusy(avatar)) return false;
  for (const Body& body : world.bodies)
    if (isBodyBusy(body)) return false;
  return true;
}

/// Whether all lists of the world have the order that their declarations promise.
[[maybe_unused]] bool areListsAscending(const WorldData& world) {
  const auto ascends = [](const auto& list, auto key) {
    return std::adjacent_find(list.begin(), list.end(), [&](const auto& a, const auto& b) {
             return !(key(a) < key(b));
           }) == list.end();
  };
  const auto itself = [](const auto& one) { return one; };
  const auto name = [](const auto& one) -> const std::string& { return one.name; };
  const auto other = [](const Contact& one) { return one.other; };
  const auto part = [](const Obstacle& one) { return std::pair(one.entity, one.part); };
  const auto entity = [](const DenseObject& one) { return one.entity; };
  for (const Avatar& avatar : world.avatars)
    if (!ascends(avatar.contacts, other) || !ascends(avatar.obstacles.list, part) ||
        !ascends(avatar.obstacles.dense, entity))
      return false;
  for (const Body& body : world.bodies)
    if (!ascends(body.occupants, itself)) return false;
  return ascends(world.avatars, name) && ascends(world.queues, name) &&
         ascends(world.bodyContacts, [](const auto& one) { return one.first; }) &&
         ascends(world.kinematicBodies, itself) && ascends(world.triggers, itself) &&
         ascends(world.movingBodies, itself) && ascends(world.dynamicBodies.activeBodies, itself) &&
         ascends(world.dynamicBodies.avatarBodyPairs, itself);
}

}  // namespace

std::shared_ptr<const Snapshot> makeSnapshot(const WorldData& world) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->bodies = makeBodySnapshots(world);
  snapshot->tick = world.tick;
  snapshot->time = static_cast<double>(world.tick) * world.settings.tickDuration;
  snapshot->stateHash = world.hash;
  for (const Avatar& avatar : world.avatars)
    snapshot->avatars.push_back(makeAvatarSnapshot(avatar));
  std::sort(snapshot->avatars.begin(), snapshot->avatars.end(),
            [](const AvatarSnapshot& a, const AvatarSnapshot& b) { return a.id < b.id; });
  return snapshot;
}

TickReport runTick(WorldData& world) {
  TickReport report;
  QueryCount count;
  Stopwatch stopwatch(report);
  ++world.tick;

  applyBodyCommands(world);
  runOrders(world, report, count);
  planKinematicMotion(world);
  planDynamicMotion(world);
  stopwatch.recordStage(Stage::commands);
  updateBroadPhase(world);
  prefetchSurroundings(world);
  stopwatch.recordStage(Stage::broad);
  if (isAuditDue(world)) {
    report.audit = auditTick(world);
    report.audit->seconds = stopwatch.lap();
  }
  moveKinematicBodies(world, report, count);
  stopwatch.recordStage(Stage::bodies);
  moveAvatars(world, count);
  stopwatch.recordStage(Stage::avatars);
  stepDynamicBodies(world, report, count);
  stopwatch.recordStage(Stage::solver);
  detectAvatarContacts(world, report, count);
  detectBodyContacts(world, report, count);
  updateTriggers(world, report, count);
  updateWalkProgress(world, report, count);
  stopwatch.recordStage(Stage::narrow);
  ENFILADE_ASSERT(areListsAscending(world));
  hashState(world);
  stopwatch.recordStage(Stage::hash);
  world.snapshot = makeSnapshot(world);
  stopwatch.recordStage(Stage::snapshot);

  std::stable_sort(report.contacts.begin(), report.contacts.end(),
                   [](const ContactEvent& x, const ContactEvent& y) {
                     return std::tie(x.a, x.b, x.kind) < std::tie(y.a, y.b, y.kind);
                   });
  std::stable_sort(report.notices.begin(), report.notices.end(),
                   [](const Notice& x, const Notice& y) { return x.avatar < y.avatar; });
  report.snapshot = world.snapshot;
  report.pairs = static_cast<std::uint32_t>(world.broadPhase.pairCount());
  report.narrowQueries = count.narrow;
  report.rationalQueries = count.rational;
  report.iterationLimitedCasts = count.bounded;
  report.partsLookedAt = count.partsLookedAt;
  reportAvatarWork(world, report);
  reportBoxWork(world, report);
  report.idle = isWorldIdle(world);
  return report;
}

}  // namespace enfilade::scene
