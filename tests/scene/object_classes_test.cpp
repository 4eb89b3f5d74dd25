#include "scene/model/object_classes.hpp"

#include <gtest/gtest.h>

#include "scene/import/bodies/sidecar.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene {
namespace {

using testing::boxModel;

Model sixBoxes() {
  std::vector<testing::NamedBox> boxes;
  for (const char* name : {"bed/frame", "bed/pillow", "door/leaf", "door/frame", "wall", "lamp"}) {
    const double x = 2.0 * static_cast<double>(boxes.size());
    boxes.push_back({name, {x, 0, 0}, {x + 1, 1, 1}});
  }
  return boxModel(boxes);
}

TEST(ObjectClasses, ComeFromIfcThenFromTheSidecarAndPartsHaveThoseOfTheirWhole) {
  Model model = sixBoxes();
  model.objects[2].ifcClass = "IfcDoor";
  model.objects[3].partOf = 2;
  model.objects[4].ifcClass = "IfcWall";
  applySidecar(model, R"({"walk":1,"classes":{"bed":["bed/*"],"thing of doors":["door/leaf"]}})",
               "s");
  const ObjectClasses classes = computeObjectClasses(model);
  EXPECT_EQ(classes.names, (std::vector<std::string>{"", "IfcDoor", "IfcWall", "bed", "avatar"}));
  EXPECT_EQ(classes.classIds, (std::vector<std::uint32_t>{3, 3, 1, 1, 2, 0}));
  EXPECT_EQ(classes.getClass(0), 0u);
  EXPECT_EQ(classes.getClass(7), 4u) << "an avatar";
  EXPECT_EQ(classes.getClasses({0, 1, 1, 3, 6, 9}), (std::vector<std::uint32_t>{0, 3, 3, 1, 0, 4}));
}

TEST(ObjectClasses, ThingsAreBodiesProductsPartsAndTheSidecarsGroups) {
  Model model = sixBoxes();
  model.objects[3].partOf = 2;
  model.objects[4].globalId = model.objects[5].globalId = "0abc";
  applySidecar(model, R"({"walk":1,"things":[["bed/pillow","bed/frame"]]})", "s");
  EXPECT_EQ(computeObjectClasses(model).things, (std::vector<std::uint32_t>{1, 1, 3, 3, 5, 5}));
  model.bodies = {BodySpec{}};
  model.bodies[0].objects = {5, 0};
  const ObjectClasses classes = computeObjectClasses(model);
  EXPECT_EQ(classes.things, (std::vector<std::uint32_t>{6, 1, 3, 3, 5, 6}));
  EXPECT_EQ(classes.getThings({0, 1, 6, 12}), (std::vector<std::uint32_t>{0, 6, 6, 12}));
}

TEST(ObjectClasses, ASidecarsMistakesAreNamed) {
  Model model = sixBoxes();
  const auto refused = [&](const char* text) -> std::string {
    try {
      applySidecar(model, text, "room.walk.json");
    } catch (const SidecarError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refused(R"({"walk":1,"classes":["bed"]})").find("classes"), std::string::npos);
  EXPECT_NE(refused(R"({"walk":1,"classes":{"bed":["bad/*"]}})").find("classes.bed[0]"),
            std::string::npos);
  EXPECT_NE(refused(R"({"walk":1,"things":["bed"]})").find("things[0]"), std::string::npos);
  for (const Object& object : model.objects) EXPECT_EQ(object.className, "");
}

}  // namespace
}  // namespace enfilade::scene
