// Camera paths: the poses of a capture's frames.
#pragma once

#include <cstddef>
#include <optional>
#include <stdexcept>
#include <vector>

#include "server/base/camera_rotation.hpp"

namespace enfilade::server {

using collision::Vec3;

inline constexpr double kMaxEyeCoordinate = 1e9;  ///< metres, limit of render/camera/camera.cpp
inline constexpr std::size_t kMaxPoses = 10'000'000;

/// An invalid camera path. The text has the file, the line or element, the value and a remedy.
struct CameraPathError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Picture size and pinhole of a path file.
struct PathLens {
  int width = 0, height = 0;  ///< pixels, at least 1
  render::Pinhole pinhole;    ///< in pixels of this size
};

struct CameraPose {
  double time = 0;                   ///< seconds
  Vec3 eye = Vec3::Zero();           ///< scene frame, metres
  Mat3 rotation = Mat3::Identity();  ///< worldFromCamera: a rotation, axes as CameraAxes::opengl
  std::optional<double> fovY = std::nullopt;    ///< radians, if the file has one for this pose
  std::optional<PathLens> lens = std::nullopt;  ///< of this pose; overrides the path's
};

struct CameraPath {
  std::vector<CameraPose> poses;  ///< at least one, times ascending
  std::optional<PathLens> lens;
  std::optional<double> fovX;  ///< radians, if the file has an angle without a size
};

}  // namespace enfilade::server
