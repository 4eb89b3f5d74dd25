#include "server/base/camera_rotation.hpp"

#include "render/camera/camera.hpp"

namespace enfilade::server {

Mat3 toRotation(const std::array<double, 4>& xyzw) {
  return Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).normalized().toRotationMatrix();
}

std::array<double, 4> toQuaternion(const Mat3& rotation) {
  Eigen::Quaterniond q(rotation);
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return {q.x(), q.y(), q.z(), q.w()};
}

Mat3 computeCameraRotation(const render::Camera& camera) {
  const render::CameraBasis view = render::computeCameraBasis(camera);
  Mat3 rotation;
  rotation << view.right, view.up, -view.forward;
  return rotation;
}

Mat3 convertAxes(const Mat3& rotation, CameraAxes from, CameraAxes to) {
  if (from == to) return rotation;
  Mat3 other = rotation;
  other.col(1) = -rotation.col(1);
  other.col(2) = -rotation.col(2);
  return other;
}

}  // namespace enfilade::server
