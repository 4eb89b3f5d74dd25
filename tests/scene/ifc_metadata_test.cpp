#include "scene/import/ifc/ifc_metadata.hpp"

#include <gtest/gtest.h>

#include "scene/import/ifc/class_names.hpp"
#include "scene/import/ifc/spatial_structure.hpp"
#include "tests/scene/hand_made_ifc.hpp"

namespace enfilade::scene {
namespace {

using tests::IfcHouse;

const IfcProduct& findProduct(const IfcMetadata& facts, const std::string& ifcClass) {
  for (const IfcProduct& product : facts.products) {
    if (product.ifcClass == ifcClass) return product;
  }
  throw std::runtime_error("no " + ifcClass);
}

IfcMetadata readFacts(const IfcHouse& house) {
  return readIfcMetadata(StepFile(house.makeText()));
}

TEST(IfcMetadata, ProductsHaveClassNamePlaceAndRole) {
  const IfcMetadata facts = readFacts({});
  EXPECT_EQ(facts.schema, "IFC4");
  EXPECT_TRUE(facts.complete);
  EXPECT_EQ(facts.metresPerUnit, 0.001);
  const IfcProduct& wall = findProduct(facts, "IfcWall");
  EXPECT_EQ(wall.id, 120u);
  EXPECT_TRUE(wall.hasBody);
  EXPECT_EQ(wall.role, IfcProduct::Role::physical);
  EXPECT_EQ(wall.parent, 41u);
  EXPECT_EQ(findProduct(facts, "IfcOpeningElement").role, IfcProduct::Role::opening);
  EXPECT_FALSE(findProduct(facts, "IfcBuildingStorey").hasBody);
}

TEST(IfcMetadata, PathsLeadFromTheProjectDownAndRepeatsAreNumbered) {
  IfcHouse house;
  house.more =
      "#500=IFCWALL('00000000000000000Wall2',$,'Wall',$,$,#102,#115,$,$);\n"
      "#501=IFCRELCONTAINEDINSPATIALSTRUCTURE('0000000000000000000009',$,$,$,(#500),#41);\n"
      "#502=IFCWALL('00000000000000000Wall3',$,$,$,$,#102,#115,$,$);\n";
  const auto paths = buildIfcPaths(readFacts(house));
  EXPECT_EQ(paths.at(120), "Test house/House/Ground%2Ffloor/Wall");
  EXPECT_EQ(paths.at(500), "Test house/House/Ground%2Ffloor/Wall#2");
  EXPECT_EQ(paths.at(502), "IfcWall") << "it has no parent and no name";
}

TEST(IfcMetadata, PartsThatContainEachOtherHavePaths) {
  IfcHouse house;
  house.more =
      "#500=IFCRELAGGREGATES('0000000000000000000009',$,$,$,#120,(#120));\n"
      "#501=IFCWALL('00000000000000000Wall2',$,'a',$,$,#102,#115,$,$);\n"
      "#502=IFCWALL('00000000000000000Wall3',$,'b',$,$,#102,#115,$,$);\n"
      "#503=IFCRELAGGREGATES('0000000000000000000010',$,$,$,#501,(#502));\n"
      "#504=IFCRELAGGREGATES('0000000000000000000011',$,$,$,#502,(#501));\n";
  const auto paths = buildIfcPaths(readFacts(house));
  EXPECT_NE(paths.at(501), paths.at(502));
}

TEST(IfcMetadata, DoorsSayHowTheyOpenInEitherVersion) {
  const IfcProduct four = findProduct(readFacts({}), "IfcDoor");
  EXPECT_EQ(four.operation, "SINGLE_SWING_LEFT");
  EXPECT_NEAR(four.overallWidth, 0.9, 1e-12);
  EXPECT_NEAR(four.overallHeight, 2.1, 1e-12);
  EXPECT_EQ(four.host, 120u);
  ASSERT_TRUE(four.fileFromPlacement);
  EXPECT_LT((four.fileFromPlacement->translation() - Vec3(1.5, 0.1, 0)).norm(), 1e-12);

  IfcHouse older;
  older.schema = "IFC2X3";
  EXPECT_EQ(findProduct(readFacts(older), "IfcDoor").operation, "");
  older.more =
      "#500=IFCDOORSTYLE('000000000000000000DSty',$,$,$,$,$,$,$,.DOUBLE_DOOR_SLIDING.,.WOOD.,.F.,"
      ".F.);\n#501=IFCRELDEFINESBYTYPE('0000000000000000000009',$,$,$,(#320),#500);\n";
  EXPECT_EQ(findProduct(readFacts(older), "IfcDoor").operation, "DOUBLE_DOOR_SLIDING");

  IfcHouse typed;  // IFC4: the door takes the operation from its type
  const std::string operation = ".SINGLE_SWING_LEFT.";
  typed.more =
      "#500=IFCDOORTYPE('000000000000000000DTyp',$,$,$,$,$,$,$,$,.DOOR.,.REVOLVING.,$,$);\n"
      "#501=IFCRELDEFINESBYTYPE('0000000000000000000009',$,$,$,(#320),#500);\n";
  std::string text = typed.makeText();
  text.replace(text.find(operation), operation.size(), "$");
  EXPECT_EQ(findProduct(readIfcMetadata(StepFile(text)), "IfcDoor").operation, "REVOLVING");
}

TEST(IfcMetadata, LiftsAreTransportElements) {
  IfcHouse house;
  house.more =
      "#500=IFCTRANSPORTELEMENT('000000000000000000Lift',$,'Lift',$,$,#102,#115,$,"
      ".ELEVATOR.);\n";
  EXPECT_EQ(findProduct(readFacts(house), "IfcTransportElement").operation, "ELEVATOR");
}

TEST(IfcMetadata, FeetAreAConversion) {
  IfcHouse house;
  house.unit = "IFCCONVERSIONBASEDUNIT(#600,.LENGTHUNIT.,'FOOT',#601)";
  house.unitsPerMetre = 1 / 0.3048;
  house.more =
      "#601=IFCMEASUREWITHUNIT(IFCLENGTHMEASURE(0.3048),#602);\n"
      "#602=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n";
  const IfcMetadata facts = readFacts(house);
  EXPECT_DOUBLE_EQ(facts.metresPerUnit, 0.3048);
  EXPECT_FALSE(facts.siUnit);
  EXPECT_NEAR(findProduct(facts, "IfcDoor").overallWidth, 0.9, 1e-5);
  house.more = "#601=IFCMEASUREWITHUNIT(IFCLENGTHMEASURE(0.3048),#31);\n";  // a unit that refers to
                                                                            // itself
  EXPECT_TRUE(readFacts(house).unitAssumption);
}

TEST(IfcMetadata, AMapPositionIsReportedInMetres) {
  IfcHouse house;  // in millimetres
  EXPECT_FALSE(readFacts(house).mapConversion);
  house.more =
      "#600=IFCMAPCONVERSION(#20,#601,456789.125,5428000.5,110.25,0.5,0.8660254037844386,0.9996);\n"
      "#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$,#602);\n"
      "#602=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n";
  const std::optional<IfcMapConversion> place = readFacts(house).mapConversion;
  ASSERT_TRUE(place);
  EXPECT_EQ(place->crs, "EPSG:25832");
  EXPECT_EQ(place->east, 456789.125);
  EXPECT_EQ(place->north, 5428000.5);
  EXPECT_EQ(place->height, 110.25);
  EXPECT_NEAR(place->rotation, 1.0471975511965976, 1e-12);
  EXPECT_EQ(place->scale, 0.9996);
  // A map conversion without a unit uses the project's; missing values use the defaults.
  house.more = "#600=IFCMAPCONVERSION(#20,#999,4000.,5000.,$);\n";
  const std::optional<IfcMapConversion> bare = readFacts(house).mapConversion;
  ASSERT_TRUE(bare);
  EXPECT_NEAR(bare->east, 4, 1e-12);
  EXPECT_NEAR(bare->north, 5, 1e-12);
  EXPECT_EQ(bare->height, 0);
  EXPECT_EQ(bare->rotation, 0);
  EXPECT_EQ(bare->scale, 1);
}

TEST(IfcMetadata, TheScaleOfAMapIsAFactorWhetherOrNotItConvertsUnits) {
  IfcHouse house;  // in millimetres
  const auto readMapConversion = [&](const std::string& scale, bool mapInMetres) {
    house.more = "#600=IFCMAPCONVERSION(#20,#601,456789.,5428000.,110.,1.,0.," + scale + ");\n" +
                 "#601=IFCPROJECTEDCRS('EPSG:25832',$,$,$,$,$," + (mapInMetres ? "#602" : "$") +
                 ");\n#602=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n";
    return readFacts(house).mapConversion.value();
  };
  // By the standard, Scale also converts from millimetres to metres; some write the factor alone.
  EXPECT_NEAR(readMapConversion("0.001", true).scale, 1, 1e-12);
  EXPECT_NEAR(readMapConversion("0.0009996", true).scale, 0.9996, 1e-12);
  EXPECT_EQ(readMapConversion("0.9996", true).scale, 0.9996);
  const IfcMapConversion bare =
      readMapConversion("0.001", false);  // then the map is in metres, too
  EXPECT_NEAR(bare.scale, 1, 1e-12);
  EXPECT_EQ(bare.east, 456789);
  const IfcMapConversion own = readMapConversion("1.", false);
  EXPECT_EQ(own.scale, 1);
  EXPECT_NEAR(own.east, 456.789, 1e-9);
}

TEST(IfcMetadata, DrawingsAreNoBodies) {
  IfcHouse house;
  house.more =
      "#500=IFCSHAPEREPRESENTATION(#20,'Axis','Curve2D',(#113));\n"
      "#501=IFCPRODUCTDEFINITIONSHAPE($,$,(#500));\n"
      "#502=IFCBEAM('000000000000000000Beam',$,'Axis alone',$,$,#102,#501,$,$);\n";
  EXPECT_FALSE(findProduct(readFacts(house), "IfcBeam").hasBody);
}

TEST(IfcMetadata, ClassesAreWrittenAsTheStandardWritesThem) {
  EXPECT_EQ(formatIfcClassName("IFCWALLSTANDARDCASE"), "IfcWallStandardCase");
  EXPECT_EQ(formatIfcClassName("IFCSOMETHINGNEW"), "IfcSomethingnew");
}

TEST(IfcMetadata, PlacementsInACircleAreNone) {
  const StepFile file(
      "#1=IFCLOCALPLACEMENT(#1,#2);#2=IFCAXIS2PLACEMENT3D(#3,$,$);"
      "#3=IFCCARTESIANPOINT((1.,2.,3.));#4=IFCLOCALPLACEMENT($,#2);");
  EXPECT_FALSE(readIfcPlacement(file, 1, 1));
  ASSERT_TRUE(readIfcPlacement(file, 4, 0.5));
  EXPECT_EQ(readIfcPlacement(file, 4, 0.5)->translation(), Vec3(0.5, 1, 1.5));
}

}  // namespace
}  // namespace enfilade::scene
