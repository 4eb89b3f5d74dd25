// Tests of IFC doors and lifts as bodies: hinge side and direction of each leaf, static doors with
// the reason, the doors of real buildings.
#include <gtest/gtest.h>

#include <algorithm>

#include "scene/import/bodies/collect_bodies.hpp"
#include "scene/import/bodies/ifc_doors.hpp"
#include "scene/import/import_model.hpp"
#include "tests/scene/body_fixture.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/hand_made_ifc.hpp"
#include "tests/scene/import_outcome.hpp"
#include "tests/support/shared_folder.hpp"
#include "tests/support/web_ifc_here.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using tests::IfcHouse;
using tests::TemporaryFolder;

void join(Mesh& mesh, const Mesh& other) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const std::uint32_t i : other.indices) mesh.indices.push_back(first + i);
}

/// Axes: x along the width, y towards the opening side, z up.
struct DoorPart {
  Vec3 min, max;
};

/// A jamb on each side and a head, of 5 x 10 cm.
std::vector<DoorPart> makeFrameParts(double width) {
  return {{{0, 0, 0}, {0.05, 0.1, 2.1}},
          {{width - 0.05, 0, 0}, {width, 0.1, 2.1}},
          {{0.05, 0, 2.05}, {width - 0.05, 0.1, 2.1}}};
}

/// A floor, and a door at (2, 0, 3) that opens towards the scene's -z: IFC's y.
Model makeIfcDoorModel(const std::string& operation, const std::vector<DoorPart>& parts,
                       double width = 1) {
  Model model = makeBoxModel({makeFloorBox()});
  Mesh mesh;
  for (const DoorPart& part : parts) join(mesh, buildBoxMesh(part.min, part.max));
  model.meshes.push_back(std::move(mesh));
  Object door;
  door.path = "house/door";
  door.globalId = "0123456789012345678901";
  door.ifcClass = "IfcDoor";
  door.operationType = operation;
  door.overallWidth = width;
  door.overallHeight = 2.1;
  door.meshes = {1};
  Eigen::Affine3d placed(Eigen::Translation3d(2, 0, 3));
  placed.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  door.worldFromPlacement = std::make_shared<Eigen::Affine3d>(placed);
  door.worldFromMesh = placed;
  model.objects.push_back(std::move(door));
  return model;
}

std::vector<DoorPart> makeDoorParts(double width, std::vector<DoorPart> leaves) {
  std::vector<DoorPart> parts = makeFrameParts(width);
  parts.insert(parts.end(), leaves.begin(), leaves.end());
  return parts;
}

std::vector<DoorPart> makeSingleDoor() {
  return makeDoorParts(1, {{{0.06, 0.02, 0.01}, {0.94, 0.06, 2.04}}});
}

std::vector<DoorPart> makeDoubleDoor() {
  return makeDoorParts(
      2, {{{0.06, 0.02, 0.01}, {0.99, 0.06, 2.04}}, {{1.01, 0.02, 0.01}, {1.94, 0.06, 2.04}}});
}

Model collectDoors(Model model, IfcDoors doors = IfcDoors::movable) {
  collectBodies(model, "no such folder/door.ifc", doors);
  return model;
}

/// The position in the open state of a body point given in the closed state.
Vec3 computeOpenPosition(const Model& model, const std::string& name, const Vec3& point) {
  BodyFixture run{Model(model)};
  run.submit({name, BodyCommand::Action::open, 0, 0, {}});
  run.runUntilIdle();
  const Body& body = run.getBody(name);
  return body.rotation * (point - body.shape->origin) + body.position;
}

TEST(IfcDoors, LeftHasItsHingesAtTheLowEndAndOpensTowardsY) {
  const Model model = collectDoors(makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor()));
  ASSERT_EQ(model.bodies.size(), 1u) << findDiagnosticText(model, "still_doors");
  const BodySpec& door = model.bodies[0];
  EXPECT_EQ(door.name, "house/door");
  EXPECT_EQ(door.source, BodySource::ifc);
  EXPECT_EQ(door.objects, std::vector<std::uint32_t>{1});
  EXPECT_EQ(door.openedBy, OpenedBy::touch);
  EXPECT_NEAR(door.anchor.x(), 2.06, 1e-6);
  const Vec3 tip =
      computeOpenPosition(model, "house/door", {2.94, 1, 2.94});  // at its far edge, y = 0.06
  EXPECT_NEAR(tip.x(), 2.06, 1e-6);
  EXPECT_NEAR(tip.z(), 2.94 - 0.88, 1e-6) << "towards -z, IFC's y";
  EXPECT_EQ(countDiagnostics(model, "guessed_doors"), 0u);
}

