#include "render/raytrace/primary_rays.hpp"

#include "render/camera/camera.hpp"

namespace enfilade::render {

PrimaryRays computePrimaryRays(const Camera& camera) {
  const CameraBasis basis = computeCameraBasis(camera);
  // NDC at the centre of the first pixel, and the step to the next pixel.
  const double stepX = 2.0 / camera.width, stepY = -2.0 / camera.height;
  const Vec3 aside = basis.right / basis.scaleX, above = basis.up / basis.scaleY;
  const Vec3 corner =
      (-1 + 0.5 * stepX - basis.shiftX) * aside + (1 + 0.5 * stepY - basis.shiftY) * above;
  const bool perspective = camera.projection == Camera::Projection::perspective;
  PrimaryRays rays{!perspective, camera.eye,    basis.forward,
                   camera.near,  camera.far,    perspective ? 0 : camera.near,
                   camera.width, camera.height, Vec3::Zero(),
                   Vec3::Zero(), Vec3::Zero(),  basis.forward,
                   Vec3::Zero(), Vec3::Zero()};
  (perspective ? rays.direction : rays.origin) += corner;
  (perspective ? rays.directionX : rays.originX) = stepX * aside;
  (perspective ? rays.directionY : rays.originY) = stepY * above;
  return rays;
}

}  // namespace enfilade::render
