// A model in ifcXML gives the objects of the same model in STEP; what is not read is reported.
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "scene/import/import_model.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/import_outcome.hpp"
#include "tests/scene/stored_zip.hpp"
#include "tests/support/web_ifc_here.hpp"

namespace enfilade::scene {
namespace {

using tests::makeReaderOptions;
using tests::TemporaryFolder;

/// A wall of 4 x 0.3 x 3 m with an opening and a door in it, a slab of triangles, and a room.
constexpr char kStep[] = R"(ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','',(''),(''),'','','');
FILE_SCHEMA(('IFC4'));
ENDSEC;
DATA;
#1=IFCPROJECT('0000000000000000000001',$,'Test ''house'' \X2\00E4\X0\',$,$,$,$,(#20),#30);
#10=IFCCARTESIANPOINT((0.,0.,0.));
#11=IFCAXIS2PLACEMENT3D(#10,$,$);
#12=IFCDIRECTION((0.,0.,1.));
#13=IFCLOCALPLACEMENT($,#11);
#20=IFCGEOMETRICREPRESENTATIONCONTEXT($,'Model',3,1.E-05,#11,$);
#30=IFCUNITASSIGNMENT((#31));
#31=IFCSIUNIT(*,.LENGTHUNIT.,.MILLI.,.METRE.);
#40=IFCSITE('0000000000000000000002',$,'Site',$,$,#13,$,$,.ELEMENT.,(24,28,0),$,10.,$,$);
#41=IFCBUILDING('0000000000000000000003',$,'House',$,$,#13,$,$,.ELEMENT.,$,$,$);
#42=IFCBUILDINGSTOREY('0000000000000000000004',$,'Ground',$,$,#13,$,$,.ELEMENT.,0.);
#43=IFCRELAGGREGATES('0000000000000000000005',$,$,$,#1,(#40));
#44=IFCRELAGGREGATES('0000000000000000000006',$,$,$,#40,(#41));
#45=IFCRELAGGREGATES('0000000000000000000007',$,$,$,#41,(#42));
#50=IFCRECTANGLEPROFILEDEF(.AREA.,$,#52,4000.,300.);
#51=IFCCARTESIANPOINT((2000.,150.));
#52=IFCAXIS2PLACEMENT2D(#51,$);
#53=IFCEXTRUDEDAREASOLID(#50,#11,#12,3000.);
#54=IFCSHAPEREPRESENTATION(#20,'Body','SweptSolid',(#53));
#55=IFCPRODUCTDEFINITIONSHAPE($,$,(#54));
#56=IFCWALL('0000000000000000000008',$,'Wall',$,$,#13,#55,'7',.STANDARD.);
#60=IFCCARTESIANPOINT((1500.,0.,0.));
#61=IFCAXIS2PLACEMENT3D(#60,$,$);
#62=IFCLOCALPLACEMENT(#13,#61);
#63=IFCRECTANGLEPROFILEDEF(.AREA.,$,#65,900.,300.);
#64=IFCCARTESIANPOINT((450.,150.));
#65=IFCAXIS2PLACEMENT2D(#64,$);
#66=IFCEXTRUDEDAREASOLID(#63,#11,#12,2100.);
#67=IFCSHAPEREPRESENTATION(#20,'Body','SweptSolid',(#66));
#68=IFCPRODUCTDEFINITIONSHAPE($,$,(#67));
#69=IFCOPENINGELEMENT('0000000000000000000009',$,$,$,$,#62,#68,$,.OPENING.);
#70=IFCRELVOIDSELEMENT('000000000000000000000A',$,$,$,#56,#69);
#71=IFCDOOR('000000000000000000000B',$,'Door',$,$,#62,#68,$,2100.,900.,.DOOR.,.SINGLE_SWING_LEFT.,$);
#72=IFCRELFILLSELEMENT('000000000000000000000C',$,$,$,#69,#71);
#80=IFCCARTESIANPOINTLIST3D(((0.,0.,0.),(4000.,0.,0.),(4000.,3000.,0.),(0.,3000.,0.)));
#81=IFCTRIANGULATEDFACESET(#80,$,.F.,((1,2,3),(1,3,4)),$);
#82=IFCSHAPEREPRESENTATION(#20,'Body','Tessellation',(#81));
#83=IFCPRODUCTDEFINITIONSHAPE($,$,(#82));
#84=IFCSLAB('000000000000000000000D',$,'Floor',$,$,#13,#83,$,.FLOOR.);
#85=IFCRELCONTAINEDINSPATIALSTRUCTURE('000000000000000000000E',$,$,$,(#56,#71,#84),#42);
#90=IFCSPACE('000000000000000000000F',$,'1',$,$,#13,#55,'Hall',.ELEMENT.,.INTERNAL.,$);
#91=IFCRELAGGREGATES('000000000000000000000G',$,$,$,#42,(#90));
ENDSEC;
END-ISO-10303-21;
)";

/// The same in ifcXML. Relationships nested as inverse attributes and at the top level. Entities in
/// place of attributes and in elements of their own, references in both forms.
constexpr char kRoot[] =
    R"(<?xml version="1.0" encoding="utf-8"?>
<ifc:ifcXML xmlns="http://www.buildingsmart-tech.org/ifcXML/IFC4/Add2"
 xmlns:ifc="http://www.buildingsmart-tech.org/ifcXML/IFC4/Add2"
 xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:schemaLocation="http://www.buildingsmart-tech.org/ifcXML/IFC4/Add2 IFC4_ADD2.xsd">
<header><name>not read</name></header>
)";
constexpr char kProject[] =
    R"(<IfcProject id="p" GlobalId="0000000000000000000001" Name="Test 'house' ä">
 <IsDecomposedBy><IfcRelAggregates GlobalId="0000000000000000000005"><RelatedObjects>
  <IfcSite id="site" GlobalId="0000000000000000000002" Name="Site"
   CompositionType="element" RefLatitude="24 28 0" RefElevation="10">
   <ObjectPlacement xsi:type="IfcLocalPlacement" xsi:nil="true" href="origin"/>
  </IfcSite>
 </RelatedObjects></IfcRelAggregates></IsDecomposedBy>
 <RepresentationContexts>
  <IfcGeometricRepresentationContext id="model" pos="0" ContextType="Model"
   CoordinateSpaceDimension="3" Precision="1E-05">
   <WorldCoordinateSystem><IfcAxis2Placement3D id="axes">
    <Location id="zero" Coordinates="0 0 0"/>
   </IfcAxis2Placement3D></WorldCoordinateSystem>
  </IfcGeometricRepresentationContext>
 </RepresentationContexts>
 <UnitsInContext><Units>
  <IfcSIUnit UnitType="lengthunit" Prefix="milli" Name="metre"/>
 </Units></UnitsInContext>
