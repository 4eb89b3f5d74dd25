// The parts of a glTF file that are read: one of its scenes, and the meshes that can be read.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <map>

#include "scene/import/import_model.hpp"
#include "scene/model/diagnostic_catalog.hpp"
#include "scene/world/data/scene.hpp"
#include "tests/scene/encoded_gltf.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

using tests::BoxMesh;
using tests::GltfWriter;
using tests::Json;
using tests::TemporaryFolder;

constexpr std::size_t kTriangles = 2 * tests::Terrace::side * tests::Terrace::side;

// ---- scenes -------------------------------------------------------------------------------------

/// Three scenes of a node each: "day" with "terrace", an unnamed one with "second", "0" with
/// "third".
GltfWriter makeThreeScenes() {
  GltfWriter file = tests::makePlainTerrace();
  file.json["scenes"][0]["name"] = "day";
  for (const char* name : {"second", "third"}) {
    file.json["scenes"].push_back({{"nodes", {file.json["nodes"].size()}}});
    file.json["nodes"].push_back({{"name", name}, {"mesh", 0}});
  }
  file.json["scenes"][2]["name"] = "0";
  file.json["scene"] = 1;
  return file;
}

TEST(GltfScenes, TheDefaultIsReadAndTheOthersAreListed) {
  const TemporaryFolder folder;
  const Model model = importModel(folder.write("a.glb", makeThreeScenes().toGlb()));
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path, "second");
  EXPECT_EQ(countDiagnostics(model, "other_scenes"), 2u);
  EXPECT_EQ(model.fileScenes, (std::vector<std::string>{"day", "", "0"}));
  EXPECT_EQ(model.fileScene, 1u);
}

TEST(GltfScenes, WithoutOneAllRootNodesAreRead) {
  const TemporaryFolder folder;
  GltfWriter file = makeThreeScenes();
  file.json["nodes"][0]["children"] = {2};
  for (const char* member : {"scenes", "scene"}) file.json.erase(member);
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 3u);
  EXPECT_EQ(countDiagnostics(model, "no_scene"), 1u);
}

TEST(GltfScenes, OneIsChosenByNameOrNumber) {
  const TemporaryFolder folder;
  const auto file = folder.write("a.glb", makeThreeScenes().toGlb());
  for (const auto& [choice, path] : {std::pair{"day", "terrace"}, std::pair{"1", "second"},
                                     std::pair{"2", "third"}, std::pair{"0", "third"}}) {
    ImportOptions options;
    options.gltfScene = choice;
    const Model model = importModel(file, options);
    ASSERT_EQ(model.objects.size(), 1u) << choice;
    EXPECT_EQ(model.objects[0].path, path) << "a name takes precedence over a number";
    EXPECT_EQ(model.meshes.at(0).triangleCount(), kTriangles);
  }
}

TEST(GltfScenes, AnUnknownOneIsAnErrorThatListsThem) {
  const TemporaryFolder folder;
  ImportOptions options;
  options.gltfScene = "night";
  const std::string text = catchFailure(folder.write("a.glb", makeThreeScenes().toGlb()), options);
  EXPECT_NE(text.find("no scene 'night'; its scenes are 0 'day', 1, 2 '0'"), std::string::npos)
      << text;
  const std::string obj =
      catchFailure(folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), options);
  EXPECT_NE(obj.find("--gltf-scene needs a glTF file"), std::string::npos) << obj;
}

// ---- the file of meshes -------------------------------------------------------------------------

TEST(GltfMeshFile, EachNodeHasTheMeshThatItNames) {
  // Meshes in descending order, children before and after their parents, one mesh twice, one
  // primitive more in each, and one that no node names.
  constexpr std::size_t kMeshes = 5;
  GltfWriter file = tests::makePlainTerrace();
  const Json primitive = file.json["meshes"][0]["primitives"][0];
  file.json["meshes"] = Json::array();
  for (std::size_t m = 0; m < kMeshes; ++m)
    file.json["meshes"].push_back({{"primitives", std::vector<Json>(m + 1, primitive)}});
  file.json["nodes"] = {{{"name", "a"}, {"mesh", 4}, {"children", {3}}},
                        {{"name", "b"}, {"mesh", 0}},
                        {{"name", "c"}, {"mesh", 2}, {"children", {1}}},
                        {{"name", "d"}, {"mesh", 1}},
                        {{"name", "e"}, {"mesh", 2}, {"translation", {50, 0, 0}}}};
  file.json["scenes"] = {{{"nodes", {4, 2, 0}}}};
  const TemporaryFolder folder;
  for (const bool isRewritten : {false, true}) {
    if (isRewritten) file.json["nodes"][1]["camera"] = 9;
    const Model model = importModel(folder.write("a.glb", file.toGlb()));
    std::map<std::string, std::size_t> primitives;
    for (const Object& object : model.objects) primitives[object.path] = object.meshes.size();
    EXPECT_EQ(primitives, (std::map<std::string, std::size_t>{
                              {"e", 3}, {"c", 3}, {"c/b", 1}, {"a", 5}, {"a/d", 2}}));
    EXPECT_EQ(countDiagnostics(model, "missing_camera"), isRewritten ? 1u : 0u);
  }
}

