#include "scene/world/tick.hpp"

#include <algorithm>
#include <chrono>
#include <tuple>
#include <utility>

#include "collision/assert.hpp"
#include "scene/world/audit.hpp"
#include "scene/world/avatars/avatar_islands.hpp"
#include "scene/world/avatars/avatar_motion.hpp"
#include "scene/world/avatars/avatar_state.hpp"
#include "scene/world/avatars/order_execution.hpp"
#include "scene/world/bodies/body_state.hpp"
#include "scene/world/bodies/kinematic_drive.hpp"
#include "scene/world/bodies/kinematic_motion.hpp"
#include "scene/world/bodies/step_dynamic_bodies.hpp"
#include "scene/world/contacts/avatar_contacts.hpp"
#include "scene/world/contacts/body_contacts.hpp"
#include "scene/world/contacts/obstacles.hpp"
#include "scene/world/contacts/triggers.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kIslandsPerTask = 8;

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
      avatar.motionBounds = inflate(avatar.motionBounds, computePushMargin(world, avatar));
    world.broadPhase.move(avatar.proxy, avatar.motionBounds);
  }
  world.broadPhase.update();
  const std::vector<collision::ProxyId> changed = collectChangedProxies(world.broadPhase);
  for (Avatar& avatar : world.avatars)
    if (std::binary_search(changed.begin(), changed.end(), avatar.proxy))
      avatar.pairsChanged = true;
}

void prepareAvatar(WorldData& world, Avatar& avatar) {
  avatar.work = {};
  avatar.blockedBy = 0;
  for (ChainLink& link : avatar.chain.links) link.blockedBy = 0;
  avatar.requestedDisplacement = Vec3::Zero();
  avatar.idle = avatar.grounded && avatar.lastDisplacement.isZero(0) &&
                avatar.desiredVelocity.isZero(0) && !avatar.dirty && avatar.chain.speed == 0 &&
                avatar.turn.left == 0 && !avatar.pairsChanged &&
                areNeighboursStationary(world, avatar);
  if (!avatar.idle) prepareBodyObstacles(world, avatar);
}

/// Avatars that may meet move one after the other, by name; islands of them in parallel.
void moveAvatars(WorldData& world) {
  for (Avatar& avatar : world.avatars) prepareAvatar(world, avatar);
  const AvatarIslands islands(world);
  ThreadPool* threadPool = acquireThreadPool(world.threads, islands.size(), kMinParallelAvatars);
  parallelForOrSerial(threadPool, islands.size(), kIslandsPerTask,
                      [&](std::size_t from, std::size_t to) {
                        for (std::size_t i = from; i < to; ++i)
                          for (const std::uint32_t member : islands.members(i)) {
                            Avatar& avatar = world.avatars[member];
                            collectObstacles(world, avatar);
                            moveAvatar(world, avatar, avatar.work);
                          }
                      });
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
  for (Avatar& avatar : world.avatars) {
    const BoxWork work = std::exchange(avatar.boxWork, {});
    report.verticesLookedAt += work.verticesLookedAt;
    report.partBoxesMade += work.partBoxesMade;
  }
}

void reportQueries(const WorldData& world, QueryCount count, TickReport& report) {
  report.avatarWork.reserve(world.avatars.size());
  for (const Avatar& avatar : world.avatars) {
    count.add(avatar.work);
    report.avatarWork.push_back(
        {avatar.id, avatar.work.narrow, avatar.work.partsLookedAt, avatar.footPosition});
  }
  report.narrowQueries = count.narrow;
  report.rationalQueries = count.rational;
  report.iterationLimitedCasts = count.bounded;
  report.partsLookedAt = count.partsLookedAt;
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
  std::vector<const Avatar*> byId;
  byId.reserve(world.avatars.size());
  for (const Avatar& avatar : world.avatars) byId.push_back(&avatar);
  std::ranges::sort(byId, {}, &Avatar::id);
  snapshot->avatars.reserve(byId.size());
  for (const Avatar* avatar : byId) snapshot->avatars.push_back(makeAvatarSnapshot(*avatar));
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
  moveAvatars(world);
  stopwatch.recordStage(Stage::avatars);
  stepDynamicBodies(world, report, count);
  stopwatch.recordStage(Stage::solver);
  detectAvatarContacts(world, report);
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
  reportQueries(world, count, report);
  reportBoxWork(world, report);
  report.idle = isWorldIdle(world);
  return report;
}

}  // namespace enfilade::scene