</IfcProject>
<IfcLocalPlacement id="origin"><RelativePlacement>
 <IfcAxis2Placement3D ref="axes" xsi:nil="true"/>
</RelativePlacement></IfcLocalPlacement>
<IfcDirection id="up" DirectionRatios="0 0 1"/>
)";
constexpr char kStorey[] =
    R"(<IfcBuilding id="house" GlobalId="0000000000000000000003" Name="House"
 CompositionType="element">
 <ObjectPlacement ref="origin" xsi:nil="true"/>
 <IsDecomposedBy><IfcRelAggregates GlobalId="0000000000000000000007"><RelatedObjects>
  <IfcBuildingStorey id="ground" GlobalId="0000000000000000000004" Name="Ground"
   CompositionType="element" Elevation="0">
   <ObjectPlacement ref="origin" xsi:nil="true"/>
   <ContainsElements>
    <IfcRelContainedInSpatialStructure id="content" GlobalId="000000000000000000000E">
     <RelatedElements>
      <IfcWall ref="wall" xsi:nil="true"/><IfcDoor ref="door" xsi:nil="true"/>
     </RelatedElements>
    </IfcRelContainedInSpatialStructure>
   </ContainsElements>
  </IfcBuildingStorey>
 </RelatedObjects></IfcRelAggregates></IsDecomposedBy>
</IfcBuilding>
<IfcRelAggregates GlobalId="0000000000000000000006">
 <RelatingObject xsi:type="IfcSite" ref="site" xsi:nil="true"/>
 <RelatedObjects><IfcBuilding ref="house" xsi:nil="true"/></RelatedObjects>
</IfcRelAggregates>
<IfcRelAggregates GlobalId="000000000000000000000G">
 <RelatingObject xsi:type="IfcBuildingStorey" ref="ground" xsi:nil="true"/>
 <RelatedObjects><IfcSpace GlobalId="000000000000000000000F" Name="1" LongName="Hall"
  CompositionType="element" PredefinedType="internal">
  <ObjectPlacement ref="origin" xsi:nil="true"/>
  <Representation ref="box" xsi:nil="true"/>
 </IfcSpace></RelatedObjects>
