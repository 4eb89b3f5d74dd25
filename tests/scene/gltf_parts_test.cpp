// Which parts of a glTF file are read: one of its scenes, and the meshes that can be read.
#include <gtest/gtest.h>

#include "scene/import/import_model.hpp"
#include "scene/model/diagnostic_catalog.hpp"
#include "scene/world/data/scene.hpp"
#include "tests/scene/encoded_gltf.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

using tests::GltfWriter;
using tests::Json;
using tests::TemporaryFolder;

constexpr std::size_t kTriangles = 2 * tests::Terrace::side * tests::Terrace::side;

// ---- scenes -------------------------------------------------------------------------------------

/// Three scenes of a node each: "day" with "terrace", an unnamed one with "second", "0" with
/// "third".
GltfWriter makeThreeScenes() {
  GltfWriter file = tests::plainTerrace();
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
  const Model model = importModel(folder.write("a.glb", makeThreeScenes().glb()));
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path, "second");
  EXPECT_EQ(countOf(model, "other_scenes"), 2u);
  EXPECT_EQ(model.fileScenes, (std::vector<std::string>{"day", "", "0"}));
  EXPECT_EQ(model.fileScene, 1u);
}

TEST(GltfScenes, OneIsChosenByNameOrNumber) {
  const TemporaryFolder folder;
  const auto file = folder.write("a.glb", makeThreeScenes().glb());
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
  const std::string text = failureOf(folder.write("a.glb", makeThreeScenes().glb()), options);
  EXPECT_NE(text.find("no scene 'night'; its scenes are 0 'day', 1, 2 '0'"), std::string::npos)
      << text;
  const std::string obj =
      failureOf(folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), options);
  EXPECT_NE(obj.find("--gltf-scene needs a glTF file"), std::string::npos) << obj;
}

// ---- meshes that cannot be read -----------------------------------------------------------------

/// Two terraces; the second one's positions extend beyond the file.
GltfWriter makeHalfBroken(bool stated) {
  GltfWriter file = tests::plainTerrace();
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
  const Model model = importModel(folder.write("a.glb", makeHalfBroken(true).glb()));
  ASSERT_EQ(model.objects.size(), 2u);
  EXPECT_EQ(model.meshes.at(model.objects[0].meshes.at(0)).triangleCount(), kTriangles);
  EXPECT_EQ(model.objects[1].path, "broken");
  EXPECT_EQ(countOf(model, "solid_mesh"), 1u);
  EXPECT_EQ(diagnosticText(model, "solid_mesh").find("meshes[1].primitives[0]"), 0u);
  const Scene scene{Model(model)};
  EXPECT_EQ(scene.objectBoxes()[1].min, Vec3(20, 0, 0));
  EXPECT_EQ(scene.objectBoxes()[1].max, Vec3(27, 2, 7));
  EXPECT_EQ(findDiagnosticKind({"solid_mesh", 1, ""}).severity, Severity::error);
}

TEST(GltfMeshes, OneWithoutAnExtentIsMissingAndReported) {
  const TemporaryFolder folder;
  const Model model = importModel(folder.write("a.glb", makeHalfBroken(false).glb()));
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(countOf(model, "missing_mesh"), 1u);
  EXPECT_EQ(findDiagnosticKind({"missing_mesh", 1, ""}).severity, Severity::error);
}

TEST(GltfMeshes, IfNoneCanBeReadTheFileIsRefused) {
  const TemporaryFolder folder;
  GltfWriter file = makeHalfBroken(true);
  file.json["scenes"][0]["nodes"] = {1};
  file.json["meshes"][0]["primitives"] = file.json["meshes"][1]["primitives"];
  const std::string text = failureOf(folder.write("a.glb", file.glb()));
  EXPECT_NE(text.find("a.glb"), std::string::npos) << text;
  EXPECT_NE(text.find("extends beyond its buffer view"), std::string::npos) << text;
}

}  // namespace
}  // namespace enfilade::scene
