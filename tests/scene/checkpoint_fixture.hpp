// Two worlds that ought to go on alike, and commands for them.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "scene/world/checkpoint/checkpoint.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene::testing {

/// What a world is told before each tick; the same for the same seed.
struct ToldOnce {
  std::vector<Command> avatars;
  std::vector<BodyCommand> bodies;
};

inline void give(World& world, const ToldOnce& told) {
  // What is refused is refused in both worlds.
  for (const Command& command : told.avatars) submit(world, command);
  for (const BodyCommand& command : told.bodies) submit(world, command);
}

inline bool same(const Vec3& a, const Vec3& b) {
  return a == b;
}
inline bool same(const collision::Decision& a, const collision::Decision& b) {
  return a.verdict == b.verdict && a.decidedBy == b.decidedBy && a.distance == b.distance &&
         a.errorBound == b.errorBound && same(a.pointA, b.pointA) && same(a.pointB, b.pointB) &&
         same(a.normal, b.normal) && a.featureA == b.featureA && a.featureB == b.featureB;
}
inline bool same(const ContactEvent& a, const ContactEvent& b) {
  return a.tick == b.tick && a.kind == b.kind && a.reason == b.reason && a.phase == b.phase &&
         a.a == b.a && a.b == b.b && same(a.decision, b.decision);
}
inline bool same(const Notice& a, const Notice& b) {
  return a.kind == b.kind && a.avatar == b.avatar && a.id == b.id && a.tag == b.tag &&
         same(a.position, b.position) && a.obstacle == b.obstacle && a.text == b.text;
}
inline bool same(const AvatarView& a, const AvatarView& b) {
  bool joints = a.joints.size() == b.joints.size();
  for (std::size_t i = 0; joints && i < a.joints.size(); ++i)
    joints =
        a.joints[i].value == b.joints[i].value && a.joints[i].stoppedBy == b.joints[i].stoppedBy;
  return joints && a.id == b.id && a.name == b.name && same(a.feet, b.feet) &&
         same(a.gaze, b.gaze) && a.eyeHeight == b.eyeHeight && a.grounded == b.grounded &&
         a.flying == b.flying && a.standsOn == b.standsOn && a.height == b.height &&
         same(a.move.asked, b.move.asked) && same(a.move.made, b.move.made) &&
         a.move.stoppedBy == b.move.stoppedBy && same(a.move.decision, b.move.decision);
}
inline bool same(const BodyView& a, const BodyView& b) {
  return a.id == b.id && a.index == b.index && same(a.pose.translation, b.pose.translation) &&
         a.pose.rotation.coeffs() == b.pose.rotation.coeffs() && a.displaced == b.displaced &&
         a.coordinate == b.coordinate && same(a.velocity, b.velocity) && same(a.spin, b.spin) &&
         a.swing == b.swing && a.moving == b.moving && a.blockedBy == b.blockedBy;
}
template <class List>
bool sameLists(const List& a, const List& b) {
  bool all = a.size() == b.size();
  for (std::size_t i = 0; all && i < a.size(); ++i) all = same(a[i], b[i]);
  return all;
}

/// The first thing that two ticks told differently; "" when there is none.
inline std::string difference(const TickReport& a, const TickReport& b) {
  if (a.snapshot->stateHash != b.snapshot->stateHash) return "state hash";
  if (!sameLists(a.contacts, b.contacts)) return "contacts";
  if (!sameLists(a.notices, b.notices)) return "notices";
  if (!sameLists(a.snapshot->avatars, b.snapshot->avatars)) return "avatars";
  if (!sameLists(*a.snapshot->bodies, *b.snapshot->bodies)) return "bodies";
  if (a.pairs != b.pairs) return "pairs";
  if (a.narrowQueries != b.narrowQueries) return "narrow queries";
  if (a.rationalQueries != b.rationalQueries) return "rational queries";
  if (a.boundedSweeps != b.boundedSweeps || a.squeezedBodies != b.squeezedBodies) return "counts";
  if (a.liveContacts != b.liveContacts) return "live contacts";
  if (a.worstPenetration != b.worstPenetration) return "penetration";
  return a.idle == b.idle ? "" : "idle";
}

/// Runs a world by `told` to `until`; with a copy made at each tick of `at`, which goes on beside
/// it for `beside` ticks and must tell the same.
inline void goOnAlike(const std::shared_ptr<const Scene>& scene, const Lengths& lengths,
                      const std::map<std::uint64_t, ToldOnce>& told, std::uint64_t until,
                      const std::vector<std::uint64_t>& at, std::uint64_t beside) {
  World world(scene, lengths);
  struct Copy {
    std::uint64_t from;
    World world;
  };
  std::vector<Copy> copies;
  std::size_t made = 0, events = 0;
  for (std::uint64_t t = 0; t < until; ++t) {
    const auto now = told.find(t + 1);
    if (std::find(at.begin(), at.end(), t) != at.end()) {
      // Half of the copies are made while commands wait.
      const bool waiting = now != told.end() && made++ % 2 == 0;
      if (waiting) give(world, now->second);
      const auto bytes = checkpointOf(world);
      copies.push_back({t, worldFrom(scene, bytes)});
      ASSERT_EQ(checkpointOf(copies.back().world), bytes) << "tick " << t;
      ASSERT_EQ(copies.back().world.snapshot()->stateHash, world.snapshot()->stateHash);
      ASSERT_TRUE(sameLists(*copies.back().world.snapshot()->bodies, *world.snapshot()->bodies));
      for (Copy& copy : copies)
        if (now != told.end() && &copy != &copies.back()) give(copy.world, now->second);
      if (!waiting && now != told.end())
        give(world, now->second), give(copies.back().world, now->second);
    } else if (now != told.end()) {
      give(world, now->second);
      for (Copy& copy : copies) give(copy.world, now->second);
    }
    const TickReport report = tick(world);
    if (!copies.empty()) events += report.contacts.size();
    for (Copy& copy : copies) {
      const TickReport other = tick(copy.world);
      ASSERT_EQ(difference(report, other), "")
          << "tick " << t + 1 << ", copied at tick " << copy.from;
    }
    std::erase_if(copies, [&](const Copy& copy) { return t + 1 >= copy.from + beside; });
  }
  EXPECT_GT(events, 50u) << "something happens beside the copies";
}

}  // namespace enfilade::scene::testing
