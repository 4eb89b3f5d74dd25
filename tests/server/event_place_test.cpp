// The storey and the room of contacts.
#include "server/messages/event_place.hpp"

#include <gtest/gtest.h>

#include "server/messages/world_messages.hpp"
#include "tests/server/small_room.hpp"

namespace enfilade::server::testing {
namespace {

using scene::Vec3;

/// Two storeys. On the ground floor a hall of 10 x 10 m, and in a corner of it a booth of 2 x 2 m.
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

TEST(EventPlace, IsNotTheRoomWhoseNotchContainsThePoint) {
  scene::Model model;
  model.spaces = {{"L", "", "", std::nullopt, {Vec3(0, 0, 0), Vec3(6, 2.5, 6)}},
                  {"H", "", "", std::nullopt, {Vec3(2, 0, 2), Vec3(12, 2.5, 12)}}};
  // The L's triangles: walls along its outline, floor and ceiling of three squares.
  const std::vector<Vec3> outline{{0, 0, 0}, {0, 0, 6}, {2, 0, 6}, {2, 0, 2}, {6, 0, 2}, {6, 0, 0}};
  const Vec3 up(0, 2.5, 0);
  std::vector<Vec3>& surface = model.spaces[0].surface;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec3 a = outline[i], b = outline[(i + 1) % outline.size()];
    for (const Vec3& corner : {a, b, Vec3(b + up), a, Vec3(b + up), Vec3(a + up)})
      surface.push_back(corner);
  }
  for (const auto& [i, j, k] : {std::array{0, 3, 1}, {1, 3, 2}, {0, 5, 3}, {3, 5, 4}}) {
    const Vec3 a = outline[i], b = outline[j], c = outline[k];
    for (const Vec3& corner : {a, b, c, Vec3(a + up), Vec3(c + up), Vec3(b + up)})
      surface.push_back(corner);
  }
  EXPECT_EQ(findEventPlace(model, makeContact({4, 1, 4}, 1)).room, "H");
  EXPECT_EQ(findEventPlace(model, makeContact({1, 1, 5}, 1)).room, "L");
  EXPECT_EQ(findEventPlace(model, makeContact({5, 1, 1}, 1)).room, "L");
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
  scene::Model model = makeSmallRoom()->model();
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
