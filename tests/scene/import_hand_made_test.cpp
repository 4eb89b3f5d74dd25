// Import tests on files with known answers; the tests write the files.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scene/import/import_model.hpp"
#include "scene/world/data/scene.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

using tests::BoxMesh;
using tests::kOneNode;
using tests::makeGltfFile;
using tests::TemporaryFolder;

void expectBounds(const Scene& scene, const Vec3& min, const Vec3& max, double tolerance = 1e-6) {
  EXPECT_LT((scene.bounds().min - min).norm(), tolerance) << scene.bounds().min.transpose();
  EXPECT_LT((scene.bounds().max - max).norm(), tolerance) << scene.bounds().max.transpose();
}

std::vector<std::string> getPaths(const Model& model) {
  std::vector<std::string> paths;
  for (const Object& object : model.objects) paths.push_back(object.path);
  return paths;
}

const std::string kObj =
    "o box\nv 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

TEST(ImportHandMade, GltfBoxHasItsSizePathAndMaterial) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "box.gltf",
      makeGltfFile(
          BoxMesh({1, 2, 3}), "0", kOneNode,
          R"("name":"glass","alphaMode":"BLEND","doubleSided":true,)"
          R"("pbrMetallicRoughness":{"baseColorFactor":[0.25,0.5,1,0.5],"metallicFactor":0})"));
  const Model model = importModel(file);
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path, "box");
  EXPECT_EQ(model.source, file.string());
  const Material& material = model.materials[model.meshes[0].material];
  EXPECT_EQ(material.name, "glass");
  EXPECT_EQ(material.baseColour, Eigen::Vector4f(0.25f, 0.5f, 1, 0.5f));
  EXPECT_EQ(material.alpha, Material::Alpha::blend);
  EXPECT_TRUE(material.doubleSided);
  expectBounds(Scene{Model(model)}, {0, 0, 0}, {1, 2, 3});
}

TEST(ImportHandMade, TransformsAreChainedInDoublesAndTheOffsetComesOff) {
  const TemporaryFolder folder;
  // The parent is a million metres away and its child 0.125 m further; float spacing there is 1/16
  // m.
  const auto file = folder.write(
      "far.gltf",
      makeGltfFile(BoxMesh({1, 1, 1}), "0",
                   R"({"name":"site","translation":[1000000,0,-2000000],"children":[1]},)"
                   R"({"name":"a","translation":[0.0078125,0,0],"children":[2]},)"
                   R"({"name":"b","translation":[0.001953125,0.25,0],"mesh":0})"));
  const Model model = importModel(file);
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path, "site/a/b");
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(model.offset[axis], std::round(model.offset[axis]));
  }
  const Vec3 corner = Vec3(1000000.009765625, 0.25, -2000000) - model.offset;
  EXPECT_LT(corner.norm(), 10);
  expectBounds(Scene{Model(model)}, corner, corner + Vec3::Ones(), 1e-9);
}

TEST(ImportHandMade, TranslationsThatFloatsCannotHoldAreReadWhole) {
  const TemporaryFolder folder;
  // Each node has its own map position; float spacing there is half a metre.
  const std::string nodes = R"({"mesh":0,"translation":[459123.4,112.6,-5428310.7]},)"
                            R"({"mesh":0,"translation":[459125.53,112.6,-5428309.31]})";
  const BoxMesh mesh({1, 1, 1});
  for (const auto& file : {folder.write("map.gltf", makeGltfFile(mesh, "0,1", nodes)),
                           folder.write("map.glb", tests::makeGlbFile(mesh, "0,1", nodes))}) {
    const Model model = importModel(file);
    ASSERT_EQ(model.objects.size(), 2u);
    const Vec3 apart =
        model.objects[1].worldFromMesh.translation() - model.objects[0].worldFromMesh.translation();
    EXPECT_LT((apart - Vec3(2.13, 0, 1.39)).norm(), 1e-8) << apart.transpose();
    const Vec3 place = model.objects[0].worldFromMesh.translation() + model.offset;
    EXPECT_LT((place - Vec3(459123.4, 112.6, -5428310.7)).norm(), 1e-8);
    EXPECT_EQ(countDiagnostics(model, "coarse_placement"), 0u);
  }
}

