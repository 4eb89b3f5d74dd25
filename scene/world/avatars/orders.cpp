// The avatars' queues: commands come in, orders start, go on and end. An order that takes no time
// ends in the tick that it starts in and the next one starts; a capture keeps the avatar still for
// its tick, so that the picture shows the place it was asked for.
#include <algorithm>
#include <cmath>

#include "scene/model/rotation.hpp"
#include "scene/world/avatars/order_context.hpp"

namespace enfilade::scene {
namespace {

constexpr double kArrivedAcross = 1e-3;  // metres over the ground from the way point
constexpr double kArrivedUp = 1.0;       // metres: a way point on another storey is not reached
constexpr double kProgress = 0.01;       // metres nearer that count as progress, less if slow
constexpr double kBelowScene = 10;       // metres below the lowest point of the scene
constexpr double kBeyondScene = 1000;    // metres out of the scene's bounds that may be flown

double acrossGround(const Vec3& from, const Vec3& to) {
  const double x = to.x() - from.x(), z = to.z() - from.z();
  return std::sqrt(x * x + z * z);
}

/// Metres still to go: over the ground, or in space for who flies.
double wayLeft(const Avatar& avatar, const Vec3& goal) {
  return avatar.flying ? (goal - avatar.feet).norm() : acrossGround(avatar.feet, goal);
}

/// "" for none.
std::string toldDropped(std::size_t orders) {
  return orders == 0 ? "" : "; " + std::to_string(orders) + " queued orders are dropped";
}

/// Takes all orders but the first `kept` out of a queue and tells each, as `like` does but for its
/// tag; `by`: what did it. Of very many the last that is told counts the others.
void dropQueued(std::deque<QueuedOrder>& queue, std::size_t kept, Notice like,
                const std::string& by, TickReport& report) {
  constexpr std::size_t kMostTold = 10'000;  // some 1 MB in a message
  like.kind = Notice::Kind::dropped;
  like.text = by;
  const std::size_t told = std::min(queue.size(), kept + kMostTold);
  for (std::size_t i = kept; i < told; ++i) {
    like.tag = queue[i].tag;
    if (i + 1 == told && told < queue.size())
      like.text += ", and " + std::to_string(queue.size() - told) + " more orders";
    report.notices.push_back(like);
  }
  queue.resize(std::min(queue.size(), kept));
}

Outcome follow(const Spawn& spawn, Follower& f) {
  if (f.avatar()) {
    f.tell(Notice::Kind::refused, "an avatar of this name is already in the world");
    return Outcome::ended;
  }
  Avatar avatar;
  std::string told;
  if (const auto why = placeAvatar(f.world, spawn, avatar, told, f.count)) {
    f.tell(Notice::Kind::refused, *why + toldDropped(f.queue.size() - 1));
    dropQueued(f.queue, 1, f.report.notices.back(), "by a refused Spawn", f.report);
    return Outcome::ended;
  }
  avatar.id = f.world.firstAvatarId() + static_cast<EntityId>(f.world.avatarNames.size());
  avatar.gaze = headingFromDegrees(spawn.facing);
  avatar.mover = f.world.broadPhase.insert(reachOf(f.world, avatar, Vec3::Zero()));
  f.world.avatarOfMover[avatar.mover] = f.name;
  f.world.avatarNames.push_back(f.name);
  f.world.avatars.emplace(f.name, std::move(avatar));
  f.tell(Notice::Kind::spawned, told);
  return Outcome::endedTick;
}

void startLeg(Avatar& avatar, const Walk& walk, const Lengths& lengths) {
  avatar.walk.nearest = wayLeft(avatar, walk.along[avatar.walk.leg]);
  avatar.walk.patienceLeft = lengths.patience;
}

Outcome follow(const Walk& walk, Follower& f) {
  Avatar& avatar = *f.avatar();
  avatar.drive = Vec3::Zero();
  if (avatar.walk.nearest < 0) startLeg(avatar, walk, f.world.lengths);
  return Outcome::goesOn;
}

Outcome follow(const Look& look, Follower& f) {
  Avatar& avatar = *f.avatar();
  const Vec3 eyes = avatar.feet + Vec3(0, avatar.eyeHeight, 0);
  const double distance = (look.at - eyes).norm();
  if (!(distance > 1e-6)) {
    f.tell(Notice::Kind::refused, "the point to look at is where the eyes are");
    return Outcome::ended;
  }
  avatar.gaze = (look.at - eyes) / distance;
  f.tell(Notice::Kind::done);
  return Outcome::ended;
}

Outcome follow(const Wait& wait, Follower& f) {
  Avatar& avatar = *f.avatar();
  if (avatar.waitLeft < 0) avatar.waitLeft = wait.seconds;
  if (avatar.waitLeft > kTimeRounding) {
    avatar.waitLeft -= f.world.lengths.tick;
    if (avatar.waitLeft < 0) avatar.waitLeft = 0;
    return Outcome::goesOn;
  }
  avatar.waitLeft = -1;
  f.tell(Notice::Kind::done);
  return Outcome::ended;
}

Outcome follow(const Capture& capture, Follower& f) {
  f.tell(Notice::Kind::capture, capture.as);
  return Outcome::endedTick;
}

Outcome follow(const Leave&, Follower& f) {
  f.tell(Notice::Kind::left);
  removeAvatar(f.world, f.name, f.report.contacts);
  return Outcome::endedTick;
}

Outcome follow(const Drive&, Follower&) {
  return Outcome::ended;
}  // taken in by takeIn()

Outcome followFront(Follower& f) {
  const Order& order = f.queue.front().order;  // stays where it is until followQueue() pops it
  if (!f.avatar() && !std::holds_alternative<Spawn>(order)) {
    f.tell(Notice::Kind::refused, "there is no avatar of this name");
    return Outcome::ended;
  }
  return std::visit([&](const auto& o) { return follow(o, f); }, order);
}

/// Starts orders until one takes time. Bounded by the length of the queue.
void followQueue(Follower& f) {
  while (!f.queue.empty()) {
    const Outcome outcome = followFront(f);
    if (outcome == Outcome::goesOn) return;
    f.queue.pop_front();
    if (outcome == Outcome::endedTick) return;
  }
}

/// What of the orders that act at once it is.
std::string byWhat(const Order& order) {
  return std::holds_alternative<Drive>(order) ? "by a Drive" : "by a DriveJoints at once";
}

/// Drops what the avatar was told before, as for an order that does not queue. Its body, if it is
/// in the world; else that is told.
Avatar* dropOrders(WorldState& world, const Command& command, TickReport& report) {
  std::deque<QueuedOrder>& queue = world.queues[command.avatar];
  const std::string counted = toldDropped(queue.size());
  const auto found = world.avatars.find(command.avatar);
  const bool absent = found == world.avatars.end();
  Notice notice{Notice::Kind::refused, command.avatar, 0, command.tag, Vec3::Zero(), 0, {}};
  if (!absent) notice.id = found->second.id, notice.position = found->second.feet;
  dropQueued(queue, 0, notice, byWhat(command.order), report);
  if (absent) {
    notice.text = "there is no avatar of this name" + counted;
    report.notices.push_back(std::move(notice));
    return nullptr;
  }
  Avatar& avatar = found->second;
  avatar.walk = {};
  avatar.waitLeft = -1;
  avatar.jumping = false;
  avatar.hangsFor = 0;
  avatar.chain.speed = 0;
  return &avatar;
}

bool actsAtOnce(const Order& order) {
  const auto* joints = std::get_if<DriveJoints>(&order);
  return std::holds_alternative<Drive>(order) || (joints && joints->atOnce);
}

void takeIn(WorldState& world, TickReport& report) {
  for (Command& command : world.incoming) {
    Avatar* avatar = nullptr;
    if (actsAtOnce(command.order) && !(avatar = dropOrders(world, command, report))) continue;
    if (const Drive* drive = std::get_if<Drive>(&command.order)) {
      avatar->drive = drive->velocity;
    } else {
      world.queues[command.avatar].push_back({std::move(command.order), command.tag});
    }
  }
  world.incoming.clear();
}

Vec3 overGround(const Vec3& velocity) {
  return {velocity.x(), 0, velocity.z()};
}

/// The velocity of a walk; its last tick ends on its way point.
Vec3 velocityOf(const WorldState& world, const Avatar& avatar, const Walk& walk) {
  const Vec3& goal = walk.along[avatar.walk.leg];
  const double distance = wayLeft(avatar, goal);
  if (!(distance > 0)) return Vec3::Zero();
  const double speed = std::min(walk.speed, distance / world.lengths.tick);
  const Vec3 way = goal - avatar.feet;
  return (avatar.flying ? way : overGround(way)) * (speed / distance);
}

/// The velocity that the front order asks for.
Vec3 velocityOf(const WorldState& world, const Avatar& avatar,
                const std::deque<QueuedOrder>& queue) {
  const Vec3 driven = avatar.flying ? avatar.drive : overGround(avatar.drive);
  if (queue.empty()) return driven;
  const Order& order = queue.front().order;
  if (const Walk* walk = std::get_if<Walk>(&order))
    return avatar.walk.nearest < 0 ? Vec3(Vec3::Zero()) : velocityOf(world, avatar, *walk);
  if (const Jump* jump = std::get_if<Jump>(&order); jump && avatar.jumping)
    return jump->velocity ? overGround(*jump->velocity) : driven;
  return std::holds_alternative<DriveJoints>(order) ? driven : Vec3(Vec3::Zero());
}

void endWalk(Follower& f, Notice::Kind kind, std::string text = {}) {
  f.tell(kind, std::move(text), kind == Notice::Kind::blocked ? f.avatar()->stoppedBy : 0);
  f.avatar()->walk = {};
  f.queue.pop_front();
}

std::string whyBlocked(const Follower& f, const Vec3& goal) {
  const double up = goal.y() - f.avatar()->feet.y();
  if (!f.avatar()->flying && acrossGround(f.avatar()->feet, goal) <= kArrivedAcross)
    return "the way point lies " + shortNumber(std::abs(up)) + " m " + (up > 0 ? "above" : "below");
  return "no progress for " + shortNumber(f.world.lengths.patience) + " s";
}

void judge(const Walk& walk, Follower& f) {
  Avatar& avatar = *f.avatar();
  const Vec3& goal = walk.along[avatar.walk.leg];
  const double distance = wayLeft(avatar, goal);
  if (distance <= kArrivedAcross && std::abs(goal.y() - avatar.feet.y()) <= kArrivedUp) {
    if (++avatar.walk.leg < walk.along.size()) return startLeg(avatar, walk, f.world.lengths);
    return endWalk(f, Notice::Kind::arrived);
  }
  const double couldBeWalked = walk.speed * f.world.lengths.patience;
  if (distance < avatar.walk.nearest - std::min(kProgress, 0.5 * couldBeWalked)) {
    avatar.walk.nearest = distance;
    avatar.walk.patienceLeft = f.world.lengths.patience;
    return;
  }
  avatar.walk.patienceLeft -= f.world.lengths.tick;
  if (avatar.walk.patienceLeft > kTimeRounding) return;
  tellBlocked(f.world, avatar, f.report, f.count);
  endWalk(f, Notice::Kind::blocked, whyBlocked(f, goal));
}

/// A driven avatar or joint that something stops: told when that begins, not as long as it lasts.
void tellDrivenAgainst(WorldState& world, TickReport& report, QueryCount& count) {
  for (auto& [name, avatar] : world.avatars) {
    const bool driven = !avatar.drive.isZero(0) && world.queues[name].empty();
    const bool blocked = (driven || avatar.chain.speed > 0) && avatar.stoppedBy != 0;
    if (blocked && !avatar.blockedTold) tellBlocked(world, avatar, report, count);
    avatar.blockedTold = blocked;
  }
}

/// Why an avatar cannot stay in the world; "" when it can.
std::string whyOut(const WorldState& world, const Avatar& avatar) {
  const Box& bounds = world.scene->bounds();
  if (avatar.feet.y() < bounds.min.y() - kBelowScene) return "fell out of the scene";
  if (!contains(grown(bounds, kBeyondScene), {avatar.feet, avatar.feet}))
    return "is " + shortNumber(kBeyondScene) + " m out of the scene";
  return "";
}

/// Nobody falls or flies for ever: outside the scene an avatar leaves it, and its queue is dropped.
void removeLost(WorldState& world, TickReport& report) {
  std::map<std::string, std::string> lost;
  for (const auto& [name, avatar] : world.avatars)
    if (std::string why = whyOut(world, avatar); !why.empty()) lost[name] = std::move(why);
  for (const auto& [name, why] : lost) {
    const Avatar& avatar = world.avatars.at(name);
    const Notice left{Notice::Kind::left,
                      name,
                      avatar.id,
                      0,
                      avatar.feet,
                      0,
                      why + "; its queued orders are dropped"};
    report.notices.push_back(left);
    dropQueued(world.queues[name], 0, left, "as the avatar left the scene", report);
    removeAvatar(world, name, report.contacts);
  }
}

}  // namespace

std::size_t sizeOf(const Order& order) {
  const Walk* walk = std::get_if<Walk>(&order);
  return 1 + (walk ? walk->along.size() : 0);
}

Wish followOrders(WorldState& world, TickReport& report, QueryCount& count) {
  takeIn(world, report);
  Wish wish;
  for (auto& [name, queue] : world.queues) {
    Follower follower{world, report, count, name, queue};
    followQueue(follower);
    Avatar* avatar = follower.avatar();
    if (!avatar) continue;
    const Vec3 velocity = velocityOf(world, *avatar, queue);
    if (const double speed = velocity.norm(); speed > 0) avatar->gaze = velocity / speed;
    wish[name] = velocity;
  }
  std::erase_if(world.queues, [&](const auto& entry) {
    return entry.second.empty() && !world.avatars.contains(entry.first);
  });
  if (world.waiting > 0) {
    world.waiting = 0;
    for (const auto& [name, queue] : world.queues)
      for (const QueuedOrder& queued : queue) world.waiting += sizeOf(queued.order);
  }
  return wish;
}

void removeAvatar(WorldState& world, const std::string& name, std::vector<ContactEvent>& events) {
  Avatar& avatar = world.avatars.at(name);
  forgetAvatar(world, avatar);
  endContactsOf(world, avatar, ContactEvent::Reason::left, events);
  world.broadPhase.remove(avatar.mover);
  world.avatarOfMover.erase(avatar.mover);
  world.avatars.erase(name);
}

void judgeWalks(WorldState& world, TickReport& report, QueryCount& count) {
  for (auto& [name, queue] : world.queues) {
    Follower follower{world, report, count, name, queue};
    if (queue.empty() || !follower.avatar() || follower.avatar()->walk.nearest < 0) continue;
    if (const Walk* walk = std::get_if<Walk>(&queue.front().order)) judge(*walk, follower);
  }
  tellDrivenAgainst(world, report, count);
  removeLost(world, report);
}

}  // namespace enfilade::scene
