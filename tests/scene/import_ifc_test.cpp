// IFC import tests for each reader, on houses known to the millimetre, with reader failures and
// archives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "scene/import/ifc/openings.hpp"
#include "scene/import/import_model.hpp"
#include "scene/world/data/scene.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/hand_made_ifc.hpp"
#include "tests/scene/import_outcome.hpp"
#include "tests/scene/stored_zip.hpp"
#include "tests/support/web_ifc_here.hpp"

namespace enfilade::scene {
namespace {

using tests::hasWebIfc;
using tests::IfcHouse;
using tests::listReadersHere;
using tests::makeReaderOptions;
using tests::TemporaryFolder;

const Diagnostic* findDiagnostic(const Model& model, const std::string& kind) {
  for (const Diagnostic& problem : model.diagnostics) {
    if (problem.kind == kind) return &problem;
  }
  return nullptr;
}

/// Sets an environment variable for the lifetime of the object.
struct Environment {
  Environment(const char* variable, const std::string& value) : name(variable) {
    setenv(name, value.c_str(), 1);
  }
  ~Environment() { unsetenv(name); }
  const char* name;
};

TEST(ImportIfc, EachReaderGivesTheSameHouse) {
  const TemporaryFolder folder;
  const auto file = folder.write("house.ifc", IfcHouse().makeText());
  for (const IfcReader reader : listReadersHere()) {
    const Model model = importModel(file, makeReaderOptions(reader));
    SCOPED_TRACE(model.reader);
    ASSERT_EQ(model.objects.size(), 2u);
    expectSize(model, {4, 3, 0.3}, 1e-5);
    EXPECT_EQ(model.metresPerUnit, 0.001);
    EXPECT_EQ(model.upAxis, UpAxis::z);
    const Object& door = findObjectOfClass(model, "IfcDoor");
    EXPECT_EQ(door.path, "Test house/House/Ground%2Ffloor/Front door");
    EXPECT_EQ(door.globalId, "000000000000000000Door");
    EXPECT_EQ(door.operationType, "SINGLE_SWING_LEFT");
    EXPECT_NEAR(door.overallWidth, 0.9, 1e-9);
    ASSERT_TRUE(door.worldFromPlacement);
    // The file's y is the scene's -z, and its z is the scene's y.
    EXPECT_LT((*door.worldFromPlacement * Vec3(0, 1, 2) - Vec3(1.5, 2, -1.1)).norm(), 1e-9);
    EXPECT_EQ(findDiagnostic(model, "uncut_opening"), nullptr);
    ASSERT_NE(findDiagnostic(model, "skipped_openings"), nullptr);
  }
}

/// With every reader, the import reports `count` doors and windows in uncut walls, with all these
/// words.
void expectUncut(const std::string& text, std::size_t count,
                 std::initializer_list<const char*> words) {
  const TemporaryFolder folder;
  const auto file = folder.write("house.ifc", text);
  for (const IfcReader reader : listReadersHere()) {
    const Model model = importModel(file, makeReaderOptions(reader));
    SCOPED_TRACE(model.reader);
    const Diagnostic* uncut = findDiagnostic(model, "uncut_opening");
    ASSERT_NE(uncut, nullptr);
    EXPECT_EQ(uncut->count, count) << uncut->example;
    for (const char* word : words)
      EXPECT_NE(uncut->example.find(word), std::string::npos) << word << ": " << uncut->example;
  }
}

TEST(ImportIfc, ADoorInAWallWithoutAHoleIsReportedByItsGlobalId) {
  IfcHouse house;
  // The hole is next to the door.
  std::string text = house.makeText();
  const std::string place = "#200=IFCCARTESIANPOINT((" + house.formatLength(1.5);
  text.replace(text.find(place), place.size(),
               "#200=IFCCARTESIANPOINT((" + house.formatLength(0.2));
  const std::string door = "#300=IFCCARTESIANPOINT((" + house.formatLength(0);
  text.replace(text.find(door), door.size(), "#300=IFCCARTESIANPOINT((" + house.formatLength(2));
  expectUncut(text, 1, {"000000000000000000Door", "0 of 9"});
}

TEST(ImportIfc, AnUncutWallIsReportedWithItsDoorAndWindow) {
  IfcHouse house;
  house.voids = false;
  // Without IfcRelFillsElement there is no opening at all: one window in the wall, and one in a gap
  // next to it.
  house.more =
      house.makePlacement(500, "#102", 3, 0.1, 1) + house.makeBox(510, 0.5, 0.05, 1) +
      "#520=IFCWINDOW('0000000000000000Window',$,'Window',$,$,#502,#515,$," +
      house.formatLength(1) + "," + house.formatLength(0.5) + ",.WINDOW.,.SINGLE_PANEL.,$);\n" +
      house.makePlacement(530, "#102", 5, 0.1, 1) + house.makeBox(540, 0.5, 0.05, 1) +
      "#550=IFCWINDOW('000000000000000Outside',$,'Outside',$,$,#532,#545,$," +
      house.formatLength(1) + "," + house.formatLength(0.5) + ",.WINDOW.,.SINGLE_PANEL.,$);\n";
  expectUncut(house.makeText(), 2, {"000000000000000000Door", "0000000000000000Window"});
}

TEST(ImportIfc, ADoorOfItsWallDoesNotCloseItsOwnHoleAndOneDrawnOpenHidesNone) {
  IfcHouse house;
  house.door = false;
  const auto door = [&](const std::string& id, const std::string& name,
                        const std::string& placement, const std::string& shape) {
    return "#" + id + "=IFCDOOR('000000000000000000" + name + "',$,'" + name + "',$,$," +
           placement + "," + shape + ",$," + house.formatLength(2.1) + "," +
           house.formatLength(0.9) + ",.DOOR.,.SINGLE_SWING_LEFT.,$);\n";
  };
  // One door in the hole, which the wall's parts leave; another, modelled open, where the wall is
  // uncut.
  house.more = house.makePlacement(500, "#202", 0, 0.1, 0) + house.makeBox(510, 0.9, 0.05, 2.1) +
               door("520", "Part", "#502", "#515") +
               "#521=IFCRELAGGREGATES('0000000000000000000009',$,$,$,#120,(#520));\n" +
               house.makePlacement(530, "#102", 2.8, 0.1, 0) + house.makeBox(540, 0.9, 0.9, 2.1) +
               door("550", "Open", "#532", "#545") +
               "#551=IFCRELCONTAINEDINSPATIALSTRUCTURE('0000000000000000000010',$,$,$,(#550),"
               "#41);\n";
  expectUncut(house.makeText(), 1, {"000000000000000000Open"});
}

TEST(ImportIfc, UnitAndUpAxisOfTheUserWin) {
  const TemporaryFolder folder;
  const auto file = folder.write("house.ifc", IfcHouse().makeText());
  ImportOptions options = makeReaderOptions(IfcReader::ifcPlusPlus);
  options.metresPerUnit = 0.002;
  options.up = UpAxis::y;
  const Model model = importModel(file, options);
  expectSize(model, {8, 0.6, 6}, 1e-5);
  EXPECT_NEAR(findObjectOfClass(model, "IfcDoor").overallWidth, 1.8, 1e-9);
  EXPECT_EQ(findDiagnostic(model, "uncut_opening"), nullptr);
}

TEST(ImportIfc, AMapPositionIsReportedAndMovesNothing) {
  const TemporaryFolder folder;
  IfcHouse house;
  house.more =
      "#600=IFCMAPCONVERSION(#20,#601,456789.125,5428000.5,110.25,1.,0.,$);\n"
      "#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$,#602);\n"
      "#602=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n";
  const auto file = folder.write("house.ifc", house.makeText());
  for (const IfcReader reader : listReadersHere()) {
    const Model model = importModel(file, makeReaderOptions(reader));
    SCOPED_TRACE(model.reader);
    const Diagnostic* place = findDiagnostic(model, "map_place");
    ASSERT_NE(place, nullptr);
    EXPECT_NE(
        place->example.find("EPSG:25832: the file's origin is at E 456789.125, N 5428000.500"),
        std::string::npos)
        << place->example;
    EXPECT_TRUE(model.offset.isZero(0));
    EXPECT_LT(
        (findObjectOfClass(model, "IfcDoor").worldFromPlacement->translation() - Vec3(1.5, 0, -0.1))
            .norm(),
        1e-9);
  }
}

TEST(ImportIfc, ATechnicalCorrigendumOfAReleaseIsReadAsTheRelease) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  IfcHouse house;
  house.schema = "IFC4";
  std::string text = house.makeText();
  text.replace(text.find("'IFC4'"), 6, "'IFC4X3_TC1'");
  const Model model =
      importModel(folder.write("house.ifc", text), makeReaderOptions(IfcReader::webIfc));
  EXPECT_EQ(model.reader, "web-ifc");
  EXPECT_TRUE(findObjectOfClass(model, "IfcDoor").worldFromPlacement);
}

TEST(ImportIfc, StoreysAndSpacesAreKept) {
  const TemporaryFolder folder;
  IfcHouse house;
  house.more = house.makePlacement(500, "#15", 0, 0, 3.2) +
               "#510=IFCBUILDINGSTOREY('0000000000000000000511',$,'Upper "
               "floor',$,$,#502,$,$,.ELEMENT.,3200.);\n"
               "#511=IFCRELAGGREGATES('0000000000000000000512',$,$,$,#40,(#510));\n" +
               house.makePlacement(520, "#502", 1, 1, 0) + house.makeBox(530, 1, 1, 0.5) +
               "#540=IFCFURNISHINGELEMENT('0000000000000000000541',$,'Table',$,$,#522,#535,$);\n"
               "#541=IFCRELCONTAINEDINSPATIALSTRUCTURE('0000000000000000000542',$,$,$,(#540),"
               "#510);\n" +
               house.makePlacement(550, "#502", 0, 0, 0) + house.makeBox(560, 4, 3, 2.5) +
               "#570=IFCSPACE('0000000000000000000571',$,'201',$,$,#552,#565,'Study',"
               ".ELEMENT.,.INTERNAL.,$);\n"
               "#571=IFCRELAGGREGATES('0000000000000000000572',$,$,$,#510,(#570));\n";
  const auto file = folder.write("house.ifc", house.makeText());
  for (const IfcReader reader : listReadersHere()) {
    const Model model = importModel(file, makeReaderOptions(reader));
    SCOPED_TRACE(model.reader);
    ASSERT_EQ(model.storeys.size(), 2u);
    EXPECT_EQ(model.storeys[0].name, "Ground/floor");
    EXPECT_EQ(model.storeys[0].elevation, 0);
    EXPECT_EQ(model.storeys[1].name, "Upper floor");
    EXPECT_EQ(model.storeys[1].globalId, "0000000000000000000511");
    EXPECT_NEAR(model.storeys[1].elevation, 3.2, 1e-9);
    EXPECT_EQ(findObjectOfClass(model, "IfcWall").storey, 0u);
    EXPECT_EQ(findObjectOfClass(model, "IfcDoor").storey, 0u);
    EXPECT_EQ(findObjectOfClass(model, "IfcFurnishingElement").storey, 1u);
    ASSERT_EQ(model.spaces.size(), 1u);
    const Space& space = model.spaces[0];
    EXPECT_EQ(space.name, "201");
    EXPECT_EQ(space.longName, "Study");
    EXPECT_EQ(space.storey, 1u);
    for (const Object& object : model.objects) EXPECT_NE(object.ifcClass, "IfcSpace");
    if (model.reader != "web-ifc") continue;
    EXPECT_LT((space.box.min - Vec3(0, 3.2, -3)).norm(), 1e-5) << space.box.min.transpose();
    EXPECT_LT((space.box.max - Vec3(4, 5.7, 0)).norm(), 1e-5) << space.box.max.transpose();
  }
}

TEST(ImportIfc, StoreysThatAreAllPlacedAtOneHeightLieAtTheirElevations) {
  const TemporaryFolder folder;
  for (const bool placed : {false, true}) {
    IfcHouse house;
    house.more = house.makePlacement(500, "#15", 0, 0, placed ? 3.2 : 0) +
                 "#510=IFCBUILDINGSTOREY('0000000000000000000511',$,'Upper "
                 "floor',$,$,#502,$,$,.ELEMENT.,3200.);\n"
                 "#511=IFCRELAGGREGATES('0000000000000000000512',$,$,$,#40,(#510));\n";
    const Model model = importModel(folder.write("house.ifc", house.makeText()), {});
    ASSERT_EQ(model.storeys.size(), 2u);
    EXPECT_NEAR(model.storeys[0].elevation, 0, 1e-9);
    EXPECT_NEAR(model.storeys[1].elevation, 3.2, 1e-9);
    EXPECT_EQ(countDiagnostics(model, "storeys_by_elevation"), placed ? 0u : 2u);
  }
}

TEST(ImportIfc, AnElevationThatIsNoNumberIsReported) {
  const TemporaryFolder folder;
  for (const char* elevation : {"1.E999", "'high'", "$", "3200."}) {
    IfcHouse house;
    house.more = house.makePlacement(500, "#15", 0, 0, 3.2) +
                 "#510=IFCBUILDINGSTOREY('0000000000000000000511',$,'Upper "
                 "floor',$,$,#502,$,$,.ELEMENT.," +
                 std::string(elevation) +
                 ");\n#511=IFCRELAGGREGATES('0000000000000000000512',$,$,$,#40,(#510));\n";
    const Model model = importModel(folder.write("house.ifc", house.makeText()), {});
    const bool isBroken = elevation[0] == '1' || elevation[0] == '\'';
    EXPECT_EQ(countDiagnostics(model, "broken_elevation"), isBroken ? 1u : 0u) << elevation;
    EXPECT_NEAR(model.storeys.at(1).elevation, 3.2, 1e-9) << elevation;
  }
}

TEST(ImportIfc, AWallIsLargerThanItsDoorAndAFrameIsNot) {
  const TemporaryFolder folder;
  const std::string text = IfcHouse().makeText();
  const StepFile steps(text);
  const IfcMetadata metadata = readIfcMetadata(steps);
  Model model =
      importModel(folder.write("house.ifc", text), makeReaderOptions(listReadersHere()[0]));
  const auto wall =
      std::find_if(metadata.products.begin(), metadata.products.end(),
                   [](const IfcProduct& product) { return product.ifcClass == "IfcWall"; });
  ASSERT_NE(wall, metadata.products.end());
  EXPECT_TRUE(isLargerThanOpenings(model, metadata, *wall)) << "4 x 3 m around 0.9 x 2.1 m";
  for (Object& object : model.objects)
    object.worldFromMesh = Eigen::Scaling(0.25, 0.7, 1.0) * object.worldFromMesh;
  EXPECT_FALSE(isLargerThanOpenings(model, metadata, *wall)) << "1 x 2.1 m";
}

TEST(ImportIfc, APositionWithoutAMapIsNotReported) {
  const TemporaryFolder folder;
  for (const char* numbers : {"1.,2.,3.,1.,0.,0.", "1.,2.,3.,0.,0.,1.", "1.E30,2.,3.,1.,0.,1."}) {
    SCOPED_TRACE(numbers);
    IfcHouse house;
    house.more = "#600=IFCMAPCONVERSION(#20,#601," + std::string(numbers) +
                 ");\n#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$,$);\n";
    const Model model = importModel(folder.write("house.ifc", house.makeText()),
                                    makeReaderOptions(listReadersHere()[0]));
    EXPECT_EQ(findDiagnostic(model, "map_place"), nullptr);
  }
}

TEST(ImportIfc, AHouseFarFromTheOriginKeepsItsMillimetres) {
  const TemporaryFolder folder;
  IfcHouse house;
  house.offset = "459123400.,5428310700.,112600.";  // UTM coordinates in millimetres
  const auto file = folder.write("far.ifc", house.makeText());
  for (const IfcReader reader : listReadersHere()) {
    const Model model = importModel(file, makeReaderOptions(reader));
    SCOPED_TRACE(model.reader);
    expectSize(model, {4, 3, 0.3}, 1e-5);
    EXPECT_NEAR(model.offset.x(), 459123.4, 10);
    EXPECT_NEAR(model.offset.z(), -5428310.7, 10);
    const Vec3 door =
        findObjectOfClass(model, "IfcDoor").worldFromPlacement->translation() + model.offset;
    EXPECT_LT((door - Vec3(459124.9, 112.6, -5428310.8)).norm(), 1e-6);
    EXPECT_EQ(findDiagnostic(model, "uncut_opening"), nullptr);
  }
}

TEST(ImportIfc, ACutOffFileIsReadAsFarAsItGoesAndSaysSo) {
  const TemporaryFolder folder;
  const std::string text = IfcHouse().makeText();
  const auto file = folder.write("cut.ifc", text.substr(0, text.find("ENDSEC;\nEND-ISO")));
  const Model model = importModel(file, makeReaderOptions(IfcReader::ifcPlusPlus));
  EXPECT_EQ(model.objects.size(), 2u);
  EXPECT_NE(findDiagnostic(model, "cut_off_file"), nullptr);
}

TEST(ImportIfc, AReaderThatFailsIsFollowedByTheNext) {
  const TemporaryFolder folder;
  IfcHouse house;
  house.schema = "IFC2X3";  // the schema that assimp supports
  const auto file = folder.write("house.ifc", house.makeText());
  for (const char* kind : {"web-ifc:crash", "web-ifc:garbage", "web-ifc:exit", "web-ifc:memory"}) {
    const Environment fault("ENFILADE_IMPORT_FAULT", kind);
    const Model model = importModel(file);
    EXPECT_EQ(model.reader, "ifcplusplus") << kind;
    EXPECT_EQ(model.objects.size(), 2u);
    if (!hasWebIfc()) continue;
    ASSERT_NE(findDiagnostic(model, "ifc_reader_failed"), nullptr);
    EXPECT_TRUE(findDiagnostic(model, "ifc_reader_failed")->example.starts_with("web-ifc: "));
  }
  const Environment fault("ENFILADE_IMPORT_FAULT", "ifcplusplus:crash");
  const Environment noNode("ENFILADE_WEB_IFC", folder.getPath());
  const Model model = importModel(file);
  EXPECT_EQ(model.reader, "assimp");
  EXPECT_NE(findDiagnostic(model, "ifc_reader_absent"), nullptr);
  EXPECT_NE(findDiagnostic(model, "ifc_reader_failed"), nullptr);
  EXPECT_EQ(findObjectOfClass(model, "IfcDoor").path, "Test house/House/Ground%2Ffloor/Front door");
}

TEST(ImportIfc, AMissingOrInvalidReaderModuleIsReported) {
  const TemporaryFolder folder;
  const auto file = folder.write("house.ifc", IfcHouse().makeText());
  for (const auto& module : {folder.getPath() / "missing.so", folder.write("none.so", "text")}) {
    const Environment named("ENFILADE_IFC_PLUS_PLUS", module);
    const std::string failure = catchFailure(file, makeReaderOptions(IfcReader::ifcPlusPlus));
    for (const std::string& part :
         {module.filename().string(), std::string("ifcplusplus: "), std::string("install it")})
      EXPECT_NE(failure.find(part), std::string::npos) << failure;
  }
}

TEST(ImportIfc, AReaderThatHangsLeavesTimeForTheNext) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  const auto file = folder.write("house.ifc", IfcHouse().makeText());
  const Environment fault("ENFILADE_IMPORT_FAULT", "web-ifc:hang");
  ImportOptions options;
  options.timeLimit = 10;  // half of it is left for a child that takes 0.4 s, on a busy machine too
  EXPECT_EQ(importModel(file, options).reader, "ifcplusplus");
}

