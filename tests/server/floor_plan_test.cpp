// Floor plans as data: shapes by what they are, and the same plan behind a socket.
#include "server/floors/floor_plan.hpp"

#include <algorithm>
#include <cmath>

#include "server/floors/plan_messages.hpp"
#include "tests/scene/prism_space.hpp"
#include "tests/server/body_room.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

using Kind = PlanShape::Kind;

std::vector<const PlanShape*> findShapes(const FloorPlan& plan, Kind kind) {
  std::vector<const PlanShape*> found;
  for (const PlanShape& shape : plan.shapes)
    if (shape.kind == kind) found.push_back(&shape);
  return found;
}

/// The room with bodies, a shelf, a sliding door, a lift, a storey with a room, and north.
scene::Model makeFurnishedRoom() {
  scene::Model model = makeBodyRoomModel();
  const auto addBox = [&](const char* name, const Vec3& min, const Vec3& max) {
    const scene::Model box = scene::testing::makeBoxModel({{name, min, max}});
    scene::Object object = box.objects.front();
    object.meshes = {static_cast<std::uint32_t>(model.meshes.size())};
    model.meshes.push_back(box.meshes.front());
    model.objects.push_back(std::move(object));
    return static_cast<std::uint32_t>(model.objects.size() - 1);
  };
  addBox("shelf", {-8, 0, -8}, {-7, 1.5, -7});
  scene::BodySpec slide, lift;
  slide.name = "slide", slide.kind = scene::BodyKind::sliding;
  slide.objects = {addBox("panel", {-4, 0, 5}, {-3, 2.5, 5.1})};
  slide.axis = Vec3::UnitX(), slide.high = 0.9, slide.speed = 1;
  lift.name = "lift", lift.kind = scene::BodyKind::lift;
  lift.objects = {addBox("cabin", {-8, 0.02, 6}, {-6, 0.1, 8})};
  lift.axis = Vec3::UnitY(), lift.high = 2, lift.stops = {0, 2}, lift.speed = 1;
  model.bodies.push_back(slide);
  model.bodies.push_back(lift);
  model.storeys = {{"Ground", "", 0}};
  for (scene::Object& object : model.objects) object.storey = 0;
  model.spaces = {tests::makePrism({{2, 2}, {2, 6}, {0, 6}, {0, 0}, {6, 0}, {6, 2}}, 2.5)};
  model.spaces[0].storey = 0, model.spaces[0].longName = "Corridor", model.spaces[0].name = "017";
  model.spaces[0].globalId = "2O2Fr$t4X7Zf8NOew3FLOH";
  model.north = Eigen::Vector2d(0.6, -0.8);
  return model;
}

FloorPlan computePlanOfFurnishedRoom() {
  return computeFloorPlan(scene::Scene(makeFurnishedRoom()), {0, "Ground", 0});
}

TEST(FloorPlan, WallsFurnitureAndBodiesAreToldApart) {
  const FloorPlan plan = computePlanOfFurnishedRoom();
  const auto walls = findShapes(plan, Kind::wall);
  ASSERT_EQ(walls.size(), 3u) << "left, right and end";
  for (const PlanShape* wall : walls) EXPECT_EQ(wall->loops.size(), 1u);
  ASSERT_EQ(findShapes(plan, Kind::furniture).size(), 1u);
  EXPECT_EQ(findShapes(plan, Kind::furniture)[0]->entity, kCrate + 1u) << "the shelf";
  EXPECT_EQ(findShapes(plan, Kind::body).size(), 1u) << "the crate; the zone is not solid";
  EXPECT_EQ(findShapes(plan, Kind::door).size(), 2u);
  // Walls come after furniture, so that their edges stay sharp.
  const auto isWall = [](const PlanShape& shape) { return shape.kind == Kind::wall; };
  EXPECT_GT(std::ranges::find_if(plan.shapes, isWall), plan.shapes.begin());
  ASSERT_EQ(plan.rooms.size(), 1u);
  EXPECT_EQ(plan.rooms[0].longName, "Corridor");
}