TEST(ImportHandMade, ObjVerticesOnAMapKeepTheirMillimetres) {
  const TemporaryFolder folder;
  std::string text = "# on a map\no one\n";
  for (const char* vertex : {"459123.401 112.6 5428310.702", "459124.401 112.6 5428310.702",
                             "459123.401 112.6 5428311.706", "459123.401 114.607 5428310.702"}) {
    text += std::string("v ") + vertex + "\n";
  }
  const auto file = folder.write("map.obj", text + "f 1 2 3\nf 1 4 2\n");
  const Model model = importModel(file);
  EXPECT_NEAR(model.offset.x(), 459123, 2);
  const Scene scene{Model(model)};
  EXPECT_LT((scene.bounds().size() - Vec3(1, 2.007, 1.004)).norm(), 1e-5)
      << scene.bounds().size().transpose();
  EXPECT_LT((scene.bounds().min + model.offset - Vec3(459123.401, 112.6, 5428310.702)).norm(),
            1e-5);
}

TEST(ImportHandMade, AnObjectThreeHundredKilometresOffIsLeftOutAndReported) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "stray.gltf",
      makeGltfFile(
          BoxMesh({1, 1, 1}), "0,1,2,3",
          R"({"mesh":0},{"mesh":0,"translation":[2,0,0]},{"mesh":0,"translation":[0,0,3]},)"
          R"({"mesh":0,"name":"stray","translation":[300000,0,0]})"));
  const Model model = importModel(file);
  EXPECT_EQ(model.objects.size(), 3u);
  EXPECT_EQ(countDiagnostics(model, "far_object_dropped"), 1u);
  EXPECT_TRUE(model.offset.isZero(0));
  expectBounds(Scene{Model(model)}, {0, 0, 0}, {3, 1, 4});
}

TEST(ImportHandMade, TwoSitesFarApartAreBothKept) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "sites.gltf",
      makeGltfFile(BoxMesh({1, 1, 1}), "0,1", R"({"mesh":0},{"mesh":0,"translation":[5000,0,0]})"));
  EXPECT_EQ(importModel(file).objects.size(), 2u);
}

TEST(ImportHandMade, NoOffsetWithinAKilometre) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "near.gltf", makeGltfFile(BoxMesh({1, 1, 1}), "0", R"({"mesh":0,"translation":[900,0,0]})"));
  EXPECT_TRUE(importModel(file).offset.isZero(0));
}

TEST(ImportHandMade, VerticesFarFromTheirOriginAreRecentred) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "far.gltf", makeGltfFile(BoxMesh({4, 4, 4}, {400000, 100, -500000}), "0", kOneNode));
  const Model model = importModel(file);
  EXPECT_GT(model.offset.norm(), 600000);
  for (const auto& p : model.meshes[0].positions) EXPECT_LT(p.norm(), 10);
  const Vec3 min = Vec3(400000, 100, -500000) - model.offset;
  expectBounds(Scene{Model(model)}, min, min + Vec3::Constant(4), 1e-9);
}

TEST(ImportHandMade, AStrayObjectFarAwayDoesNotMoveTheScene) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "stray.gltf", makeGltfFile(BoxMesh({1, 1, 1}), "0,1,2",
                                 R"({"mesh":0},{"mesh":0,"translation":[2,0,0]},)"
                                 R"({"mesh":0,"name":"stray","translation":[1e9,0,0]})"));
  const Model model = importModel(file);
  EXPECT_TRUE(model.offset.isZero(0));
  EXPECT_EQ(model.objects.size(), 2u);
  EXPECT_EQ(countDiagnostics(model, "far_object_dropped"), 1u);
}