TEST(ImportIfc, WithoutNodeTheNextReaderIsUsedAndReported) {
  const TemporaryFolder folder;
  const auto file = folder.write("house.ifc", IfcHouse().makeText());
  const Environment nowhere("ENFILADE_WEB_IFC", folder.getPath());
  const Model model = importModel(file);
  EXPECT_EQ(model.reader, "ifcplusplus");
  ASSERT_NE(findDiagnostic(model, "ifc_reader_absent"), nullptr);
  EXPECT_NE(findDiagnostic(model, "ifc_reader_absent")->example.find("npm ci"), std::string::npos);
  const std::string failure = catchFailure(file, makeReaderOptions(IfcReader::webIfc));
  EXPECT_NE(failure.find("house.ifc: cannot be read: web-ifc: "), std::string::npos) << failure;
  EXPECT_NE(failure.find("--ifc-reader auto"), std::string::npos) << failure;
}

TEST(ImportIfc, WhenAllReadersFailTheErrorSaysWhyOfEach) {
  const TemporaryFolder folder;
  IfcHouse house;
  std::string text = house.makeText();
  for (std::size_t at = text.find("IFCEXTRUDEDAREASOLID"); at != std::string::npos;
       at = text.find("IFCEXTRUDEDAREASOLID", at)) {
    text.replace(at, 20, "IFCNOSUCHTHINGATALL1");
  }
  const std::string failure = catchFailure(folder.write("empty.ifc", text));
  for (const char* part : {"empty.ifc", "web-ifc: ", "ifcplusplus: ", "assimp: ", "re-export"}) {
    EXPECT_NE(failure.find(part), std::string::npos) << failure;
  }
}

