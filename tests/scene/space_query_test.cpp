// The room of a point, and the middle of a room: by the solid of its space, not by its box.
#include "scene/world/queries/space_query.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "scene/import/import_model.hpp"
#include "scene/model/shapes/space_solid.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/hand_made_ifc.hpp"
#include "tests/scene/prism_space.hpp"
#include "tests/support/web_ifc_here.hpp"

namespace enfilade::scene {
namespace {

using tests::IfcHouse;
using tests::makeReaderOptions;
using tests::TemporaryFolder;

constexpr double kReach = 0.05;

/// The number of the room at a point of the file: x, y, z up. "": none.
std::string findRoomAt(const Model& model, double x, double y, double z) {
  const Space* space = findSpace(model, Vec3(x, z, -y), kReach);
  return space == nullptr ? "" : space->name;
}

/// A corridor "L" along two sides of a square of 6 m. A larger hall "H" begins in the notch of the
/// L, behind a wall of 0.2 m. In the hall a booth "B" of 1 m, without a wall of its own.
std::string makeRooms() {
  IfcHouse house;
  const auto space = [&](int id, const std::string& name, const std::string& shape) {
    const std::string n = std::to_string(id);
    return shape + "#" + n + "=IFCSPACE('0000000000000000Space" + name + "',$,'" + name +
           "',$,$,#15,#" + std::to_string(id + 15) + ",$,.ELEMENT.,.INTERNAL.,$);\n";
  };
  house.more =
      space(500, "L", house.makePrism(510, {{0, 0}, {6, 0}, {6, 2}, {2, 2}, {2, 6}, {0, 6}}, 2.5)) +
      space(550, "H", house.makePrism(560, {{2.2, 2.2}, {12, 2.2}, {12, 12}, {2.2, 12}}, 2.5)) +
      space(600, "B", house.makePrism(610, {{11, 11}, {12, 11}, {12, 12}, {11, 12}}, 2.2)) +
      "#650=IFCRELAGGREGATES('0000000000000000000650',$,$,$,#41,(#500,#550,#600));\n";
  return house.makeText();
}

/// By each reader that is here.
std::vector<Model> importRooms() {
  const TemporaryFolder folder;
  const auto file = folder.write("rooms.ifc", makeRooms());
  std::vector<Model> models;
  for (const IfcReader reader : tests::listReadersHere())
    models.push_back(importModel(file, makeReaderOptions(reader)));
  return models;
}

TEST(SpaceQuery, ARoomShapedLikeAnLDoesNotClaimItsNotch) {
  for (const Model& model : importRooms()) {
    SCOPED_TRACE(model.reader);
    ASSERT_EQ(model.spaces.size(), 3u);
    EXPECT_EQ(findRoomAt(model, 1, 5, 1), "L");
    EXPECT_EQ(findRoomAt(model, 5, 1, 1), "L");
    EXPECT_EQ(findRoomAt(model, 5, 5, 1), "H") << "in the box of the L, which is smaller";
    EXPECT_EQ(findRoomAt(model, 2.2, 5, 1), "H") << "on the wall of the hall";
    EXPECT_EQ(findRoomAt(model, 2.0, 5, 1), "L") << "on the wall of the corridor";
    EXPECT_EQ(findRoomAt(model, 2.16, 2.5, 1), "H") << "4 cm from the hall, in the wall";
    EXPECT_EQ(findRoomAt(model, 2.1, 5, 1), "") << "in the middle of the wall";
    EXPECT_EQ(findRoomAt(model, 5, 5, 2.56), "") << "in the ceiling";
    EXPECT_EQ(findRoomAt(model, 11.5, 11.5, 1), "B") << "the smaller of two";
    EXPECT_EQ(findRoomAt(model, 11.5, 11.5, 2.4), "H") << "above the booth";
    EXPECT_EQ(findRoomAt(model, 10.97, 11.5, 1), "H") << "in the hall, next to the booth";
  }
}

TEST(SpaceQuery, ASurfaceInsideOutIsTheSameSolid) {
  const TemporaryFolder folder;
  Model model = importModel(folder.write("rooms.ifc", makeRooms()),
                            makeReaderOptions(tests::listReadersHere()[0]));
  ASSERT_EQ(model.spaces.size(), 3u);
  for (Space& space : model.spaces)
    for (std::size_t i = 0; i < space.surface.size(); i += 3)
      std::swap(space.surface[i], space.surface[i + 1]);
  EXPECT_EQ(findRoomAt(model, 1, 5, 1), "L");
  EXPECT_EQ(findRoomAt(model, 5, 5, 1), "H");
}

TEST(SpaceMiddle, OfARoomShapedLikeAnLIsInItsCornerAwayFromTheWalls) {
  for (const Model& model : importRooms()) {
    SCOPED_TRACE(model.reader);
    ASSERT_EQ(model.spaces.size(), 3u);
    for (const Space& space : model.spaces) {
      const SpaceMiddle middle = findSpaceMiddle(space, space.box);
      EXPECT_NEAR(middle.point.y(), space.box.centre().y(), 1e-9);
      const bool corridor = space.name == "L";
      EXPECT_EQ((middle.point - space.box.centre()).norm() > 1e-6, corridor) << space.name;
      if (!corridor) {
        EXPECT_NEAR(middle.width, space.box.size().x(), 1e-6) << space.name;
        continue;
      }
      EXPECT_EQ(findSpace(model, middle.point, 0), &space);
      // The largest circle in the corner of the corridor touches two walls and the corner of the
      // hall. It has a radius of 2 - sqrt(2) * 1.17 m. The grid's step is 19 cm.
      const Vec3 best(1.172, 1.25, -1.172);
      EXPECT_LT((middle.point - best).norm(), 0.19);
      EXPECT_NEAR(middle.width, 2 * middle.point.x(), 0.2);
    }
  }
}

TEST(SpaceMiddle, IsInTheVisiblePart) {
  const TemporaryFolder folder;
  const Model model = importModel(folder.write("rooms.ifc", makeRooms()),
                                  makeReaderOptions(tests::listReadersHere()[0]));
  const auto corridor = std::ranges::find(model.spaces, "L", &Space::name);
  ASSERT_NE(corridor, model.spaces.end());
  const Aabb end{Vec3(4, 0, -6), Vec3(20, 3, 0)}, arm{Vec3(0, 0, -20), Vec3(20, 3, -4)};
  const SpaceMiddle atEnd = findSpaceMiddle(*corridor, end),
                    inArm = findSpaceMiddle(*corridor, arm);
  EXPECT_LT((atEnd.point - Vec3(5, 1.25, -1)).norm(), 0.2);
  EXPECT_LT((inArm.point - Vec3(1, 1.25, -5)).norm(), 0.2);
  EXPECT_NEAR(inArm.width, 2, 0.2);
}

TEST(SpaceMiddle, OfANarrowCorridorAroundACourtIsInTheCorridor) {
  // 1 m wide, about a court of 98 m: narrower than the steps of the grid.
  Space space = tests::makePrism({{0, 0}, {100, 0}, {100, 100}, {0, 100}}, 3);
  const Space court = tests::makePrism({{1, 1}, {1, 99}, {99, 99}, {99, 1}}, 3);
  space.surface.insert(space.surface.end(), court.surface.begin(), court.surface.end());
  const SpaceMiddle middle = findSpaceMiddle(space, space.box);
  EXPECT_TRUE(isInSpace(space, middle.point)) << middle.point.transpose();
  EXPECT_FALSE(isInSpace(space, space.box.centre()));
}

TEST(SpaceMiddle, WithoutASolidIsThatOfTheBox) {
  Space space = tests::makePrism({{0, 0}, {4, 0}, {4, 2}, {0, 2}}, 3);
  space.surface.resize(3);
  EXPECT_EQ(findSpaceMiddle(space, space.box).point, Vec3(2, 1.5, 1));
  space.surface.clear();
  EXPECT_EQ(findSpaceMiddle(space, space.box).point, Vec3(2, 1.5, 1));
  EXPECT_EQ(findSpaceMiddle(space, space.box).width, 4);
}

TEST(SpaceQuery, WithoutASurfaceTheBoxIsTheSolid) {
  Model model;
  model.spaces.resize(2);
  model.spaces[0] = {"1", "", "", std::nullopt, {Vec3(0, 0, 0), Vec3(4, 3, 4)}};
  EXPECT_EQ(findSpace(model, Vec3(1, 1, 1), kReach), &model.spaces[0]);
  EXPECT_EQ(findSpace(model, Vec3(-0.04, 1, 1), kReach), &model.spaces[0]);
  EXPECT_EQ(findSpace(model, Vec3(-0.04, -0.04, 1), kReach), nullptr) << "5.7 cm from the edge";
  EXPECT_EQ(findSpace(model, Vec3(5, 1, 1), kReach), nullptr);
}

}  // namespace
}  // namespace enfilade::scene
