#include "scene/physics/physics_body.hpp"

#include <algorithm>

#include "collision/assert.hpp"
#include "collision/shapes/hull.hpp"

namespace enfilade::scene {
namespace {

constexpr double kRadiusRoundUpFactor =
    1 + 0x1p-48;  // exceeds the rounding error of sums of a few products

/// Newell's method: the normalised sum over the triangle fan.
Vec3 computeFaceNormal(const collision::Hull& hull, const std::vector<std::uint32_t>& face) {
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 1; i + 1 < face.size(); ++i)
    normal += (hull.vertices[face[i]] - hull.vertices[face[0]])
                  .cross(hull.vertices[face[i + 1]] - hull.vertices[face[0]]);
  return normal.normalized();
}

}  // namespace

ConvexPart makeConvexPart(const collision::Hull& hull) {
  ConvexPart part{{hull.vertices, &hull}, {}};
  for (const auto& face : hull.faces) part.faceNormals.push_back(computeFaceNormal(hull, face));
  return part;
}

void updateTransform(PhysicsBody& body) {
  ENFILADE_ASSERT(!(std::abs(body.motion.rotation.squaredNorm() - 1) > 1e-6));
  const auto [rotation, position] =
      collision::placeFrame({body.motion.centre, body.motion.rotation}, body.centreInFrame);
  body.rotation = rotation, body.position = position;
}

collision::InterpolatedMotion makeStationaryMotion(const PhysicsBody& body) {
  collision::InterpolatedMotion motion;
  motion.from = motion.to = {body.motion.centre, body.motion.rotation};
  motion.radius = body.radius;
  motion.centreInFrame = body.centreInFrame;
  motion.isStationary = true;
  motion.fromFrame = motion.toFrame = {body.rotation, body.position};
  return motion;
}

PhysicsBody makeStaticBody(const CollisionGeometry& parts) {
  PhysicsBody body;
  body.motion.centre = parts.origin;
  for (const collision::Hull& hull : parts.localHulls) {
    body.parts.push_back(makeConvexPart(hull));
    body.radius = std::max(body.radius, hull.radius * kRadiusRoundUpFactor);
  }
  body.mesh = &parts.localTriangles;
  for (const collision::Triangle& triangle : parts.localTriangles.triangles())
    for (const Vec3& corner : triangle)
      body.radius = std::max(body.radius, corner.norm() * kRadiusRoundUpFactor);
  updateTransform(body);
  return body;
}

}  // namespace enfilade::scene