TEST(ImportIfc, ProgressNamesTheReaders) {
  const TemporaryFolder folder;
  const auto file = folder.write("house.ifc", IfcHouse().makeText());
  std::vector<std::string> stages;
  importModel(file, {}, [&](const std::string& stage, double fraction) {
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    if (stages.empty() || stages.back() != stage) stages.push_back(stage);
  });
  const std::string shapes = hasWebIfc() ? "shapes (web-ifc)" : "shapes (ifcplusplus)";
  for (const std::string& stage : {std::string("index"), shapes, std::string("openings")}) {
    EXPECT_NE(std::find(stages.begin(), stages.end(), stage), stages.end()) << stage;
  }
}

TEST(ImportIfc, AnArchiveIsUnpacked) {
  const TemporaryFolder folder;
  const std::string text = IfcHouse().makeText();
  const auto file =
      folder.write("house.ifczip",
                   tests::makeStoredZip({{"__MACOSX/._house.ifc", "x"}, {"sub/House.IFC", text}}));
  EXPECT_EQ(importModel(file, makeReaderOptions(IfcReader::ifcPlusPlus)).objects.size(), 2u);
  const auto misnamed = folder.write("zipped.ifc", tests::makeStoredZip({{"a.ifc", text}}));
  EXPECT_EQ(importModel(misnamed, makeReaderOptions(IfcReader::ifcPlusPlus)).objects.size(), 2u);
  const auto unzipped = folder.write("plain.ifczip", text);
  EXPECT_EQ(importModel(unzipped, makeReaderOptions(IfcReader::ifcPlusPlus)).objects.size(), 2u);
}