TEST(ImportHandMade, MirroredNodesAreKeptAsTheyAreAndCounted) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "mirror.gltf", makeGltfFile(BoxMesh({1, 2, 3}), "0,1",
                                  R"({"mesh":0},{"mesh":0,"scale":[-1,1,1],"name":"mirrored"})"));
  const Model model = importModel(file);
  EXPECT_EQ(countDiagnostics(model, "mirrored_object"), 1u);
  EXPECT_LT(model.objects[1].worldFromMesh.linear().determinant(), 0);
  expectBounds(Scene{Model(model)}, {-1, 0, 0}, {1, 2, 3});
}

TEST(ImportHandMade, RepeatedUnnamedAndSlashedNamesGiveUniquePaths) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "names.gltf",
      makeGltfFile(BoxMesh({1, 1, 1}), "0",
                   R"({"name":"house","children":[1,2,3,4,5,6]},{"mesh":0,"name":"door"},)"
                   R"({"mesh":0,"name":"door"},{"mesh":0,"name":"door#2"},{"mesh":0},)"
                   R"({"mesh":0,"name":"a/b"},{"mesh":0,"name":"100%"})"));
  EXPECT_EQ(getPaths(importModel(file)),
            (std::vector<std::string>{"house/door", "house/door#2", "house/door#2#2", "house/node",
                                      "house/a%2Fb", "house/100%25"}));
}

TEST(ImportHandMade, UnitAndUpOfTheUserWin) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.gltf", makeGltfFile(BoxMesh({1, 2, 3}), "0", kOneNode));
  ImportOptions options;
  options.metresPerUnit = 0.5;
  options.up = UpAxis::z;
  const Model model = importModel(file, options);
  EXPECT_EQ(model.metresPerUnit, 0.5);
  EXPECT_EQ(model.upAxis, UpAxis::z);
  // A point (x, y, z) with z up is (x, z, -y) with y up.
  expectBounds(Scene{Model(model)}, {0, 0, -1}, {0.5, 1.5, 0});
  options.up = UpAxis::x;
  expectBounds(Scene(importModel(file, options)), {-1, 0, 0}, {0, 0.5, 1.5});
}

TEST(ImportHandMade, ObjIsInMetresByDefault) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.OBJ", kObj);
  const Model model = importModel(file);
  EXPECT_EQ(getPaths(model), std::vector<std::string>{"box"});
  EXPECT_EQ(countDiagnostics(model, "no_unit"), 1u);
  expectBounds(Scene{Model(model)}, {0, 0, 0}, {1, 2, 3});
  ImportOptions options;
  options.metresPerUnit = parseMetresPerUnit("mm");
  const Model small = importModel(file, options);
  EXPECT_EQ(countDiagnostics(small, "no_unit"), 0u);
  expectBounds(Scene{Model(small)}, {0, 0, 0}, {0.001, 0.002, 0.003}, 1e-9);
}

std::string makeColladaBox(const std::string& asset) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>)" +
         asset +
         R"(</asset><library_geometries><geometry id="g"><mesh><source id="p">)"
         R"(<float_array id="pa" count="12">0 0 0 1 0 0 0 2 0 0 0 3</float_array><technique_common>)"
         R"(<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>)"
         R"(<param name="Y" type="float"/><param name="Z" type="float"/></accessor>)"
         R"(</technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/>)"
         R"(</vertices><triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>)"
         R"(<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>)"
         R"(<library_visual_scenes><visual_scene id="s"><node id="n" name="tip">)"
         R"(<translate>10 20 30</translate><instance_geometry url="#g"/></node></visual_scene>)"
         R"(</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST(ImportHandMade, ColladaUnitAndUpAreAppliedOnceOrReplaced) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "tip.dae", makeColladaBox(R"(<unit name="inch" meter="0.0254"/><up_axis>Z_UP</up_axis>)"));
  const Model model = importModel(file);
  EXPECT_EQ(model.metresPerUnit, 0.0254);
  EXPECT_EQ(model.upAxis, UpAxis::z);
  EXPECT_EQ(getPaths(model), std::vector<std::string>{"tip"});
  expectBounds(Scene{Model(model)}, Vec3(10, 30, -22) * 0.0254, Vec3(11, 33, -20) * 0.0254);
  ImportOptions options;
  options.metresPerUnit = 1;
  options.up = UpAxis::y;
  expectBounds(Scene(importModel(file, options)), {10, 20, 30}, {11, 22, 33}, 1e-5);
  const auto xUp = folder.write("x.dae", makeColladaBox("<up_axis>X_UP</up_axis>"));
  const Model turned = importModel(xUp);
  EXPECT_EQ(countDiagnostics(turned, "no_unit"), 1u);
  expectBounds(Scene{Model(turned)}, {-22, 10, 30}, {-20, 11, 33}, 1e-5);
}

