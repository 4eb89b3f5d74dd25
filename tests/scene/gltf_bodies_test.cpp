// Tests of bodies declared in glTF: node extras and the physics extension.
#include <gtest/gtest.h>

#include <algorithm>

#include "scene/import/bodies/collect_bodies.hpp"
#include "scene/import/bodies/sidecar.hpp"
#include "scene/import/import_model.hpp"
#include "scene/import/worker/model_stream.hpp"
#include "scene/world/data/scene.hpp"
#include "tests/scene/body_fixture.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

using testing::kQuarter;
using tests::BoxMesh;
using tests::makeGltfFile;
using tests::TemporaryFolder;

/// Imports a glTF file of one-metre boxes with these nodes, all of them roots. `more`: further
/// members of the document.
Model importNodes(const std::string& roots, const std::string& nodes,
                  const std::string& more = "") {
  const TemporaryFolder folder;
  std::string text = makeGltfFile(BoxMesh({1, 1, 1}), roots, nodes);
  text.insert(1, more);
  return importModel(folder.write("hall.gltf", text));
}

std::string catchBodyFailure(const std::string& extras) {
  try {
    importNodes("0", R"({"name":"door","mesh":0,"extras":)" + extras + "}");
  } catch (const ImportError& error) {
    return error.what();
  }
  return "";
}

const BodySpec& findBody(const Model& model, const std::string& name) {
  for (const BodySpec& body : model.bodies)
    if (body.name == name) return body;
  throw std::out_of_range("no body " + name);
}

std::uint32_t findObject(const Model& model, const std::string& path) {
  for (std::uint32_t i = 0; i < model.objects.size(); ++i)
    if (model.objects[i].path == path) return i;
  throw std::out_of_range("no object " + path);
}

// ---- extras -------------------------------------------------------------------------------------

