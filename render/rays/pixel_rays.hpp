// The rays of a camera, one through the centre of each pixel, in doubles.
#pragma once

#include "render/camera.hpp"

namespace enfilade::render {

/// Pixel (x, y), row 0 on top, sees the points originAt(x, y) + z * directionAt(x, y), where z is
/// its depth: directions have length 1 along `forward`. Metres, world axes, relative to the eye.
struct PixelRays {
  Vec3 eye;  ///< world
  Vec3 forward;
  double near, far;
  int width, height;
  Vec3 origin, originX, originY;  ///< of pixel (0, 0), and what a pixel to the right or down adds
  Vec3 direction, directionX, directionY;

  Vec3 originAt(double x, double y) const { return origin + x * originX + y * originY; }
  Vec3 directionAt(double x, double y) const { return direction + x * directionX + y * directionY; }
  bool parallel() const { return directionX.isZero(0) && directionY.isZero(0); }
};

/// Of a camera that refusal() lets pass.
PixelRays pixelRaysOf(const Camera& camera);

}  // namespace enfilade::render
