// Test fixture: a world of boxes or of any model, and all events that its ticks report.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "scene/world/world.hpp"
#include "tests/scene/box_scene.hpp"
#include "tests/scene/world_controls.hpp"

namespace enfilade::scene::testing {

/// A world and all events that its ticks reported.
struct WorldFixture : WorldControls<WorldFixture> {
  explicit WorldFixture(const std::vector<NamedBox>& boxes, const WorldSettings& settings = {})
      : WorldFixture(makeBoxScene(boxes), settings) {}
  explicit WorldFixture(std::shared_ptr<const Scene> scene, const WorldSettings& settings = {})
      : world(std::move(scene), settings) {}

  TickReport step() {
    TickReport report = tickWorld(world);
    worstPenetration = std::max(worstPenetration, report.maxPenetration);
    notices.insert(notices.end(), report.notices.begin(), report.notices.end());
    for (const ContactEvent& e : report.contacts) take(e);
    return report;
  }
  void take(const ContactEvent& e) {
    events.push_back(e);
    const std::pair pair(e.a, e.b);
    if (e.kind == ContactEvent::Kind::begin) {
      EXPECT_TRUE(open.insert(pair).second) << "begun twice";
      EXPECT_LT(e.separation.distance, 2 * world.settings().contactOffset);
    }
    if (e.kind == ContactEvent::Kind::end) {
      EXPECT_EQ(open.erase(pair), 1u) << "ended, not begun";
    }
  }
  AvatarSnapshot getView(const std::string& name) const {
    for (const AvatarSnapshot& a : world.snapshot()->avatars)
      if (a.name == name) return a;
    ADD_FAILURE() << name << " is not in the world";
    return {};
  }
  Vec3 getFeet(const std::string& name) const { return getView(name).footPosition; }
  /// The text of the last notice of this kind; "" if there was none.
  std::string getText(Notice::Kind kind) const {
    std::string found;
    for (const Notice& n : notices)
      if (n.kind == kind) found = n.text;
    return found;
  }
  int count(Notice::Kind kind) const {
    return static_cast<int>(std::count_if(notices.begin(), notices.end(),
                                          [&](const Notice& n) { return n.kind == kind; }));
  }
  bool hasTouched(const std::string& name) const {
    return std::any_of(events.begin(), events.end(), [&](const ContactEvent& e) {
      return e.kind == ContactEvent::Kind::begin && findEntityName(world, e.b) == name;
    });
  }

  World world;
  std::vector<Notice> notices;
  std::vector<ContactEvent> events;
  std::set<std::pair<EntityId, EntityId>> open;
  double worstPenetration = 0;
};

/// The scene of a world, not owned: the world outlives the queries on it.
inline std::shared_ptr<const Scene> borrowScene(const World& world) {
  return {std::shared_ptr<void>(), &world.scene()};
}

inline Walk makeWalkTo(double x, double z, double speed = 1.5, double y = 0) {
  return {{{x, y, z}}, speed};
}

}  // namespace enfilade::scene::testing
