// A world of boxes or of any model, and everything that its ticks told.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "scene/world/world.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene::testing {

/// A world and everything that its ticks told.
struct Trial {
  explicit Trial(const std::vector<NamedBox>& boxes, const Lengths& lengths = {})
      : Trial(boxScene(boxes), lengths) {}
  explicit Trial(std::shared_ptr<const Scene> scene, const Lengths& lengths = {})
      : world(std::move(scene), lengths) {}

  void order(const std::string& name, Order o) {
    const auto why = submit(world, {name, std::move(o), 0});
    ASSERT_FALSE(why) << *why;
  }
  void ticks(int count) {
    for (int i = 0; i < count; ++i) step();
  }
  /// Steps until every queue is empty; fails after a simulated minute.
  void untilIdle() {
    for (int i = 0; i < 3600; ++i)
      if (step().idle) return;
    FAIL() << "not idle after a minute";
  }
  TickReport step() {
    TickReport report = tick(world);
    worstPenetration = std::max(worstPenetration, report.worstPenetration);
    notices.insert(notices.end(), report.notices.begin(), report.notices.end());
    for (const ContactEvent& e : report.contacts) take(e);
    return report;
  }
  void take(const ContactEvent& e) {
    events.push_back(e);
    const std::pair pair(e.a, e.b);
    if (e.kind == ContactEvent::Kind::begin) {
      EXPECT_TRUE(open.insert(pair).second) << "begun twice";
      EXPECT_LT(e.decision.distance, 2 * world.lengths().epsilon);
    }
    if (e.kind == ContactEvent::Kind::end) {
      EXPECT_EQ(open.erase(pair), 1u) << "ended, not begun";
    }
  }
  AvatarView view(const std::string& name) const {
    for (const AvatarView& a : world.snapshot()->avatars)
      if (a.name == name) return a;
    ADD_FAILURE() << name << " is not in the world";
    return {};
  }
  Vec3 feet(const std::string& name) const { return view(name).feet; }
  /// The text of the last notice of this kind; "" for none.
  std::string text(Notice::Kind kind) const {
    std::string found;
    for (const Notice& n : notices)
      if (n.kind == kind) found = n.text;
    return found;
  }
  int count(Notice::Kind kind) const {
    return static_cast<int>(std::count_if(notices.begin(), notices.end(),
                                          [&](const Notice& n) { return n.kind == kind; }));
  }
  bool touched(const std::string& name) const {
    return std::any_of(events.begin(), events.end(), [&](const ContactEvent& e) {
      return e.kind == ContactEvent::Kind::begin && nameOf(world, e.b) == name;
    });
  }

  World world;
  std::vector<Notice> notices;
  std::vector<ContactEvent> events;
  std::set<std::pair<EntityId, EntityId>> open;
  double worstPenetration = 0;
};

/// The scene of a world that outlives what is asked of it.
inline std::shared_ptr<const Scene> sharedScene(const World& world) {
  return {std::shared_ptr<void>(), &world.scene()};
}

inline Walk to(double x, double z, double speed = 1.5, double y = 0) {
  return {{{x, y, z}}, speed};
}

}  // namespace enfilade::scene::testing
