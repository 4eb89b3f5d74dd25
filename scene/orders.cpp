// The avatars' queues: commands come in, orders start, go on and end. An order that takes no time
// ends in the tick that it starts in and the next one starts; a capture keeps the avatar still for
// its tick, so that the picture shows the place it was asked for.
#include <array>
#include <cmath>
#include <cstdio>

#include "scene/rotation.hpp"
#include "scene/world_state.hpp"

namespace enfilade::scene {
namespace {

constexpr double kArrivedAcross = 1e-3;  // metres over the ground from the way point
constexpr double kArrivedUp = 1.0;       // metres: a way point on another storey is not reached
constexpr double kProgress = 0.01;       // metres nearer that count as progress, less if slow
constexpr double kTimeRounding = 1e-9;   // seconds: sums of ticks against whole waits
constexpr double kBelowScene = 10;       // metres below the lowest point of the scene
constexpr double kEyesBelowTop = 0.15;   // metres, at most a tenth of the height

double acrossGround(const Vec3& from, const Vec3& to) {
  const double x = to.x() - from.x(), z = to.z() - from.z();
  return std::sqrt(x * x + z * z);
}

/// One avatar's name, queue and body, while its orders are followed in this tick.
struct Follower {
  WorldState& world;
  TickReport& report;
  QueryCount& count;
  const std::string& name;
  std::deque<QueuedOrder>& queue;

  Avatar* avatar() const {
    const auto found = world.avatars.find(name);
    return found == world.avatars.end() ? nullptr : &found->second;
  }
  std::uint64_t tag() const { return queue.front().tag; }
  void tell(Notice::Kind kind, std::string text = {}, EntityId obstacle = 0) const {
    Notice notice{kind, name, 0, tag(), Vec3::Zero(), obstacle, std::move(text)};
    if (const Avatar* a = avatar()) notice.id = a->id, notice.position = a->feet;
    report.notices.push_back(std::move(notice));
  }
};

/// What following the front order came to.
enum class Outcome : std::uint8_t {
  ended,      ///< took no time: the next order may start in this tick
  endedTick,  ///< done, but the avatar stays as it is until the next tick
  goesOn
};

/// "" for none.
std::string toldDropped(std::size_t orders) {
  return orders == 0 ? "" : "; " + std::to_string(orders) + " queued orders are dropped";
}

Outcome follow(const Spawn& spawn, Follower& f) {
  if (f.avatar()) {
    f.tell(Notice::Kind::refused, "an avatar of this name is already in the world");
    return Outcome::ended;
  }
  Avatar avatar;
  if (const auto why = placeAvatar(f.world, spawn, avatar, f.count)) {
    f.tell(Notice::Kind::refused, *why + toldDropped(f.queue.size() - 1));
    f.queue.resize(1);
    return Outcome::ended;
  }
  avatar.id = f.world.firstAvatarId() + static_cast<EntityId>(f.world.avatarNames.size());
  avatar.gaze = headingFromDegrees(spawn.facing);
  avatar.eyeHeight = spawn.height - std::min(kEyesBelowTop, 0.1 * spawn.height);
  avatar.mover = f.world.broadPhase.insert(reachOf(f.world, avatar, Vec3::Zero()));
  f.world.avatarOfMover[avatar.mover] = f.name;
  f.world.avatarNames.push_back(f.name);
  f.world.avatars.emplace(f.name, std::move(avatar));
  f.tell(Notice::Kind::spawned);
  return Outcome::endedTick;
}

void startLeg(Avatar& avatar, const Walk& walk, const Lengths& lengths) {
  avatar.walk.nearest = acrossGround(avatar.feet, walk.along[avatar.walk.leg]);
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

void drive(WorldState& world, const Command& command, TickReport& report) {
  std::deque<QueuedOrder>& queue = world.queues[command.avatar];
  const std::string dropped = toldDropped(queue.size());
  queue.clear();
  const auto found = world.avatars.find(command.avatar);
  if (found == world.avatars.end()) {
    report.notices.push_back({Notice::Kind::refused, command.avatar, 0, command.tag, Vec3::Zero(),
                              0, "there is no avatar of this name" + dropped});
    return;
  }
  Avatar& avatar = found->second;
  const Vec3& velocity = std::get<Drive>(command.order).velocity;
  avatar.drive = {velocity.x(), 0, velocity.z()};
  avatar.walk = {};
  avatar.waitLeft = -1;
}

void takeIn(WorldState& world, TickReport& report) {
  for (Command& command : world.incoming) {
    if (std::holds_alternative<Drive>(command.order)) {
      drive(world, command, report);
    } else {
      world.queues[command.avatar].push_back({std::move(command.order), command.tag});
    }
  }
  world.incoming.clear();
}

/// The horizontal velocity that the front order asks for. A walk's last tick ends on its way point.
Vec3 velocityOf(const WorldState& world, const Avatar& avatar,
                const std::deque<QueuedOrder>& queue) {
  const Walk* walk = queue.empty() ? nullptr : std::get_if<Walk>(&queue.front().order);
  if (!walk || avatar.walk.nearest < 0) return queue.empty() ? avatar.drive : Vec3(Vec3::Zero());
  const Vec3& goal = walk->along[avatar.walk.leg];
  const double distance = acrossGround(avatar.feet, goal);
  if (!(distance > 0)) return Vec3::Zero();
  const double speed = std::min(walk->speed, distance / world.lengths.tick);
  return Vec3(goal.x() - avatar.feet.x(), 0, goal.z() - avatar.feet.z()) * (speed / distance);
}

void endWalk(Follower& f, Notice::Kind kind, std::string text = {}) {
  f.tell(kind, std::move(text), kind == Notice::Kind::blocked ? f.avatar()->stoppedBy : 0);
  f.avatar()->walk = {};
  f.queue.pop_front();
}

std::string shortNumber(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

std::string whyBlocked(const Follower& f, const Vec3& goal) {
  const double up = goal.y() - f.avatar()->feet.y();
  if (acrossGround(f.avatar()->feet, goal) <= kArrivedAcross)
    return "the way point lies " + shortNumber(std::abs(up)) + " m " + (up > 0 ? "above" : "below");
  return "no progress for " + shortNumber(f.world.lengths.patience) + " s";
}

void judge(const Walk& walk, Follower& f) {
  Avatar& avatar = *f.avatar();
  const Vec3& goal = walk.along[avatar.walk.leg];
  const double distance = acrossGround(avatar.feet, goal);
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

/// Nobody falls for ever: below the scene an avatar leaves it, and its queue is dropped.
void removeFallen(WorldState& world, TickReport& report) {
  std::vector<std::string> fallen;
  for (const auto& [name, avatar] : world.avatars)
    if (avatar.feet.y() < world.scene->bounds().min.y() - kBelowScene) fallen.push_back(name);
  for (const std::string& name : fallen) {
    const Avatar& avatar = world.avatars.at(name);
    report.notices.push_back({Notice::Kind::left, name, avatar.id, 0, avatar.feet, 0,
                              "fell out of the scene; its queued orders are dropped"});
    world.queues[name].clear();
    removeAvatar(world, name, report.contacts);
  }
}

}  // namespace

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
  return wish;
}

void removeAvatar(WorldState& world, const std::string& name, std::vector<ContactEvent>& events) {
  Avatar& avatar = world.avatars.at(name);
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
  removeFallen(world, report);
}

}  // namespace enfilade::scene
