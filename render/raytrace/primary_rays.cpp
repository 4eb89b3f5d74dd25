#include "render/raytrace/primary_rays.hpp"

#include "render/camera_basis.hpp"

namespace enfilade::render {

PixelRays pixelRaysOf(const Camera& camera) {
  const View view = viewOf(camera);
  // The picture's -1..1 at the middle of the first pixel, and the step to the next.
  const double stepX = 2.0 / camera.width, stepY = -2.0 / camera.height;
  const Vec3 aside = view.right / view.scaleX, above = view.up / view.scaleY;
  const Vec3 corner =
      (-1 + 0.5 * stepX - view.shiftX) * aside + (1 + 0.5 * stepY - view.shiftY) * above;
  const bool perspective = camera.projection == Camera::Projection::perspective;
  PixelRays rays{!perspective, camera.eye,    view.forward,
                 camera.near,  camera.far,    perspective ? 0 : camera.near,
                 camera.width, camera.height, Vec3::Zero(),
                 Vec3::Zero(), Vec3::Zero(),  view.forward,
                 Vec3::Zero(), Vec3::Zero()};
  (perspective ? rays.direction : rays.origin) += corner;
  (perspective ? rays.directionX : rays.originX) = stepX * aside;
  (perspective ? rays.directionY : rays.originY) = stepY * above;
  return rays;
}

}  // namespace enfilade::render
