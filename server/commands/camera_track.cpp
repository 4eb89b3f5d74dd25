#include "server/commands/camera_track.hpp"

#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "render/image/atomic_file.hpp"
#include "server/base/camera_rotation.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFloat = 5126;  // glTF 2.0, 3.6.2.2
constexpr std::uint32_t kGlb = 0x46546C67, kJson = 0x4E4F534A, kBinary = 0x004E4942;  // 4.4
constexpr std::size_t kMaxGlbBytes = 0xF0000000;  // lengths have 32 bits

void appendNumber(std::string& into, std::uint32_t number) {
  char bytes[4];
  std::memcpy(bytes, &number, sizeof bytes);  // x86-64 and glTF are little-endian
  into.append(bytes, sizeof bytes);
}

void appendChunk(std::string& into, std::uint32_t kind, std::string content, char filler) {
  content.resize((content.size() + 3) / 4 * 4, filler);
  appendNumber(into, static_cast<std::uint32_t>(content.size()));
  appendNumber(into, kind);
  into += content;
}

/// Appends the numbers to the buffer. Returns the index of their accessor.
std::size_t addAccessor(Json& file, std::string& buffer, const std::vector<float>& numbers,
                        std::size_t each, const char* type) {
  const std::size_t bytes = numbers.size() * sizeof(float);
  file["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes}});
  Json accessor{{"bufferView", file["bufferViews"].size() - 1},
                {"componentType", kFloat},
                {"count", numbers.size() / each},
                {"type", type}};
  if (each == 1) {
    accessor["min"] = {numbers.front()};
    accessor["max"] = {numbers.back()};
  }
  buffer.append(reinterpret_cast<const char*>(numbers.data()), bytes);
  file["accessors"].push_back(std::move(accessor));
  return file["accessors"].size() - 1;
}

void addChannel(Json& animation, std::size_t input, std::size_t output, std::size_t node,
                const char* path) {
  animation["samplers"].push_back(
      {{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
  animation["channels"].push_back({{"sampler", animation["samplers"].size() - 1},
                                   {"target", {{"node", node}, {"path", path}}}});
}

}  // namespace

void CameraTrack::add(double time, const render::Camera& camera) {
  std::array<double, 4> q = toQuaternion(computeCameraRotation(camera));
  // Keeps the sign continuous: interpolation with the opposite quaternion takes the long way round.
  if (!rotations_.empty()) {
    double product = 0;
    for (std::size_t i = 0; i < 4; ++i)
      product += q[i] * static_cast<double>(rotations_[rotations_.size() - 4 + i]);
    if (product < 0)
      for (double& part : q) part = -part;
  }
  std::array<float, 3> position{};
  std::array<float, 4> rotation{};
  for (std::size_t i = 0; i < 3; ++i)
    position[i] = static_cast<float>(camera.eye[static_cast<int>(i)]);
  for (std::size_t i = 0; i < 4; ++i) rotation[i] = static_cast<float>(q[i]);
  const auto sameAs = [&](std::size_t keysAgo) {
    return times_.size() >= keysAgo &&
           std::equal(position.begin(), position.end(),
                      positions_.end() - 3 * static_cast<std::ptrdiff_t>(keysAgo)) &&
           std::equal(rotation.begin(), rotation.end(),
                      rotations_.end() - 4 * static_cast<std::ptrdiff_t>(keysAgo));
  };
  if (sameAs(1) && sameAs(2)) {
    times_.back() = static_cast<float>(time);
    return;
  }
  times_.push_back(static_cast<float>(time));
  positions_.insert(positions_.end(), position.begin(), position.end());
  rotations_.insert(rotations_.end(), rotation.begin(), rotation.end());
}

void writeCameras(const std::filesystem::path& file, const std::vector<CameraTrack>& tracks,
                  const Vec3& offset, double fovY) {
  Json gltf{{"asset", {{"version", "2.0"}, {"generator", "enfilade"}}},
            {"scene", 0},
            {"scenes", {{{"nodes", {0}}}}},
            {"nodes", Json::array()}};
  gltf["nodes"].push_back({{"name", "walk"},
                           {"translation", {offset.x(), offset.y(), offset.z()}},
                           {"children", Json::array()}});
  std::string buffer;
  Json animation{{"name", "walk"}, {"samplers", Json::array()}, {"channels", Json::array()}};
  for (const CameraTrack& track : tracks) {
    const std::size_t node = gltf["nodes"].size();
    gltf["nodes"][0]["children"].push_back(node);
    gltf["cameras"].push_back({{"name", track.name()},
                               {"type", "perspective"},
                               {"perspective", {{"yfov", fovY}, {"znear", 0.05}, {"zfar", 1000}}}});
    gltf["nodes"].push_back({{"name", track.name()}, {"camera", gltf["cameras"].size() - 1}});
    const std::size_t times = addAccessor(gltf, buffer, track.times_, 1, "SCALAR");
    addChannel(animation, times, addAccessor(gltf, buffer, track.positions_, 3, "VEC3"), node,
               "translation");
    addChannel(animation, times, addAccessor(gltf, buffer, track.rotations_, 4, "VEC4"), node,
               "rotation");
    if (buffer.size() > kMaxGlbBytes)
      throw std::runtime_error(file.string() + ": the walk is too long for a glTF file");
  }
  gltf["buffers"] = {{{"byteLength", buffer.size()}}};
  gltf["animations"] = {std::move(animation)};
  std::string chunks, whole;
  appendChunk(chunks, kJson, gltf.dump(), ' ');
  appendChunk(chunks, kBinary, std::move(buffer), '\0');
  appendNumber(whole, kGlb);
  appendNumber(whole, 2);
  appendNumber(whole, static_cast<std::uint32_t>(chunks.size() + 12));
  whole += chunks;
  render::writeFileAtomically(file, whole);
}

}  // namespace enfilade::server
