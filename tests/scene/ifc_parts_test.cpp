// A file that two processes of web-ifc read in parts gives the meshes of the whole file, to the
// bit.
#include "scene/import/file/ifc_parts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include "scene/import/ifc/ifc_metadata.hpp"
#include "scene/import/ifc/ifc_readers.hpp"
#include "tests/scene/hand_made_ifc.hpp"
#include "tests/support/shared_folder.hpp"
#include "tests/support/web_ifc_here.hpp"

namespace enfilade::scene {
namespace {

using tests::IfcHouse;

std::vector<std::uint32_t> listBodies(const StepFile& file) {
  std::vector<std::uint32_t> products;
  for (const IfcProduct& product : readIfcMetadata(file).products)
    if (product.hasBody && product.role != IfcProduct::Role::opening)
      products.push_back(product.id);
  return products;
}

std::string joinRanges(const StepFile& file, const IfcFilePart& part) {
  std::string text;
  for (const TextRange& range : part.ranges) text += file.text().substr(range.first, range.size);
  return text;
}

TEST(IfcParts, AProductIsInOnePartWithAllThatItsShapeNeeds) {
  IfcHouse house;
  std::string points = "#600=IFCCARTESIANPOINTLIST3D((";  // larger than the gap that is read, too
  for (int i = 0; i < 1000; ++i) points += "(0.,0.,0.),";
  house.more = points + "(1.,0.,0.)));\n";
  house.more += house.makePlacement(500, "#15", 1, 1, 0) + house.makeBox(510, 1, 1, 0.5) +
                "#601=IFCTRIANGULATEDFACESET(#600,$,.F.,((1,2,3)),$);\n"
                "#602=IFCSHAPEREPRESENTATION(#20,'Body','Tessellation',(#601));\n"
                "#603=IFCPRODUCTDEFINITIONSHAPE($,$,(#602));\n"
                "#604=IFCFURNISHINGELEMENT('0000000000000000000604',$,'Rug',$,$,#502,#603,$);\n"
                "#605=IFCSTYLEDITEM(#601,(#606),$);\n#606=IFCPRESENTATIONSTYLEASSIGNMENT(($));\n";
  const StepFile file(house.makeText());
  const std::vector<std::uint32_t> products = listBodies(file);
  ASSERT_EQ(products, (std::vector<std::uint32_t>{120, 320, 604}));
  const std::vector<IfcFilePart> parts = divideIfc(file, products, 2);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].products, (std::vector<std::uint32_t>{120}));
  EXPECT_EQ(parts[1].products, (std::vector<std::uint32_t>{320, 604})) << "the lighter part";
  EXPECT_EQ(joinRanges(file, parts[1]).size(), file.text().size()) << "small gaps are read";
  const StepFile first(joinRanges(file, parts[0]));
  EXPECT_EQ(first.damagedCount(), 0u);
  EXPECT_TRUE(first.hasEnd());
  std::set<std::uint32_t> missing;
  for (const StepStatement& statement : file.statements())
    if (first.find(statement.id) == nullptr) missing.insert(statement.id);
  EXPECT_EQ(missing, (std::set<std::uint32_t>{600})) << "the points of the rug";
}

TEST(IfcParts, WhatOthersNeedIsInAllParts) {
  IfcHouse house;
  std::string points = "#600=IFCCARTESIANPOINTLIST3D((";
  for (int i = 0; i < 1000; ++i) points += "(0.,0.,0.),";
  const std::string rug =
      points + "(1.,0.,0.)));\n#601=IFCTRIANGULATEDFACESET(#600,$,.F.,((1,2,3)),$);\n" +
      "#602=IFCSHAPEREPRESENTATION(#20,'Body','Tessellation',(#601));\n"
      "#603=IFCPRODUCTDEFINITIONSHAPE($,$,(#602));\n"
      "#604=IFCFURNISHINGELEMENT('0000000000000000000604',$,'Rug',$,$,#15,#603,$);\n";
  // Openings that have the shape of the rug, or a statement of another kind that refers to it.
  for (const std::string& more :
       {std::string(
            "#610=IFCOPENINGELEMENT('0000000000000000000610',$,'Hole',$,$,#15,#603,$,$);\n"),
        std::string("#610=IFCCONNECTIONSURFACEGEOMETRY(#601,$);\n")}) {
    house.more = rug + more;
    const StepFile file(house.makeText());
    const std::vector<IfcFilePart> parts = divideIfc(file, listBodies(file), 2);
    for (const IfcFilePart& part : parts) {
      const StepFile read(joinRanges(file, part));
      EXPECT_NE(read.find(600), nullptr);
      EXPECT_NE(read.find(601), nullptr);
    }
  }
  // Products of one mapped geometry are together.
  house.more = rug + "#611=IFCREPRESENTATIONMAP(#11,#602);\n";
  for (int i = 0; i < 4; ++i) {
    const std::string n = std::to_string(62 + i);
    house.more += "#" + n + "0=IFCMAPPEDITEM(#611,$);\n#" + n +
                  "1=IFCSHAPEREPRESENTATION(#20,'Body','MappedRepresentation',(#" + n + "0));\n#" +
                  n + "2=IFCPRODUCTDEFINITIONSHAPE($,$,(#" + n + "1));\n#" + n +
                  "3=IFCFURNISHINGELEMENT('0000000000000000000" + n + "3',$,'Mat',$,$,#15,#" + n +
                  "2,$);\n";
  }
  const StepFile file(house.makeText());
  const std::vector<IfcFilePart> parts = divideIfc(file, listBodies(file), 2);
  std::set<std::size_t> homes;
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (const std::uint32_t product : {623u, 633u, 643u, 653u})
      if (std::ranges::count(parts[i].products, product) > 0) homes.insert(i);
  EXPECT_EQ(homes.size(), 1u);
}

