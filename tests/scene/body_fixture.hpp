// Test fixture: a world with bodies, and all events that its ticks report.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "scene/world/data/world_data.hpp"
#include "scene/world/world.hpp"
#include "tests/scene/box_scene.hpp"
#include "tests/scene/world_controls.hpp"

namespace enfilade::scene::testing {

inline constexpr double kQuarter = 1.5707963267948966;  ///< of a turn, radians

inline BodySpec makeBodySpec(const std::string& name, BodyKind kind,
                             std::vector<std::uint32_t> objects) {
  BodySpec spec;
  spec.name = name;
  spec.kind = kind;
  spec.objects = std::move(objects);
  return spec;
}

/// Names every penetrating pair by the exact verdict of each avatar on each triangle, part and
/// other avatar. Reference implementation of TickReport::maxPenetration.
inline std::string namePenetratingPairs(const World& world) {
  const WorldData& state = world.data();
  std::string found;
  const auto penetrates = [](const collision::PlacedConvex& a, const collision::PlacedConvex& b) {
    collision::FeatureCache cache;
    return collision::computeSeparation(a, b, cache).verdict == collision::Verdict::penetrating;
  };
  for (const Avatar& avatar : state.avatars) {
    for (const AvatarPart& limb : avatar.shape->parts) {
      const collision::PlacedConvex hull = placeAvatarPart(limb, avatar.footPosition);
      for (const std::uint32_t object : state.scene->solidObjects())
        for (const collision::Triangle& t : collectSolidTriangles(state.scene->model(), object))
          if (penetrates(hull, {std::span<const Vec3>(t), Vec3::Zero()}))
            found += avatar.name + " in " + state.scene->model().objects[object].path + "; ";
      for (const Body& body : state.bodies)
        for (std::uint32_t i = 0; i < body.shape->parts.size(); ++i)
          if (body.spec->kind != BodyKind::trigger && penetrates(hull, makePlacedPart(body, i)))
            found += avatar.name + " in " + body.spec->name + "; ";
      for (const Avatar& other : state.avatars)
        for (const AvatarPart& otherLimb : other.shape->parts)
          if (other.name > avatar.name &&
              penetrates(hull, placeAvatarPart(otherLimb, other.footPosition)))
            found += avatar.name + " in " + other.name + "; ";
    }
  }
  return found;
}

struct BodyFixture : WorldControls<BodyFixture> {
  explicit BodyFixture(Model model, const WorldSettings& settings = {})
      : world(std::make_shared<const Scene>(std::move(model)), settings) {}

  void submit(BodyCommand command) {
    const auto why = submitBodyCommand(world, std::move(command));
    ASSERT_FALSE(why) << *why;
  }
  TickReport step() {
    TickReport report = tickWorld(world);
    EXPECT_EQ(report.maxPenetration, 0) << "tick " << report.snapshot->tick;
    events.insert(events.end(), report.contacts.begin(), report.contacts.end());
    return report;
  }
  Vec3 getFeet(const std::string& name) const {
    return world.data().findAvatarByName(name)->footPosition;
  }
  const Body& getBody(const std::string& name) const {
    for (const Body& b : world.data().bodies)
      if (b.spec->name == name) return b;
    throw std::out_of_range(name);
  }
  int countEvents(ContactEvent::Kind kind, const std::string& a, const std::string& b) const {
    return static_cast<int>(std::count_if(events.begin(), events.end(), [&](const ContactEvent& e) {
      return e.kind == kind && findEntityName(world, e.a) == a && findEntityName(world, e.b) == b;
    }));
  }

  World world;
  std::vector<ContactEvent> events;
};

}  // namespace enfilade::scene::testing