</IfcRelAggregates>
)";
constexpr char kWallXml[] =
    R"(<IfcWall id="wall" GlobalId="0000000000000000000008" Name="Wall" Tag="7"
 PredefinedType="standard">
 <ObjectPlacement ref="origin" xsi:nil="true"/>
 <Representation xsi:type="IfcProductDefinitionShape" id="box"><Representations>
  <IfcShapeRepresentation RepresentationIdentifier="Body" RepresentationType="SweptSolid">
   <ContextOfItems xsi:nil="true" href="model"/>
   <Items><IfcExtrudedAreaSolid Depth="3000">
    <SweptArea xsi:type="IfcRectangleProfileDef" ProfileType="area" XDim="4000" YDim="300">
     <Position><Location Coordinates="2000 150"/></Position>
    </SweptArea>
    <Position><Location xsi:nil="true" href="zero"/></Position>
    <ExtrudedDirection xsi:nil="true" href="up"/>
   </IfcExtrudedAreaSolid></Items>
  </IfcShapeRepresentation>
 </Representations></Representation>
 <HasOpenings GlobalId="000000000000000000000A">
  <RelatedOpeningElement xsi:type="IfcOpeningElement" GlobalId="0000000000000000000009"
   PredefinedType="opening">
   <ObjectPlacement xsi:type="IfcLocalPlacement" id="corner">
    <PlacementRelTo xsi:type="IfcLocalPlacement" ref="origin" xsi:nil="true"/>
    <RelativePlacement><IfcAxis2Placement3D>
     <Location Coordinates="1.5e3 0 0"/>
    </IfcAxis2Placement3D></RelativePlacement>
   </ObjectPlacement>
   <Representation xsi:type="IfcProductDefinitionShape" id="leaf"><Representations>
    <IfcShapeRepresentation RepresentationIdentifier="Body" RepresentationType="SweptSolid">
     <ContextOfItems xsi:nil="true" href="model"/>
     <Items><IfcExtrudedAreaSolid Depth="2100">
      <SweptArea xsi:type="IfcRectangleProfileDef" ProfileType="area" XDim="900" YDim="300">
       <Position><Location Coordinates="450 150"/></Position>
      </SweptArea>
      <Position xsi:nil="true" href="axes"/>
      <ExtrudedDirection xsi:nil="true" href="up"/>
     </IfcExtrudedAreaSolid></Items>
    </IfcShapeRepresentation>
   </Representations></Representation>
   <HasFillings><IfcRelFillsElement GlobalId="000000000000000000000C">
    <RelatedBuildingElement xsi:type="IfcDoor" id="door" GlobalId="000000000000000000000B"
     Name="Door" OverallHeight="2100" OverallWidth="900" PredefinedType="door"
     OperationType="single_swing_left">
     <ObjectPlacement xsi:type="IfcLocalPlacement" ref="corner" xsi:nil="true"/>
     <Representation ref="leaf" xsi:nil="true"/>
    </RelatedBuildingElement>
   </IfcRelFillsElement></HasFillings>
  </RelatedOpeningElement>
 </HasOpenings>
 <IsDefinedBy><IfcRelDefinesByProperties GlobalId="000000000000000000000H">
  <RelatingPropertyDefinition>
   <IfcPropertySet GlobalId="000000000000000000000I" Name="Pset_WallCommon"><HasProperties>
    <IfcPropertySingleValue Name="IsExternal">
     <NominalValue><IfcBoolean-wrapper>true</IfcBoolean-wrapper></NominalValue>
    </IfcPropertySingleValue>
   </HasProperties></IfcPropertySet>
  </RelatingPropertyDefinition>
 </IfcRelDefinesByProperties></IsDefinedBy>
</IfcWall>
)";
constexpr char kSlab[] =
    R"(<IfcSlab GlobalId="000000000000000000000D" Name="Floor" PredefinedType="floor">
 <ContainedInStructure>
  <IfcRelContainedInSpatialStructure ref="content" xsi:nil="true"/>
 </ContainedInStructure>
 <ObjectPlacement ref="origin" xsi:nil="true"/>
 <Representation xsi:type="IfcProductDefinitionShape"><Representations>
  <IfcShapeRepresentation RepresentationIdentifier="Body" RepresentationType="Tessellation">
   <ContextOfItems xsi:nil="true" href="model"/>
   <Items><IfcTriangulatedFaceSet Closed="false" CoordIndex="1 2 3 1 3 4">
    <Coordinates CoordList="0 0 0 4000 0 0 4000 3000 0 0 3000 0"/>
   </IfcTriangulatedFaceSet></Items>
  </IfcShapeRepresentation>
 </Representations></Representation>
