#include "scene/physics/physics_body.hpp"

#include <algorithm>

#include "collision/shapes/hull.hpp"

namespace enfilade::scene {
namespace {

constexpr double kUp = 1 + 0x1p-48;  // above what sums of a few rounded products lose

/// Newell's: the sum of the fan's, unit.
Vec3 normalOfFace(const collision::Hull& hull, const std::vector<std::uint32_t>& face) {
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 1; i + 1 < face.size(); ++i)
    normal += (hull.vertices[face[i]] - hull.vertices[face[0]])
                  .cross(hull.vertices[face[i + 1]] - hull.vertices[face[0]]);
  return normal.normalized();
}

/// The parts, and a radius about the centre.
void addParts(std::span<const collision::Hull* const> hulls, Solid& solid) {
  for (const collision::Hull* hull : hulls) {
    solid.parts.push_back(partOfHull(*hull));
    for (const Vec3& v : hull->vertices)
      solid.radius = std::max(solid.radius, (v - solid.centreInFrame).norm() * kUp);
  }
}

}  // namespace

SolidPart partOfHull(const collision::Hull& hull) {
  SolidPart part{{hull.vertices, &hull}, {}};
  for (const auto& face : hull.faces) part.faceNormals.push_back(normalOfFace(hull, face));
  return part;
}

void placeSolid(Solid& solid) {
  solid.rotation = solid.motion.rotation.toRotationMatrix();
  solid.position = solid.motion.centre - solid.rotation * solid.centreInFrame;
}

Solid freeSolid(std::span<const collision::Hull* const> hulls, double density,
                const collision::Pose& worldFromFrame) {
  std::vector<MassProperties> masses;
  for (const collision::Hull* hull : hulls) masses.push_back(massOfHull(*hull, density));
  const MassProperties whole = together(masses);
  Solid solid;
  solid.motion = freeBody(whole, worldFromFrame);
  solid.centreInFrame = whole.centre;
  addParts(hulls, solid);
  placeSolid(solid);
  return solid;
}

Solid heldSolid(std::span<const collision::Hull* const> hulls,
                const collision::Pose& worldFromFrame) {
  Solid solid;
  solid.motion.rotation = worldFromFrame.rotation;
  solid.motion.centre = worldFromFrame.translation;
  addParts(hulls, solid);
  placeSolid(solid);
  return solid;
}

Solid stillSolid(const ObjectParts& parts) {
  Solid solid;
  solid.motion.centre = parts.origin;
  for (const collision::Hull& hull : parts.localHulls) {
    solid.parts.push_back(partOfHull(hull));
    solid.radius = std::max(solid.radius, hull.radius * kUp);
  }
  solid.mesh = &parts.localTriangles;
  for (const collision::Triangle& triangle : parts.localTriangles.triangles())
    for (const Vec3& corner : triangle) solid.radius = std::max(solid.radius, corner.norm() * kUp);
  placeSolid(solid);
  return solid;
}

}  // namespace enfilade::scene
