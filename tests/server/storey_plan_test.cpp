// The storeys that plans are drawn for, of files that state none.
#include <gtest/gtest.h>

#include "server/plans/floor_plans.hpp"
#include "tests/scene/roofed_rooms.hpp"

namespace enfilade::server {
namespace {

using scene::testing::makeBoxScene;
using scene::testing::makeRoofedRooms;
using scene::testing::NamedBox;

TEST(StoreyPlans, ASolidOnTheRoofMakesNoStorey) {
  const auto findHeights = [](const std::vector<NamedBox>& boxes) {
    std::vector<double> heights;
    for (const StoreyFloor& storey : findStoreys(*makeBoxScene(boxes)))
      heights.push_back(storey.height);
    return heights;
  };
  std::vector<NamedBox> boxes = makeRoofedRooms(1);
  boxes.push_back({"parapet", {0, 3.2, -3}, {0.2, 5, 3}});  // walls above the roof: a storey
  ASSERT_EQ(findHeights(boxes).size(), 2u);
  EXPECT_NEAR(findHeights(boxes)[1], 3.2, 1e-6);
  boxes.back() = {"block", {0, 3.2, -3}, {10, 6, 3}};  // fills what is above the roof
  EXPECT_EQ(findHeights(boxes), (std::vector<double>{0}));
}

TEST(StoreyPlans, AHouseOnALargeLawnIsCutAboveItsOwnFloor) {
  const auto findHeight = [](const std::vector<NamedBox>& boxes) {
    const std::vector<StoreyFloor> storeys = findStoreys(*makeBoxScene(boxes));
    EXPECT_EQ(storeys.size(), 1u);
    return storeys.at(0).height;
  };
  std::vector<NamedBox> boxes = makeRoofedRooms(1);
  boxes[0].min.y() = -0.45;
  boxes.push_back({"lawn", {-30, -0.6, -30}, {40, -0.45, 30}});
  boxes.push_back({"tree", {20, -0.45, 20}, {20.3, 4, 20.3}});
  EXPECT_NEAR(findHeight(boxes), 0, 1e-6);
  // A table in the house is no floor, however much of it there is on the lawn.
  boxes.push_back({"table", {1, 0.7, -1}, {3, 0.8, 1}});
  EXPECT_NEAR(findHeight(boxes), 0, 1e-6);
  // Without a roof the floor below the walls counts.
  std::erase_if(boxes, [](const NamedBox& box) { return box.path == "roof"; });
  EXPECT_NEAR(findHeight(boxes), 0, 1e-6);
  // A pavilion on the lawn has no other floor.
  std::erase_if(boxes, [](const NamedBox& box) { return box.path == "floor"; });
  for (NamedBox& box : boxes)
    if (box.min.y() == 0) box.min.y() = -0.45;
  EXPECT_NEAR(findHeight(boxes), -0.45, 1e-6);
}

TEST(StoreyPlans, NamesComeFromPathsWithoutGlobalIdsAndPlaceholders) {
  const auto findName = [](const std::string& storey) {
    std::vector<NamedBox> boxes = makeRoofedRooms(1);
    for (NamedBox& box : boxes) box.path = storey + "/" + box.path;
    return findStoreys(*makeBoxScene(boxes)).at(0).name;
  };
  EXPECT_EQ(findName("IfcBuildingStorey_Ebene:2_0hEsDgzvbFtOVSvLpJ1fVP_node"), "Ebene:2");
  EXPECT_EQ(findName("IfcBuildingStorey_Undefined_0hEsDgzvbFtOVSvLpJ1fVP_node"), "");
  EXPECT_EQ(findName("house"), "");
}

}  // namespace
}  // namespace enfilade::server