TEST(GltfMeshFile, TheBinaryChunkMayFollowAnyJsonOrBeMissing) {
  const TemporaryFolder folder;
  const std::string glb = tests::makeGlbFile(BoxMesh({1, 2, 3}), "0", tests::kOneNode);
  std::uint32_t size = 0;
  std::memcpy(&size, glb.data() + 12, sizeof size);
  const auto withJson = [&](const std::string& json, const std::string& rest) {
    std::string text = "glTF";
    for (const std::size_t word : {std::size_t{2}, 20 + json.size() + rest.size(), json.size()})
      for (int shift = 0; shift < 32; shift += 8) text += static_cast<char>(word >> shift & 255);
    return text + "JSON" + json + rest;
  };
  const std::string json = glb.substr(20, size), rest = glb.substr(20 + size);
  for (int blanks = 0; blanks < 5; ++blanks) {
    const Model model = importModel(
        folder.write("a.glb", withJson(json + std::string(static_cast<std::size_t>(blanks), ' '),
                                       rest + std::string(64, 'x'))));
    EXPECT_EQ(Scene(Model(model)).bounds().size(), Vec3(1, 2, 3)) << blanks;
  }
  const std::string embedded = tests::makeGltfFile(BoxMesh({1, 2, 3}), "0", tests::kOneNode);
  const Model model = importModel(folder.write("b.glb", withJson(embedded, "")));
  EXPECT_EQ(Scene(Model(model)).bounds().size(), Vec3(1, 2, 3));
}

// ---- meshes that cannot be read -----------------------------------------------------------------

/// Two terraces; the second one's positions extend beyond the file.
GltfWriter makeHalfBroken(bool stated) {
  GltfWriter file = tests::makePlainTerrace();
  file.json["meshes"].push_back(file.json["meshes"][0]);
  file.json["accessors"].push_back(file.json["accessors"][0]);
  Json& accessor = file.json["accessors"].back();
  accessor["byteOffset"] = 1 << 24;
  for (const char* key : {"min", "max"}) accessor.erase(key);
  if (stated) accessor["min"] = {0, 0, 0}, accessor["max"] = {7, 2, 7};
  file.json["meshes"][1]["primitives"][0]["attributes"]["POSITION"] =
      file.json["accessors"].size() - 1;
  file.json["nodes"].push_back({{"name", "broken"}, {"mesh", 1}, {"translation", {20, 0, 0}}});
  file.json["scenes"][0]["nodes"] = {0, 1};
  return file;
}

TEST(GltfMeshes, OneThatCannotBeReadIsASolidBoxOfItsStatedExtent) {
  const TemporaryFolder folder;
  const Model model = importModel(folder.write("a.glb", makeHalfBroken(true).toGlb()));
  ASSERT_EQ(model.objects.size(), 2u);
  EXPECT_EQ(model.meshes.at(model.objects[0].meshes.at(0)).triangleCount(), kTriangles);
  EXPECT_EQ(model.objects[1].path, "broken");
  EXPECT_EQ(countDiagnostics(model, "solid_mesh"), 1u);
  EXPECT_EQ(findDiagnosticText(model, "solid_mesh").find("meshes[1].primitives[0]"), 0u);
  const Scene scene{Model(model)};
  EXPECT_EQ(scene.objectBoxes()[1].min, Vec3(20, 0, 0));
  EXPECT_EQ(scene.objectBoxes()[1].max, Vec3(27, 2, 7));
  EXPECT_EQ(findDiagnosticKind({"solid_mesh", 1, ""}).severity, Severity::error);
}

TEST(GltfMeshes, OneWithoutAnExtentIsMissingAndReported) {
  const TemporaryFolder folder;
  const Model model = importModel(folder.write("a.glb", makeHalfBroken(false).toGlb()));
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(countDiagnostics(model, "missing_mesh"), 1u);
  EXPECT_EQ(findDiagnosticKind({"missing_mesh", 1, ""}).severity, Severity::error);
}

