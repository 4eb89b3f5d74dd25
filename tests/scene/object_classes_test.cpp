#include "scene/model/object_classes.hpp"

#include <gtest/gtest.h>

#include "scene/import/bodies/sidecar.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene {
namespace {

using testing::makeBoxModel;

Model makeSixBoxes() {
  std::vector<testing::NamedBox> boxes;
  for (const char* name : {"bed/frame", "bed/pillow", "door/leaf", "door/frame", "wall", "lamp"}) {
    const double x = 2.0 * static_cast<double>(boxes.size());
    boxes.push_back({name, {x, 0, 0}, {x + 1, 1, 1}});
  }
  return makeBoxModel(boxes);
}

TEST(ObjectClasses, ComeFromIfcThenFromTheSidecarAndPartsHaveThoseOfTheirWhole) {
  Model model = makeSixBoxes();
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
  Model model = makeSixBoxes();
  model.objects[3].partOf = 2;
  model.objects[4].globalId = model.objects[5].globalId = "0abc";
  applySidecar(model, R"({"walk":1,"things":[["bed/pillow","bed/frame"]]})", "s");
  EXPECT_EQ(computeObjectClasses(model).things, (std::vector<std::uint32_t>{1, 1, 3, 3, 5, 5}));
  model.bodies = {BodySpec{}};
  model.bodies[0].objects = {5, 0};
  const ObjectClasses classes = computeObjectClasses(model);
  EXPECT_EQ(classes.things, (std::vector<std::uint32_t>{6, 6, 3, 3, 5, 6}))
      << "the pillow is of the frame's thing, and that is of a body";
  EXPECT_EQ(classes.getThings({0, 1, 6, 12}), (std::vector<std::uint32_t>{0, 6, 6, 12}));
}

/// A model of boxes; each box has the material of its number.
Model makeBoxesOfMaterials(const std::vector<std::pair<const char*, std::uint32_t>>& boxes) {
  std::vector<testing::NamedBox> named;
  for (const auto& [name, material] : boxes) named.push_back({name, {0, 0, 0}, {1, 1, 1}});
  Model model = makeBoxModel(named);
  for (std::size_t i = 0; i < boxes.size(); ++i)
    model.meshes[model.objects[i].meshes.front()].material = boxes[i].second;
  return model;
}

TEST(ObjectClasses, NodesOfAMeshThatAFileSplitsByMaterialAreOneThing) {
  const auto things = [](const std::vector<std::pair<const char*, std::uint32_t>>& boxes) {
    return computeObjectClasses(makeBoxesOfMaterials(boxes)).things;
  };
  using Things = std::vector<std::uint32_t>;
  EXPECT_EQ(things({{"house/bed_node/bed_0", 0},
                    {"house/bed_node_1/bed_0_node", 0},
                    {"house/bed_node/bed_1", 1},
                    {"house/bed_node_1/bed_1_node_7", 1},
                    {"house/bed_node#2/bed_1", 1},
                    {"house/bed_node#2/bed_0", 0}}),
            (Things{1, 2, 1, 2, 5, 5}));
  EXPECT_EQ(things({{"chair/chair_0", 0}, {"chair/chair_1", 0}}), (Things{1, 2}))
      << "of one material";
  EXPECT_EQ(things({{"chair/chair_1", 0}, {"chair/chair_2", 1}}), (Things{1, 2})) << "no number 0";
  EXPECT_EQ(things({{"row/chair_0", 0}, {"row/chair_1", 1}}), (Things{1, 2})) << "another parent";
  EXPECT_EQ(things({{"chair_0", 0}, {"chair_1", 1}, {"_0", 2}, {"/_", 3}, {"", 4}}),
            (Things{1, 2, 3, 4, 5}));
}

TEST(ObjectClasses, PartsOfASplitMeshAreItsThingAndTheSidecarComesFirst) {
  Model model = makeBoxesOfMaterials({{"bed/bed_0", 0}, {"bed/bed_1", 1}, {"shape", 2}});
  model.objects[2].partOf = 1;
  EXPECT_EQ(computeObjectClasses(model).things, (std::vector<std::uint32_t>{1, 1, 1}));
  model.objects[0].thing = model.objects[1].thing = 1;
  EXPECT_EQ(computeObjectClasses(model).things, (std::vector<std::uint32_t>{2, 2, 2}));
}

TEST(ObjectClasses, AListOrABodyThatNamesAPrimitiveTakesItOutOfItsSplitMesh) {
  using Things = std::vector<std::uint32_t>;
  const auto things = [](const std::string& listed) {
    Model model = makeBoxesOfMaterials({{"bed/bed_0", 0}, {"bed/bed_1", 1}, {"lamp", 2}});
    applySidecar(model, R"({"walk":1,"things":[)" + listed + "]}", "s");
    return computeObjectClasses(model).things;
  };
  EXPECT_EQ(things(R"(["bed/bed_0"])"), (Things{1, 2, 3}));
  EXPECT_EQ(things(R"(["bed/bed_0","lamp"])"), (Things{1, 2, 1}));
  EXPECT_EQ(things(R"(["lamp","bed/bed_1"])"), (Things{1, 2, 2}));
  Model model = makeBoxesOfMaterials({{"bed/bed_0", 0}, {"bed/bed_1", 1}, {"lamp", 2}});
  model.bodies = {BodySpec{}};
  model.bodies[0].objects = {2, 0};
  EXPECT_EQ(computeObjectClasses(model).things, (Things{3, 2, 3}));
}

TEST(ObjectClasses, ASidecarsMistakesAreNamed) {
  Model model = makeSixBoxes();
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
