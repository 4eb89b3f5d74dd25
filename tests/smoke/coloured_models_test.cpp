// Two squares, one red and one grey by the colours of their vertices, as PLY, OBJ and glTF. Both
// renderers show each colour as they show a material of that colour.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <memory>

#include "render/gl/gl_renderer.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "scene/import/import_model.hpp"
#include "scene/model/srgb.hpp"
#include "tests/scene/hand_made_files.hpp"

namespace enfilade {
namespace {

using ScenePtr = std::shared_ptr<const scene::Scene>;

constexpr int kGrey = 128;  // sRGB
// Squares of 1 m, 2 m ahead of the camera: the left one red, the right one grey.
constexpr std::array<std::array<float, 3>, 8> kCorners{{{-1, -0.5f, -2},
                                                        {0, -0.5f, -2},
                                                        {0, 0.5f, -2},
                                                        {-1, 0.5f, -2},
                                                        {0, -0.5f, -2},
                                                        {1, -0.5f, -2},
                                                        {1, 0.5f, -2},
                                                        {0, 0.5f, -2}}};

std::string makePly() {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
      "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t i = 0; i < 8; ++i) {
    for (const float c : kCorners[i]) text += std::to_string(c) + " ";
    text += i < 4 ? "255 0 0\n" : "128 128 128\n";
  }
  return text + "4 0 1 2 3\n4 4 5 6 7\n";
}

std::string makeObj() {
  std::string text;
  for (std::size_t i = 0; i < 8; ++i) {
    text += "v";
    for (const float c : kCorners[i]) text += " " + std::to_string(c);
    text += i < 4 ? " 1 0 0\n" : " 0.50196 0.50196 0.50196\n";
  }
  return text + "f 1 2 3 4\nf 5 6 7 8\n";
}

/// COLOR_0 is linear, in normalised 16 bits.
std::string makeGltf() {
  const auto grey = static_cast<std::uint16_t>(
      std::lround(65535 * scene::srgbToLinear(static_cast<float>(kGrey) / 255)));
  std::string bytes(8 * 12 + 8 * 8 + 12 * 2, '\0');
  std::memcpy(bytes.data(), kCorners.data(), 8 * 12);
  for (std::size_t i = 0; i < 8; ++i) {
    const std::array<std::uint16_t, 4> colour =
        i < 4 ? std::array<std::uint16_t, 4>{65535, 0, 0, 65535}
              : std::array<std::uint16_t, 4>{grey, grey, grey, 65535};
    std::memcpy(bytes.data() + 96 + 8 * i, colour.data(), 8);
  }
  const std::array<std::uint16_t, 12> indices{0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
  std::memcpy(bytes.data() + 160, indices.data(), 24);
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0,"name":"squares"}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1},"indices":2,"material":0}]}],
"materials":[{"pbrMetallicRoughness":{"metallicFactor":0}}],
"accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[-1,-0.5,-2],
"max":[1,0.5,-2]},{"bufferView":1,"componentType":5123,"count":8,"type":"VEC4","normalized":true},
{"bufferView":2,"componentType":5123,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":96},
{"buffer":0,"byteOffset":96,"byteLength":64},{"buffer":0,"byteOffset":160,"byteLength":24}],
"buffers":[{"byteLength":184,"uri":"data:application/octet-stream;base64,)" +
         tests::encodeBase64(bytes) + R"("}]})";
}

ScenePtr importColoured(const std::string& name, const std::string& text) {
  const tests::TemporaryFolder folder;
  scene::ImportOptions options;
  options.up = scene::UpAxis::y;
  return std::make_shared<const scene::Scene>(
      scene::importModel(folder.write(name, text), options));
}

/// The squares with a material each.
ScenePtr makeWanted() {
  const float grey = scene::srgbToLinear(static_cast<float>(kGrey) / 255);
  scene::Model model;
  model.objects.resize(1);
  for (std::uint32_t square = 0; square < 2; ++square) {
    scene::Mesh mesh;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& c = kCorners[4 * square + i];
      mesh.positions.emplace_back(c[0], c[1], c[2]);
    }
    mesh.indices = {0, 1, 2, 0, 2, 3};
    mesh.material = square;
    model.meshes.push_back(mesh);
    model.materials.emplace_back().baseColour =
        square == 0 ? Eigen::Vector4f(1, 0, 0, 1) : Eigen::Vector4f(grey, grey, grey, 1);
    model.objects[0].meshes.push_back(square);
  }
  return std::make_shared<const scene::Scene>(std::move(model));
}

std::unique_ptr<render::Renderer> makeRenderer(const ScenePtr& scene, bool gl) {
  if (gl) return std::make_unique<render::GlRenderer>(scene);
  return std::make_unique<render::RayRenderer>(scene);
}

class ColouredModels : public ::testing::TestWithParam<bool> {};

TEST_P(ColouredModels, AreDrawnInTheColoursOfTheirVertices) {
  render::Camera camera;
  camera.forward = -scene::Vec3::UnitZ();
  camera.width = camera.height = 100;
  const render::Frame wanted = makeRenderer(makeWanted(), GetParam())->render({}, camera);
  const auto pixel = [](const render::Frame& frame, int x) {
    return &frame.rgb[3 * (50 * 100 + x)];
  };
  ASSERT_GT(pixel(wanted, 35)[0], pixel(wanted, 35)[1] + 100) << "red";
  ASSERT_EQ(pixel(wanted, 65)[0] > 60 && pixel(wanted, 65)[0] < 250, true) << "grey";
  for (const auto& [name, text] : {std::pair{"a.ply", makePly()}, std::pair{"a.obj", makeObj()},
                                   std::pair{"a.gltf", makeGltf()}}) {
    SCOPED_TRACE(name);
    const render::Frame frame =
        makeRenderer(importColoured(name, text), GetParam())->render({}, camera);
    for (const int x : {30, 40, 60, 70})
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel(frame, x)[c], pixel(wanted, x)[c], 1) << x << c;
  }
}

TEST_P(ColouredModels, AreCutOutWhereTheAlphaOfTheirVerticesIsLow) {
  // A square whose left corners are opaque and right corners clear: cut at the middle, x = 0.
  scene::Model model;
  scene::Mesh mesh;
  mesh.positions = {{-1, -1, -2}, {1, -1, -2}, {1, 1, -2}, {-1, 1, -2}};
  mesh.colours = {
      {255, 255, 255, 255}, {255, 255, 255, 0}, {255, 255, 255, 0}, {255, 255, 255, 255}};
  mesh.indices = {0, 1, 2, 0, 2, 3};
  model.meshes = {mesh};
  model.materials.resize(1);
  model.materials[0].alpha = scene::Material::Alpha::mask;
  model.objects.resize(1);
  model.objects[0].meshes = {0};
  const auto scene = std::make_shared<const scene::Scene>(std::move(model));
  render::Camera camera;
  camera.forward = -scene::Vec3::UnitZ();
  camera.width = camera.height = 100;
  const render::Frame frame = makeRenderer(scene, GetParam())->render({}, camera);
  const auto idAt = [&](int x) { return frame.ids[static_cast<std::size_t>(50 * 100 + x)]; };
  for (const int x : {40, 47}) EXPECT_EQ(idAt(x), 1u) << x;
  for (const int x : {53, 60}) EXPECT_EQ(idAt(x), 0u) << x;
}

INSTANTIATE_TEST_SUITE_P(BothRenderers, ColouredModels, ::testing::Bool(),
                         [](const auto& renderer) { return renderer.param ? "Gl" : "Ray"; });

}  // namespace
}  // namespace enfilade