TEST(IfcDoors, RightHasItsHingesAtTheHighEndAndOpensTowardsY) {
  const Model model = collectDoors(makeIfcDoorModel("SINGLE_SWING_RIGHT", makeSingleDoor()));
  ASSERT_EQ(model.bodies.size(), 1u) << findDiagnosticText(model, "still_doors");
  EXPECT_NEAR(model.bodies[0].anchor.x(), 2.94, 1e-6);
  const Vec3 tip = computeOpenPosition(model, "house/door", {2.06, 1, 2.94});
  EXPECT_NEAR(tip.x(), 2.94, 1e-6);
  EXPECT_NEAR(tip.z(), 2.94 - 0.88, 1e-6);
}

TEST(IfcDoors, OnlyTheLeafMovesAndTheFrameStands) {
  const Model model = collectDoors(makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor()));
  ASSERT_EQ(model.objects.size(), 3u);
  EXPECT_EQ(model.objects[2].path, "house/door/frame");
  EXPECT_EQ(model.objects[2].partOf, 1u);
  EXPECT_TRUE(model.objects[2].globalId.empty()) << "only the leaf has the GlobalId";
  EXPECT_EQ(collectSolidTriangles(model, 1).size(), 12u);
  EXPECT_EQ(collectSolidTriangles(model, 2).size(), 36u);
  EXPECT_EQ(model.meshes.size(), 3u) << "the cut part is removed";
  const Scene scene{Model(model)};
  EXPECT_EQ(scene.solidObjects(), (std::vector<std::uint32_t>{0, 2}));
}

TEST(IfcDoors, TwoLeavesOpenApart) {
  const Model swing =
      collectDoors(makeIfcDoorModel("DOUBLE_DOOR_SINGLE_SWING", makeDoubleDoor(), 2));
  ASSERT_EQ(swing.bodies.size(), 2u) << findDiagnosticText(swing, "still_doors");
  EXPECT_EQ(swing.bodies[1].name, "house/door/leaf2");
  EXPECT_NEAR(swing.bodies[0].anchor.x(), 2.06, 1e-6);
  EXPECT_NEAR(swing.bodies[1].anchor.x(), 3.94, 1e-6);
  EXPECT_LT(computeOpenPosition(swing, "house/door", {2.99, 1, 2.94}).z(), 2.1);
  EXPECT_LT(computeOpenPosition(swing, "house/door/leaf2", {3.01, 1, 2.94}).z(), 2.1);
  const Model slide = collectDoors(makeIfcDoorModel("DOUBLE_DOOR_SLIDING", makeDoubleDoor(), 2));
  ASSERT_EQ(slide.bodies.size(), 2u);
  EXPECT_NEAR(computeOpenPosition(slide, "house/door", {2.99, 1, 2.95}).x(), 2.06, 1e-6);
  EXPECT_NEAR(computeOpenPosition(slide, "house/door/leaf2", {3.01, 1, 2.95}).x(), 3.94, 1e-6);
}

TEST(IfcDoors, SlidingDoorsSlideTheirWidth) {
  const Model left = collectDoors(makeIfcDoorModel("SLIDING_TO_LEFT", makeSingleDoor()));
  ASSERT_EQ(left.bodies.size(), 1u);
  EXPECT_NEAR(computeOpenPosition(left, "house/door", {2.94, 1, 2.95}).x(), 2.06, 1e-6);
  const Model right = collectDoors(makeIfcDoorModel("SLIDING_TO_RIGHT", makeSingleDoor()));
  EXPECT_NEAR(computeOpenPosition(right, "house/door", {2.06, 1, 2.95}).x(), 2.94, 1e-6);
}

