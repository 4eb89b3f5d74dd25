// Skinned and morphed glTF meshes are imported in their rest pose: skins where the joints are,
// morph targets by their default weights.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>

#include "scene/import/import_model.hpp"
#include "tests/scene/encoded_gltf.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

using Eigen::Affine3d;
using tests::GltfWriter;
using tests::Json;
using tests::TemporaryFolder;

constexpr std::size_t kVertices = 64;  // of the terrace

std::vector<Vec3> computePositions(const Model& model, const Object& object) {
  std::vector<Vec3> positions;
  for (const std::uint32_t m : object.meshes)
    for (std::uint32_t v = 0; v < model.meshes[m].positions.size(); ++v)
      positions.push_back(computeWorldPosition(object, model.meshes[m], v));
  return positions;
}

/// Expects the positions of the terrace's vertices after `move`, in any order.
void expectMoved(const Model& model, const Object& object,
                 const std::function<Vec3(const Vec3&, std::size_t)>& move) {
  const std::vector<Vec3> read = computePositions(model, object);
  const tests::Terrace terrace;
  ASSERT_EQ(terrace.positions.size(), kVertices);
  for (std::size_t v = 0; v < kVertices; ++v) {
    const auto& p = terrace.positions[v];
    const Vec3 wanted = move(Vec3(p[0], p[1], p[2]), v);
    double nearest = 1e300;
    for (const Vec3& other : read) nearest = std::min(nearest, (other - wanted).norm());
    EXPECT_LT(nearest, 1e-5) << "vertex " << v << ": " << wanted.transpose();
  }
}

unsigned addMatrices(GltfWriter& file, const std::vector<Affine3d>& matrices) {
  std::vector<float> numbers;
  for (const Affine3d& m : matrices)
    for (int i = 0; i < 16; ++i) numbers.push_back(static_cast<float>(m.matrix()(i % 4, i / 4)));
  return file.addAccessor(static_cast<int>(file.addView(tests::toBytes(numbers))), 5126,
                          matrices.size(), "MAT4");
}

/// Share of the second joint at a vertex: 0, 0.25 or 1.
double getSecondShare(std::size_t vertex) {
  return vertex % 3 == 0 ? 0 : vertex % 3 == 1 ? 0.25 : 1;
}

/// Binds the terrace to two joints: nodes 1 and 2, the second one a child of the first.
void bindToJoints(GltfWriter& file, const std::vector<Affine3d>& inverseBinds) {
  std::vector<std::uint8_t> joints;
  std::vector<float> weights;
  for (std::size_t v = 0; v < kVertices; ++v) {
    joints.insert(joints.end(), {1, 0, 0, 0});
    const auto second = static_cast<float>(getSecondShare(v));
    weights.insert(weights.end(), {second, 1 - second, 0, 0});
  }
  Json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = file.addAccessor(static_cast<int>(file.addView(tests::toBytes(joints))),
                                            5121, kVertices, "VEC4");
  attributes["WEIGHTS_0"] = file.addAccessor(
      static_cast<int>(file.addView(tests::toBytes(weights))), 5126, kVertices, "VEC4");
  file.json["nodes"].push_back({{"name", "hip"}, {"translation", {0, 5, 0}}, {"children", {2}}});
  file.json["nodes"].push_back(
      {{"name", "knee"}, {"translation", {0, 0, 2}}, {"rotation", {0, 0, 0.6, 0.8}}});
  file.json["scenes"][0]["nodes"] = {0, 1};
  file.json["skins"] = Json::array({{{"joints", {1, 2}}}});
  if (!inverseBinds.empty())
    file.json["skins"][0]["inverseBindMatrices"] = addMatrices(file, inverseBinds);
  file.json["nodes"][0]["skin"] = 0;
  // glTF: the node's own transform does not move a skinned mesh.
  file.json["nodes"][0]["translation"] = {100, 0, 0};
  file.json["nodes"][0]["scale"] = {2, 2, 2};
}

