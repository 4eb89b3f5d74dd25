// Rotations of cameras, as matrices and quaternions, in two conventions of axes.
#pragma once

#include <array>
#include <cstdint>

#include "render/camera/camera.hpp"

namespace enfilade::server {

using collision::Mat3;

/// Axes of a camera.
enum class CameraAxes : std::uint8_t {
  opengl,  ///< x to the right, y up, looks along -z (nerfstudio, Blender, glTF)
  opencv   ///< x to the right, y down, looks along +z (TUM's own files, COLMAP, ROS)
};

/// Converts between unit quaternions `x y z w` and rotations.
Mat3 toRotation(const std::array<double, 4>& xyzw);
std::array<double, 4> toQuaternion(const Mat3& rotation);

/// worldFromCamera rotation of a camera, axes as CameraAxes::opengl.
Mat3 computeCameraRotation(const render::Camera& camera);

/// Converts a camera rotation between axis conventions.
Mat3 convertAxes(const Mat3& rotation, CameraAxes from, CameraAxes to);

}  // namespace enfilade::server
