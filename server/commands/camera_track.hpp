// Animated cameras as binary glTF: the avatars' views for other programs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "render/camera/camera.hpp"

namespace enfilade::server {

using collision::Vec3;

/// The camera of an avatar's eyes over time, as keys of a glTF animation.
class CameraTrack {
 public:
  explicit CameraTrack(std::string name) : name_(std::move(name)) {}

  /// Adds a key; times ascend. While a camera stands still, only the first and the last key are
  /// kept, because glTF interpolates linearly.
  void add(double time, const render::Camera& camera);
  const std::string& name() const { return name_; }

 private:
  friend void writeCameras(const std::filesystem::path&, const std::vector<CameraTrack>&,
                           const Vec3&, double);
  std::string name_;
  std::vector<float> times_;      ///< seconds
  std::vector<float> positions_;  ///< three per key; scene frame, metres
  std::vector<float> rotations_;  ///< four per key: x y z w; the camera looks along its -z
};

/// Writes a GLB file with one camera and one animated node per track, below a node at `offset`.
/// With the scene's offset, positions are those of the model file in metres, Y up. `fovY` in
/// radians. Throws std::runtime_error.
void writeCameras(const std::filesystem::path& file, const std::vector<CameraTrack>& tracks,
                  const Vec3& offset, double fovY);

}  // namespace enfilade::server