Vec3 blend(const std::vector<Affine3d>& inverseBinds, const Vec3& p, std::size_t vertex) {
  const Affine3d hip(Eigen::Translation3d(0, 5, 0));
  const Affine3d knee = hip * Eigen::Translation3d(0, 0, 2) * Eigen::Quaterniond(0.8, 0, 0, 0.6);
  const double second = getSecondShare(vertex);
  return (1 - second) * (hip * inverseBinds[0] * p) + second * (knee * inverseBinds[1] * p);
}

TEST(GltfRestPose, ASkinPutsVerticesWhereTheJointsAre) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  const std::vector<Affine3d> inverseBinds{
      Affine3d(Eigen::Translation3d(0, -1, 0)),
      Eigen::Translation3d(0.5, 0, 0) * Affine3d(Eigen::Scaling(0.5))};
  bindToJoints(file, inverseBinds);
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path.substr(model.objects[0].path.rfind('/') + 1), "terrace");
  EXPECT_TRUE(model.diagnostics.empty());
  expectMoved(model, model.objects[0],
              [&](const Vec3& p, std::size_t v) { return blend(inverseBinds, p, v); });
}

TEST(GltfRestPose, WithoutInverseBindMatricesTheyAreIdentities) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  bindToJoints(file, {});
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  const std::vector<Affine3d> identities(2, Affine3d::Identity());
  expectMoved(model, model.objects.at(0),
              [&](const Vec3& p, std::size_t v) { return blend(identities, p, v); });
}

TEST(GltfRestPose, AMeshThatOtherNodesUseUnskinnedStaysThere) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  bindToJoints(file, {});
  file.json["nodes"].push_back({{"name", "plain"}, {"mesh", 0}});
  file.json["scenes"][0]["nodes"].push_back(3);
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 2u);
  expectMoved(model, model.objects[1], [](const Vec3& p, std::size_t) { return p; });
  EXPECT_TRUE(model.diagnostics.empty());
}

TEST(GltfRestPose, InvalidSkinsAreErrorsInWords) {
  const TemporaryFolder folder;
  const auto catchDamage = [&](const std::function<void(GltfWriter&)>& damage) {
    GltfWriter file = tests::makePlainTerrace();
    bindToJoints(file, {Affine3d::Identity(), Affine3d::Identity()});
    damage(file);
    return catchFailure(folder.write("a.glb", file.toGlb()));
  };
  const auto expect = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect(catchDamage([](GltfWriter& f) { f.json["skins"][0]["joints"] = {1}; }),
         "is not in its skin");
  expect(catchDamage([](GltfWriter& f) {
           f.json["skins"][0]["joints"] = {1, 99};
         }),
         "skins[0]: joint 1 is not a node");
  expect(catchDamage([](GltfWriter& f) { f.json["skins"][0]["joints"] = Json::array(); }),
         "skins[0]: has no joints");
  expect(catchDamage([](GltfWriter& f) {
           f.json["skins"][0]["joints"] = {1, 2, 1};
         }),
         "fewer inverse bind matrices than joints");
  expect(catchDamage([](GltfWriter& f) {
           f.json["meshes"][0]["primitives"][0]["attributes"].erase("WEIGHTS_0");
         }),
         "joints and weights do not fit");
}

/// Adds two morph targets: one raises all vertices by 2 m, the other moves them along x.
void addTargets(GltfWriter& file) {
  const unsigned raised = file.addPoints(tests::Points(kVertices, {0, 2, 0}));
  const unsigned moved = file.addPoints(tests::Points(kVertices, {4, 0, 0}));
  file.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", raised}},
                                                        {{"POSITION", moved}}};
}

TEST(GltfRestPose, MorphTargetsHaveTheWeightsOfTheMeshOrOfTheNode) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  addTargets(file);
  const Model neutral = importModel(folder.write("neutral.glb", file.toGlb()));
  expectMoved(neutral, neutral.objects.at(0), [](const Vec3& p, std::size_t) { return p; });
  file.json["meshes"][0]["weights"] = {0.5, 0};
  file.json["nodes"].push_back({{"name", "own"}, {"mesh", 0}, {"weights", {0, -0.25}}});
  file.json["scenes"][0]["nodes"] = {0, 1};
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 2u);
  expectMoved(model, model.objects[0],
              [](const Vec3& p, std::size_t) { return Vec3(p + Vec3(0, 1, 0)); });
  expectMoved(model, model.objects[1],
              [](const Vec3& p, std::size_t) { return Vec3(p - Vec3(1, 0, 0)); });
  EXPECT_TRUE(model.diagnostics.empty());
}

