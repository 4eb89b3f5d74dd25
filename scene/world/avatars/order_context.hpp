// How one avatar's orders are followed in one tick; private to orders.cpp and order_moves.cpp.
#pragma once

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

inline constexpr double kTimeRounding = 1e-9;  ///< seconds: sums of ticks against whole waits

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

/// Metres above the feet, of an avatar of this height.
double eyeHeightOf(double height);
/// "0.123", for a person.
std::string shortNumber(double value);

Outcome follow(const Jump& jump, Follower& f);
Outcome follow(const Fly& fly, Follower& f);
Outcome follow(const Crouch& crouch, Follower& f);
Outcome follow(const DriveJoints& drive, Follower& f);

}  // namespace enfilade::scene
