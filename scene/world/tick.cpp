// The tick, a table of contents. Each stage is timed; what it does is in the file it is named
// after.
#include <algorithm>
#include <chrono>
#include <tuple>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

/// Times the stages one after another.
class Stopwatch {
 public:
  explicit Stopwatch(TickReport& report) : report_(report) {}
  void done(Stage stage) { report_.stageSeconds[static_cast<std::size_t>(stage)] = lap(); }
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

Vec3 wishOf(const Wish& wish, const std::string& name) {
  const auto found = wish.find(name);
  return found == wish.end() ? Vec3(Vec3::Zero()) : found->second;
}

/// The movers whose partners changed at the last update of the broad phase, ascending.
std::vector<collision::MoverId> changedMovers(const collision::SortAndSweep& broadPhase) {
  std::vector<collision::MoverId> changed;
  for (const auto& pairs : {broadPhase.begun(), broadPhase.ended()}) {
    for (const collision::BoxPair& pair : pairs) {
      changed.push_back(pair.mover);
      if (pair.otherMoves) changed.push_back(pair.other);
    }
  }
  std::sort(changed.begin(), changed.end());
  return changed;
}

void updateBroadPhase(WorldState& world, const Wish& wish) {
  for (auto& [name, avatar] : world.avatars) {
    avatar.reach = reachOf(world, avatar, wishOf(wish, name));
    if (!world.goingBodies.empty()) avatar.reach = grown(avatar.reach, pushRoom(world, avatar));
    world.broadPhase.move(avatar.mover, avatar.reach);
  }
  world.broadPhase.update();
  const std::vector<collision::MoverId> changed = changedMovers(world.broadPhase);
  for (auto& [name, avatar] : world.avatars)
    if (std::binary_search(changed.begin(), changed.end(), avatar.mover))
      avatar.pairsChanged = true;
}

void moveAvatars(WorldState& world, const Wish& wish, QueryCount& count) {
  for (auto& [name, avatar] : world.avatars) {
    const Vec3 velocity = wishOf(wish, name);
    avatar.stoppedBy = 0;
    avatar.asked = Vec3::Zero();
    avatar.resting = avatar.grounded && avatar.lastMove.isZero(0) && velocity.isZero(0) &&
                     !avatar.stirred && avatar.chain.speed == 0 && !avatar.pairsChanged &&
                     nobodyMovesNear(world, avatar);
    if (avatar.resting) continue;
    gatherObstacles(world, avatar);
    moveAvatar(world, avatar, velocity, count);
  }
}

/// Of bodies that stand nothing is new since the tick in which they came to rest.
void hashBodies(const WorldState& world, Hasher& hash) {
  for (const Body& body : world.bodies) {
    const BodyDrive& drive = body.drive;
    if (!body.inside.empty()) {
      hash.add((std::uint64_t{body.id} << 32) | body.inside.size());
      for (const EntityId id : body.inside) hash.add(std::uint64_t{id});
    }
    if (!body.moved && !drive.going && drive.closesIn < 0) continue;
    hash.add(std::uint64_t{body.id});
    hash.add(body.position);
    for (const double number :
         {body.orientation.w(), body.orientation.x(), body.orientation.y(), body.orientation.z()})
      hash.add(number);
    hash.add(body.velocity);
    hash.add(body.spin);
    for (const double number :
         {drive.coordinate, drive.rate, drive.target, drive.speed, drive.closesIn})
      hash.add(number);
    hash.add((std::uint64_t{body.blockedBy} << 1) | std::uint64_t{drive.going});
  }
}

void hashState(WorldState& world) {
  Hasher hash(world.hash);
  hash.add(world.tick);
  for (const auto& [name, avatar] : world.avatars) hashAvatar(avatar, hash);
  for (const auto& [name, queue] : world.queues) {
    hash.add(std::string_view(name));
    hash.add(std::uint64_t{queue.size()});
  }
  hashBodies(world, hash);
  if (!world.rigids.seeds.empty() || !world.goingBodies.empty())
    for (const auto& [key, contact] : world.bodyContacts)
      hash.add((std::uint64_t{key.first} << 32) | std::uint64_t{key.second});
  world.hash = hash.value();
}

/// Still on its way: falling, or driven by a client.
bool isBusy(const Avatar& avatar) {
  return !avatar.drive.isZero(0) || (!avatar.grounded && !avatar.lastMove.isZero(0));
}

bool isIdle(const WorldState& world) {
  for (const auto& [name, queue] : world.queues)
    if (!queue.empty()) return false;
  for (const auto& [name, avatar] : world.avatars)
    if (isBusy(avatar)) return false;
  for (const Body& body : world.bodies)
    if (isBusy(body)) return false;
  return true;
}

}  // namespace

std::shared_ptr<const Snapshot> makeSnapshot(const WorldState& world) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->bodies = viewsOfBodies(world);
  snapshot->tick = world.tick;
  snapshot->time = static_cast<double>(world.tick) * world.lengths.tick;
  snapshot->stateHash = world.hash;
  for (const auto& [name, avatar] : world.avatars)
    snapshot->avatars.push_back(viewOf(name, avatar));
  std::sort(snapshot->avatars.begin(), snapshot->avatars.end(),
            [](const AvatarView& a, const AvatarView& b) { return a.id < b.id; });
  return snapshot;
}

TickReport tick(World& w) {
  WorldState& world = w.state();
  TickReport report;
  QueryCount count;
  Stopwatch stopwatch(report);
  ++world.tick;

  followBodyCommands(world);
  const Wish wish = followOrders(world, report, count);
  planBodies(world);
  planRigids(world);
  stopwatch.done(Stage::commands);
  updateBroadPhase(world, wish);
  stopwatch.done(Stage::broad);
  if (auditIsDue(world)) {
    report.audit = auditTick(world);
    report.audit->seconds = stopwatch.lap();
  }
  moveBodies(world, report, count);
  stopwatch.done(Stage::bodies);
  moveAvatars(world, wish, count);
  stopwatch.done(Stage::avatars);
  moveRigids(world, wish, report, count);
  stopwatch.done(Stage::solver);
  findContacts(world, report, count);
  findBodyContacts(world, report, count);
  watchTriggers(world, report, count);
  judgeWalks(world, report, count);
  stopwatch.done(Stage::narrow);
  hashState(world);
  stopwatch.done(Stage::hash);
  world.snapshot = makeSnapshot(world);
  stopwatch.done(Stage::snapshot);

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
  report.boundedSweeps = count.bounded;
  report.idle = isIdle(world);
  return report;
}

}  // namespace enfilade::scene