TEST(IfcDoors, AHandleLocatesTheHingesAndTheGuessIsReported) {
  auto parts = makeSingleDoor();
  parts.push_back({{0.1, -0.04, 1}, {0.22, 0.0, 1.03}});  // the handle, at the low end
  const Model model = collectDoors(makeIfcDoorModel("NOTDEFINED", parts));
  ASSERT_EQ(model.bodies.size(), 1u) << findDiagnosticText(model, "still_doors");
  EXPECT_NEAR(model.bodies[0].anchor.x(), 2.94, 1e-6);
  EXPECT_EQ(model.bodies[0].low, -kQuarter);
  EXPECT_EQ(model.bodies[0].high, kQuarter);
  EXPECT_EQ(collectSolidTriangles(model, 1).size(), 24u) << "the handle moves with the leaf";
  EXPECT_EQ(countDiagnostics(model, "guessed_doors"), 1u);
  EXPECT_NE(findDiagnosticText(model, "guessed_doors")
                .find("house/door: NOTDEFINED; hinged at the right"),
            std::string::npos)
      << findDiagnosticText(model, "guessed_doors");
}

TEST(IfcDoors, APaneBelongsToTheLeafThatHoldsIt) {
  // Two stiles and two rails as one surface form a ring; four boxes that share faces form one
  // solid.
  Model model = makeIfcDoorModel("SINGLE_SWING_LEFT", {});
  Mesh& mesh = model.meshes[1];
  const auto ring = [&](double x0, double x1, double z0, double z1, double rail) {
    // The ring is one surface: inner and outer rectangle, front and back.
    const double xs[] = {x0, x1, x1, x0, x0 + rail, x1 - rail, x1 - rail, x0 + rail};
    const double zs[] = {z0, z0, z1, z1, z0 + rail, z0 + rail, z1 - rail, z1 - rail};
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const double y : {0.02, 0.06})
      for (int i = 0; i < 8; ++i) mesh.positions.push_back(Vec3(xs[i], y, zs[i]).cast<float>());
    const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
      for (const std::uint32_t i : {a, b, c, a, c, d}) mesh.indices.push_back(first + i);
    };
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t next = (i + 1) % 4;
      quad(i, next, 4 + next, 4 + i);
      quad(8 + next, 8 + i, 12 + i, 12 + next);
      quad(next, i, 8 + i, 8 + next);
      quad(4 + i, 4 + next, 12 + next, 12 + i);
    }
  };
  ring(0, 1, 0, 2.1, 0.05);           // the frame
  ring(0.06, 0.94, 0.06, 2.04, 0.1);  // the leaf
  join(mesh, buildBoxMesh({0.17, 0.035, 0.17}, {0.83, 0.045, 1.93}));
  const Model split = collectDoors(model);
  ASSERT_EQ(split.bodies.size(), 1u) << findDiagnosticText(split, "still_doors");
  EXPECT_EQ(collectSolidTriangles(split, 1).size(), 44u) << "the ring's 32 and the pane's 12";
  EXPECT_NEAR(split.bodies[0].anchor.x(), 2.06, 1e-6);
}

TEST(IfcDoors, UndecidableDoorsStayStaticAndAreReported) {
  const auto still = [](const Model& given) {
    const Model model = collectDoors(given);
    EXPECT_TRUE(model.bodies.empty());
    EXPECT_EQ(model.objects.size(), given.objects.size());
    EXPECT_EQ(model.meshes.size(), given.meshes.size());
    return findDiagnosticText(model, "still_doors");
  };
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(still(makeIfcDoorModel("SINGLE_SWING_LEFT", makeFrameParts(1))),
      "no surface fills its middle");
  has(still(makeIfcDoorModel("REVOLVING", makeSingleDoor())), "REVOLVING");
  has(still(makeIfcDoorModel("SINGLE_SWING_LEFT", makeDoubleDoor(), 2)), "does not match 2 leaves");
  has(still(makeIfcDoorModel("SINGLE_SWING_LEFT", {{{0, 0, 0}, {1, 0.5, 2.1}}})), "too thick");
  Model lying = makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor());
  lying.objects[1].worldFromPlacement = std::make_shared<Eigen::Affine3d>(
      Eigen::Translation3d(lying.objects[1].worldFromPlacement->translation()));
  has(still(lying), "upright");
  Model nowhere = makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor());
  nowhere.objects[1].worldFromPlacement.reset();
  has(still(nowhere), "placement is not known");
}

