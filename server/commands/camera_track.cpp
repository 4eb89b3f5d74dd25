#include "server/commands/camera_track.hpp"

#include <array>

#include "render/image/atomic_file.hpp"
#include "server/base/camera_rotation.hpp"
#include "server/export/glb_file.hpp"

namespace enfilade::server {
namespace {

/// Adds the times of a sampler, for which glTF requires bounds.
std::size_t addTimes(GlbFile& file, const std::vector<float>& times) {
  const std::size_t accessor = file.addFloats(times, "SCALAR", GlbTarget::other);
  file.root["accessors"][accessor]["min"] = {times.front()};
  file.root["accessors"][accessor]["max"] = {times.back()};
  return accessor;
}

void addChannel(GlbJson& animation, std::size_t input, std::size_t output, std::size_t node,
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
  GlbFile gltf;
  gltf.root["scene"] = 0;
  gltf.root["scenes"] = {{{"nodes", {0}}}};
  gltf.add("nodes", {{"name", "walk"},
                     {"translation", {offset.x(), offset.y(), offset.z()}},
                     {"children", GlbJson::array()}});
  GlbJson animation{
      {"name", "walk"}, {"samplers", GlbJson::array()}, {"channels", GlbJson::array()}};
  for (const CameraTrack& track : tracks) {
    const std::size_t camera =
        gltf.add("cameras", {{"name", track.name()},
                             {"type", "perspective"},
                             {"perspective", {{"yfov", fovY}, {"znear", 0.05}, {"zfar", 1000}}}});
    const std::size_t node = gltf.add("nodes", {{"name", track.name()}, {"camera", camera}});
    gltf.root["nodes"][0]["children"].push_back(node);
    const std::size_t times = addTimes(gltf, track.times_);
    addChannel(animation, times, gltf.addFloats(track.positions_, "VEC3", GlbTarget::other), node,
               "translation");
    addChannel(animation, times, gltf.addFloats(track.rotations_, "VEC4", GlbTarget::other), node,
               "rotation");
  }
  gltf.add("animations", std::move(animation));
  const std::vector<std::uint8_t> bytes = gltf.finish();
  render::writeFileAtomically(file, bytes.data(), bytes.size());
}

}  // namespace enfilade::server
