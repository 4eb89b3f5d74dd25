// Tests of glTF cameras whose pose is known at every time; the tests write the files.
#include "scene/import/gltf/gltf_cameras.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "scene/import/import_model.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

/// A glTF file with one camera below one node that can be animated.
class GltfFile {
 public:
  GltfFile() {
    json_ = Json::parse(R"({
      "asset":{"version":"2.0"},
      "cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1}}],
      "nodes":[{"name":"rig","children":[1],"translation":[10,0,0]},{"name":"cam","camera":0}],
      "scenes":[{"nodes":[0]}],"buffers":[],"bufferViews":[],"accessors":[],
      "animations":[{"samplers":[],"channels":[]}]})");
  }

  Json& getJson() { return json_; }

  std::size_t add(const std::vector<float>& values, const char* type, std::size_t count) {
    std::string bytes(values.size() * 4, '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    json_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}});
    bytes_ += bytes;
    json_["accessors"].push_back({{"bufferView", json_["bufferViews"].size() - 1},
                                  {"componentType", 5126},
                                  {"type", type},
                                  {"count", count}});
    return json_["accessors"].size() - 1;
  }

  void animate(std::size_t node, const char* path, const char* how, const std::vector<float>& times,
               const std::vector<float>& values) {
    Json& animation = json_["animations"][0];
    const bool turns = std::string(path) == "rotation";
    const std::size_t input = add(times, "SCALAR", times.size());
    const std::size_t output =
        add(values, turns ? "VEC4" : "VEC3", values.size() / (turns ? 4 : 3));
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
    animation["samplers"].push_back({{"input", input}, {"output", output}, {"interpolation", how}});
  }

  GltfCameraPath sample(double fps, const std::string& name = "") const {
    const auto file = tests::makeOwnFile("camera.gltf");
    Json whole = json_;
    whole["buffers"] = {
        {{"byteLength", bytes_.size()},
         {"uri", "data:application/octet-stream;base64," + tests::encodeBase64(bytes_)}}};
    std::ofstream(file) << whole.dump();
    return sampleGltfCamera(file, name, fps);
  }

 private:
  Json json_;
  std::string bytes_;
};

TEST(GltfCamera, WithoutAnimationItIsOnePose) {
  const GltfCameraPath path = GltfFile().sample(30);
  EXPECT_EQ(path.name, "cam");
  EXPECT_EQ(path.fovY, 0.8);
  ASSERT_EQ(path.poses.size(), 1U);
  EXPECT_EQ(path.poses[0].eye, Vec3(10, 0, 0));
  EXPECT_EQ(path.poses[0].forward, Vec3(0, 0, -1));
  EXPECT_EQ(path.poses[0].up, Vec3(0, 1, 0));
}

TEST(GltfCamera, LinearKeysAreMixedAndTheNodesAboveMoveIt) {
  GltfFile file;
  file.animate(1, "translation", "LINEAR", {0, 1, 2}, {0, 0, 0, 0, 4, 0, 0, 4, 8});
  // The rig rotates by a quarter turn to the left within two seconds.
  const float h = std::sqrt(0.5f);
  file.animate(0, "rotation", "LINEAR", {0, 2}, {0, 0, 0, 1, 0, h, 0, h});
  const GltfCameraPath path = file.sample(2);
  ASSERT_EQ(path.poses.size(), 5U);
  EXPECT_EQ(path.poses[1].time, 0.5);
  EXPECT_LT((path.poses[1].eye - Vec3(10, 2, 0)).norm(), 1e-6);
  EXPECT_LT((path.poses[4].eye - Vec3(18, 4, 0)).norm(), 1e-6);
  EXPECT_LT((path.poses[4].forward - Vec3(-1, 0, 0)).norm(), 1e-6);
  const double eighth = std::sqrt(0.5);
  EXPECT_LT((path.poses[2].forward - Vec3(-eighth, 0, -eighth)).norm(), 1e-6);
}

TEST(GltfCamera, StepKeysHoldAndTheFirstHoldsBeforeItself) {
  GltfFile file;
  file.animate(1, "translation", "STEP", {1, 2}, {1, 0, 0, 2, 0, 0});
  const GltfCameraPath path = file.sample(2);
  ASSERT_EQ(path.poses.size(), 5U);
  const std::vector<double> x{11, 11, 11, 11, 12};
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_EQ(path.poses[i].eye.x(), x[i]) << i;
}

