// Cameras that move, as a binary glTF file: what avatars saw, for programs that know glTF.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "render/camera.hpp"

namespace enfilade::server {

using collision::Vec3;

/// An avatar's eyes over time, gathered as a glTF animation keeps them.
class CameraTrack {
 public:
  explicit CameraTrack(std::string name) : name_(std::move(name)) {}

  /// Ascending times. Where a camera does not move, all keys but the first and the last are left
  /// out: what is between two keys is the mean of them.
  void add(double time, const render::Camera& camera);
  const std::string& name() const { return name_; }

 private:
  friend void writeCameras(const std::filesystem::path&, const std::vector<CameraTrack>&,
                           const Vec3&, double);
  std::string name_;
  std::vector<float> times_;      ///< seconds
  std::vector<float> places_;     ///< three a key, scene frame, metres
  std::vector<float> rotations_;  ///< four a key: x y z w; the camera looks along its -z
};

/// A GLB file: one camera and one animated node a track, below a node at `offset` (the scene's, so
/// that places are the model file's, in metres and Y up). `fovY` in radians. Throws
/// std::runtime_error.
void writeCameras(const std::filesystem::path& file, const std::vector<CameraTrack>& tracks,
                  const Vec3& offset, double fovY);

}  // namespace enfilade::server