TEST(ImportIfc, AnArchiveWithZeroSeveralOrTooLargeModelsIsRefused) {
  const TemporaryFolder folder;
  const auto none = folder.write("none.ifczip", tests::makeStoredZip({{"readme.txt", "x"}}));
  EXPECT_NE(catchFailure(none).find("none.ifczip: contains no .ifc file"), std::string::npos);
  EXPECT_NE(catchFailure(folder.write("empty.ifczip", tests::makeStoredZip({})))
                .find("empty.ifczip: contains no .ifc file (0 others)"),
            std::string::npos);
  const auto two =
      folder.write("two.ifczip", tests::makeStoredZip({{"a.ifc", "x"}, {"b.ifc", "x"}}));
  EXPECT_NE(catchFailure(two).find("has 2 .ifc files (a.ifc, b.ifc)"), std::string::npos);
  const auto noise = folder.write("noise.ifczip", "PK\3\4 and then nothing");
  EXPECT_NE(catchFailure(noise).find("noise.ifczip: cannot be unzipped"), std::string::npos);
  std::string locked = tests::makeStoredZip({{"a.ifc", "x"}});
  locked[locked.find("PK\1\2") + 8] = 1;  // sets the "encrypted" flag in the directory
  EXPECT_NE(
      catchFailure(folder.write("locked.ifczip", locked)).find("is encrypted; unzip it with its"),
      std::string::npos);
  std::string other = tests::makeStoredZip({{"a.ifc", "what the checksum is of"}});
  other[other.find("what")] = 'W';
  EXPECT_NE(catchFailure(folder.write("other.ifczip", other)).find("its .ifc file is damaged"),
            std::string::npos);
  const auto large =
      folder.write("large.ifczip", tests::makeStoredZip({{"a.ifc", std::string(40 << 20, ' ')}}));
  ImportOptions options;
  options.memoryLimit = std::size_t{256} << 20;  // an eighth of the limit may be text
  EXPECT_NE(catchFailure(large, options).find("unpacks to more than the 32 MiB"),
            std::string::npos);
}