TEST(GltfCamera, CubicSplinesFollowTheirTangents) {
  GltfFile file;
  // Cubic Hermite spline from 0 to 0 in two seconds, with the tangents 3 m/s and -3 m/s. At the
  // middle h10 * 2 * 3 + h11 * 2 * (-3) = (0.125 + 0.125) * 6.
  file.animate(1, "translation", "CUBICSPLINE", {0, 2},
               {0, 0, 0, 0, 0, 0, 0, 3, 0, 0, -3, 0, 0, 0, 0, 0, 0, 0});
  const GltfCameraPath path = file.sample(1);
  ASSERT_EQ(path.poses.size(), 3U);
  EXPECT_NEAR(path.poses[0].eye.y(), 0, 1e-12);
  EXPECT_NEAR(path.poses[1].eye.y(), 1.5, 1e-12);
  EXPECT_NEAR(path.poses[2].eye.y(), 0, 1e-12);
}

TEST(GltfCamera, TheNamedCameraIsUsedOtherwiseTheAnimatedOne) {
  GltfFile file;
  file.getJson()["nodes"].push_back({{"name", "still"}, {"camera", 0}});
  std::swap(file.getJson()["nodes"][1]["name"], file.getJson()["nodes"][2]["name"]);
  file.getJson()["scenes"][0]["nodes"].push_back(2);
  file.animate(2, "translation", "LINEAR", {0, 1}, {0, 0, 0, 1, 0, 0});
  EXPECT_EQ(file.sample(1).name, "cam");
  EXPECT_EQ(file.sample(1, "still").poses.size(), 1U);
  try {
    file.sample(1, "other");
    ADD_FAILURE() << "a camera that is not there";
  } catch (const ImportError& error) {
    EXPECT_NE(std::string(error.what()).find("still, cam"), std::string::npos) << error.what();
  }
}

TEST(GltfCamera, BrokenFilesAreErrors) {
  GltfFile none;
  none.getJson()["nodes"][1].erase("camera");
  EXPECT_THROW(none.sample(1), ImportError);
  GltfFile ring;
  ring.getJson()["nodes"][1]["children"] = {0};
  EXPECT_THROW(ring.sample(1), ImportError);
  GltfFile flat;
  flat.getJson()["nodes"][1]["scale"] = {0, 0, 0};
  EXPECT_THROW(flat.sample(1), ImportError);
  GltfFile orthographic;
  orthographic.getJson()["cameras"][0] = {{"type", "orthographic"}};
  EXPECT_THROW(orthographic.sample(1), ImportError);
  GltfFile shortOne;
  shortOne.animate(1, "translation", "LINEAR", {0, 1}, {0, 0, 0});
  EXPECT_THROW(shortOne.sample(1), ImportError);
  GltfFile back;
  back.animate(1, "translation", "LINEAR", {1, 0}, {0, 0, 0, 1, 1, 1});
  EXPECT_THROW(back.sample(1), ImportError);
  GltfFile beyond;
  beyond.animate(1, "translation", "LINEAR", {0, 1}, {0, 0, 0, 1, 1, 1});
  beyond.getJson()["accessors"][1]["count"] = 3;
  EXPECT_THROW(beyond.sample(1), ImportError);
  beyond.getJson()["accessors"][1]["count"] = std::uint64_t{1} << 62U;
  EXPECT_THROW(beyond.sample(1), ImportError);
  beyond.getJson()["accessors"][1]["count"] = 2;
  beyond.getJson()["bufferViews"][1]["byteOffset"] = 1000;
  EXPECT_THROW(beyond.sample(1), ImportError);
}

TEST(GltfCamera, SparseKeysReplaceTheirBase) {
  GltfFile file;
  file.animate(1, "translation", "LINEAR", {0, 1}, {0, 0, 0, 9, 9, 9});
  const std::size_t keys = file.getJson()["accessors"].size() - 1;
  file.add({std::bit_cast<float>(1u)}, "SCALAR", 1);  // the second key
  file.add({4, 5, 6}, "VEC3", 1);
  const std::size_t views = file.getJson()["bufferViews"].size();
  file.getJson()["accessors"][keys]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", views - 2}, {"componentType", 5125}}},
      {"values", {{"bufferView", views - 1}}}};
  const GltfCameraPath path = file.sample(1);
  EXPECT_EQ(path.poses.at(0).eye, Vec3(10, 0, 0));
  EXPECT_EQ(path.poses.at(1).eye, Vec3(14, 5, 6));
}

TEST(GltfCamera, AbsurdStridesAndRatesAreErrors) {
  GltfFile file;
  file.animate(1, "translation", "LINEAR", {0, 1}, {0, 0, 0, 1, 1, 1});
  EXPECT_THROW(file.sample(1e300), ImportError);
  file.getJson()["bufferViews"][1]["byteStride"] = std::uint64_t{1} << 31U;
  EXPECT_THROW(file.sample(1), ImportError);
}

}  // namespace
}  // namespace enfilade::scene
