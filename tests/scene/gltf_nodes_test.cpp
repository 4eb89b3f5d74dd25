// The nodes of glTF files: transforms are the file's own, whatever assimp makes of them, and what
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

Model modelOf(const std::string& nodes) {
  const TemporaryFolder folder;
  return importModel(folder.write("a.gltf", tests::gltf(BoxMesh({1, 2, 3}), "0", nodes)));
}

Model modelWith(const std::string& transform) {
  return modelOf(R"({"name":"box","mesh":0,)" + transform + "}");
}

void expectSize(const Model& model, const Vec3& size) {
  const Scene scene{Model(model)};
  EXPECT_LT((scene.bounds().size() - size).norm(), 1e-9) << scene.bounds().size().transpose();
}

TEST(GltfNodes, ARotationOfThreeDigitsNeitherScalesNorHidesWhatIsBelowIt) {
  const Model model = modelOf(R"({"name":"frame","rotation":[0,0.707,0,0.707],"children":[1]},)"
                              R"({"name":"door","mesh":0,"translation":[0.123456789012,0,0],)"
                              R"("extras":{"walk_kind":"hinged","walk_axis":[0,1,0],"_ID":7}})");
  expectSize(model, {3, 2, 1});
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path, "frame/door");
  EXPECT_EQ(model.objects[0].attributes, (std::vector<ObjectAttribute>{{"_ID", {7}}}));
  EXPECT_NEAR(model.objects[0].worldFromMesh.translation().z(), -0.123456789012, 1e-15);
  EXPECT_EQ(model.bodies.size(), 1u);
  EXPECT_EQ(countOf(model, "rescaled_rotation"), 0u);
}

TEST(GltfNodes, ARotationOfAnotherLengthIsNormalisedAndReported) {
  const Model model = modelWith(R"("rotation":[0,2,0,2])");
  expectSize(model, {3, 2, 1});
  EXPECT_EQ(countOf(model, "rescaled_rotation"), 1u);
  EXPECT_EQ(diagnosticText(model, "rescaled_rotation").find("nodes[0] 'box': of length 2.8"), 0u)
      << diagnosticText(model, "rescaled_rotation");
}

TEST(GltfNodes, WhatGltfDoesNotAllowInATransformIsIgnoredAndReported) {
  for (const char* transform :
       {R"("translation":[1,2])", R"("translation":"up")", R"("translation":{"x":1})",
        R"("rotation":[0,0,1])", R"("rotation":[0,0,0,0])", R"("scale":2)", R"("scale":[1,"1",1])",
        R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0])", R"("matrix":[1,0,0,0.5,0,1,0,0,0,0,1,0,0,0,0,1])",
        R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,2])"}) {
    const Model model = modelWith(transform);
    EXPECT_EQ(countOf(model, "broken_transform_dropped"), 1u) << transform;
    EXPECT_EQ(diagnosticText(model, "broken_transform_dropped").find("nodes[0] 'box': "), 0u);
    expectSize(model, {1, 2, 3});
  }
  const Model whole = modelWith(R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,6,7,1])");
  EXPECT_EQ(countOf(whole, "broken_transform_dropped"), 0u);
}

TEST(GltfNodes, AChildThatIsNoIndexIsReportedWithItsParent) {
  const Model model =
      modelOf(R"({"name":"box","mesh":0,"children":[1.0]},{"name":"lost","mesh":0})");
  EXPECT_EQ(countOf(model, "unmatched_node"), 1u);
  EXPECT_EQ(diagnosticText(model, "unmatched_node"), "box");
}

}  // namespace
}  // namespace enfilade::scene