</IfcSlab>
)";

/// `more`: further elements.
std::string makeXml(const std::string& more = "") {
  return std::string(kRoot) + kProject + kStorey + kWallXml + kSlab + more + "</ifc:ifcXML>\n";
}

struct ObjectFacts {
  std::string path, ifcClass, operation, storey;
  std::size_t triangles = 0;
  Vec3 min = Vec3::Constant(1e9), max = Vec3::Constant(-1e9);
};

std::map<std::string, ObjectFacts> collectFacts(const Model& model) {
  std::map<std::string, ObjectFacts> facts;
  for (const Object& object : model.objects) {
    ObjectFacts& f = facts[object.globalId];
    f = {object.path, object.ifcClass, object.operationType, ""};
    if (object.storey) f.storey = model.storeys[*object.storey].globalId;
    for (const std::uint32_t index : object.meshes) {
      const Mesh& mesh = model.meshes[index];
      f.triangles += mesh.indices.size() / 3;
      for (std::uint32_t i = 0; i < mesh.positions.size(); ++i) {
        const Vec3 p = computeWorldPosition(object, mesh, i);
        f.min = f.min.cwiseMin(p);
        f.max = f.max.cwiseMax(p);
      }
    }
  }
  return facts;
}

void expectSame(const Model& model, const Model& expected) {
  const auto facts = collectFacts(model), right = collectFacts(expected);
  ASSERT_EQ(facts.size(), right.size());
  for (const auto& [id, f] : right) {
    ASSERT_TRUE(facts.contains(id)) << id;
    EXPECT_EQ(facts.at(id).path, f.path);
    EXPECT_EQ(facts.at(id).ifcClass, f.ifcClass);
    EXPECT_EQ(facts.at(id).operation, f.operation);
    EXPECT_EQ(facts.at(id).storey, f.storey);
    EXPECT_EQ(facts.at(id).triangles, f.triangles) << id;
    EXPECT_EQ(facts.at(id).min, f.min) << id;
    EXPECT_EQ(facts.at(id).max, f.max) << id;
  }
  EXPECT_EQ(model.metresPerUnit, expected.metresPerUnit);
  ASSERT_EQ(model.spaces.size(), expected.spaces.size());
  for (std::size_t i = 0; i < model.spaces.size(); ++i) {
    EXPECT_EQ(model.spaces[i].globalId, expected.spaces[i].globalId);
    EXPECT_EQ(model.spaces[i].longName, expected.spaces[i].longName);
    EXPECT_EQ(model.spaces[i].box.max, expected.spaces[i].box.max);
  }
}

std::size_t countXmlProblems(const Model& model) {
  return countDiagnostics(model, "xml_not_read") + countDiagnostics(model, "xml_value_ignored") +
         countDiagnostics(model, "xml_reference_missing");
}

TEST(IfcXml, GivesTheModelOfTheSameStepFile) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  const auto step = folder.write("a.ifc", kStep);
  const auto plain = folder.write("a.ifcXML", makeXml());
  const auto zipped = folder.write("a.ifczip", tests::makeStoredZip({{"house.ifcxml", makeXml()}}));
  for (const IfcReader reader : {IfcReader::webIfc, IfcReader::ifcPlusPlus}) {
    const Model expected = importModel(step, makeReaderOptions(reader));
    ASSERT_EQ(expected.objects.size(), 3u);
    ASSERT_EQ(expected.storeys.size(), 1u);
    ASSERT_EQ(expected.spaces.size(), 1u);
    EXPECT_NE(expected.objects[0].path.find("Test 'house' ä/Site/House/Ground"), std::string::npos)
        << expected.objects[0].path;
    for (const auto& file : {plain, zipped}) {
      SCOPED_TRACE(file.string() + " by " + expected.reader);
      const Model model = importModel(file, makeReaderOptions(reader));
      expectSame(model, expected);
      EXPECT_EQ(countXmlProblems(model), 0u);
      EXPECT_EQ(model.reader, expected.reader);
    }
  }
}

TEST(IfcXml, InUtf16GivesTheSameModel) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  std::string text("\xff\xfe", 2);
  for (const char c : replaceFirst(replaceFirst(makeXml(), "utf-8", "utf-16"), "ä", "\xe4")) {
    text += c;
    text += '\0';
  }
  expectSame(importModel(folder.write("a.ifcxml", text)),
             importModel(folder.write("a.ifc", kStep)));
}