TEST(IfcDoors, AllStandWhereTheUserSaysSoAndIdsStayTheSame) {
  const Model model =
      collectDoors(makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor()), IfcDoors::fixed);
  EXPECT_TRUE(model.bodies.empty());
  EXPECT_EQ(model.objects.size(), 3u);
}

/// The box of an object's vertices.
Aabb computeBox(const Model& model, std::size_t object) {
  Aabb box;
  for (const std::uint32_t mesh : model.objects[object].meshes)
    for (std::uint32_t i = 0; i < model.meshes[mesh].positions.size(); ++i)
      box.include(computeWorldPosition(model.objects[object], model.meshes[mesh], i));
  return box;
}

TEST(IfcDoors, OpenOnesAreStaticWithTheirLeavesWhereTheBodyWouldOpenThem) {
  const Model moving = collectDoors(makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor()));
  const Model open =
      collectDoors(makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor()), IfcDoors::open);
  EXPECT_TRUE(open.bodies.empty());
  EXPECT_EQ(open.objects.size(), moving.objects.size());
  const std::uint32_t leaf = moving.bodies[0].objects[0];
  Aabb expected;
  const Aabb closed = computeBox(moving, leaf);
  for (int corner = 0; corner < 8; ++corner)
    expected.include(computeOpenPosition(
        moving, moving.bodies[0].name,
        {corner & 1 ? closed.max.x() : closed.min.x(), corner & 2 ? closed.max.y() : closed.min.y(),
         corner & 4 ? closed.max.z() : closed.min.z()}));
  EXPECT_LT((computeBox(open, leaf).min - expected.min).norm(), 1e-6);
  EXPECT_LT((computeBox(open, leaf).max - expected.max).norm(), 1e-6);
  EXPECT_GT((computeBox(open, leaf).max - closed.max).norm(), 0.5) << "the leaf has moved";
}

TEST(IfcDoors, WithoutLeavesOnlyTheFramesStand) {
  const Model model =
      collectDoors(makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor()), IfcDoors::absent);
  EXPECT_TRUE(model.bodies.empty());
  const std::uint32_t leaf =
      collectDoors(makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor())).bodies[0].objects[0];
  EXPECT_TRUE(model.objects[leaf].meshes.empty());
  EXPECT_EQ(model.objects.size(), 3u) << "ids stay the same";
  const auto frame = std::find_if(model.objects.begin(), model.objects.end(),
                                  [](const Object& o) { return o.path.ends_with("/frame"); });
  ASSERT_NE(frame, model.objects.end());
  EXPECT_FALSE(frame->meshes.empty());
}

TEST(IfcDoors, ASidecarSaysBetterOfTheLeafAlone) {
  const TemporaryFolder folder;
  folder.write("door.walk.json",
               R"({"walk":1,"bodies":[{"name":"mine","kind":"hinged","anchor":[2.94,0,2.95],)"
               R"("objects":["0123456789012345678901"]}]})");
  Model model = makeIfcDoorModel("SINGLE_SWING_LEFT", makeSingleDoor());
  collectBodies(model, folder.getPath() / "door.ifc");
  ASSERT_EQ(model.bodies.size(), 1u);
  EXPECT_EQ(model.bodies[0].source, BodySource::sidecar);
  EXPECT_EQ(model.bodies[0].objects, std::vector<std::uint32_t>{1});
}

TEST(IfcDoors, AnAvatarWalksThroughAGuessedDoorFromEitherSide) {
  const Model model = collectDoors(makeIfcDoorModel(
      "NOTDEFINED", makeDoorParts(1.2, {{{0.06, 0.02, 0.01}, {1.14, 0.06, 2.04}}}), 1.2));
  ASSERT_EQ(model.bodies.size(), 1u) << findDiagnosticText(model, "still_doors");
  for (const double side : {1.0, -1.0}) {
    BodyFixture run{Model(model)};
    run.order("ann", Spawn{{2.65, 0.001, 2.95 + 1.5 * side}, 0, 0.3, 1.75});
    run.order("ann", Walk{{{2.65, 0, 2.95 - 1.5 * side}}, 1});
    run.runTicks(600);
    EXPECT_LT(side * (run.getFeet("ann").z() - 2.95), -1.4) << run.getFeet("ann").transpose();
    EXPECT_EQ(namePenetratingPairs(run.world), "");
  }
}