TEST(Extras, DescribeANodeAndItsDescendants) {
  // The node's y axis lies along the scene's x.
  const Model model = importNodes(
      "0", R"({"name":"door","translation":[5,0,0],"rotation":[0,0,-0.7071067811865476,)"
           R"(0.7071067811865476],"children":[1,2],"extras":{"walk_kind":"hinged",)"
           R"("walk_axis":[0,1,0],"walk_limits":[-10,80],"walk_opened_by":"touch","note":"mine"}},)"
           R"({"name":"leaf","mesh":0},{"name":"handle","mesh":0,"translation":[1,0,0]})");
  ASSERT_EQ(model.bodies.size(), 1u);
  const BodySpec& door = model.bodies[0];
  EXPECT_EQ(door.name, "door");
  EXPECT_EQ(door.source, BodySource::extras);
  EXPECT_EQ(door.objects, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_LT((door.axis - Vec3::UnitX()).norm(), 1e-12) << door.axis.transpose();
  EXPECT_LT((door.anchor - Vec3(5, 0, 0)).norm(), 1e-12) << door.anchor.transpose();
  EXPECT_NEAR(door.high, kQuarter * 8 / 9, 1e-12);
  EXPECT_EQ(door.openedBy, OpenedBy::touch);
  EXPECT_NO_THROW(Scene{Model(model)});
}

TEST(Extras, TheNearestNodeWinsAndMayBeStatic) {
  const Model model = importNodes(
      "0", R"({"name":"lift","children":[1,2,3],"extras":{"walk_kind":"lift","walk_stops":[0,3]}},)"
           R"({"name":"car","mesh":0},)"
           R"({"name":"box","mesh":0,"extras":{"walk_kind":"rigid","walk_mass":4}},)"
           R"({"name":"rail","mesh":0,"extras":{"walk_kind":"still"}})");
  ASSERT_EQ(model.bodies.size(), 2u);
  EXPECT_EQ(findBody(model, "lift").objects, std::vector<std::uint32_t>{0});
  EXPECT_EQ(findBody(model, "lift/box").mass, 4.0);
}

TEST(Extras, MistakesNameTheFileTheNodeAndTheField) {
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(catchBodyFailure(R"({"walk_kind":"hinged","walk_axis":[0,0,0]})"),
      "hall.gltf: node 'door': extras.walk_axis: has no direction");
  has(catchBodyFailure(R"({"walk_kind":"hinged","walk_axes":[0,1,0]})"),
      "known here are walk_anchor");
  has(catchBodyFailure(R"({"walk_kind":"revolving"})"), "extras.walk_kind: must be hinged");
  has(catchBodyFailure(R"({"walk_kind":"sliding"})"), "limits is missing");
  has(catchBodyFailure(R"({"walk_kind":"rigid","walk_mass":-1})"), "mass is -1");
}

TEST(Extras, AClassMakesTheObjectsBelowOneThing) {
  const Model model =
      importNodes("0,3", R"({"name":"bed","children":[1,2],"extras":{"walk_class":"bed"}},)"
                         R"({"name":"frame","mesh":0},{"name":"mattress","mesh":0},)"
                         R"({"name":"lamp","mesh":0,"extras":{"class":"lamp","walk_class":7}})");
  EXPECT_TRUE(model.bodies.empty());
  for (const Diagnostic& one : model.diagnostics) EXPECT_NE(one.kind, "extras_without_kind");
  const std::uint32_t frame = findObject(model, "bed/frame"), lamp = findObject(model, "lamp");
  EXPECT_EQ(model.objects[frame].className, "bed");
  EXPECT_EQ(model.objects[frame].thing, frame);
  EXPECT_EQ(model.objects[findObject(model, "bed/mattress")].className, "bed");
  EXPECT_EQ(model.objects[findObject(model, "bed/mattress")].thing, frame);
  EXPECT_EQ(model.objects[lamp].className, "lamp") << "a class is a text";
  EXPECT_EQ(model.objects[lamp].thing, std::nullopt);
}

TEST(Extras, WithoutAKindAreReportedAndDefineNoBody) {
  const Model model = importNodes("0", R"({"name":"a","mesh":0,"extras":{"walk_speed":3}})");
  EXPECT_TRUE(model.bodies.empty());
  EXPECT_EQ(countDiagnostics(model, "extras_without_kind"), 1u);
}

TEST(Extras, OfOthersAreNotOurs) {
  const Model model = importNodes("0", R"({"name":"a","mesh":0,"extras":{"kind":"walk_kind"}})");
  EXPECT_TRUE(model.bodies.empty());
}

// ---- the physics extension ----------------------------------------------------------------------

std::string makePhysics(const std::string& members) {
  return R"("extensions":{"KHR_physics_rigid_bodies":{)" + members + "}}";
}

std::string makeDocument(const std::string& members, const std::string& shapes = "") {
  return R"("extensions":{"KHR_implicit_shapes":{"shapes":[)" + shapes +
         R"(]},"KHR_physics_rigid_bodies":{)" + members + "}},";
}

TEST(Physics, ADynamicNodeIsAFreeBodyOfItsMassVelocityAndMaterial) {
  const Model model = importNodes(
      "0",
      R"({"name":"crate","mesh":0,"translation":[0,5,0],)" +
          makePhysics(R"("motion":{"mass":7,"linearVelocity":[1,0,0]},)"
                      R"("collider":{"geometry":{"node":0},"physicsMaterial":0})") +
          "}",
      makeDocument(R"("physicsMaterials":[{"staticFriction":0.9,"dynamicFriction":0.25,)"
                   R"("restitution":0.5}])"));
  ASSERT_EQ(model.bodies.size(), 1u);
  const BodySpec& crate = model.bodies[0];
  EXPECT_EQ(crate.source, BodySource::khr);
  EXPECT_EQ(crate.kind, BodyKind::rigid);
  EXPECT_EQ(crate.mass, 7.0);
  EXPECT_EQ(crate.friction, 0.25);
  EXPECT_EQ(crate.restitution, 0.5);
  EXPECT_EQ(countDiagnostics(model, "unsupported_physics"), 0u)
      << findDiagnosticText(model, "unsupported_physics");
  testing::BodyFixture run(Model{model});
  run.runTicks(6);
  EXPECT_NEAR(run.getBody("crate").velocity.x(), 1, 1e-9) << "keeps its initial velocity";
  EXPECT_LT(run.getBody("crate").velocity.y(), 0);
}

TEST(Physics, ACollisionShapeIsSolidAndItsVisualMeshIsNot) {
  const Model model =
      importNodes("0",
                  R"({"name":"ball","mesh":0,)" +
                      makePhysics(R"("motion":{},"collider":{"geometry":{"shape":0}})") + "}",
                  makeDocument("", R"({"type":"sphere","sphere":{"radius":2}})"));
  ASSERT_EQ(model.objects.size(), 2u);
  EXPECT_EQ(model.objects[0].usage, Object::Usage::visualOnly);
  EXPECT_EQ(model.objects[1].usage, Object::Usage::collisionOnly);
  EXPECT_EQ(model.objects[1].path, "ball/collider");
  EXPECT_EQ(model.objects[1].partOf, 0u);
  ASSERT_EQ(model.bodies.size(), 1u);
  EXPECT_EQ(model.bodies[0].objects, (std::vector<std::uint32_t>{0, 1}));
  const Scene scene{Model(model)};
  const BodyShape& shape = *scene.bodyShape(0);
  ASSERT_EQ(shape.parts.size(), 1u) << "one hull";
  EXPECT_EQ(shape.approximateCount, 0u);
  EXPECT_NEAR(shape.volume, 4.0 / 3 * 3.14159265 * 8, 1) << "a polytope of the ball's size";
  EXPECT_NEAR(shape.box.size().y(), 4, 1e-6);
}

TEST(Physics, EachImplicitShapeIsConvexAndHasItsSize) {
  const std::string nodes =
      R"({"name":"box","mesh":0,)" + makePhysics(R"("collider":{"geometry":{"shape":0}})") +
      R"(},{"name":"capsule","mesh":0,)" + makePhysics(R"("collider":{"geometry":{"shape":1}})") +
      R"(},{"name":"cylinder","mesh":0,)" + makePhysics(R"("collider":{"geometry":{"shape":2}})") +
      "}";
  const Model model = importNodes(
      "0,1,2", nodes,
      makeDocument(
          "", R"({"type":"box","box":{"size":[1,2,3]}},)"
              R"({"type":"capsule","capsule":{"height":2,"radiusTop":0.5,"radiusBottom":0.5}},)"
              R"({"type":"cylinder","cylinder":{"height":2,"radiusTop":1,"radiusBottom":0.5}})"));
  ASSERT_EQ(model.objects.size(), 6u);
  EXPECT_TRUE(model.bodies.empty()) << "colliders without motion are static";
  const Scene scene{Model(model)};
  const std::map<std::string, Vec3> sizes{{"box/collider", {1, 2, 3}},
                                          {"capsule/collider", {1, 3, 1}},
                                          {"cylinder/collider", {2, 2, 2}}};
  EXPECT_EQ(scene.solidObjects().size(), 3u) << "a drawn mesh is not solid";
  for (const auto& [path, size] : sizes) {
    const std::uint32_t object = findObject(model, path);
    EXPECT_EQ(scene.collisionGeometry(object).hullCount(), 1u) << path;
    EXPECT_EQ(scene.collisionGeometry(object).size(), 1u) << path;
    Aabb box;
    for (std::uint32_t i = 0; i < scene.collisionGeometry(object).size(); ++i)
      box.include(scene.collisionGeometry(object).box(i));
    EXPECT_LT((box.size() - size).norm(), 0.02) << path << " " << box.size().transpose();
  }
}

/// A door whose joint sits on its own node 1, connected to the frame's node 2.
Model importHinged(const std::string& limits, bool fromFrame = false) {
  const std::string joint = R"("joint":{"joint":0,"connectedNode":)";
  const std::string onDoor = fromFrame ? "" : makePhysics(joint + "2}") + ",";
  const std::string onFrame = fromFrame ? makePhysics(joint + "1}") + "," : "";
  return importNodes("0,2",
                     R"({"name":"door","mesh":0,"children":[1],)" +
                         makePhysics(R"("motion":{"mass":20})") + R"(},{)" + onDoor +
                         R"("name":"hinge","translation":[0,1,0]},)" + R"({)" + onFrame +
                         R"("name":"frame","translation":[0,1,0]})",
                     makeDocument(R"("physicsJoints":[{"limits":[)" + limits + "]}]"));
}

const std::string kAtPoint = R"({"linearAxes":[0,1,2],"max":0})";

TEST(Physics, AJointWithOneAngleLeftIsAHinge) {
  const std::string limits =
      kAtPoint + R"(,{"angularAxes":[0,2],"max":0},{"angularAxes":[1],"min":-0.5,"max":1})";
  const Model model = importHinged(limits);
  ASSERT_EQ(model.bodies.size(), 1u) << findDiagnosticText(model, "unsupported_physics");
  EXPECT_EQ(model.bodies[0].kind, BodyKind::hinged);
  EXPECT_EQ(model.bodies[0].axis, Vec3(0, 1, 0));
  EXPECT_EQ(model.bodies[0].anchor, Vec3(0, 1, 0));
  // The joint's angle is that of the frame relative to the door.
  EXPECT_EQ(model.bodies[0].low, -1);
  EXPECT_EQ(model.bodies[0].high, 0.5);
  EXPECT_EQ(model.bodies[0].openedBy, OpenedBy::touch);
  const Model other = importHinged(limits, true);
  ASSERT_EQ(other.bodies.size(), 1u);
  EXPECT_EQ(other.bodies[0].low, -0.5);
  EXPECT_EQ(other.bodies[0].high, 1);
}

TEST(Physics, AJointWithOneDistanceLeftIsASlider) {
  const Model model =
      importHinged(R"({"linearAxes":[1,2],"max":0},{"linearAxes":[0],"min":0,"max":2},)"
                   R"({"angularAxes":[0,1,2],"max":0})",
                   true);
  ASSERT_EQ(model.bodies.size(), 1u) << findDiagnosticText(model, "unsupported_physics");
  EXPECT_EQ(model.bodies[0].kind, BodyKind::sliding);
  EXPECT_EQ(model.bodies[0].axis, Vec3(1, 0, 0));
  EXPECT_EQ(model.bodies[0].high, 2);
}

TEST(Physics, UnsupportedPartsAreReportedAndTheRestLoads) {
  const Model ball = importHinged(kAtPoint);  // all angles free
  EXPECT_EQ(findBody(ball, "door").kind, BodyKind::rigid);
  EXPECT_NE(findDiagnosticText(ball, "unsupported_physics").find("node 'door/hinge'"),
            std::string::npos)
      << findDiagnosticText(ball, "unsupported_physics");
  const Model kinematic = importNodes(
      "0", R"({"name":"a","mesh":0,)" + makePhysics(R"("motion":{"isKinematic":true})") + "}");
  EXPECT_TRUE(kinematic.bodies.empty());
  EXPECT_EQ(countDiagnostics(kinematic, "unsupported_physics"), 1u);
  const Model senseless = importNodes(
      "0",
      R"({"name":"a","mesh":0,)" +
          makePhysics(
              R"("motion":{"mass":-3,"centerOfMass":[0,1,0]},"collider":{"geometry":{"shape":7},)"
              R"("physicsMaterial":"steel"},"joint":{"joint":[],"connectedNode":-1})") +
          "}");
  EXPECT_TRUE(senseless.bodies.empty()) << "a negative mass";
  EXPECT_EQ(countDiagnostics(senseless, "unsupported_physics"), 4u);
  EXPECT_NO_THROW(Scene{Model(senseless)});
}

TEST(Physics, ATriggerIsNeitherSolidNorDrawn) {
  const Model model =
      importNodes("0,1",
                  R"({"name":"floor","mesh":0},{"name":"exit","translation":[5,0,0],)" +
                      makePhysics(R"("trigger":{"geometry":{"shape":0}})") + "}",
                  makeDocument("", R"({"type":"box","box":{"size":[2,2,2]}})"));
  ASSERT_EQ(model.bodies.size(), 1u);
  EXPECT_EQ(model.bodies[0].kind, BodyKind::trigger);
  const Scene scene{Model(model)};
  EXPECT_EQ(scene.solidObjects(), std::vector<std::uint32_t>{0});
  EXPECT_NEAR(scene.bodyShape(0)->box.centre().x() + scene.bodyShape(0)->origin.x(), 5, 1e-9);
}

// ---- precedence ---------------------------------------------------------------------------------

TEST(Sources, TheHigherOneHasTheSayAndTheLowerOneAddsTheRest) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "hall.gltf",
      makeGltfFile(
          BoxMesh({1, 1, 1}), "0,1,2,3",
          R"({"name":"a","mesh":0,"extras":{"walk_kind":"rigid","walk_mass":1},)" +
              makePhysics(R"("motion":{"mass":2})") +
              R"(},{"name":"b-rigid","mesh":0,"extras":{"walk_kind":"rigid","walk_mass":3}},)" +
              R"({"name":"c-rigid","mesh":0},{"name":"d-rigid","mesh":0})"));
  folder.write(
      "hall.walk.json",
      R"({"walk":1,"bodies":[{"name":"mine","kind":"rigid","objects":["c-rigid"],"mass":9}],)"
      R"("still":["d-rigid"]})");
  Model model = importModel(file);
  EXPECT_EQ(model.bodies.size(), 4u);
  collectBodies(model, file);
  ASSERT_EQ(model.bodies.size(), 3u);
  EXPECT_EQ(findBody(model, "mine").source, BodySource::sidecar);
  EXPECT_EQ(findBody(model, "a").mass, 2.0) << "the physics extension before extras";
  EXPECT_EQ(findBody(model, "b-rigid").mass, 3.0) << "extras before names";
  EXPECT_EQ(countDiagnostics(model, "replaced_bodies"), 3u);
  const auto replaced = std::ranges::find(model.diagnostics, "replaced_bodies", &Diagnostic::kind);
  EXPECT_EQ(replaced->example, "'a' of the extras by 'a' of the khr, object a");
  EXPECT_EQ(formatBodySources(model), "1 of sidecar, 1 of khr, 1 of extras");
}