/// Makes node 0 two instances: one in its place and one 20 m along x.
void addInstances(GltfWriter& file) {
  const unsigned moves = file.addPoints({{0, 0, 0}, {20, 0, 0}});
  file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", moves}};
  file.use("EXT_mesh_gpu_instancing");
}

TEST(GltfRestPose, InstancesAreCopiesOfTheMorphedMesh) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  addTargets(file);
  file.json["nodes"][0]["weights"] = {0.5, 0};
  addInstances(file);
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i)
    expectMoved(model, model.objects[i], [&](const Vec3& p, std::size_t) {
      return Vec3(p + Vec3(20.0 * static_cast<double>(i), 1, 0));
    });
  EXPECT_EQ(model.meshes.size(), 1u) << "instances share the mesh in its pose";
}

TEST(GltfRestPose, InstancesAreCopiesOfTheSkinnedMesh) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  bindToJoints(file, {});
  addInstances(file);
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 2u);
  const std::vector<Affine3d> identities(2, Affine3d::Identity());
  for (std::size_t i = 0; i < 2; ++i)
    expectMoved(model, model.objects[i], [&](const Vec3& p, std::size_t v) {
      // The node scales its instances' places by 2.
      return Vec3(blend(identities, p, v) + Vec3(40.0 * static_cast<double>(i), 0, 0));
    });
}

TEST(GltfRestPose, AMorphTargetOfAnotherLengthIsAnError) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  addTargets(file);
  const unsigned single = file.addPoints({{1, 1, 1}});
  file.json["meshes"][0]["primitives"][0]["targets"][1]["POSITION"] = single;
  file.json["meshes"][0]["weights"] = {0, 1};
  const std::string text = catchFailure(folder.write("a.glb", file.toGlb()));
  EXPECT_NE(text.find("morph target 1 has another number of vertices"), std::string::npos) << text;
}

// ---- meshes that cannot be read -----------------------------------------------------------------

/// Replaces an attribute of the first primitive by one that extends beyond the file.
void breakAttribute(GltfWriter& file, const std::string& attribute) {
  Json& index = file.json["meshes"][0]["primitives"][0]["attributes"][attribute];
  Json broken = file.json["accessors"][index.get<std::size_t>()];
  broken["byteOffset"] = 1 << 24;
  if (attribute == "POSITION") broken["min"] = {0, 0, 0}, broken["max"] = {7, 2, 7};
  file.json["accessors"].push_back(broken);
  index = file.json["accessors"].size() - 1;
}

/// The terrace bound to joints, and next to it an unbound one that keeps the file readable.
GltfWriter makeBoundTerrace() {
  GltfWriter file = tests::makePlainTerrace();
  bindToJoints(file, {});
  file.json["accessors"][0]["min"] = {0, 0, 0};
  file.json["accessors"][0]["max"] = {7, 2, 7};
  file.json["meshes"].push_back({{"primitives", Json::array()}});
  file.json["meshes"][1]["primitives"].push_back(
      {{"attributes", {{"POSITION", file.addPoints({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})}}}});
  file.json["nodes"].push_back({{"name", "other"}, {"mesh", 1}});
  file.json["scenes"][0]["nodes"].push_back(3);
  return file;
}

/// The box of the object "terrace".
Aabb computeBoxOfTerrace(const Model& model) {
  Aabb box;
  for (const Object& object : model.objects) {
    if (!object.path.ends_with("terrace")) continue;
    for (const Vec3& position : computePositions(model, object)) box.include(position);
  }
  return box;
}

