// Import tests on malformed and hostile files: each loads, or fails with an error that names the
// file, the stage and a remedy.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

#include "scene/import/import_model.hpp"
#include "scene/world/data/scene.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/hand_made_ifc.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;
using tests::BoxMesh;
using tests::kOneNode;
using tests::TemporaryFolder;

std::string makeBoxGltf() {
  return tests::makeGltfFile(BoxMesh({1, 2, 3}), "0", kOneNode);
}

// ---- files that fail ----------------------------------------------------------------------------

/// `levels` nodes, each with the next one as its child `times` times, and the mesh below the last.
/// All but the last have `name`.
std::string makeNestedNodes(int levels, int times = 1, const std::string& name = "") {
  std::string nodes;
  for (int i = 0; i < levels; ++i) {
    const std::string next = std::to_string(i + 1);
    nodes += R"({"name":")" + name + R"(","children":[)" + next;
    for (int k = 1; k < times; ++k) nodes += "," + next;
    nodes += "]},";
  }
  return nodes + R"({"mesh":0})";
}

std::string makeNestedGltf(int levels, int times, const BoxMesh& mesh = BoxMesh({1, 1, 1})) {
  return tests::makeGltfFile(mesh, "0", makeNestedNodes(levels, times));
}

struct Damage {
  const char* name;
  const char* file;
  std::string content;
  std::vector<const char*> words;  ///< all in the error, in addition to the file's name
};

void PrintTo(const Damage& spoilt, std::ostream* to) {
  *to << spoilt.name;
}

