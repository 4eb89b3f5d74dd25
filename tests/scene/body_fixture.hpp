// A world with bodies and everything that its ticks told, for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "scene/world/data/world_data.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene::testing {

inline BodySpec bodySpec(const std::string& name, BodyKind kind,
                         std::vector<std::uint32_t> objects) {
  BodySpec spec;
  spec.name = name;
  spec.kind = kind;
  spec.objects = std::move(objects);
  return spec;
}

/// The verdict of every avatar on every triangle, part and other avatar, one after another: the
/// slow twin of TickReport::worstPenetration.
inline std::string whoPenetrates(const World& world) {
  const WorldState& state = world.state();
  std::string found;
  const auto penetrates = [](const collision::ConvexBody& a, const collision::ConvexBody& b) {
    collision::FeatureCache cache;
    return collision::decide(a, b, cache).verdict == collision::Verdict::penetrating;
  };
  for (const auto& [name, avatar] : state.avatars) {
    for (const AvatarPart& limb : avatar.shape->parts) {
      const collision::ConvexBody hull = bodyAt(limb, avatar.feet);
      for (const std::uint32_t object : state.scene->solidObjects())
        for (const collision::Triangle& t : solidTriangles(state.scene->model(), object))
          if (penetrates(hull, {std::span<const Vec3>(t), Vec3::Zero()}))
            found += name + " in " + state.scene->model().objects[object].path + "; ";
      for (const Body& body : state.bodies)
        for (std::uint32_t i = 0; i < body.shape->parts.size(); ++i)
          if (body.spec->kind != BodyKind::trigger && penetrates(hull, partOf(body, i)))
            found += name + " in " + body.spec->name + "; ";
      for (const auto& [otherName, other] : state.avatars)
        for (const AvatarPart& otherLimb : other.shape->parts)
          if (otherName > name && penetrates(hull, bodyAt(otherLimb, other.feet)))
            found += name + " in " + otherName + "; ";
    }
  }
  return found;
}

struct BodyTrial {
  explicit BodyTrial(Model model, const Lengths& lengths = {})
      : world(std::make_shared<const Scene>(std::move(model)), lengths) {}

  void order(const std::string& name, Order o) {
    const auto why = submit(world, {name, std::move(o), 0});
    ASSERT_FALSE(why) << *why;
  }
  void tell(BodyCommand command) {
    const auto why = submit(world, std::move(command));
    ASSERT_FALSE(why) << *why;
  }
  TickReport step() {
    TickReport report = tick(world);
    EXPECT_EQ(report.worstPenetration, 0) << "tick " << report.snapshot->tick;
    events.insert(events.end(), report.contacts.begin(), report.contacts.end());
    return report;
  }
  void ticks(int count) {
    for (int i = 0; i < count; ++i) step();
  }
  void untilIdle() {
    for (int i = 0; i < 3600; ++i)
      if (step().idle) return;
    FAIL() << "not idle after a minute";
  }
  Vec3 feet(const std::string& name) const { return world.state().avatars.at(name).feet; }
  const Body& body(const std::string& name) const {
    for (const Body& b : world.state().bodies)
      if (b.spec->name == name) return b;
    throw std::out_of_range(name);
  }
  int told(ContactEvent::Kind kind, const std::string& a, const std::string& b) const {
    return static_cast<int>(std::count_if(events.begin(), events.end(), [&](const ContactEvent& e) {
      return e.kind == kind && nameOf(world, e.a) == a && nameOf(world, e.b) == b;
    }));
  }

  World world;
  std::vector<ContactEvent> events;
};

}  // namespace enfilade::scene::testing
