// The map of an IFC file, applied on request, and north.
#include <gtest/gtest.h>

#include "scene/import/import_model.hpp"
#include "scene/world/data/scene.hpp"
#include "tests/scene/hand_made_ifc.hpp"
#include "tests/scene/import_outcome.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/web_ifc_here.hpp"

namespace enfilade::scene {
namespace {

using tests::IfcHouse;
using tests::listReadersHere;
using tests::makeReaderOptions;
using tests::TemporaryFolder;

// ---- the map ------------------------------------------------------------------------------------

TEST(IfcMap, OnRequestCoordinatesAreThoseOfTheMap) {
  const TemporaryFolder folder;
  IfcHouse house;
  // The file's x axis points north on the map.
  house.more =
      "#600=IFCMAPCONVERSION(#20,#601,456789.,5428000.,110.,0.,1.,$);\n"
      "#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$,#602);\n"
      "#602=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n";
  const auto file = folder.write("house.ifc", house.makeText());
  for (const IfcReader reader : listReadersHere()) {
    ImportOptions options = makeReaderOptions(reader);
    options.georeference = true;
    const Model model = importModel(file, options);
    SCOPED_TRACE(model.reader);
    EXPECT_EQ(model.map, "EPSG:25832");
    // A corner of the file's (1.5, 0.1) is 0.1 m west and 1.5 m north of the origin; -z is north.
    const Vec3 door =
        findObjectOfClass(model, "IfcDoor").worldFromPlacement->translation() + model.offset;
    EXPECT_LT((door - Vec3(456789 - 0.1, 110, -(5428000 + 1.5))).norm(), 1e-6) << door.transpose();
    EXPECT_LT(Scene(Model(model)).bounds().size().z(), 4.01);
    EXPECT_GT(Scene(Model(model)).bounds().size().z(), 3.99) << "the wall runs north";
    EXPECT_LT(Scene(Model(model)).bounds().max.norm(), 100) << "the scene lies near its origin";
  }
}

/// The place on its map of the origin of a house with these statements.
Vec3 findOriginOnMap(const std::string& more, const std::string& schema,
                     std::string* crs = nullptr) {
  const TemporaryFolder folder;
  IfcHouse house;
  house.schema = schema;
  house.more = more;
  ImportOptions options = makeReaderOptions(listReadersHere().front());
  options.georeference = true;
  const Model model = importModel(folder.write("house.ifc", house.makeText()), options);
  if (crs != nullptr) *crs = model.map;
  // The door stands at (1.5, 0.1) of the file.
  return findObjectOfClass(model, "IfcDoor").worldFromPlacement->translation() + model.offset;
}

TEST(IfcMap, AMapConversionWithAxisFactorsIsApplied) {
  // Twice as long along x than the file says, to show the factor: 1.5 m become 3.
  const Vec3 door = findOriginOnMap(
      "#600=IFCMAPCONVERSIONSCALED(#20,#601,456000.,5428000.,110.,1.,0.,$,2.,1.,1.);\n"
      "#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$,#602);\n"
      "#602=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n",
      "IFC4");
  EXPECT_LT((door - Vec3(456003, 110, -(5428000 + 0.1))).norm(), 1e-6) << door.transpose();
}

TEST(IfcMap, ARigidOperationIsApplied) {
  std::string crs;
  const Vec3 door = findOriginOnMap(
      "#600=IFCRIGIDOPERATION(#20,#601,IFCLENGTHMEASURE(456000.),IFCLENGTHMEASURE(5428000.),110.);"
      "\n"
      "#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$,#602);\n"
      "#602=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n",
      "IFC4", &crs);
  EXPECT_LT((door - Vec3(456001.5, 110, -(5428000 + 0.1))).norm(), 1e-6) << door.transpose();
  EXPECT_EQ(crs, "EPSG:25832");
}

TEST(IfcMap, TheMapPropertySetsOfIfc2x3AreApplied) {
  std::string crs;
  const Vec3 door = findOriginOnMap(
      "#600=IFCPROPERTYSET('00000000000000000000Map',#5,'ePset_MapConversion',$,"
      "(#601,#602,#603,#604,#605));\n"
      "#601=IFCPROPERTYSINGLEVALUE('Eastings',$,IFCLENGTHMEASURE(456000.),$);\n"
      "#602=IFCPROPERTYSINGLEVALUE('Northings',$,IFCLENGTHMEASURE(5428000.),$);\n"
      "#603=IFCPROPERTYSINGLEVALUE('OrthogonalHeight',$,IFCLENGTHMEASURE(110.),$);\n"
      "#604=IFCPROPERTYSINGLEVALUE('XAxisAbscissa',$,IFCREAL(0.),$);\n"
      "#605=IFCPROPERTYSINGLEVALUE('XAxisOrdinate',$,IFCREAL(1.),$);\n"
      "#610=IFCPROPERTYSET('00000000000000000000Crs',#5,'ePSet_ProjectedCRS',$,(#611,#612));\n"
      "#611=IFCPROPERTYSINGLEVALUE('Name',$,IFCLABEL('EPSG:25832'),$);\n"
      "#612=IFCPROPERTYSINGLEVALUE('MapUnit',$,IFCIDENTIFIER('METRE'),$);\n",
      "IFC2X3", &crs);
  EXPECT_LT((door - Vec3(456000 - 0.1, 110, -(5428000 + 1.5))).norm(), 1e-6) << door.transpose();
  EXPECT_EQ(crs, "EPSG:25832");
}

// ---- north --------------------------------------------------------------------------------------

TEST(IfcMap, NorthIsAsTheFileStatesItAndElseItsYAxis) {
  const TemporaryFolder folder;
  IfcHouse house;
  const ImportOptions options = makeReaderOptions(listReadersHere().front());
  EXPECT_EQ(importModel(folder.write("house.ifc", house.makeText()), options).north,
            Eigen::Vector2d(0, -1));
  // 30 degrees east of the file's y axis, so towards +x and -z of the scene.
  std::string text = house.makeText();
  const std::string context = "1.E-05,#11,$)";
  text.replace(text.find(context), context.size(), "1.E-05,#11,#16)");
  text.insert(text.find("#20="), "#16=IFCDIRECTION((0.5,0.866025403784439));\n");
  const auto north = importModel(folder.write("true.ifc", text), options).north;
  ASSERT_TRUE(north);
  EXPECT_LT((*north - Eigen::Vector2d(0.5, -0.866025403784439)).norm(), 1e-9);
}

TEST(IfcMap, ANorthThatCannotBeUsedIsReported) {
  const TemporaryFolder folder;
  for (const auto& [reader, north] :
       {std::pair(listReadersHere().front(), "#16"), std::pair(listReadersHere().back(), "#16"),
        std::pair(listReadersHere().front(), "#999"),
        std::pair(listReadersHere().front(), "(0.,1.)")}) {
    std::string text = IfcHouse().makeText();
    const std::string context = "1.E-05,#11,$)";
    text.replace(text.find(context), context.size(), std::string("1.E-05,#11,") + north + ")");
    text.insert(text.find("#20="), "#16=IFCDIRECTION((0.,0.));\n");
    const Model model = importModel(folder.write("broken.ifc", text), makeReaderOptions(reader));
    EXPECT_FALSE(model.north) << north;
    EXPECT_EQ(countDiagnostics(model, "broken_north"), 1u) << north;
    EXPECT_TRUE(
        findDiagnosticText(model, "broken_north").ends_with(std::string("TrueNorth ") + north))
        << findDiagnosticText(model, "broken_north");
  }
}

TEST(IfcMap, NorthFollowsFromTheMapIfNothingElseStatesIt) {
  const TemporaryFolder folder;
  IfcHouse house;
  house.more =
      "#600=IFCMAPCONVERSION(#20,#601,456789.,5428000.,110.,0.,1.,$);\n"
      "#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$,$);\n";
  const auto file = folder.write("house.ifc", house.makeText());
  ImportOptions options = makeReaderOptions(listReadersHere().front());
  // The file's x axis points north.
  EXPECT_EQ(importModel(file, options).north, Eigen::Vector2d(1, 0));
  options.georeference = true;
  const auto north = importModel(file, options).north;
  ASSERT_TRUE(north);
  EXPECT_LT((*north - Eigen::Vector2d(0, -1)).norm(), 1e-12) << "the scene's axes are the map's";
}

TEST(IfcMap, AMapThatIsMissingIsAnErrorOnRequest) {
  const TemporaryFolder folder;
  ImportOptions options;
  options.georeference = true;
  for (const auto& file : {folder.write("house.ifc", IfcHouse().makeText()),
                           folder.write("cube.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")}) {
    try {
      importModel(file, options);
      ADD_FAILURE() << file << " was read";
    } catch (const ImportError& error) {
      EXPECT_NE(std::string(error.what()).find("--georeference"), std::string::npos)
          << error.what();
    }
  }
}

TEST(IfcMap, NumbersThatCannotBeUsedAreNamed) {
  const TemporaryFolder folder;
  const auto expectFault = [&](const std::string& numbers, const std::string& fault) {
    IfcHouse house;
    house.more = "#600=IFCMAPCONVERSION(#20,#601," + numbers +
                 ");\n#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$,#602);\n"
                 "#602=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n";
    const auto file = folder.write("house.ifc", house.makeText());
    ImportOptions options = makeReaderOptions(IfcReader::ifcPlusPlus);
    const Model model = importModel(file, options);
    EXPECT_EQ(findDiagnosticText(model, "broken_map"), "IfcMapConversion: " + fault);
    EXPECT_EQ(countDiagnostics(model, "map_place"), 0u);
    options.georeference = true;
    const std::string text = catchFailure(file, options);
    EXPECT_NE(text.find("--georeference: IfcMapConversion: " + fault), std::string::npos) << text;
  };
  expectFault("1.E400,5428000.,110.,0.,1.,$", "its Eastings '1.E400' is not a number");
  expectFault("456789.,5428000.,110.,0.,0.,$", "its x axis has no direction (0, 0)");
  expectFault("456789.,5428000.,110.,0.,1.,-1.",
              "its scale is not a positive number that a map can have");
}

TEST(IfcMap, AMapOfAnotherScaleIsRefusedOnRequest) {
  const TemporaryFolder folder;
  IfcHouse house;
  house.more =
      "#600=IFCMAPCONVERSION(#20,#601,456789.,5428000.,110.,1.,0.,40.);\n"
      "#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$,#602);\n"
      "#602=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n";
  ImportOptions options;
  options.georeference = true;
  try {
    importModel(folder.write("house.ifc", house.makeText()), options);
    ADD_FAILURE() << "a map forty times as large was applied";
  } catch (const ImportError& error) {
    EXPECT_NE(std::string(error.what()).find("IfcMapConversion scales by 40"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace enfilade::scene
