// The golden picture is encoded as text: 16 x 12 cells. Each has the id at its centre (a digit) and
// its mean colour (two hexadecimal digits for red, green and blue).
#include "server/commands/self_test_scene.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "scene/model/box_mesh.hpp"

namespace enfilade::server {
namespace {

constexpr int kColumns = 16, kRows = 12;
constexpr std::size_t kCellLetters = 7;                     // per cell: id and colour
constexpr int kMaxColourError = 24;                         // of 255, per cell
constexpr double kMaxMeanColourError = 4;                   // of 255
constexpr int kMaxWrongIds = 4;                             // cells whose centre lies on an edge
constexpr double kWallDistance = 4, kMaxDepthError = 1e-3;  // metres, of the back wall

constexpr const char* kGolden =
    "0c7d4e10c6d3e00c5d3e00c4d2e00c3d2e00c3d1e00c2d1e00c2d1e00c2d1e00c2d1e00c3d1e00c3d2e0"
    "0c4d2e00c5d3e00c6d3e00c7d4e10cdd4d90cdd4d90cdd4d90cdd4da0cdd4da0cdd4db0cdd5db0cdd5db"
    "0cdd5db0cdd5db0cdd4db0cdd4da0cdd4da0cdd4d90cdd4d90cdd4d92d3d2cb2d5d3cd2d6d4ce2d7d6d0"
    "2d9d7d12d9d8d22dad9d32dad9d32dad9d32dad9d32d9d8d22d9d7d12d7d6d02d6d4ce2d5d3cd2d3d2cb"
    "2d4d2cc2d5d4ce2d7d5cf2d8d7d12d9d8d22dad9d32dbdad42dcdad42dcdad42dbdad42dad9d32d9d8d2"
    "2d8d7d12d7d5cf2d5d4ce2d4d2cc2d4d3cc2d6d4ce2d7d6d02d9d7d12dad9d32dbdad42dcdad52dcdbd5"
    "2dcdbd52dcdad52dbdad42dad9d32d9d7d12d7d6d02d6d4ce2d4d3cc2d4d3cd2d6d4ce2d8d6d02d9d7d2"
    "2dad9d32dbdad42dcdad52dddbd62d0dccf2b7ddc42b7ddc32b5dcc12c2d9c62d8d6d02d6d4ce2d4d3cd"
    "2d4d3cd2d6d4ce2d8d6d03dd8a873df6e6b3e06e6c2d4a29d2dddbd62c9ddcc29fdcb928dd4b828ed4b8"
    "2add6c12d8d6d02d6d4ce2d4d3cd2d1d0c92d3d1cb2d4d3cd3dc89863df6d6b3df6e6c2d2a09c2d9d7d2"
    "2c6dac9298d8b746ec6b8470c8bc498ccc22d4d3cd2d3d1cb2d1cfc91b1a6971b2a7981b2a7983d27d77"
    "3dc6c693dc6c6a1b9897f1b5aa9a1a8b69e189cba546dc5b7470c7bb48cbdae1b2a7981b2a7981b1a697"
    "1baac991bbac9a1bbad9a1bb95871b5887c1b7897d1b4a4931beaf9d1b9b39d1acb69c4779bb247199b6"
    "48b9da61b9ab981bbac9a1baac991bdaf9c1beb09d1bfb19e1bfb19e1c0b29f1c0b29f1c1b3a01c2b3a0"
    "1c2b3a01c1b3a01beb09d1bbad9b1bbad9b1bfb09d1beb09d1bdaf9c1c0b29f1c1b3a01c2b4a11c3b5a2"
    "1c4b5a21c4b6a31c4b6a31c5b7a31c5b7a31c4b6a31c4b6a31c4b5a21c3b5a21c2b4a11c1b3a01c0b29f";

void addBox(scene::Model& model, const char* name, const collision::Vec3& centre,
            const collision::Vec3& size, const Eigen::Vector4f& colour) {
  const collision::Vec3 half = collision::Vec3::Constant(0.5);
  scene::Material material;
  material.baseColour = colour;
  if (colour.w() < 1) material.alpha = scene::Material::Alpha::blend;
  scene::Mesh mesh = scene::makeBoxMesh({-half, half});
  mesh.material = static_cast<std::uint32_t>(model.materials.size());
  scene::Object object;
  object.path = name;
  object.meshes = {static_cast<std::uint32_t>(model.meshes.size())};
  object.worldFromMesh.linear() = size.asDiagonal();
  object.worldFromMesh.translation() = centre;
  model.materials.push_back(material);
  model.meshes.push_back(std::move(mesh));
  model.objects.push_back(std::move(object));
}

/// Encodes the frame like the golden picture.
std::string encodeSelfTestFrame(const render::Frame& frame) {
  const int width = frame.camera.width / kColumns, height = frame.camera.height / kRows;
  std::string encoded;
  for (int cell = 0; cell < kColumns * kRows; ++cell) {
    const int left = cell % kColumns * width, top = cell / kColumns * height;
    std::array<long, 3> sum{};
    for (int y = top; y < top + height; ++y) {
      for (int x = left; x < left + width; ++x) {
        const auto pixel = static_cast<std::size_t>(y * frame.camera.width + x);
        for (std::size_t c = 0; c < 3; ++c) sum[c] += frame.rgb[3 * pixel + c];
      }
    }
    const auto middle =
        static_cast<std::size_t>((top + height / 2) * frame.camera.width + left + width / 2);
    const long pixels = static_cast<long>(width) * height;
    std::array<char, kCellLetters + 1> text{};
    std::snprintf(text.data(), text.size(), "%u%02lx%02lx%02lx", frame.ids[middle] % 10,
                  sum[0] / pixels, sum[1] / pixels, sum[2] / pixels);
    encoded += text.data();
  }
  return encoded;
}

int parseChannel(const std::string& encoded, std::size_t cell, std::size_t channel) {
  return std::stoi(encoded.substr(kCellLetters * cell + 1 + 2 * channel, 2), nullptr, 16);
}

std::string compareColours(const std::string& encoded, const std::string& golden) {
  double sum = 0;
  const std::size_t cells = golden.size() / kCellLetters;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const int difference =
          std::abs(parseChannel(encoded, cell, channel) - parseChannel(golden, cell, channel));
      if (difference > kMaxColourError)
        return "a colour is off by " + std::to_string(difference) + " of 255";
      sum += difference;
    }
  }
  const double mean = sum / (3 * static_cast<double>(cells));
  return mean > kMaxMeanColourError
             ? "colours are off by " + std::to_string(mean) + " of 255 on average"
             : "";
}

}  // namespace

