// Nodes of glTF files: transforms are the file's own, whatever assimp makes of them, and what
// glTF does not allow in a node is reported.
#include <gtest/gtest.h>

#include "scene/import/import_model.hpp"
#include "scene/world/data/scene.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

using tests::BoxMesh;
using tests::TemporaryFolder;

Model importNodes(const std::string& nodes) {
  const TemporaryFolder folder;
  return importModel(folder.write("a.gltf", tests::makeGltfFile(BoxMesh({1, 2, 3}), "0", nodes)));
}

Model importBoxWith(const std::string& transform) {
  return importNodes(R"({"name":"box","mesh":0,)" + transform + "}");
}

TEST(GltfNodes, ARotationOfThreeDigitsNeitherScalesNorHidesWhatIsBelowIt) {
  const Model model =
      importNodes(R"({"name":"frame","rotation":[0,0.707,0,0.707],"children":[1]},)"
                  R"({"name":"door","mesh":0,"translation":[0.123456789012,0,0],)"
                  R"("extras":{"walk_kind":"hinged","walk_axis":[0,1,0],"_ID":7}})");
  expectSize(model, {3, 2, 1}, 1e-9);
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path, "frame/door");
  EXPECT_EQ(model.objects[0].attributes, (std::vector<ObjectAttribute>{{"_ID", {7}}}));
  EXPECT_NEAR(model.objects[0].worldFromMesh.translation().z(), -0.123456789012, 1e-15);
  EXPECT_EQ(model.bodies.size(), 1u);
  EXPECT_EQ(countDiagnostics(model, "rescaled_rotation"), 0u);
}

TEST(GltfNodes, ARotationOfAnotherLengthIsNormalisedAndReported) {
  const Model model = importBoxWith(R"("rotation":[0,2,0,2])");
  expectSize(model, {3, 2, 1}, 1e-9);
  EXPECT_EQ(countDiagnostics(model, "rescaled_rotation"), 1u);
  EXPECT_EQ(findDiagnosticText(model, "rescaled_rotation").find("nodes[0] 'box': of length 2.8"),
            0u)
      << findDiagnosticText(model, "rescaled_rotation");
}

TEST(GltfNodes, WhatGltfDoesNotAllowInATransformIsIgnoredAndReported) {
  for (const char* transform :
       {R"("translation":[1,2])", R"("translation":"up")", R"("translation":{"x":1})",
        R"("rotation":[0,0,1])", R"("rotation":[0,0,0,0])", R"("scale":2)", R"("scale":[1,"1",1])",
        R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0])", R"("matrix":[1,0,0,0.5,0,1,0,0,0,0,1,0,0,0,0,1])",
        R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,2])",
        R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"translation":[9,0,0])",
        R"("rotation":[0,1,0,0],"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1])",
        R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"scale":[2,2,2])"}) {
    const Model model = importBoxWith(transform);
    EXPECT_EQ(countDiagnostics(model, "broken_transform_dropped"), 1u) << transform;
    EXPECT_EQ(findDiagnosticText(model, "broken_transform_dropped").find("nodes[0] 'box': "), 0u);
    expectSize(model, {1, 2, 3}, 1e-9);
  }
  const Model whole = importBoxWith(R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,6,7,1])");
  EXPECT_EQ(countDiagnostics(whole, "broken_transform_dropped"), 0u);
}

TEST(GltfNodes, AChildThatIsNoIndexIsReportedWithItsParent) {
  const Model model =
      importNodes(R"({"name":"box","mesh":0,"children":[1.0,"1"]},{"name":"lost","mesh":0})");
  EXPECT_EQ(countDiagnostics(model, "missing_node"), 2u);
  EXPECT_EQ(findDiagnosticText(model, "missing_node"), "nodes[0] 'box': node is not an index");
  EXPECT_EQ(model.objects.size(), 1u);
}

TEST(GltfNodes, ChildrenThatAreNoListAreReported) {
  for (const char* children : {"1", R"({"0":1})", "null"}) {
    const std::string parent = std::string(R"({"name":"box","mesh":0,"children":)") + children;
    const Model model = importNodes(parent + R"(},{"name":"lost","mesh":0})");
    EXPECT_EQ(countDiagnostics(model, "missing_node"), 1u) << children;
    EXPECT_EQ(findDiagnosticText(model, "missing_node"),
              "nodes[0] 'box': \"children\" is not a list");
    EXPECT_EQ(model.objects.size(), 1u);
  }
}

TEST(GltfNodes, TheRootThatAssimpWritesIsNotInPathsButMoves) {
  const Model model = importNodes(
      R"({"name":"ROOT","translation":[0,7,0],"children":[1]},{"name":"box","mesh":0})");
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path, "box");
  EXPECT_EQ(model.objects[0].worldFromMesh.translation().y() + model.offset.y(), 7);
}

TEST(GltfNodes, ALongNameIsCutBetweenCharacters) {
  std::string name(1022, 'n');
  const Model model = importNodes(R"({"name":")" + name + "\u00FC" + R"(","mesh":0})");
  EXPECT_EQ(model.objects.at(0).path, name);
}

TEST(GltfNodes, ACycleOutsideTheSceneIsNotRead) {
  const Model model =
      importNodes(R"({"name":"box","mesh":0},{"children":[2],"mesh":0},{"children":[1]})");
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_TRUE(model.diagnostics.empty()) << model.diagnostics[0].kind;
}

// ---- keys twice in one object -------------------------------------------------------------------