TEST(IfcXml, ElementsThatTheSchemaLacksAreReportedAndTheRestIsRead) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  const std::string text = replaceFirst(
      replaceFirst(makeXml("<IfcStrange id=\"s\"/>\n"), "Tag=\"7\"", "Tag=\"7\" Colour=\"red\""),
      "<HasOpenings ", "<Colour><Red>1</Red></Colour><HasOpenings ");
  const Model model = importModel(folder.write("a.ifcxml", text));
  EXPECT_EQ(countDiagnostics(model, "xml_not_read"), 3u);
  const std::string example = findDiagnosticText(model, "xml_not_read");
  EXPECT_TRUE(example.starts_with("line ")) << example;
  EXPECT_NE(example.find("attribute 'Colour' of IfcWall"), std::string::npos) << example;
  expectSame(model, importModel(folder.write("a.ifc", kStep)));
}

TEST(IfcXml, AReferenceToAMissingIdIsReportedAndLeftOut) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  const std::string text =
      replaceFirst(makeXml(), "<IfcDoor ref=\"door\"", "<IfcDoor ref=\"gone\"");
  const Model model = importModel(folder.write("a.ifcxml", text));
  EXPECT_EQ(countDiagnostics(model, "xml_reference_missing"), 1u);
  EXPECT_NE(findDiagnosticText(model, "xml_reference_missing").find("id 'gone'"),
            std::string::npos);
  EXPECT_EQ(model.objects.size(), 3u);
}

TEST(IfcXml, AReferenceToAnotherClassIsReportedAndLeftOut) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  const std::string text =
      replaceFirst(makeXml(), "<IfcRelContainedInSpatialStructure ref=\"content\"",
                   "<IfcRelContainedInSpatialStructure ref=\"zero\"");
  const Model model = importModel(folder.write("a.ifcxml", text));
  EXPECT_EQ(countDiagnostics(model, "xml_not_read"), 1u);
  EXPECT_NE(findDiagnosticText(model, "xml_not_read")
                .find("IfcCartesianPoint in place of IfcRelContainedInSpatialStructure"),
            std::string::npos);
  EXPECT_EQ(model.objects.size(), 3u);
}

TEST(IfcXml, AChoiceMayBeAReferenceWithoutAType) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  const std::string text = replaceFirst(
      makeXml("<IfcAxis2Placement3D id=\"corner2\"><Location Coordinates=\"1500 0 0\"/>"
              "</IfcAxis2Placement3D>\n"),
      R"(<RelativePlacement><IfcAxis2Placement3D>
     <Location Coordinates="1.5e3 0 0"/>
    </IfcAxis2Placement3D></RelativePlacement>)",
      "<RelativePlacement ref=\"corner2\" xsi:nil=\"true\"/>");
  const Model model = importModel(folder.write("a.ifcxml", text));
  expectSame(model, importModel(folder.write("a.ifc", kStep)));
  EXPECT_EQ(countXmlProblems(model), 0u);
}

TEST(IfcXml, HostileNumbersAndCyclesLoadOrAreErrorsInWords) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  const std::string digits(400, '9');
  const std::vector<std::pair<std::string, std::string>> changes{
      {"CoordIndex=\"1 2 3", "CoordIndex=\"1 2 99999999999999999999"},
      {"CoordIndex=\"1 2 3", "CoordIndex=\"1 0 -3"},
      {"CoordList=\"0 0 0", "CoordList=\"1e308 -1e308 1e999"},
      {"Depth=\"3000\"", "Depth=\"" + digits + "\""},
      {"Elevation=\"0\"", "Elevation=\"" + digits + "\""},
      {"RefLatitude=\"24 28 0\"", "RefLatitude=\"" + digits + " 28 0\""},
      {"<PlacementRelTo xsi:type=\"IfcLocalPlacement\" ref=\"origin\"",
       "<PlacementRelTo xsi:type=\"IfcLocalPlacement\" ref=\"corner\""},
      {"<RelatingObject xsi:type=\"IfcSite\" ref=\"site\"",
       "<RelatingObject xsi:type=\"IfcSite\" ref=\"ground\""},
  };
  int loaded = 0;
  for (const auto& [from, to] : changes) {
    const auto file = folder.write("a.ifcxml", replaceFirst(makeXml(), from, to));
    const std::string message = catchFailure(file);
    loaded += message.empty() ? 1 : 0;
    for (const char* fault : {"crashed", "hung", "timed out", "invalid data", "exited"})
      EXPECT_EQ(message.find(fault), std::string::npos) << to.substr(0, 60) << ": " << message;
  }
  EXPECT_GE(loaded, 4);
}