TEST(IfcDoors, AnAvatarWalksThroughADoorThatOpensOneWayFromEitherSide) {
  for (const char* operation : {"SINGLE_SWING_LEFT", "SINGLE_SWING_RIGHT"}) {
    const Model model = collectDoors(makeIfcDoorModel(
        operation, makeDoorParts(1.2, {{{0.06, 0.02, 0.01}, {1.14, 0.06, 2.04}}}), 1.2));
    ASSERT_EQ(model.bodies.size(), 1u) << findDiagnosticText(model, "still_doors");
    for (const double side : {1.0, -1.0}) {
      SCOPED_TRACE(std::string(operation) + (side > 0 ? ", pushed open" : ", pulled open"));
      BodyFixture run{Model(model)};
      run.order("ann", Spawn{{2.6, 0.001, 2.95 + 1.5 * side}, 0, 0.3, 1.75});
      run.order("ann", Walk{{{2.6, 0, 2.95 - 1.5 * side}}, 1});
      run.runTicks(900);
      EXPECT_LT(side * (run.getFeet("ann").z() - 2.95), -1.4) << run.getFeet("ann").transpose();
      EXPECT_EQ(namePenetratingPairs(run.world), "");
    }
  }
}

// ---- files --------------------------------------------------------------------------------------

Model importWithBodies(const std::filesystem::path& file, IfcReader reader) {
  Model model = importModel(file, tests::makeReaderOptions(reader));
  collectBodies(model, file);
  return model;
}

TEST(IfcDoors, OfAFileOpenTowardsItsY) {
  const TemporaryFolder folder;
  const auto file = folder.write("house.ifc", IfcHouse().makeText());
  for (const IfcReader reader : tests::listReadersHere()) {
    const Model model = importWithBodies(file, reader);
    ASSERT_EQ(model.bodies.size(), 1u) << findDiagnosticText(model, "still_doors");
    // A slab of 0.9 x 0.05 m from (1.5, 0.1) in the file; the file's y is the scene's -z.
    EXPECT_LT((model.bodies[0].anchor - Vec3(1.5, 0, -0.15)).norm(), 1e-5)
        << model.bodies[0].anchor.transpose();
    EXPECT_NEAR(model.bodies[0].low, 0, 0);
    EXPECT_EQ(model.bodies[0].high, kQuarter);
  }
}

/// Two storeys 3 m apart, and a cabin of 1.5 x 1.5 x 2.4 m at (10, 10) on the lower one.
std::string makeHouseWithLift(double cabin, const std::string& slab) {
  IfcHouse house;
  house.more =
      house.makePlacement(500, "#15", 10, 10, 0) + house.makeBox(510, 1.5, 1.5, cabin) +
      "#520=IFCTRANSPORTELEMENT('000000000000000000Lift',$,'Lift',$,$,#502,#515,$,"
      ".ELEVATOR.);\n" +
      house.makePlacement(530, "#15", 0, 0, 3) +
      "#540=IFCBUILDINGSTOREY('000000000000000Storey2',$,'Upper',$,$,#532,$,$,.ELEMENT.,"
      "3000.);\n#541=IFCRELAGGREGATES('0000000000000000000010',$,$,$,#40,(#540));\n"
      "#542=IFCRELCONTAINEDINSPATIALSTRUCTURE('0000000000000000000011',$,$,$,(#520),#41);\n" +
      (slab.empty()
           ? ""
           : house.makePlacement(550, "#15", 9, 9, 2.9) + house.makeBox(560, 4, 4, 0.1) + slab);
  return house.makeText();
}