TEST(GltfNodes, AKeyTwiceInOneObjectIsReportedWithItsPathAndTheLastCounts) {
  const Model model = importBoxWith(R"("translation":[1,0,0],"translation":[5,0,0])");
  EXPECT_EQ(countDiagnostics(model, "duplicate_key"), 1u);
  EXPECT_EQ(findDiagnosticText(model, "duplicate_key"), "nodes[0].translation");
  EXPECT_NEAR(model.objects.at(0).worldFromMesh.translation().x() + model.offset.x(), 5, 1e-12);
  const Model deep = importBoxWith(
      R"("extras":{"a":[1,[2],{"b":2},{"c":{"d":1,"e":[{"d":1},{"d":2}],"d":2,"d":3}}]})");
  EXPECT_EQ(countDiagnostics(deep, "duplicate_key"), 2u);
  EXPECT_EQ(findDiagnosticText(deep, "duplicate_key"), "nodes[0].extras.a[3].c.d");
  // Two objects of many keys, of which the first has some twice.
  std::string many;
  for (int i = 0; i < 40; ++i) many += "\"k" + std::to_string(i) + "\":1,";
  const Model wide =
      importBoxWith(R"("extras":{"a":[{)" + many + R"("k39":2,"k3":2},{)" + many + R"("k40":1}]})");
  EXPECT_EQ(countDiagnostics(wide, "duplicate_key"), 2u);
  EXPECT_EQ(findDiagnosticText(wide, "duplicate_key"), "nodes[0].extras.a[0].k39");
}

TEST(GltfNodes, ASectionTwiceIsReadFromTheLast) {
  const TemporaryFolder folder;
  for (const char* first : {R"("meshes":[{"primitives":[{"attributes":{"POSITION":1}}]}],)",
                            R"("accessors":[],)", R"("nodes":[{"mesh":0,"scale":[7,7,7]}],)"}) {
    std::string text = tests::makeGltfFile(BoxMesh({1, 2, 3}), "0", tests::kOneNode);
    const Model model = importModel(folder.write("a.gltf", text.insert(1, first)));
    EXPECT_EQ(countDiagnostics(model, "duplicate_key"), 1u) << first;
    expectSize(model, {1, 2, 3}, 1e-9);
  }
}

TEST(GltfNodes, TheSameKeyInSeveralObjectsIsNoDuplicate) {
  const Model model =
      importNodes(R"({"name":"box","mesh":0,"extras":{"name":{"name":1},"mesh":[{}]},)"
                  R"("children":[1]},{"name":"box","mesh":0})");
  EXPECT_EQ(countDiagnostics(model, "duplicate_key"), 0u);
}

// ---- references to nothing ----------------------------------------------------------------------

TEST(GltfNodes, ANodeWithTwoParentsIsReportedOnceAndStandsBelowEach) {
  const TemporaryFolder folder;
  const Model model =
      importModel(folder.write("a.gltf", tests::makeGltfFile(BoxMesh({1, 2, 3}), "0,1",
                                                             R"({"name":"a","children":[2]},
                               {"name":"b","translation":[5,0,0],"children":[2]},
                               {"name":"shared","children":[3]},{"name":"box","mesh":0})")));
  EXPECT_EQ(model.objects.size(), 2u);
  EXPECT_EQ(countDiagnostics(model, "shared_node"), 1u);
  EXPECT_EQ(findDiagnosticText(model, "shared_node"), "nodes[2] 'shared' is listed several times");
}

TEST(GltfNodes, AReferenceToNothingCostsItselfAlone) {
  struct Row {
    const char *scene, *members, *kind, *text;
  };
  const TemporaryFolder folder;
  for (const Row& row : std::vector<Row>{
           {"0,1", R"("mesh":7)", "missing_mesh", "nodes[1] 'b': mesh 7 does not exist"},
           {"0,1", R"("mesh":-1)", "missing_mesh", "nodes[1] 'b': mesh -1 does not exist"},
           {"0,1", R"("mesh":"7")", "missing_mesh", "nodes[1] 'b': mesh is not an index"},
           {"0,1", R"("camera":4)", "missing_camera", "nodes[1] 'b': camera 4 does not exist"},
           {"0,1", R"("mesh":0,"skin":2)", "skin_ignored", "nodes[1] 'b': skin 2 does not exist"},
           {"0,1", R"("children":[17])", "missing_node", "nodes[1] 'b': node 17 does not exist"},
           {"0,9", R"("mesh":0)", "missing_node", "scenes[0]: node 9 does not exist"}}) {
    const std::string nodes =
        R"({"name":"a","mesh":0},{"name":"b",)" + std::string(row.members) + "}";
    const Model model = importModel(
        folder.write("a.gltf", tests::makeGltfFile(BoxMesh({1, 2, 3}), row.scene, nodes)));
    EXPECT_EQ(countDiagnostics(model, row.kind), 1u) << row.members;
    EXPECT_EQ(findDiagnosticText(model, row.kind), row.text);
    expectSize(model, {1, 2, 3}, 1e-9);
  }
}

TEST(GltfNodes, ASkinThatDoesNotExistDoesNotRefuseAFileThatHasSkins) {
  const TemporaryFolder folder;
  std::string text =
      tests::makeGltfFile(BoxMesh({1, 2, 3}), "0", R"({"name":"box","mesh":0,"skin":1})");
  const Model model =
      importModel(folder.write("a.gltf", text.insert(1, R"("skins":[{"joints":[0]}],)")));
  EXPECT_EQ(findDiagnosticText(model, "skin_ignored"), "nodes[0] 'box': skin 1 does not exist");
  expectSize(model, {1, 2, 3}, 1e-9);
}

}  // namespace
}  // namespace enfilade::scene
