// Test fixture that compares two worlds which must continue identically, with commands for both.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "scene/world/checkpoint/checkpoint.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene::testing {

/// Commands given to a world before one tick. Equal seeds give equal commands.
struct TickCommands {
  std::vector<Command> avatars;
  std::vector<BodyCommand> bodies;
};

inline void give(World& world, const TickCommands& commands) {
  // A command that one world refuses is refused by the other, too.
  for (const Command& command : commands.avatars) submitAvatarCommand(world, command);
  for (const BodyCommand& command : commands.bodies) submitBodyCommand(world, command);
}

inline bool areSame(const Vec3& a, const Vec3& b) {
  return a == b;
}
inline bool areSame(const collision::SeparationResult& a, const collision::SeparationResult& b) {
  return a.verdict == b.verdict && a.certificate == b.certificate && a.distance == b.distance &&
         a.errorBound == b.errorBound && areSame(a.pointA, b.pointA) &&
         areSame(a.pointB, b.pointB) && areSame(a.normal, b.normal) && a.featureA == b.featureA &&
         a.featureB == b.featureB;
}
inline bool areSame(const ContactEvent& a, const ContactEvent& b) {
  return a.tick == b.tick && a.kind == b.kind && a.reason == b.reason && a.phase == b.phase &&
         a.a == b.a && a.b == b.b && areSame(a.separation, b.separation);
}
inline bool areSame(const Notice& a, const Notice& b) {
  return a.kind == b.kind && a.avatar == b.avatar && a.id == b.id && a.tag == b.tag &&
         areSame(a.position, b.position) && a.obstacle == b.obstacle && a.text == b.text;
}
inline bool areSame(const AvatarSnapshot& a, const AvatarSnapshot& b) {
  bool joints = a.joints.size() == b.joints.size();
  for (std::size_t i = 0; joints && i < a.joints.size(); ++i)
    joints =
        a.joints[i].value == b.joints[i].value && a.joints[i].blockedBy == b.joints[i].blockedBy;
  return joints && a.id == b.id && a.name == b.name && areSame(a.footPosition, b.footPosition) &&
         areSame(a.viewDirection, b.viewDirection) && a.eyeHeight == b.eyeHeight &&
         a.grounded == b.grounded && a.flying == b.flying && a.groundEntity == b.groundEntity &&
         a.height == b.height &&
         areSame(a.move.requestedDisplacement, b.move.requestedDisplacement) &&
         areSame(a.move.actualDisplacement, b.move.actualDisplacement) &&
         a.move.blockedBy == b.move.blockedBy && areSame(a.move.separation, b.move.separation) &&
         a.lastStoppedTick == b.lastStoppedTick;
}
inline bool areSame(const BodySnapshot& a, const BodySnapshot& b) {
  return a.id == b.id && a.index == b.index && areSame(a.pose.translation, b.pose.translation) &&
         a.pose.rotation.coeffs() == b.pose.rotation.coeffs() && a.displaced == b.displaced &&
         a.jointPosition == b.jointPosition && areSame(a.velocity, b.velocity) &&
         areSame(a.angularVelocity, b.angularVelocity) &&
         a.velocityDeviation == b.velocityDeviation && a.moving == b.moving &&
         a.blockedBy == b.blockedBy;
}
template <class List>
bool areListsSame(const List& a, const List& b) {
  bool all = a.size() == b.size();
  for (std::size_t i = 0; all && i < a.size(); ++i) all = areSame(a[i], b[i]);
  return all;
}

/// The first difference between two tick reports; "" if they are equal.
inline std::string findDifference(const TickReport& a, const TickReport& b) {
  if (a.snapshot->stateHash != b.snapshot->stateHash) return "state hash";
  if (!areListsSame(a.contacts, b.contacts)) return "contacts";
  if (!areListsSame(a.notices, b.notices)) return "notices";
  if (!areListsSame(a.snapshot->avatars, b.snapshot->avatars)) return "avatars";
  if (!areListsSame(*a.snapshot->bodies, *b.snapshot->bodies)) return "bodies";
  if (a.pairs != b.pairs) return "pairs";
  if (a.narrowQueries != b.narrowQueries) return "narrow queries";
  if (a.rationalQueries != b.rationalQueries) return "rational queries";
  if (a.iterationLimitedCasts != b.iterationLimitedCasts || a.crushedBodies != b.crushedBodies)
    return "counts";
  if (a.activeContacts != b.activeContacts) return "live contacts";
  if (a.maxPenetration != b.maxPenetration) return "penetration";
  return a.idle == b.idle ? "" : "idle";
}

/// Runs a world by the commands in `commands` until tick `until`. At each tick of `at` a copy is
/// made, which runs in parallel for `duration` ticks and must report the same.
inline void compareCopies(const std::shared_ptr<const Scene>& scene, const WorldSettings& settings,
                          const std::map<std::uint64_t, TickCommands>& commands,
                          std::uint64_t until, const std::vector<std::uint64_t>& at,
                          std::uint64_t duration) {
  World world(scene, settings);
  struct Copy {
    std::uint64_t from;
    World world;
  };
  std::vector<Copy> copies;
  std::size_t made = 0, events = 0;
  for (std::uint64_t t = 0; t < until; ++t) {
    const auto now = commands.find(t + 1);
    if (std::find(at.begin(), at.end(), t) != at.end()) {
      // Half of the copies are made while commands are queued.
      const bool waiting = now != commands.end() && made++ % 2 == 0;
      if (waiting) give(world, now->second);
      const auto bytes = makeCheckpoint(world);
      copies.push_back({t, restoreWorld(scene, bytes)});
      ASSERT_EQ(makeCheckpoint(copies.back().world), bytes) << "tick " << t;
      ASSERT_EQ(copies.back().world.snapshot()->stateHash, world.snapshot()->stateHash);
      ASSERT_TRUE(areListsSame(*copies.back().world.snapshot()->bodies, *world.snapshot()->bodies));
      for (Copy& copy : copies)
        if (now != commands.end() && &copy != &copies.back()) give(copy.world, now->second);
      if (!waiting && now != commands.end())
        give(world, now->second), give(copies.back().world, now->second);
    } else if (now != commands.end()) {
      give(world, now->second);
      for (Copy& copy : copies) give(copy.world, now->second);
    }
    const TickReport report = tickWorld(world);
    if (!copies.empty()) events += report.contacts.size();
    for (Copy& copy : copies) {
      const TickReport other = tickWorld(copy.world);
      ASSERT_EQ(findDifference(report, other), "")
          << "tick " << t + 1 << ", copied at tick " << copy.from;
    }
    std::erase_if(copies, [&](const Copy& copy) { return t + 1 >= copy.from + duration; });
  }
  EXPECT_GT(events, 50u) << "events occur while the copies run";
}

}  // namespace enfilade::scene::testing
