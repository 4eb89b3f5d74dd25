// Where the pictures of a capture are taken from: a camera path, read from a file of poses.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "render/camera.hpp"

namespace enfilade::server {

using collision::Mat3;
using collision::Vec3;

/// Says the file, the line or element, the value, and what to do.
struct CameraPathError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// How a file's rotations take a camera's axes: which way a picture's right, up and depth go.
enum class CameraAxes : std::uint8_t {
  opengl,  ///< x to the right, y up, looks along -z (nerfstudio, Blender, glTF)
  opencv   ///< x to the right, y down, looks along +z (TUM's own files, COLMAP, ROS)
};

/// What a file says about the pictures taken along it.
struct PathLens {
  int width = 0, height = 0;  ///< pixels, at least 1
  render::Pinhole pinhole;    ///< in pixels of that size
};

struct CameraPose {
  double time = 0;                 ///< seconds
  Vec3 eye = Vec3::Zero();         ///< scene frame, metres
  Mat3 turned = Mat3::Identity();  ///< worldFromCamera: a rotation, axes as CameraAxes::opengl
  std::optional<double> fovY = std::nullopt;    ///< radians, where the file says so for this pose
  std::optional<PathLens> lens = std::nullopt;  ///< the same; before the path's
};

struct CameraPath {
  std::vector<CameraPose> poses;  ///< at least one, times ascending
  std::optional<PathLens> lens;
  std::optional<double> fovX;  ///< radians, where the file tells an opening and no size
};

/// Lines `t tx ty tz qx qy qz qw`, as the TUM RGB-D benchmark has them; blank lines and what
/// follows a '#' are skipped. Times ascend. `source` names the text in errors. Throws
/// CameraPathError.
CameraPath parseTumPath(std::string_view text, const std::string& source, CameraAxes axes);

/// A list of poses, or an object with `frames` (nerfstudio's transforms.json); CAPTURE.md has both.
/// Poses without a time are `fps` a second. Throws CameraPathError.
CameraPath parseJsonPath(std::string_view text, const std::string& source, CameraAxes axes,
                         double fps);

/// A rotation's quaternion, and the other way round; `x y z w` in this order, unit length.
Mat3 rotationOf(const std::array<double, 4>& xyzw);
std::array<double, 4> quaternionOf(const Mat3& rotation);

/// worldFromCamera of a camera, axes as CameraAxes::opengl.
Mat3 turnedOf(const render::Camera& camera);

/// The same camera with the other axes.
Mat3 withAxes(const Mat3& turned, CameraAxes from, CameraAxes to);

}  // namespace enfilade::server