void expectBox(const Aabb& box, const Vec3& min, const Vec3& max) {
  EXPECT_LT((box.min - min).norm(), 1e-5) << box.min.transpose();
  EXPECT_LT((box.max - max).norm(), 1e-5) << box.max.transpose();
}

TEST(GltfRestPose, TheBoxOfAMeshThatCannotBeReadIsPosedByTheJointsThatMoveIt) {
  const TemporaryFolder folder;
  GltfWriter file = makeBoundTerrace();
  breakAttribute(file, "POSITION");
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_EQ(countDiagnostics(model, "solid_mesh"), 1u);
  EXPECT_EQ(findDiagnosticText(model, "solid_mesh").find("not posed"), std::string::npos);
  // The hip raises the box of 7 x 2 x 7 m by 5 m; the knee turns it, too, with a cosine of 0.28.
  expectBox(computeBoxOfTerrace(model), Vec3(-0.96 * 2, 5, 0), Vec3(7, 5 + 0.96 * 7 + 0.28 * 2, 9));
  Json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
  std::vector<float> weights;  // of the hip alone
  for (std::size_t v = 0; v < kVertices; ++v) weights.insert(weights.end(), {0, 1, 0, 0});
  attributes["WEIGHTS_0"] = file.addAccessor(
      static_cast<int>(file.addView(tests::toBytes(weights))), 5126, kVertices, "VEC4");
  expectBox(computeBoxOfTerrace(importModel(folder.write("hip.glb", file.toGlb()))), Vec3(0, 5, 0),
            Vec3(7, 7, 7));
}

TEST(GltfRestPose, WithoutReadableJointsTheBoxStaysAndTheReportSaysSo) {
  const TemporaryFolder folder;
  GltfWriter file = makeBoundTerrace();
  breakAttribute(file, "JOINTS_0");
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_EQ(countDiagnostics(model, "solid_mesh"), 1u);
  EXPECT_NE(findDiagnosticText(model, "solid_mesh").find("not posed by its skin"),
            std::string::npos)
      << findDiagnosticText(model, "solid_mesh");
  // In the frame of its node, which doubles it and moves it by 100 m.
  expectBox(computeBoxOfTerrace(model), Vec3(100, 0, 0), Vec3(114, 4, 14));
}

TEST(GltfRestPose, TheBoxOfAMeshThatCannotBeReadIsMorphed) {
  const TemporaryFolder folder;
  GltfWriter file = makeBoundTerrace();
  for (const char* member : {"skin", "translation", "scale"}) file.json["nodes"][0].erase(member);
  file.json["nodes"][0]["weights"] = {0.5, -0.25};
  addTargets(file);
  breakAttribute(file, "POSITION");
  const Model without = importModel(folder.write("without.glb", file.toGlb()));
  EXPECT_NE(findDiagnosticText(without, "solid_mesh").find("without morph targets"),
            std::string::npos);
  for (const auto& [target, offset] : {std::pair{0, Json{0, 2, 0}}, std::pair{1, Json{4, 0, 0}}}) {
    const Json& targets = file.json["meshes"][0]["primitives"][0]["targets"];
    Json& accessor = file.json["accessors"][targets[target]["POSITION"].get<std::size_t>()];
    accessor["min"] = accessor["max"] = offset;
  }
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_EQ(findDiagnosticText(model, "solid_mesh").find("without morph targets"),
            std::string::npos);
  expectBox(computeBoxOfTerrace(model), Vec3(-1, 1, 0), Vec3(6, 3, 7));
}

TEST(GltfRestPose, AMeshThatNoNodeUsesIsNoBrokenTriangle) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  file.json["meshes"].push_back(Json(file.json["meshes"][0]));
  const Model unused = importModel(folder.write("unused.glb", file.toGlb()));
  EXPECT_TRUE(unused.diagnostics.empty());
  file.json["nodes"].push_back({{"name", "stray"}, {"mesh", 1}});
  const Model stray = importModel(folder.write("stray.glb", file.toGlb()));
  EXPECT_TRUE(stray.diagnostics.empty());
}

}  // namespace
}  // namespace enfilade::scene