TEST(IfcXml, AValueThatIsNotOfItsTypeIsReported) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  std::string text = replaceFirst(makeXml(), "Elevation=\"0\"", "Elevation=\"0,5\"");
  text = replaceFirst(text, "PredefinedType=\"floor\"", "PredefinedType=\"constructor\"");
  text = replaceFirst(text, "<IfcBoolean-wrapper>true", "<IfcBoolean-wrapper>constructor");
  const Model model = importModel(folder.write("a.ifcxml", text));
  EXPECT_EQ(countDiagnostics(model, "xml_value_ignored"), 3u);
  EXPECT_NE(findDiagnosticText(model, "xml_value_ignored").find("Elevation=\"0,5\""),
            std::string::npos);
}

/// A document that cannot be read, with parts of the error.
struct Refusal {
  std::string name, text;
  std::vector<std::string> parts;
};

TEST(IfcXml, ADocumentThatCannotBeReadIsRefusedWithLineAndRemedy) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  std::string deep = kRoot;
  for (int i = 0; i < 1001; ++i) deep += "<a>\n";
  const std::vector<Refusal> refusals{
      {"unclosed", kRoot + std::string("<IfcWall>"), {":7: the XML is damaged: "}},
      {"crossed", kRoot + std::string("<IfcWall></IfcDoor>"), {":7: the XML is damaged: "}},
      {"entity", kRoot + std::string("<IfcWall Name='&x;'/>"), {":7: the XML is damaged: "}},
      {"bytes", kRoot + std::string("<IfcWall Name='\xff'/>"), {"bytes that are not utf-8"}},
      {"dtd",
       "<?xml version='1.0'?>\n<!DOCTYPE a [<!ENTITY x SYSTEM '/etc/hostname'>]>\n<a>&x;</a>",
       {":2: a document type (DTD) is not allowed"}},
      {"older",
       "<ex:iso_10303_28 xmlns:ex='urn:iso.org:standard:10303:part(28):version(2)'>"
       "</ex:iso_10303_28>",
       {":1: ISO 10303-28, the ifcXML of IFC2x3, is not read"}},
      {"between",
       replaceFirst(makeXml(), "xmlns:ifc=\"http://www.buildingsmart-tech.org/ifcXML/IFC4/Add2",
                    "xmlns:ifc=\"http://www.buildingsmart-tech.org/ifcXML/IFC4x1/FINAL"),
       {"ifcXML of", "IFC4x1/FINAL"}},
      {"other", "<html xmlns='http://www.w3.org/1999/xhtml'/>", {"not an ifcXML file", "'html'"}},
      {"deep", deep, {":1006: its elements are nested more than 1000 deep"}},
      {"coded", "<?xml version='1.0' encoding='odd'?><a/>", {"encoding 'odd'"}},
  };
  for (const Refusal& refusal : refusals) {
    const std::string message = catchFailure(folder.write(refusal.name + ".ifcxml", refusal.text));
    EXPECT_NE(message.find(refusal.name + ".ifcxml:"), std::string::npos) << message;
    EXPECT_NE(message.find(".ifc, the STEP form"), std::string::npos) << message;
    for (const std::string& part : refusal.parts)
      EXPECT_NE(message.find(part), std::string::npos) << message;
  }
}

TEST(IfcXml, WithoutNodePackagesIsRefusedWithTheRemedy) {
  const TemporaryFolder folder;
  setenv("ENFILADE_WEB_IFC", folder.getPath().c_str(), 1);
  const std::string message = catchFailure(folder.write("a.ifcxml", makeXml()));
  unsetenv("ENFILADE_WEB_IFC");
  for (const char* part : {"a.ifcxml: IFC in XML is not read: web-ifc is not in ", "run npm ci",
                           "export it as .ifc, the STEP form"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(IfcXml, AConverterThatCrashesIsAnError) {
  ENFILADE_NEED_WEB_IFC();
  const TemporaryFolder folder;
  setenv("ENFILADE_IMPORT_FAULT", "ifcxml:crash", 1);
  const std::string message = catchFailure(folder.write("a.ifcxml", makeXml()));
  unsetenv("ENFILADE_IMPORT_FAULT");
  EXPECT_NE(message.find("the process that converts its XML crashed"), std::string::npos)
      << message;
}

}  // namespace
}  // namespace enfilade::scene
