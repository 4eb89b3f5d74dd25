// A triangle as a camera sees it, in doubles. Over the picture its depth is a quotient of two
// functions that are affine in the pixel, and so are its barycentric weights (Pineda 1988, "A
// parallel algorithm for polygon rasterization"): after the set-up a pixel costs a division.
//
// For a ray o + z d and corners r0, r1, r2 with n = (r1 - r0) x (r2 - r0):
//   depth      z = n.(r0 - o) / n.d
//   weight i   w = d.((rj - o) x (rk - o)), up to one factor for all three
// A perspective camera's o and a parallel camera's d are the same for all pixels.
#pragma once

#include <algorithm>
#include <array>

#include "render/raytrace/primary_rays.hpp"

namespace enfilade::render {

/// c + x * dx + y * dy at pixel (x, y).
struct Affine {
  double c = 0, dx = 0, dy = 0;

  double at(double x, double y) const { return c + x * dx + y * dy; }
};

/// Metres, world axes, relative to the eye.
using SeenCorners = std::array<Vec3, 3>;

/// Metres along `forward`.
struct DepthOfPlane {
  Affine over, under;  ///< depth = over / under
  /// Of the triangle's corners, within near and far: nothing of the triangle that is in the picture
  /// lies outside, however badly its plane is known where it is seen edge on.
  double nearest = 0, farthest = 0;

  double at(double x, double y) const { return bounded(over.at(x, y) / under.at(x, y)); }
  double bounded(double z) const {
    z = z > nearest ? z : nearest;  // so that a NaN becomes `nearest`
    return z < farthest ? z : farthest;
  }
};

DepthOfPlane depthOf(const SeenCorners& corners, const PixelRays& rays);

/// Of the three corners; they are divided by their sum to be barycentric. The sum is positive where
/// the ray meets the plane from the side on which the corners run clockwise, and negative on the
/// other. A common edge of two triangles has the same numbers in both, up to the sign: no ray gets
/// between them.
struct Weights {
  std::array<Affine, 3> corner;

  std::array<double, 3> at(double x, double y) const {
    return {corner[0].at(x, y), corner[1].at(x, y), corner[2].at(x, y)};
  }
};

Weights weightsOf(const SeenCorners& corners, const PixelRays& rays);

}  // namespace enfilade::render
