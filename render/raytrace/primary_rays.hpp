// The rays of a camera, one through the centre of each pixel, in doubles.
#pragma once

#include "render/camera.hpp"

namespace enfilade::render {

/// Pixel (x, y), row 0 on top, sees the points originAt(x, y) + z * directionAt(x, y), where z is
/// its depth: directions have length 1 along `forward`. Metres, world axes, relative to the eye.
struct PixelRays {
  bool parallel;  ///< of an orthographic camera
  Vec3 eye;       ///< world
  Vec3 forward;
  double near, far;
  /// Depth at which Embree's rays begin, which must not be behind them: 0, or of parallel rays
  /// near.
  double start;
  int width, height;
  Vec3 origin, originX, originY;  ///< of pixel (0, 0), and what a pixel to the right or down adds
  Vec3 direction, directionX, directionY;

  Vec3 originAt(double x, double y) const { return origin + x * originX + y * originY; }
  /// Where Embree's ray begins: relative to the eye as well.
  Vec3 startAt(double x, double y) const { return originAt(x, y) + start * forward; }
  Vec3 directionAt(double x, double y) const { return direction + x * directionX + y * directionY; }
};

/// Of a camera that refusal() lets pass.
PixelRays pixelRaysOf(const Camera& camera);

}  // namespace enfilade::render
