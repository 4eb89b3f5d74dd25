// The primary rays of a camera, one through the centre of each pixel, in doubles.
#pragma once

#include "render/camera/camera.hpp"

namespace enfilade::render {

/// The ray of pixel (x, y), row 0 on top, is originAt(x, y) + z * directionAt(x, y). z is the
/// depth, because directions have length 1 along `forward`. Metres, world axes, relative to the
/// eye.
struct PrimaryRays {
  bool parallel;  ///< orthographic camera
  Vec3 eye;       ///< world
  Vec3 forward;
  double near, far;
  /// Depth at which Embree's rays start: 0; parallel rays: near, because their tnear must be >= 0.
  double start;
  int width, height;
  Vec3 origin, originX, originY;  ///< of pixel (0, 0), and steps to the right and down
  Vec3 direction, directionX, directionY;

  Vec3 originAt(double x, double y) const { return origin + x * originX + y * originY; }
  /// Start of Embree's ray, relative to the eye.
  Vec3 startAt(double x, double y) const { return originAt(x, y) + start * forward; }
  Vec3 directionAt(double x, double y) const { return direction + x * directionX + y * directionY; }
  std::size_t pixelIndex(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
};

/// `camera` must satisfy validateCamera().
PrimaryRays computePrimaryRays(const Camera& camera);

}  // namespace enfilade::render