IfcReadResult readInParts(const StepFile& file, const std::string& name,
                          const std::vector<std::uint32_t>& products, std::size_t count) {
  ImportRequest request;
  request.file = name;
  request.options.timeLimit = 60;
  const ImportProgress none;
  IfcInput input(request, count);
  WebIfcReading reading(input, 60, none);
  input.fill(file.text(), products,
             count == 1 ? std::vector<IfcFilePart>() : divideIfc(file, products, count));
  return reading.finish();
}

void expectSameMeshes(const IfcMeshes& whole, const IfcMeshes& parts) {
  EXPECT_EQ(whole.failures, parts.failures);
  ASSERT_EQ(whole.products.size(), parts.products.size());
  ASSERT_EQ(whole.geometries.size(), parts.geometries.size());
  for (const auto& [id, geometry] : whole.geometries) {
    const IfcGeometry& other = parts.geometries.at(id);
    EXPECT_EQ(geometry.positions, other.positions) << id;
    EXPECT_EQ(geometry.normals, other.normals) << id;
    EXPECT_EQ(geometry.indices, other.indices) << id;
  }
  for (const auto& [id, placed] : whole.products) {
    const std::vector<IfcPlacedGeometry>& other = parts.products.at(id);
    ASSERT_EQ(placed.size(), other.size()) << id;
    for (std::size_t i = 0; i < placed.size(); ++i) {
      EXPECT_EQ(placed[i].geometry, other[i].geometry) << id;
      EXPECT_EQ(placed[i].colour, other[i].colour) << id;
      EXPECT_EQ(placed[i].worldFromGeometry.matrix(), other[i].worldFromGeometry.matrix()) << id;
    }
  }
}

/// An import that fails while it indexes the file leaves processes that wait for their input.
TEST(IfcParts, ReadersThatGetNoInputEnd) {
  ENFILADE_NEED_WEB_IFC();
  ImportRequest request;
  request.file = "a.ifc";
  request.options.timeLimit = 60;
  const ImportProgress none;
  IfcInput input(request, 2);
  { const WebIfcReading reading(input, 60, none); }
  input.waitUntilFilled();  // returns
}

TEST(IfcParts, ReadAtTheSameTimeGiveTheMeshesOfTheWholeFile) {
  ENFILADE_NEED_WEB_IFC();
  ENFILADE_NEED_SHARED(shared);
  for (const char* name :
       {"fzk-haus/AC14-FZK-Haus.ifc", "duplex/Duplex_A_20110907.ifc",
        "duplex/Duplex_Electrical_20121207.ifc", "schependomlaan/LINDEN_-_Kozijnen.ifc"}) {
    SCOPED_TRACE(name);
    std::ifstream in(*shared / "scenes" / name, std::ios::binary);
    const StepFile file(std::string(std::istreambuf_iterator<char>(in), {}));
    const std::vector<std::uint32_t> products = listBodies(file);
    const IfcReadResult whole = readInParts(file, name, products, 1);
    const IfcReadResult parts = readInParts(file, name, products, 2);
    EXPECT_EQ(whole.failure, "");
    EXPECT_EQ(parts.failure, "");
    EXPECT_GT(whole.meshes.geometries.size(), 0u);
    expectSameMeshes(whole.meshes, parts.meshes);
  }
}

}  // namespace
}  // namespace enfilade::scene