TEST(FloorPlan, DoorsHaveTheirSwing) {
  const FloorPlan plan = computePlanOfFurnishedRoom();
  const auto open = findShapes(plan, Kind::openDoor), swings = findShapes(plan, Kind::swing);
  ASSERT_EQ(open.size(), 1u) << "the closed limit has none";
  ASSERT_EQ(swings.size(), 2u) << "an arc, and the open panel";
  // 1.6 radians from +z towards +x, around the hinge at (2.04, -0.6).
  const Vec3 hinge(2.04, 0, -0.6), end = open[0]->lines.at(0).at(1);
  EXPECT_GT(end.x(), hinge.x() + 1.1);
  EXPECT_LT(end.z(), hinge.z() + 0.05);
  for (const Vec3& point : swings[0]->lines.at(0))
    EXPECT_NEAR(std::hypot(point.x() - hinge.x(), point.z() - hinge.z()),
                std::hypot(end.x() - hinge.x(), end.z() - hinge.z()), 1e-9);
  double right = -100;
  for (const Vec3& point : swings[1]->loops.at(0)) right = std::max(right, point.x());
  EXPECT_NEAR(right, -3 + 0.9, 1e-9);
  ASSERT_EQ(findShapes(plan, Kind::lift).size(), 1u);
  EXPECT_EQ(findShapes(plan, Kind::lift)[0]->lines.size(), 2u) << "diagonals";
}

TEST(FloorPlan, AHingeThatTurnsOftenHasOneWholeArc) {
  scene::Model model = makeBodyRoomModel();
  model.bodies[0].low = -1e6, model.bodies[0].high = 1e6;
  const FloorPlan plan = computeFloorPlan(scene::Scene(std::move(model)), {});
  const auto swings = findShapes(plan, Kind::swing);
  ASSERT_EQ(swings.size(), 2u);
  for (const PlanShape* swing : swings) {
    EXPECT_LT(swing->lines.at(0).size(), 200u);
    EXPECT_LT((swing->lines[0].front() - swing->lines[0].back()).norm(), 1e-9);
  }
}

void expectEqual(const FloorPlan& a, const FloorPlan& b) {
  EXPECT_EQ(a.floor, b.floor);
  EXPECT_EQ(a.storey, b.storey);
  EXPECT_EQ(a.north, b.north);
  ASSERT_EQ(a.shapes.size(), b.shapes.size());
  for (std::size_t i = 0; i < a.shapes.size(); ++i) {
    EXPECT_EQ(a.shapes[i].kind, b.shapes[i].kind);
    EXPECT_EQ(a.shapes[i].entity, b.shapes[i].entity);
    EXPECT_EQ(a.shapes[i].loops, b.shapes[i].loops);
    EXPECT_EQ(a.shapes[i].lines, b.shapes[i].lines);
  }
  ASSERT_EQ(a.rooms.size(), b.rooms.size());
  for (std::size_t i = 0; i < a.rooms.size(); ++i) {
    EXPECT_EQ(a.rooms[i].name, b.rooms[i].name);
    EXPECT_EQ(a.rooms[i].longName, b.rooms[i].longName);
    EXPECT_EQ(a.rooms[i].globalId, b.rooms[i].globalId);
    EXPECT_EQ(a.rooms[i].surface, b.rooms[i].surface);
    EXPECT_EQ(a.rooms[i].box.min, b.rooms[i].box.min);
    EXPECT_EQ(a.rooms[i].box.max, b.rooms[i].box.max);
  }
}

using ServedPlan = ServedRoom;

TEST_F(ServedPlan, IsThatOfTheSceneToTheLastBit) {
  const auto scene = std::make_shared<const scene::Scene>(makeFurnishedRoom());
  serve({}, scene);
  const FloorPlan received = floorPlanFromProto(makeClient("ann").floorPlan(0.3));
  EXPECT_EQ(received.floor, 0.3) << "the storey near a floor keeps the height that was given";
  EXPECT_EQ(received.storey, "Ground");
  expectEqual(received, makeFloorPlanSource(scene)(0.3).value());
  EXPECT_EQ(findShapes(received, Kind::wall).size(), 3u);
  const FloorPlan above = floorPlanFromProto(makeClient("bob").floorPlan(20));
  EXPECT_TRUE(findShapes(above, Kind::wall).empty());
  EXPECT_TRUE(above.rooms.empty() && above.storey.empty());
}

TEST_F(ServedPlan, ThatDoesNotFitAReplyIsRefused) {
  ServerLimits limits;
  limits.replyBytes = 200;
  serve(limits);
  try {
    makeClient("ann").floorPlan(0);
    FAIL() << "no refusal";
  } catch (const protocol::ProtocolError& refused) {
    EXPECT_EQ(refused.code, v1::ERROR_TOO_LARGE);
    EXPECT_EQ(refused.field, "floor_plan.floor");
  }
}

}  // namespace
}  // namespace enfilade::server::testing