std::vector<Damage> makeDamagedFiles() {
  const std::string box = makeBoxGltf();
  const std::string glb = tests::makeGlbFile(BoxMesh({1, 1, 1}), "0", kOneNode);
  BoxMesh dense({1, 1, 1});
  const std::vector<std::uint16_t> once = dense.indices;
  for (int i = 0; i < 1400; ++i)
    dense.indices.insert(dense.indices.end(), once.begin(), once.end());
  std::string longJson = glb;
  longJson.replace(12, 4, "\xf0\xff\xff\xff");
  return {
      {"BufferViewBeyondItsBuffer",
       "a.gltf",
       replaceFirst(box, R"("byteOffset":0,"byteLength":96)",
                    R"("byteOffset":0,"byteLength":96000)"),
       {"bufferViews[0]"}},
      {"BufferViewThatIsNotThere",
       "a.gltf",
       replaceFirst(box, R"("bufferView":0)", R"("bufferView":17)"),
       {"bufferView"}},
      {"HugeCount", "a.gltf", replaceFirst(box, R"("count":8)", R"("count":4000000000)"), {}},
      {"NegativeCount", "a.gltf", replaceFirst(box, R"("count":8)", R"("count":-8)"), {}},
      {"MissingBuffer",
       "a.gltf",
       replaceFirst(box, R"("uri":"data)", R"("uri":"nowhere.bin","x":"data)"),
       {"nowhere.bin"}},
      {"NoTriangles",
       "a.gltf",
       replaceFirst(box, R"("material":0})", R"("material":0,"mode":1})"),
       {"triangle"}},
      {"UnsupportedExtension",
       "a.gltf",
       replaceFirst(box, R"({"asset")",
                    R"({"extensionsRequired":["ACME_bent_meshes"],)"
                    R"("extensionsUsed":["ACME_bent_meshes"],"asset")"),
       {"ACME_bent_meshes"}},
      {"NodesInACycle",
       "a.gltf",
       tests::makeGltfFile(BoxMesh({1, 1, 1}), "0",
                           R"({"children":[1],"mesh":0},{"children":[0],"mesh":0})"),
       {"nodes[0] stands below itself"}},
      {"NodeThatIsItsOwnChild",
       "a.gltf",
       tests::makeGltfFile(BoxMesh({1, 1, 1}), "0", R"({"name":"a","children":[0],"mesh":0})"),
       {"nodes[0] 'a' stands below itself"}},
      {"CycleBelowASharedNode",
       "a.gltf",
       tests::makeGltfFile(
           BoxMesh({1, 1, 1}), "0,1",
           R"({"children":[2]},{"children":[2]},{"children":[3]},{"children":[2],"mesh":0})"),
       {"nodes[2] stands below itself"}},
      {"CycleInAFileThatIsRewritten",
       "a.gltf",
       tests::makeGltfFile(BoxMesh({1, 1, 1}), "0",
                           R"({"children":[1],"mesh":7},{"children":[0],"mesh":0,"skin":3})"),
       {"nodes[0] stands below itself"}},
      {"NodesThatAreNoList",
       "a.gltf",
       replaceFirst(replaceFirst(box, R"("nodes":[{)", R"("nodes":{"a":{)"), "}],\"materials\"",
                    "}},\"materials\""),
       {"its JSON has no list of nodes"}},
      {"NodesThatAreANumber",
       "a.gltf",
       replaceFirst(box, R"("nodes":[{)", R"("nodes":3,"extras":[{)"),
       {"its JSON has no list of nodes"}},
      {"NodeThatIsANumber",
       "a.gltf",
       tests::makeGltfFile(BoxMesh({1, 1, 1}), "0", R"({"children":[1],"mesh":0},5)"),
       {"nodes[1] is not an object"}},
      {"MeshThatIsNotThere",
       "a.gltf",
       tests::makeGltfFile(BoxMesh({1, 1, 1}), "0", R"({"mesh":3})"),
       {}},
      {"TooDeep", "a.gltf", makeNestedGltf(3000, 1), {"2000 levels", "flatter tree"}},
      {"FarTooDeep", "a.gltf", makeNestedGltf(20'000, 1), {"2000 levels", "flatter tree"}},
      {"LongCycle",
       "a.gltf",
       replaceFirst(makeNestedGltf(20'000, 1), R"({"mesh":0})", R"({"mesh":0,"children":[7]})"),
       {"2000 levels", "flatter tree"}},
      {"NodesListedTwiceOnEachLevel",
       "a.gltf",
       makeNestedGltf(40, 2),
       {"such as nodes[19]", "1000000 copied nodes", "list each node once"}},
      {"NodesListedTwiceAboveManyTriangles",
       "a.gltf",
       makeNestedGltf(18, 2, dense),
       {"such as nodes[18]", "4000000000 copied triangles"}},
      {"NodesListedTwiceWithLongNames",
       "a.gltf",
       tests::makeGltfFile(BoxMesh({1, 1, 1}), "0", makeNestedNodes(15, 2, std::string(900, 'n'))),
       {"500000000 bytes of copied paths"}},
      {"GlbCalledGltf", "a.gltf", glb, {"rename it to .glb"}},
      {"GltfCalledGlb", "a.glb", box, {"rename", ".gltf"}},
      {"NoJsonAtAll", "a.gltf", std::string(400, '['), {"its JSON is damaged (byte 401)"}},
      {"JsonOfManyLevels", "a.gltf", std::string(4000, '['), {"deeper than 512 levels"}},
      {"JsonCutOff", "a.gltf", box.substr(0, 100), {"its JSON is damaged (byte 101)"}},
      {"JsonWithAComment", "a.gltf", "/* by hand */" + box, {"its JSON is damaged (byte 1)"}},
      {"JsonInUtf16", "a.gltf", std::string("\xff\xfe{\0", 4), {"its JSON is damaged (byte 1)"}},
      {"JsonWithNan",
       "a.gltf",
       replaceFirst(box, R"("count":8)", R"("count":NaN)"),
       {"its JSON is damaged (byte "}},
      {"JsonWithAHugeNumber",
       "a.gltf",
       replaceFirst(box, R"("count":8)", R"("count":1e400)"),
       {"its JSON has a number that is too large"}},
      {"VersionThatIsANumber",
       "a.gltf",
       replaceFirst(box, R"("version":"2.0")", R"("version":2.0)"),
       {"its JSON states no glTF version"}},
      {"JsonOfAList", "a.gltf", "[1]", {"its JSON is not an object"}},
      {"JsonLengthOfAGlbThatLies",
       "a.glb",
       longJson,
       {"announces 4294967280 bytes of JSON", "copy or export it again"}},
      {"RequiredExtensionsThatAreNoList",
       "a.gltf",
       replaceFirst(box, R"({"asset")", R"({"extensionsRequired":"FOO","asset")"),
       {"extensionsRequired is not a list of names"}},
      {"BinaryCalledText", "a.obj", glb, {}},
      {"LengthOfAGlbThatLies",
       "a.glb",
       replaceFirst(glb, std::string("glTF\2\0\0\0", 8),
                    std::string("glTF\2\0\0\0\xff\xff\xff\x7f", 12)),
       {}},
      {"PointsOnly", "a.obj", "v 0 0 0\nv 1 0 0\np 1 2\n", {"triangle"}},
      {"FacesOfNothing", "a.obj", "o a\nf 1 2 3\n", {}},
      {"NegativeIndexTooFar", "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 -2 -1\n", {}},
      {"HtmlInsteadOfAModel", "a.dae", "<html><body>404 not found</body></html>", {}},
      {"IfcWithoutData", "a.ifc", "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\n", {}},
      {"EmptyZip", "a.ifczip", std::string("PK\5\6", 4) + std::string(18, '\0'), {".ifc"}},
      {"BinaryFbxCutOff", "a.fbx", std::string("Kaydara FBX Binary  \0\x1a\0\xe8\x1c\0\0", 27), {}},
  };
}

class DamagedFile : public ::testing::TestWithParam<Damage> {};

TEST_P(DamagedFile, FailsWithItsNameTheStageAndARemedy) {
  const TemporaryFolder folder;
  const fs::path file = folder.write(GetParam().file, GetParam().content);
  const std::string error = catchFailure(file);
  EXPECT_TRUE(error.starts_with(file.string())) << error;
  for (const char* word : GetParam().words)
    EXPECT_NE(error.find(word), std::string::npos) << word << " is not in: " << error;
  bool remedy = false;
  for (const char* word : {"export", "check", "copy", "rename", "zip the"})
    remedy = remedy || error.find(word) != std::string::npos;
  EXPECT_TRUE(remedy) << error;
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  EXPECT_LT(error.size(), 600u) << error;
}

INSTANTIATE_TEST_SUITE_P(TextTable, DamagedFile, ::testing::ValuesIn(makeDamagedFiles()),
                         [](const auto& row) { return std::string(row.param.name); });

// ---- files that load ----------------------------------------------------------------------------

TEST(MalformedFiles, AnObjWithCrlfNegativeIndicesPolygonsAndNoMaterialsLoads) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "house plan.obj",
      "\xEF\xBB\xBF# made by hand\r\nmtllib gone.mtl\r\no Haus\r\nusemtl brick\r\n"
      "v 0 0 0\r\nv 4 0 0\r\nv 4 0 5\r\nv 0 0 5\r\nv 2 3 2.5\r\nvt 0 0\r\nvn 0 1 0\r\n"
      "f -5/1/1 -4/1/1 -3/1/1 -2/1/1\r\nf 1//1 2//1 5//1\r\nf 2 3 5\r\nf 3 4 5\r\nf 4 1 5\r\n");
  const Model model = importModel(file);
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path, "Haus");
  std::size_t triangles = 0;
  for (const std::uint32_t mesh : model.objects[0].meshes)
    triangles += model.meshes[mesh].indices.size() / 3;
  EXPECT_EQ(triangles, 6u);
  expectSize(model, {4, 3, 5}, 1e-6);
  EXPECT_GT(countDiagnostics(model, "missing_material_file"), 0u);
}

TEST(MalformedFiles, APathWithSpacesUmlautsAndAQuoteIsAPathAsAnyOther) {
  const TemporaryFolder folder;
  const std::string inner = "Häuser & 'Räume' 世界 #1";
  fs::create_directories(folder.getPath() / inner);
  const BoxMesh mesh({1, 2, 3});
  const std::string text =
      tests::makeGltfJson(mesh, "0", R"({"mesh":0,"name":"Tür"})", R"("name":"p")",
                          R"(,"uri":"daten%20und%20mehr.bin")");
  folder.write(inner + "/daten und mehr.bin", mesh.toBytes());
  const auto file = folder.write(inner + "/Stück 1.gltf", text);
  const Model model = importModel(file);
  EXPECT_EQ(model.objects.at(0).path, "Tür");
  EXPECT_EQ(model.source, file.string());
  expectSize(model, {1, 2, 3}, 1e-6);
  const auto ifc = folder.write(inner + "/Plan.ifc", tests::IfcHouse().makeText());
  EXPECT_EQ(importModel(ifc).objects.size(), 2u);
  EXPECT_NE(catchFailure(folder.write(inner + "/leer.glb", "")).find(inner), std::string::npos);
}

TEST(MalformedFiles, ASymbolicLinkIsFollowed) {
  const TemporaryFolder folder;
  folder.write("box.glb", tests::makeGlbFile(BoxMesh({1, 2, 3}), "0", kOneNode));
  fs::create_symlink("box.glb", folder.getPath() / "link.glb");
  fs::create_symlink("nothing.glb", folder.getPath() / "dangling.glb");
  fs::create_symlink("circle.glb", folder.getPath() / "circle.glb");
  fs::create_symlink(".", folder.getPath() / "folder.glb");
  expectSize(importModel(folder.getPath() / "link.glb"), {1, 2, 3}, 1e-6);
  EXPECT_NE(catchFailure(folder.getPath() / "dangling.glb").find("no such file"),
            std::string::npos);
  EXPECT_NE(catchFailure(folder.getPath() / "circle.glb").find("circle.glb: "), std::string::npos);
  EXPECT_NE(catchFailure(folder.getPath() / "folder.glb").find("is a folder"), std::string::npos);
}

TEST(MalformedFiles, AnUnreadableFileIsReportedAsSuch) {
  const TemporaryFolder folder;
  const auto locked =
      folder.write("locked.glb", tests::makeGlbFile(BoxMesh({1, 1, 1}), "0", kOneNode));
  fs::permissions(locked, fs::perms::none);
  fs::create_directories(folder.getPath() / "closed");
  const auto below = folder.write("closed/box.glb", "x");
  fs::permissions(below.parent_path(), fs::perms::none);
  const auto pipe = folder.getPath() / "pipe.glb";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(catchFailure(pipe).find("pipe.glb: is not a regular file"), std::string::npos);
  // Root may read all files, so this runs as another user in a child process.
  const auto asUnprivileged = [&] {
    if (geteuid() == 0 && (setgid(65534) != 0 || setuid(65534) != 0)) _exit(9);
    for (const fs::path& file : {locked, below}) {
      const std::string error = catchFailure(file);
      std::fprintf(stderr, "%s\n", error.c_str());
      if (!error.starts_with(file.string() + ": cannot be read: Permission denied")) _exit(1);
    }
    _exit(0);
  };
  EXPECT_EXIT(asUnprivileged(), ::testing::ExitedWithCode(0), "Permission denied");
  fs::permissions(below.parent_path(), fs::perms::owner_all);
}

TEST(MalformedFiles, AGltfNameInAnotherEncodingThanUtf8IsMendedAndReported) {
  const TemporaryFolder folder;
  const std::string text = replaceFirst(makeBoxGltf(), R"("name":"box")", "\"name\":\"T\xFCr\"");
  const Model model = importModel(folder.write("a.gltf", text));
  EXPECT_EQ(model.objects.at(0).path, "T\u00FCr");
  const std::string euro = replaceFirst(makeBoxGltf(), R"("name":"box")", "\"name\":\"5\x80\x81\"");
  EXPECT_EQ(importModel(folder.write("b.gltf", euro)).objects.at(0).path, "5\u20AC\uFFFD");
  const std::string control =
      replaceFirst(makeBoxGltf(), R"("name":"box")", "\"name\":\"a\u009Bb\"");
  EXPECT_EQ(importModel(folder.write("c.gltf", control)).objects.at(0).path, "a%C2%9Bb");
  EXPECT_EQ(countDiagnostics(model, "mended_text"), 1u);
  expectSize(model, {1, 2, 3}, 1e-6);
}

TEST(MalformedFiles, AnExtensionInCapitalsIsOne) {
  const TemporaryFolder folder;
  const std::string glb = tests::makeGlbFile(BoxMesh({1, 2, 3}), "0", kOneNode);
  expectSize(importModel(folder.write("BOX.GLB", glb)), {1, 2, 3}, 1e-6);
  expectSize(importModel(folder.write("box.GlTf", makeBoxGltf())), {1, 2, 3}, 1e-6);
}

TEST(MalformedFiles, FifteenHundredNestedNodesAreOneObject) {
  const TemporaryFolder folder;
  std::string nodes = R"({"name":"n","children":[1]})";
  for (int i = 1; i < 1500; ++i)
    nodes += R"(,{"translation":[0,0.001,0],"children":[)" + std::to_string(i + 1) + "]}";
  nodes += R"(,{"mesh":0})";
  const Model model =
      importModel(folder.write("deep.gltf", tests::makeGltfFile(BoxMesh({1, 1, 1}), "0", nodes)));
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_NEAR(model.objects[0].worldFromMesh.translation().y(), 1.499, 1e-6);
}

TEST(MalformedFiles, NodesListedTwiceOnSixteenLevelsAreCopies) {
  const TemporaryFolder folder;
  const auto file = folder.write("copies.gltf", makeNestedGltf(16, 2));
  EXPECT_EQ(importModel(file).objects.size(), 65536u);
}

TEST(MalformedFiles, NodesListedTwiceInAnotherSceneAreNotCounted) {
  const TemporaryFolder folder;
  const std::string text = tests::makeGltfFile(BoxMesh({1, 1, 1}), "40", makeNestedNodes(40, 2));
  const std::string other =
      replaceFirst(text, R"({"nodes":[40]})", R"({"nodes":[40]},{"nodes":[0]})");
  const Model model = importModel(folder.write("a.gltf", other));
  EXPECT_EQ(model.objects.size(), 1u);
}

TEST(MalformedFiles, AZeroScaleOrNonFiniteNodeKeepsTheOthers) {
  const TemporaryFolder folder;
  const Model flat = importModel(folder.write(
      "flat.gltf",
      tests::makeGltfFile(BoxMesh({1, 2, 3}), "0,1",
                          R"({"mesh":0},{"mesh":0,"name":"nothing","scale":[0,0,0]})")));
  expectSize(flat, {1, 2, 3}, 1e-6);
  const std::string text =
      tests::makeGltfFile(BoxMesh({1, 2, 3}), "0,1",
                          R"({"mesh":0},{"mesh":0,"name":"wild","translation":[1e300,0,0]})");
  const Model wild = importModel(folder.write("wild.gltf", text));
  EXPECT_EQ(wild.objects.size(), 1u);
  expectSize(wild, {1, 2, 3}, 1e-6);
}

TEST(MalformedFiles, IndicesOfVerticesThatAreNotThereLeaveTheirTrianglesOut) {
  const TemporaryFolder folder;
  BoxMesh mesh({1, 2, 3});
  mesh.indices.insert(mesh.indices.end(), {0, 1, 60000, 7, 65535, 2});
  const Model model = importModel(folder.write("a.gltf", tests::makeGltfFile(mesh, "0", kOneNode)));
  expectSize(model, {1, 2, 3}, 1e-6);
  EXPECT_EQ(model.meshes.at(0).indices.size(), 36u);
  std::size_t reported = 0;
  for (const Diagnostic& problem : model.diagnostics) reported += problem.count;
  EXPECT_GE(reported, 1u) << "omitted without a diagnostic";
}

TEST(MalformedFiles, IfcInFeetFarFromTheOriginIsInMetresAndNearIt) {
  const TemporaryFolder folder;
  tests::IfcHouse house;
  house.unit = "IFCCONVERSIONBASEDUNIT(#33,.LENGTHUNIT.,'FOOT',#32)";
  house.unitsPerMetre = 1 / 0.3048;
  house.more =
      "#32=IFCMEASUREWITHUNIT(IFCRATIOMEASURE(0.3048),#34);\n"
      "#33=IFCDIMENSIONALEXPONENTS(1,0,0,0,0,0,0);\n#34=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n";
  house.offset = "1506310.,17809418.,369.";
  const Model model = importModel(folder.write("feet.ifc", house.makeText()));
  EXPECT_NEAR(model.metresPerUnit, 0.3048, 1e-9);
  EXPECT_NEAR(model.offset.x(), 1506310 * 0.3048, 10);
  EXPECT_NEAR(model.offset.z(), -17809418 * 0.3048, 10);
  expectSize(model, {4, 3, 0.3}, 1e-4);
}

TEST(MalformedFiles, AnFbxInCentimetresIsInMetres) {
  const TemporaryFolder folder;
  const auto text = [](const char* factor) {
    return std::string(
               "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n\tFBXVersion: 7400\n}\n"
               "GlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n"
               "\t\tP: \"UpAxis\", \"int\", \"Integer\", \"\",2\n"
               "\t\tP: \"UpAxisSign\", \"int\", \"Integer\", \"\",1\n"
               "\t\tP: \"FrontAxis\", \"int\", \"Integer\", \"\",1\n"
               "\t\tP: \"FrontAxisSign\", \"int\", \"Integer\", \"\",-1\n"
               "\t\tP: \"CoordAxis\", \"int\", \"Integer\", \"\",0\n"
               "\t\tP: \"CoordAxisSign\", \"int\", \"Integer\", \"\",1\n"
               "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\",") +
           factor +
           "\n\t}\n}\nDefinitions:  {\n\tVersion: 100\n\tCount: 2\n"
           "\tObjectType: \"Geometry\" {\n\t\tCount: 1\n\t}\n"
           "\tObjectType: \"Model\" {\n\t\tCount: 1\n\t}\n}\n"
           "Objects:  {\n\tGeometry: 1001, \"Geometry::tip\", \"Mesh\" {\n"
           "\t\tVertices: *12 {\n\t\t\ta: 0,0,0,100,0,0,0,200,0,0,0,300\n\t\t}\n"
           "\t\tPolygonVertexIndex: *12 {\n\t\t\ta: 0,2,-2,0,1,-4,0,3,-3,1,2,-4\n\t\t}\n"
           "\t\tGeometryVersion: 124\n\t}\n"
           "\tModel: 2001, \"Model::tip\", \"Mesh\" {\n\t\tVersion: 232\n\t\tProperties70:  {\n"
           "\t\t\tP: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",50,0,0\n\t\t}\n"
           "\t\tShading: T\n\t\tCulling: \"CullingOff\"\n\t}\n}\n"
           "Connections:  {\n\tC: \"OO\",2001,0\n\tC: \"OO\",1001,2001\n}\n";
  };
  std::string hanging = text("1");
  const std::string upright = "UpAxisSign\", \"int\", \"Integer\", \"\",1";
  hanging.replace(hanging.find(upright), upright.size(),
                  "UpAxisSign\", \"int\", \"Integer\", \"\",-1");
  EXPECT_EQ(importModel(folder.write("hanging.fbx", hanging)).upAxis, UpAxis::minusZ);
  const Model centimetres = importModel(folder.write("cm.fbx", text("1")));
  EXPECT_NEAR(centimetres.metresPerUnit, 0.01, 1e-12);
  EXPECT_EQ(centimetres.upAxis, UpAxis::z);
  expectSize(centimetres, {1, 3, 2}, 1e-5);
  const Model inches = importModel(folder.write("inch.fbx", text("2.54")));
  EXPECT_NEAR(inches.metresPerUnit, 0.0254, 1e-12);
  expectSize(inches, {2.54, 7.62, 5.08}, 1e-4);
}

}  // namespace
}  // namespace enfilade::scene
