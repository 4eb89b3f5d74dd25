// The storey and the room of contacts.
#include "server/messages/event_place.hpp"

#include <gtest/gtest.h>

#include "server/messages/world_messages.hpp"
#include "tests/server/small_room.hpp"

namespace enfilade::server::testing {
namespace {

using scene::Vec3;

/// Two storeys; on the ground floor a hall of 10 x 10 m, and in a corner of it a booth of 2 x 2 m.
/// Object 1 is in the upper storey, object 2 in none.
scene::Model makeHouse() {
  scene::Model model;
  model.storeys = {{"Ground", "", 0}, {"Upper", "", 3}};
  model.spaces = {{"1", "Hall", "", 0, {Vec3(0, 0, 0), Vec3(10, 2.8, 10)}},
                  {"2", "Booth", "", std::nullopt, {Vec3(8, 0, 8), Vec3(10, 2.8, 10)}},
                  {"3", "Nowhere", "", 0, {}}};
  model.objects.resize(2);
  model.objects[0].storey = 1;
  return model;
}

scene::ContactEvent makeContact(const Vec3& point, scene::EntityId b) {
  scene::ContactEvent event;
  event.a = 3;
  event.b = b;
  event.separation.pointA = event.separation.pointB = point;
  event.separation.normal = Vec3::UnitX();
  return event;
}

void expectPlace(const scene::ContactEvent& event, const std::string& storey,
                 const std::string& room, const std::string& name) {
  const scene::Model model = makeHouse();
  const EventPlace place = findEventPlace(model, event);
  EXPECT_EQ(place.storey, storey);
  EXPECT_EQ(place.room, room);
  EXPECT_EQ(place.roomName, name);
}

TEST(EventPlace, IsTheSmallestRoomAroundThePoint) {
  expectPlace(makeContact({1, 1, 1}, 1), "Ground", "1", "Hall");
  expectPlace(makeContact({9, 1, 9}, 2), "Ground", "2", "Booth");
  expectPlace(makeContact({-0.04, 1, 1}, 2), "Ground", "1", "Hall");
}

TEST(EventPlace, WithoutARoomTheStoreyIsThatOfTheObjectOrTheLevelBelow) {
  expectPlace(makeContact({20, 0.5, 1}, 1), "Upper", "", "");
  expectPlace(makeContact({20, 4, 1}, 2), "Upper", "", "");
  expectPlace(makeContact({20, 2.9, 1}, 2), "Ground", "", "");
  expectPlace(makeContact({20, -7, 1}, 2), "Ground", "", "");
}

TEST(EventPlace, IsUnknownForEventsWithoutAPointAndScenesWithoutStoreys) {
  expectPlace(makeContact({1, 1, 1}, 0), "", "", "");
  scene::ContactEvent nowhere = makeContact(Vec3::Zero(), 1);
  nowhere.separation.normal.setZero();
  expectPlace(nowhere, "", "", "");
  EXPECT_EQ(findEventPlace(scene::Model(), makeContact({1, 1, 1}, 1)).storey, "");
}

TEST(EventPlace, IsInTheMessage) {
  scene::Model model = smallRoom()->model();
  model.storeys = {{"Ground", "", 0}};
  model.spaces = {{"101", "Kitchen", "", 0, {Vec3(-50, -1, -50), Vec3(50, 5, 50)}}};
  const scene::World world(std::make_shared<const scene::Scene>(std::move(model)), {});
  const v1::ContactEvent message = toProto(world, makeContact({1, 1, 1}, 1));
  EXPECT_EQ(message.storey(), "Ground");
  EXPECT_EQ(message.room(), "101");
  EXPECT_EQ(message.room_name(), "Kitchen");
}

}  // namespace
}  // namespace enfilade::server::testing