TEST(ImportHandMade, ATriangleWithANanVertexIsDroppedAndReported) {
  const TemporaryFolder folder;
  BoxMesh mesh({1, 1, 1});
  mesh.positions.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  mesh.indices.insert(mesh.indices.end(), {0, 1, 8});
  const Model model = importModel(folder.write("nan.gltf", makeGltfFile(mesh, "0", kOneNode)));
  EXPECT_EQ(countDiagnostics(model, "broken_triangle_dropped"), 1u);
  EXPECT_EQ(model.meshes[0].indices.size(), 36u);
  expectBounds(Scene{Model(model)}, {0, 0, 0}, {1, 1, 1});
}

TEST(ImportHandMade, DegenerateTrianglesAreKeptForTheEyeAndSkippedForTouch) {
  const TemporaryFolder folder;
  BoxMesh mesh({1, 1, 1});
  mesh.positions.push_back({9, 0, 0});
  mesh.indices.insert(mesh.indices.end(), {0, 1, 8});  // collinear corners
  const Model model = importModel(folder.write("flat.gltf", makeGltfFile(mesh, "0", kOneNode)));
  EXPECT_EQ(countDiagnostics(model, "degenerate_triangle"), 1u);
  const Scene scene{Model(model)};
  EXPECT_EQ(scene.shape(0).triangles.size(), 12u);
  expectBounds(scene, {0, 0, 0}, {1, 1, 1});
}

TEST(ImportHandMade, AMissingTextureIsAProblemAndNoError) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.obj", "mtllib box.mtl\nusemtl wall\n" + kObj);
  folder.write("box.mtl", "newmtl wall\nKd 0.5 0.5 0.5\nmap_Kd brick.png\n");
  const Model model = importModel(file);
  EXPECT_EQ(countDiagnostics(model, "missing_texture"), 1u);
  const Material& material = model.materials[model.meshes[0].material];
  EXPECT_EQ(material.baseColourTexture, -1);
  EXPECT_NEAR(material.baseColour.x(), 0.2140f, 1e-3f) << "sRGB 0.5 in linear light";
}

TEST(ImportHandMade, ProgressNamesStagesInOrder) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.gltf", makeGltfFile(BoxMesh({1, 1, 1}), "0", kOneNode));
  std::vector<std::string> stages;
  importModel(file, {}, [&](const std::string& stage, double fraction) {
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    if (stages.empty() || stages.back() != stage) stages.push_back(stage);
  });
  EXPECT_EQ(stages, (std::vector<std::string>{"open", "parse", "textures", "convert", "send"}));
}

TEST(ImportHandMade, UnitsAreParsedOrRefused) {
  EXPECT_EQ(parseMetresPerUnit("m"), 1);
  EXPECT_EQ(parseMetresPerUnit("ft"), 0.3048);
  EXPECT_EQ(parseMetresPerUnit("in"), 0.0254);
  EXPECT_EQ(parseMetresPerUnit("0.05"), 0.05);
  for (const char* wrong : {"", "0", "-1", "nan", "inf", "1 m", "yard", "1e400"}) {
    EXPECT_FALSE(parseMetresPerUnit(wrong).has_value()) << wrong;
  }
}

}  // namespace
}  // namespace enfilade::scene
