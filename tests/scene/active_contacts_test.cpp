#include "scene/world/active_contacts.hpp"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "tests/scene/body_fixture.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Event = ContactEvent::Kind;
using Living = std::set<std::tuple<EntityId, EntityId, Event>>;

/// A wall, a volume, and a tower of boxes with an avatar that walks into it.
std::shared_ptr<const Scene> makeTowerRoom() {
  std::vector<NamedBox> boxes{
      makeFloorBox(), {"wall", {5, 0, -10}, {5.2, 3, 10}}, {"zone", {-1, 0, -1}, {1, 2, 1}}};
  for (int i = 0; i < 3; ++i)
    boxes.push_back({"box" + std::to_string(i), {3, 0.301 * i, -0.2}, {3.4, 0.301 * i + 0.3, 0.2}});
  Model model = makeBoxModel(boxes);
  model.bodies = {makeBodySpec("zone", BodyKind::trigger, {2})};
  for (std::uint32_t i = 3; i < 6; ++i)
    model.bodies.push_back(makeBodySpec(boxes[i].path, BodyKind::rigid, {i}));
  return std::make_shared<const Scene>(std::move(model));
}

/// Applies begin and end events: keeps the contacts that began and did not end.
void follow(Living& living, const std::vector<ContactEvent>& events) {
  for (const ContactEvent& event : events) {
    if (event.kind == Event::begin || event.kind == Event::enter)
      living.insert({event.a, event.b, event.kind});
    if (event.kind == Event::end) living.erase({event.a, event.b, Event::begin});
    if (event.kind == Event::leave) living.erase({event.a, event.b, Event::enter});
  }
}

TEST(ActiveContacts, AreTheReportedBeginsWithoutAnEnd) {
  World world(makeTowerRoom());
  submitAvatarCommand(world, {"ann", Spawn{{-4, 0, 0}}});
  submitAvatarCommand(world, {"ann", Walk{{Vec3(8, 0, 0)}}});
  submitAvatarCommand(world, {"bob", Spawn{{4, 0, 4}}});
  submitAvatarCommand(world, {"bob", Walk{{Vec3(4.6, 0, 0), Vec3(-4, 0, 0)}}});
  Living followed;
  std::size_t entered = 0, ended = 0, betweenBodies = 0;
  for (int tick = 0; tick < 600; ++tick) {
    if (tick == 500) submitAvatarCommand(world, {"bob", Leave{}});
    const std::size_t before = followed.size();
    follow(followed, enfilade::scene::tickWorld(world).contacts);
    Living living;
    for (const ContactEvent& event : collectActiveContacts(world)) {
      EXPECT_TRUE(living.insert({event.a, event.b, event.kind}).second);
      entered += event.kind == Event::enter ? 1 : 0;
      betweenBodies += event.kind == Event::begin && event.a <= 6 ? 1 : 0;
    }
    ended += followed.size() < before ? 1 : 0;
    ASSERT_EQ(living, followed) << "tick " << tick;
  }
  EXPECT_GT(entered, 0u);
  EXPECT_GT(ended, 0u);
  EXPECT_GT(betweenBodies, 0u);
}

}  // namespace
}  // namespace enfilade::scene