TEST(ImportIfc, APlacementRelativeToItselfIsReported) {
  const TemporaryFolder folder;
  IfcHouse house;
  std::string loop =
      house.makePlacement(600, "#702", 0, 5, 0) + house.makePlacement(700, "#602", 0, 5, 0);
  house.more = loop + house.makeBox(610, 4, 0.3, 3) +
               "#620=IFCWALL('000000000000000000Loop',$,'Loop',$,$,#602,#615,$,$);\n";
  const Model model = importModel(folder.write("house.ifc", house.makeText()),
                                  makeReaderOptions(IfcReader::ifcPlusPlus));
  EXPECT_EQ(countDiagnostics(model, "broken_transform_dropped"), 1u);
  EXPECT_EQ(findDiagnosticText(model, "broken_transform_dropped"),
            "000000000000000000Loop (IfcWall): its placement is relative to itself, or nested "
            "more than 200 deep");
}

TEST(ImportIfc, DamagedFilesEndInModelsOrInErrorsThatNameThem) {
  const TemporaryFolder folder;
  const std::string whole = IfcHouse().makeText();
  std::mt19937_64 random(2026);
  std::size_t loaded = 0, refused = 0;
  for (int i = 0; i < 12; ++i) {
    std::string text = whole;
    if (i % 3 == 0) text.resize(random() % text.size());
    for (int k = 0; k < 4 && i % 3 != 0; ++k) {
      text[random() % text.size()] = static_cast<char>(random());
    }
    const auto file = folder.write("damaged.ifc", text);
    const std::string failure = catchFailure(
        file, makeReaderOptions(i < 4 ? IfcReader::automatic : IfcReader::ifcPlusPlus));
    ++(failure.empty() ? loaded : refused);
    EXPECT_TRUE(failure.empty() || failure.find("damaged.ifc") != std::string::npos) << failure;
  }
  EXPECT_GT(loaded, 3u);
  EXPECT_GT(refused, 0u);
}

}  // namespace
}  // namespace enfilade::scene
