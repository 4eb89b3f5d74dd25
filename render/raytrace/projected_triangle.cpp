#include "render/raytrace/projected_triangle.hpp"

namespace enfilade::render {
namespace {

/// The weight of the corner across the edge from `a` to `b`.
Affine weightAcross(const Vec3& a, const Vec3& b, const PixelRays& rays) {
  if (rays.parallel) {
    // d.((a - o) x (b - o)) = d.(a x b) + d.((b - a) x o)
    const Vec3 edge = b - a;
    return {rays.direction.dot((a - rays.origin).cross(b - rays.origin)),
            rays.direction.dot(edge.cross(rays.originX)),
            rays.direction.dot(edge.cross(rays.originY))};
  }
  const Vec3 normal = a.cross(b);
  return {normal.dot(rays.direction), normal.dot(rays.directionX), normal.dot(rays.directionY)};
}

}  // namespace

DepthOfPlane depthOf(const SeenCorners& corners, const PixelRays& rays) {
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  DepthOfPlane depth;
  depth.over = {normal.dot(corners[0] - rays.origin), -normal.dot(rays.originX),
                -normal.dot(rays.originY)};
  depth.under = {normal.dot(rays.direction), normal.dot(rays.directionX),
                 normal.dot(rays.directionY)};
  const std::array<double, 3> z{rays.forward.dot(corners[0]), rays.forward.dot(corners[1]),
                                rays.forward.dot(corners[2])};
  depth.nearest = std::clamp(std::min({z[0], z[1], z[2]}), rays.near, rays.far);
  depth.farthest = std::clamp(std::max({z[0], z[1], z[2]}), rays.near, rays.far);
  return depth;
}

Weights weightsOf(const SeenCorners& corners, const PixelRays& rays) {
  return {{weightAcross(corners[1], corners[2], rays), weightAcross(corners[2], corners[0], rays),
           weightAcross(corners[0], corners[1], rays)}};
}

}  // namespace enfilade::render
