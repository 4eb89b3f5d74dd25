#include "render/raytrace/projected_triangle.hpp"

namespace enfilade::render {
namespace {

/// The weight of the corner opposite to the edge from `a` to `b`.
Affine computeEdgeWeight(const Vec3& a, const Vec3& b, const PrimaryRays& rays) {
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

PlaneDepth computePlaneDepth(const EyeSpaceCorners& corners, const PrimaryRays& rays) {
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  PlaneDepth depth;
  depth.numerator = {normal.dot(corners[0] - rays.origin), -normal.dot(rays.originX),
                     -normal.dot(rays.originY)};
  depth.denominator = {normal.dot(rays.direction), normal.dot(rays.directionX),
                       normal.dot(rays.directionY)};
  const std::array<double, 3> z{rays.forward.dot(corners[0]), rays.forward.dot(corners[1]),
                                rays.forward.dot(corners[2])};
  depth.minDepth = std::clamp(std::min({z[0], z[1], z[2]}), rays.near, rays.far);
  depth.maxDepth = std::clamp(std::max({z[0], z[1], z[2]}), rays.near, rays.far);
  return depth;
}

BarycentricWeights computeWeights(const EyeSpaceCorners& corners, const PrimaryRays& rays) {
  return {{computeEdgeWeight(corners[1], corners[2], rays),
           computeEdgeWeight(corners[2], corners[0], rays),
           computeEdgeWeight(corners[0], corners[1], rays)}};
}

}  // namespace enfilade::render