TEST(Sources, BodiesOfTheFilePassThroughTheStream) {
  const Model model = importNodes(
      "0", R"({"name":"a","mesh":0,"extras":{"walk_kind":"path","walk_keys":[{"time":0},)"
           R"({"time":2,"offset":[1,0,0],"turn":90}],"walk_speed":0.5}})");
  const std::vector<std::byte> bytes = serializeModel(model);
  const Model back = deserializeModel(bytes);
  EXPECT_EQ(serializeModel(back), bytes);
  ASSERT_EQ(back.bodies.size(), 1u);
  EXPECT_EQ(back.bodies[0].keys[1].offset, Vec3(1, 0, 0));
  EXPECT_EQ(back.bodies[0].speed, 0.5);
}

// ---- names --------------------------------------------------------------------------------------

TEST(Names, AShapeIsTheCollisionOfWhomItNames) {
  const Model model = importNodes(
      "0,1,2", R"({"name":"chair","mesh":0},{"name":"UCX_chair_01","mesh":0,"scale":[2,2,2]},)"
               R"({"name":"UCX_chair_02","mesh":0,"translation":[3,0,0]})");
  const Scene scene{Model(model)};
  EXPECT_EQ(model.objects[0].usage, Object::Usage::visualOnly);
  EXPECT_EQ(scene.solidObjects(), (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(model.objects[2].partOf, 0u);
  EXPECT_EQ(countDiagnostics(model, "collision_suffix"), 2u);
}

TEST(Names, GodotsHintsAreKept) {
  const Model model = importNodes(
      "0,1,2,3", R"({"name":"wall-col","mesh":0},{"name":"lamp","mesh":0},)"
                 R"({"name":"lamp-colonly.001","mesh":0},{"name":"barrel-rigid.003","mesh":0})");
  EXPECT_EQ(model.objects[0].usage, Object::Usage::both);
  EXPECT_EQ(model.objects[1].usage, Object::Usage::visualOnly);
  EXPECT_EQ(model.objects[2].usage, Object::Usage::collisionOnly);
  ASSERT_EQ(model.bodies.size(), 1u);
  EXPECT_EQ(model.bodies[0].source, BodySource::suffix);
  EXPECT_EQ(model.bodies[0].objects, std::vector<std::uint32_t>{3});
  EXPECT_EQ(countDiagnostics(model, "collision_suffix"), 3u);
}

TEST(Names, AShapeWithoutAnObjectIsReportedAndStaysSolid) {
  const Model model =
      importNodes("0,1", R"({"name":"UCX_gone","mesh":0},{"name":"protocol","mesh":0})");
  EXPECT_EQ(countDiagnostics(model, "collision_shape_alone"), 1u);
  EXPECT_EQ(Scene{Model(model)}.solidObjects().size(), 2u);
}

TEST(Names, AShapeFollowsTheBodyOfItsObject) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "hall.gltf", makeGltfFile(BoxMesh({1, 1, 1}), "0,1",
                                R"({"name":"chair","mesh":0},{"name":"UCX_chair","mesh":0})"));
  folder.write("hall.walk.json",
               R"({"walk":1,"bodies":[{"name":"c","kind":"rigid","objects":["chair"]}]})");
  Model model = importModel(file);
  collectBodies(model, file);
  EXPECT_EQ(findBody(model, "c").objects, (std::vector<std::uint32_t>{0, 1}));
  const Scene scene(std::move(model));
  EXPECT_TRUE(scene.solidObjects().empty());
  EXPECT_EQ(scene.bodyShape(0)->parts.size(), 1u) << "the shape's name alone";
}

}  // namespace
}  // namespace enfilade::scene
