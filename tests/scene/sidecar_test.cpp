#include "scene/import/bodies/sidecar.hpp"

#include <gtest/gtest.h>

#include "tests/scene/box_scene.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

Model makeHallModel() {
  return makeBoxModel({makeFloorBox(),
                       {"hall/leaf", {0, 0, 0}, {1, 2, 0.05}},
                       {"hall/chair1", {3, 0, 0}, {3.5, 1, 0.5}},
                       {"hall/chair2", {4, 0, 0}, {4.5, 1, 0.5}}});
}

/// The error for the bodies of a sidecar; "" if they are valid.
std::string findComplaint(const std::string& bodies) {
  Model model = makeHallModel();
  try {
    applySidecar(model, R"({"walk":1,"bodies":[)" + bodies + "]}", "s.walk.json");
    return "";
  } catch (const SidecarError& error) {
    EXPECT_TRUE(model.bodies.empty()) << "left as it was";
    EXPECT_EQ(model.objects.size(), makeHallModel().objects.size());
    return error.what();
  }
}

TEST(Sidecar, DefinesBodiesInRadiansAndMetres) {
  Model model = makeHallModel();
  applySidecar(model, R"({"walk":1,"bodies":[
    {"name":"door","kind":"hinged","objects":["hall/leaf"],"anchor":[0,0,0],"axis":[0,2,0],
     "limits":[-90,90],"closed":-90,"closes_after":2,"opened_by":"touch"},
    {"name":"chair","kind":"rigid","objects":["hall/chair*"],"each":true,"mass":6}]})",
               "s.walk.json");
  ASSERT_EQ(model.bodies.size(), 3u);
  const BodySpec& door = model.bodies[0];
  EXPECT_EQ(door.axis, Vec3(0, 1, 0));
  EXPECT_NEAR(door.high, 1.5707963267948966, 1e-15);
  EXPECT_EQ(door.closedPosition, door.low);
  EXPECT_EQ(door.autoCloseDelay, 2.0);
  EXPECT_EQ(door.openedBy, OpenedBy::touch);
  EXPECT_EQ(model.bodies[1].name, "chair#1");
  EXPECT_EQ(model.bodies[2].objects, std::vector<std::uint32_t>{3});
  EXPECT_NO_THROW(Scene{model});
}

TEST(Sidecar, ABoxBecomesATriggersObject) {
  Model model = makeHallModel();
  applySidecar(model,
               R"({"walk":1,"bodies":[{"name":"exit","kind":"trigger","box":[[9,0,1],[8,2,-1]]}]})",
               "s.walk.json");
  ASSERT_EQ(model.objects.size(), 5u);
  const Scene scene(std::move(model));
  EXPECT_EQ(scene.bodyShape(0)->parts.size(), 1u);
  EXPECT_EQ(scene.solidObjects().size(), 4u) << "not solid";
}

TEST(Sidecar, MistakesAreNamedWithTheirPlace) {
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(findComplaint(R"({"name":"d","kind":"hinged","objects":["hall/leaf"],"anchr":[0,0,0]})"),
      "s.walk.json.bodies[0]: unknown key \"anchr\"");
  has(findComplaint(R"({"name":"d","kind":"hinged","objects":["hall/gate"],"anchor":[0,0,0]})"),
      "bodies[0].objects[0]: unknown object \"hall/gate\"");
  has(findComplaint(R"({"name":"d","kind":"spinning","objects":["hall/leaf"]})"), "bodies[0].kind");
  has(findComplaint(R"({"name":"d","kind":"hinged","objects":["hall/leaf"]})"),
      "anchor is missing");
  has(findComplaint(R"({"name":"d","kind":"lift","objects":["hall/leaf"],"stops":[3,1]})"),
      "stops");
  has(findComplaint(R"({"name":"d","kind":"lift","objects":["hall/leaf"],"stops":[0,3,1]})"),
      "s.walk.json.bodies[0]: body 'd': stops must ascend");
  has(findComplaint(R"({"name":"d","kind":"lift","objects":["hall/leaf"],"stops":[0,3,3]})"),
      "stops must ascend strictly");
  has(findComplaint(R"({"name":"d","kind":"hinged","objects":["hall/leaf"],"anchor":[0,0,0],
                    "limits":[10,90]})"),
      "bodies[0]: body 'd': limits: 0, the authored position");
  has(findComplaint(R"({"name":"d","kind":"path","objects":["hall/leaf"],
                    "keys":[{"time":0},{"time":2},{"time":1}]})"),
      "bodies[0]: body 'd': keys: times must ascend");
  has(findComplaint(R"({"name":"d","kind":"trigger","box":[[0,0,0],[1,1,0]]})"), "no volume");
  has(findComplaint(R"({"name":"d","kind":"trigger","box":[[0,0,0],[1,1,1]]},
                   {"name":"d","kind":"rigid","objects":["hall/leaf"]})"),
      "another body already uses it");
  has(findComplaint(R"({"name":"d","kind":"rigid","objects":["hall/leaf"],"mass":"6"})"), "number");
  has(findComplaint(
          R"({"name":"d","kind":"rigid","objects":["hall/leaf"],"mass":6,"density":500})"),
      "bodies[0]: has a density and a mass");
  has(findComplaint(R"({"name":"d","kind":"trigger","objects":["hall/leaf"],
                    "box":[[0,0,0],[1,1,1]]})"),
      "bodies[0]: has objects and a box");
  has(findComplaint(R"({"name":"d","kind":"rigid","objects":["hall/leaf"],"mass":6,"mass":7})"),
      "s.walk.json: the key \"mass\" is repeated in an object");
}

TEST(Sidecar, DeeplyNestedBracketsAreAnError) {
  const std::string nest = std::string(200'000, '[') + std::string(200'000, ']');
  for (const std::string& body :
       {nest, R"({"name":"d","kind":"rigid","objects":["hall/leaf"],"mass":)" + nest + "}"})
    EXPECT_NE(findComplaint(body).find("nested too deeply"), std::string::npos);
}

TEST(Sidecar, AnInvalidSidecarIsReported) {
  Model model = makeHallModel();
  EXPECT_THROW(applySidecar(model, "{", "s"), SidecarError);
  EXPECT_THROW(applySidecar(model, "[]", "s"), SidecarError);
  EXPECT_THROW(applySidecar(model, R"({"bodies":[]})", "s"), SidecarError);
  EXPECT_THROW(applySidecar(model, R"({"walk":1,"still":["nothing"]})", "s"), SidecarError);
  try {
    applySidecar(model, R"({"walk":1,"still":["hall/ch*"],"bodies":[
                   {"name":"c","kind":"rigid","objects":["hall/chair2"]}]})",
                 "s");
    FAIL() << "a body cannot be declared as none, too";
  } catch (const SidecarError& error) {
    EXPECT_STREQ(error.what(), "s.still: 'hall/chair2' is in the body 'c': it is either");
  }
}

TEST(Sidecar, IsReadFromTheFolderOfItsModel) {
  EXPECT_EQ(makeSidecarPath("a/hall.glb"), "a/hall.walk.json");
}

}  // namespace
}  // namespace enfilade::scene
