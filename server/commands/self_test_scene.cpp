// The golden picture is encoded as text: 16 x 12 cells, each with the id at its centre (a digit)
// and its mean colour (two hexadecimal digits for red, green and blue).
#include "server/commands/self_test_scene.hpp"

#include <array>
#include <cmath>
#include <cstdio>

namespace enfilade::server {
namespace {

constexpr int kColumns = 16, kRows = 12;
constexpr std::size_t kCellLetters = 7;                     // per cell: id and colour
constexpr int kMaxColourError = 24;                         // of 255, per cell
constexpr double kMaxMeanColourError = 4;                   // of 255
constexpr int kMaxWrongIds = 4;                             // cells whose centre lies on an edge
constexpr double kWallDistance = 4, kMaxDepthError = 1e-3;  // metres, of the back wall

constexpr const char* kGolden =
    "0afbdcc0aebccb0adbccb0acbbcb0acbbcb0abbacb0abbacb0aabacb0aabacb0abbacb0abbacb0acbbcb"
    "0acbbcb0adbccb0aebccb0afbdcc0b5bdc30b5bdc30b6bdc40b6bdc40b6bec50b6bec50b6bec50b6bec5"
    "0b6bec50b6bec50b6bec50b6bec50b6bdc40b6bdc40b5bdc30b5bdc32bcbab42bebcb52bfbeb72c1bfb9"
    "2c2c0ba2c3c2bb2c4c2bc2c5c3bc2c5c3bc2c4c2bc2c3c2bb2c2c0ba2c1bfb92bfbeb72bebcb52bcbab4"
    "2bdbbb52bfbdb62c0beb82c2c0ba2c3c2bb2c5c3bc2c5c4bd2c6c4be2c6c4be2c5c4bd2c5c3bc2c3c2bb"
    "2c2c0ba2c0beb82bfbdb62bdbbb52bdbcb52bfbdb72c1bfb92c3c1ba2c4c2bc2c5c4bd2c6c5be2c7c5be"
    "2c7c5be2c6c5be2c5c4bd2c4c2bc2c3c1ba2c1bfb92bfbdb72bdbcb52bebcb52c0beb72c1c0b92c3c1bb"
    "2c5c3bc2c6c4bd2c7c5be2c8c6bf2bbc7b92a3c8ad2a3c7ac2a1c6ab2adc3af2c1c0b92c0beb72bebcb5"
    "2bebcb52bfbeb72c1bfb93c776733ca5b593cb5c5a2bd8e892c7c5be2b4c7b528cc8a227ac0a127bbfa1"
    "299c0aa2c1bfb92bfbeb72bebcb52bab8b22bcbab32bdbbb53c675723ca5b593ca5b592bb8c872c3c1ba"
    "2b0c4b2284c49f45cb2a145eb3a5484b7aa2bdbbb52bcbab32bab8b219a908119a8f811998e803b96863"
    "3c559573c659571a1736a19c9183191a087173b78d45bb1a045db2a4476a69619a908119a8f8119a9081"
    "1a194821a294831a3958319f7b6e19f73681a174691a0907f1a597851a19b861939d83462859945e849f"
    "478899319f92801a294831a194821a597851a698861a799871a698861a698861a799871a99b891a99b89"
    "1a99b891a89a881a395841a294831a597851a799871a698861a597851a89a881a99b891aa9c891ab9c8a"
    "1ab9d8b1ac9e8b1ac9e8c1ad9e8c1ad9e8c1ac9e8c1ac9e8b1ab9d8b1ab9c8a1aa9c891a99b891a89a88";

scene::Mesh makeCube() {
  scene::Mesh mesh;
  mesh.name = "cube";
  for (int i = 0; i < 8; ++i) {
    mesh.positions.emplace_back((i & 1) != 0 ? 0.5f : -0.5f, (i & 2) != 0 ? 0.5f : -0.5f,
                                (i & 4) != 0 ? 0.5f : -0.5f);
  }
  mesh.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  return mesh;
}

void addBox(scene::Model& model, const char* name, const collision::Vec3& centre,
            const collision::Vec3& size, const Eigen::Vector4f& colour) {
  scene::Material material;
  material.baseColour = colour;
  if (colour.w() < 1) material.alpha = scene::Material::Alpha::blend;
  scene::Mesh mesh = makeCube();
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
