// A triangle projected by a camera, in doubles. Its depth is a quotient of two functions that are
// affine in the pixel. So are its barycentric weights (Pineda 1988, "A parallel algorithm for
// polygon rasterization"): after the set-up, a pixel costs one division.
//
// For a ray o + z d and corners r0, r1, r2 with n = (r1 - r0) x (r2 - r0):
//   depth      z = n.(r0 - o) / n.d
//   weight i   w = d.((rj - o) x (rk - o)), up to a common factor
// o of a perspective camera and d of an orthographic camera are equal for all pixels.
#pragma once

#include <algorithm>
#include <array>

#include "render/raytrace/primary_rays.hpp"

namespace enfilade::render {

/// The function c + x * dx + y * dy of pixel (x, y).
struct Affine {
  double c = 0, dx = 0, dy = 0;

  double at(double x, double y) const { return c + x * dx + y * dy; }
};

/// Corners of a triangle: metres, world axes, relative to the eye.
using EyeSpaceCorners = std::array<Vec3, 3>;

/// Depth of a triangle's plane, metres along `forward`.
struct PlaneDepth {
  Affine numerator, denominator;  ///< depth = numerator / denominator
  /// Depth range of the triangle's corners, clamped to near..far. It bounds the depth if the plane
  /// is ill-conditioned because the triangle is seen edge on.
  double minDepth = 0, maxDepth = 0;

  double at(double x, double y) const {
    return clampDepth(numerator.at(x, y) / denominator.at(x, y));
  }
  double clampDepth(double z) const {
    z = z > minDepth ? z : minDepth;  // a NaN becomes minDepth
    return z < maxDepth ? z : maxDepth;
  }
};

PlaneDepth computePlaneDepth(const EyeSpaceCorners& corners, const PrimaryRays& rays);

/// Barycentric weights, to be divided by their sum. The sum is positive if the ray hits the side on
/// which the corners are clockwise, otherwise negative. Two triangles have the same values at a
/// common edge, up to the sign, so no ray passes between them.
struct BarycentricWeights {
  std::array<Affine, 3> corner;

  std::array<double, 3> at(double x, double y) const {
    return {corner[0].at(x, y), corner[1].at(x, y), corner[2].at(x, y)};
  }
};

BarycentricWeights computeWeights(const EyeSpaceCorners& corners, const PrimaryRays& rays);

}  // namespace enfilade::render