TEST(GltfMeshes, IfNoneCanBeReadTheFileIsRefused) {
  const TemporaryFolder folder;
  GltfWriter file = makeHalfBroken(true);
  file.json["scenes"][0]["nodes"] = {1};
  file.json["meshes"][0]["primitives"] = file.json["meshes"][1]["primitives"];
  const std::string text = catchFailure(folder.write("a.glb", file.toGlb()));
  EXPECT_NE(text.find("a.glb"), std::string::npos) << text;
  EXPECT_NE(text.find("extends beyond its buffer view"), std::string::npos) << text;
}

/// The second terrace of makeHalfBroken() before `damage` of its positions and primitive.
GltfWriter makeDamaged(
    const std::function<void(GltfWriter&, Json& accessor, Json& primitive)>& damage) {
  GltfWriter file = makeHalfBroken(true);
  file.json["accessors"].back()["byteOffset"] = 0;
  damage(file, file.json["accessors"].back(), file.json["meshes"][1]["primitives"][0]);
  return file;
}

/// Gives `accessor` a view of its own, with one member replaced.
void changeView(GltfWriter& file, Json& accessor, const char* member, const Json& value) {
  Json view = file.json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
  view[member] = value;
  file.json["bufferViews"].push_back(view);
  accessor["bufferView"] = file.json["bufferViews"].size() - 1;
}

/// Gives `primitive` an accessor of indices of its own, with one member replaced.
void changeIndices(GltfWriter& file, Json& primitive, const char* member, const Json& value) {
  Json accessor = file.json["accessors"][primitive["indices"].get<std::size_t>()];
  accessor[member] = value;
  file.json["accessors"].push_back(accessor);
  primitive["indices"] = file.json["accessors"].size() - 1;
}

TEST(GltfMeshes, WhatGltfDoesNotAllowIsNotReadInSilence) {
  const TemporaryFolder folder;
  const std::pair<const char*, GltfWriter> files[] = {
      {"extends beyond its buffer view",
       makeDamaged([](auto&, Json& accessor, Json&) { accessor["byteOffset"] = 12; })},
      {"extends beyond its buffer view", makeDamaged([](GltfWriter& file, Json& accessor, Json&) {
         changeView(file, accessor, "byteLength", 64 * 12 - 1);
       })},
      {"extends beyond its buffer of", makeDamaged([](GltfWriter& file, Json& accessor, Json&) {
         changeView(file, accessor, "byteOffset", file.binary.size() - 12);
       })},
      {"byteOffset is not a valid whole number",
       makeDamaged([](GltfWriter& file, Json& accessor, Json&) {
         changeView(file, accessor, "byteOffset", -12);
       })},
      {"byteOffset is not a valid whole number",
       makeDamaged([](GltfWriter& file, Json&, Json& primitive) {
         changeIndices(file, primitive, "byteOffset", -12);
       })},
      {"extends beyond its buffer view", makeDamaged([](GltfWriter& file, Json&, Json& primitive) {
         changeIndices(file, primitive, "byteOffset", 12);
       })},
      {"not of unsigned integers", makeDamaged([](GltfWriter& file, Json&, Json& primitive) {
         changeIndices(file, primitive, "componentType", 5126);
       })},
      {"has an index beyond its vertices",
       makeDamaged([](GltfWriter& file, Json&, Json& primitive) {
         primitive["indices"] = file.addIndices({64, 65, 66, 0, 1, 4294967295});
       })},
      {"mode 99 is not 0 to 6",
       makeDamaged([](auto&, Json&, Json& primitive) { primitive["mode"] = 99; })},
      {"has no whole triangle", makeDamaged([](GltfWriter& file, Json&, Json& primitive) {
         changeIndices(file, primitive, "count", 2);
       })},
      {"mode -1 is not 0 to 6",
       makeDamaged([](auto&, Json&, Json& primitive) { primitive["mode"] = -1; })},
      {"its indices are not an accessor",
       makeDamaged([](auto&, Json&, Json& primitive) { primitive["indices"] = "1"; })},
      {"is not of type VEC3",
       makeDamaged([](auto&, Json& accessor, Json&) { accessor["type"] = "VEC2"; })},
      {"byteStride is smaller", makeDamaged([](GltfWriter& file, Json& accessor, Json&) {
         changeView(file, accessor, "byteStride", 4);
       })}};
  for (const auto& [fault, file] : files) {
    const Model model = importModel(folder.write("a.glb", file.toGlb()));
    EXPECT_EQ(model.objects.size(), 2u) << fault;
    EXPECT_EQ(countDiagnostics(model, "solid_mesh"), 1u) << fault;
    EXPECT_NE(findDiagnosticText(model, "solid_mesh").find(fault), std::string::npos)
        << findDiagnosticText(model, "solid_mesh");
  }
}