TEST(IfcLifts, StopAtTheStoreysThatTheirShaftIsOpenTo) {
  const TemporaryFolder folder;
  const auto open = folder.write("open.ifc", makeHouseWithLift(2.4, ""));
  const auto closed = folder.write(
      "closed.ifc",
      makeHouseWithLift(
          2.4, "#570=IFCSLAB('000000000000000000Slab',$,'Slab',$,$,#552,#565,$,.FLOOR.);\n"));
  const auto tall = folder.write("tall.ifc", makeHouseWithLift(6, ""));
  for (const IfcReader reader : tests::listReadersHere()) {
    const Model lift = importWithBodies(open, reader);
    ASSERT_EQ(lift.bodies.size(), 2u) << findDiagnosticText(lift, "still_lifts");
    const BodySpec& body = lift.bodies[1].kind == BodyKind::lift ? lift.bodies[1] : lift.bodies[0];
    EXPECT_EQ(body.kind, BodyKind::lift);
    ASSERT_EQ(body.stops.size(), 2u);
    EXPECT_NEAR(body.stops[0], 0, 1e-9);
    EXPECT_NEAR(body.stops[1], 3, 1e-9);
    EXPECT_NE(
        findDiagnosticText(importWithBodies(closed, reader), "still_lifts").find("no open shaft"),
        std::string::npos);
    EXPECT_NE(findDiagnosticText(importWithBodies(tall, reader), "still_lifts")
                  .find("taller than a cabin"),
              std::string::npos);
  }
}

struct Building {
  const char* file;
  std::size_t doors, leaves, guessed, still;
};

// Read by web-ifc: the number of doors in the file and the bodies made of them.
const Building kBuildings[] = {
    {"fzk-haus/AC14-FZK-Haus.ifc", 5, 4, 4, 1},  // the fifth door has three panes in one sash of
                                                 // 1.9 m
    {"duplex/Duplex_A_20110907.ifc", 14, 14, 0, 0},
};

TEST(IfcDoors, HowADoorOpensIsNotGuessedWhereNoneOpens) {
  for (const IfcDoors doors :
       {IfcDoors::movable, IfcDoors::open, IfcDoors::fixed, IfcDoors::absent}) {
    const Model model = collectDoors(makeIfcDoorModel("NOTDEFINED", makeSingleDoor()), doors);
    const bool opens = doors == IfcDoors::movable || doors == IfcDoors::open;
    EXPECT_EQ(countDiagnostics(model, "guessed_doors"), opens ? 1u : 0u) << toString(doors);
  }
}

TEST(IfcDoors, OfRealBuildingsBecomeBodiesOrAreReported) {
  ENFILADE_NEED_SHARED(shared);
  ENFILADE_NEED_WEB_IFC();
  for (const Building& building : kBuildings) {
    SCOPED_TRACE(building.file);
    const Model model = importWithBodies(*shared / "scenes" / building.file, IfcReader::webIfc);
    const auto doors = std::count_if(
        model.objects.begin(), model.objects.end(),
        [](const Object& object) { return object.ifcClass == "IfcDoor" && !object.partOf; });
    EXPECT_EQ(static_cast<std::size_t>(doors), building.doors);
    EXPECT_EQ(model.bodies.size(), building.leaves);
    EXPECT_EQ(countDiagnostics(model, "guessed_doors"), building.guessed)
        << findDiagnosticText(model, "guessed_doors");
    EXPECT_EQ(countDiagnostics(model, "still_doors"), building.still)
        << findDiagnosticText(model, "still_doors");
    EXPECT_NO_THROW(Scene{Model(model)});
  }
}

TEST(IfcDoors, AnAvatarWalksThroughARealDoorFromEitherSide) {
  ENFILADE_NEED_SHARED(shared);
  ENFILADE_NEED_WEB_IFC();
  const auto file = *shared / "scenes/fzk-haus/AC14-FZK-Haus.ifc";
  const Model model = importWithBodies(file, IfcReader::webIfc);
  for (const double side : {1.0, -1.0}) {
    BodyFixture run{Model(model)};
    const std::string name = "Projekt/Gelände/AC14-FZK-Haus/0. Erdgeschoss/Innentuer-2";
    const Aabb leaf = run.getBody(name).boxes.whole;
    const Vec3 ahead(0, 0, 0.9 * side), middle(leaf.centre().x(), leaf.min.y(), leaf.centre().z());
    run.order("ann", Spawn{middle + ahead + Vec3(0, 0.01, 0), 0, 0.3, 1.75});
    run.order("ann", Walk{{middle - ahead}, 1});
    run.runTicks(900);
    EXPECT_GT(side * (middle.z() - run.getFeet("ann").z()), 0.85) << run.getFeet("ann").transpose();
    EXPECT_NE(run.getBody(name).drive.jointPosition, 0);
  }
}

}  // namespace
}  // namespace enfilade::scene