std::shared_ptr<const scene::Scene> makeSelfTestScene() {
  scene::Model model;
  model.source = "self-test picture";
  addBox(model, "floor", {0, -1.1, -3}, {8, 0.2, 6}, {0.5f, 0.4f, 0.3f, 1});
  addBox(model, "wall", {0, 0.5, -4.5}, {8, 3, 1}, {0.8f, 0.8f, 0.75f, 1});
  addBox(model, "red", {-1, -0.5, -3}, {0.8, 1, 0.8}, {0.8f, 0.1f, 0.1f, 1});
  addBox(model, "blue", {0.9, -0.6, -2.6}, {0.6, 0.8, 0.6}, {0.1f, 0.2f, 0.8f, 1});
  addBox(model, "pane", {0.6, -0.3, -2}, {0.9, 0.9, 0.02}, {0.1f, 0.8f, 0.3f, 0.4f});
  return std::make_shared<const scene::Scene>(std::move(model));
}

render::Camera makeSelfTestCamera(int width, int height) {
  render::Camera camera;
  camera.forward = {0, 0, -1};
  camera.width = width;
  camera.height = height;
  return camera;
}

std::string validateSelfTestFrame(const render::Frame& frame) {
  const std::string encoded = encodeSelfTestFrame(frame), golden = kGolden;
  int wrongIds = 0;
  for (std::size_t letter = 0; letter < golden.size(); letter += kCellLetters)
    wrongIds += encoded[letter] == golden[letter] ? 0 : 1;
  if (wrongIds > kMaxWrongIds) return std::to_string(wrongIds) + " of 192 ids are wrong";
  const auto wall = static_cast<std::size_t>(frame.camera.height / 6 * frame.camera.width +
                                             frame.camera.width / 2);
  if (!(std::abs(frame.depth[wall] - kWallDistance) < kMaxDepthError))
    return "the depth of a wall at 4 m is " + std::to_string(frame.depth[wall]);
  return compareColours(encoded, golden);
}

}  // namespace enfilade::server