TEST(GltfMeshes, OneWithoutPrimitivesIsMissingAndReported) {
  const TemporaryFolder folder;
  GltfWriter file = makeHalfBroken(true);
  file.json["meshes"][1]["primitives"] = Json::array();
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(findDiagnosticText(model, "missing_mesh"), "meshes[1] has no primitives");
}

TEST(GltfMeshes, OneWithAMaterialThatDoesNotExistIsReadWithoutIt) {
  const TemporaryFolder folder;
  const GltfWriter file =
      makeDamaged([](auto&, Json&, Json& primitive) { primitive["material"] = 9; });
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 2u);
  EXPECT_EQ(model.meshes.at(model.objects[1].meshes.at(0)).triangleCount(), kTriangles);
  EXPECT_EQ(findDiagnosticText(model, "missing_material"), "meshes[1].primitives[0]");
}

TEST(GltfMeshes, OneOfABufferThatIsCutOffIsNotReadBeyondIt) {
  const TemporaryFolder folder;
  GltfWriter file = makeHalfBroken(true);
  file.json["accessors"].back()["byteOffset"] = 0;
  const std::size_t size = file.binary.size();
  changeView(file, file.json["accessors"].back(), "byteOffset", size);
  std::string glb = file.toGlb();
  const std::string stated = "\"byteLength\":" + std::to_string(size) + "}";
  const std::size_t at = glb.find(stated);
  ASSERT_NE(at, std::string::npos);
  glb.replace(at, stated.size(), "\"byteLength\":9" + std::to_string(size).substr(1) + "}");
  const Model model = importModel(folder.write("a.glb", glb));
  EXPECT_EQ(countDiagnostics(model, "solid_mesh"), 1u);
}

TEST(GltfMeshes, AnIncompleteLastTriangleIsLeftOutAndReported) {
  const TemporaryFolder folder;
  for (const bool indexed : {false, true}) {
    const GltfWriter file = makeDamaged([&](GltfWriter& whole, Json& accessor, Json& primitive) {
      if (!indexed) {
        primitive.erase("indices");
        accessor["count"] = 5;
        return;
      }
      whole.json["accessors"].push_back(whole.json["accessors"][1]);
      whole.json["accessors"].back()["count"] = 5;
      primitive["indices"] = whole.json["accessors"].size() - 1;
    });
    const Model model = importModel(folder.write("a.glb", file.toGlb()));
    ASSERT_EQ(model.objects.size(), 2u);
    EXPECT_EQ(model.meshes.at(model.objects[1].meshes.at(0)).triangleCount(), 1u);
    EXPECT_EQ(countDiagnostics(model, "broken_triangle_dropped"), 1u);
    EXPECT_EQ(countDiagnostics(model, "solid_mesh"), 0u);
  }
}

TEST(GltfMeshes, WithoutATriangleTheProblemsAreNamed) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  const float none = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t at = 0; at < tests::Terrace().positions.size() * 12; at += sizeof none)
    std::memcpy(file.binary.data() + at, &none, sizeof none);
  const std::string broken = catchFailure(folder.write("a.glb", file.toGlb()));
  EXPECT_NE(broken.find("contains no usable triangles: " + std::to_string(kTriangles) +
                        " broken_triangle_dropped ("),
            std::string::npos)
      << broken;
  GltfWriter other = tests::makePlainTerrace();
  other.json["nodes"][0]["mesh"] = 7;
  const std::string missing = catchFailure(folder.write("b.glb", other.toGlb()));
  EXPECT_NE(missing.find("contains no usable triangles: 1 missing_mesh (nodes[0] 'terrace': mesh 7 "
                         "does not exist)"),
            std::string::npos)
      << missing;
}

TEST(GltfMeshes, OneVertexThatIsNoNumberCostsItsOwnTrianglesAlone) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  const float none = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(file.binary.data() + 12 * tests::Terrace::computeIndex(3, 3), &none, sizeof none);
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_EQ(countDiagnostics(model, "broken_triangle_dropped"), 6u);
  EXPECT_EQ(model.meshes.at(model.objects.at(0).meshes.at(0)).triangleCount(), kTriangles - 6);
}

}  // namespace
}  // namespace enfilade::scene
