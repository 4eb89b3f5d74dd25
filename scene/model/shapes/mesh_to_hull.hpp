// Decides which surfaces of a placed shape collision replaces by their convex hull, and builds
// these hulls. All other surfaces stay triangles.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>

#include "collision/shapes/hull.hpp"
#include "collision/shapes/triangle_tree.hpp"
#include "scene/model/shapes/shape.hpp"

namespace enfilade::scene {

/// A shape, which must outlive this, and its placement. That keeps values finite; it may mirror and
/// flatten.
struct PlacedShape {
  const Shape& shape;
  Eigen::Affine3d worldFromMesh;

  /// Scene frame, metres. Same expression as computeWorldPosition(), so that results agree bit for
  /// bit.
  collision::Vec3 vertexPosition(std::uint32_t vertex) const {
    return worldFromMesh * shape.vertices[vertex].cast<double>();
  }
  collision::Triangle triangle(std::size_t t) const {
    const auto& corners = shape.triangles[t];
    return {vertexPosition(corners[0]), vertexPosition(corners[1]), vertexPosition(corners[2])};
  }
};

/// True if collision uses the hull of this shell.
bool isTreatedAsHull(const PlacedShape& placed, const Shell& shell);

/// Convex hull of all vertices of `shells`, relative to `origin` (scene frame, metres).
collision::Hull buildShellHull(const PlacedShape& placed, std::span<const Shell> shells,
                               const collision::Vec3& origin);

}  // namespace enfilade::scene
