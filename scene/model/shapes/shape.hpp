// Shape: the triangles of an object, welded by position, cleaned and split into connected surfaces.
// Some of these are closed, and some of the closed ones bound convex solids.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/model/model.hpp"
#include "scene/model/shapes/shell.hpp"

namespace enfilade::scene {

/// In the meshes' frame and unit.
struct Shape {
  std::vector<Eigen::Vector3f> vertices;  ///< unique; each is used by a triangle
  /// The triangles of a surface are contiguous and have one winding (that of most of them).
  /// Counter-clockwise is the outside, unless the surface is `inward`.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Shell> shells;

  // Counts of repaired and remaining defects.
  std::uint32_t degenerate = 0;        ///< triangles with exactly collinear corners
  std::uint32_t duplicate = 0;         ///< triangles with the same corners as an earlier one
  std::uint32_t flippedTriangles = 0;  ///< triangles wound against the rest of their surface
  std::uint32_t boundaryEdges = 0;     ///< with one triangle
  std::uint32_t nonManifoldEdges = 0;  ///< with three or more
  std::uint32_t notTested = 0;         ///< closed surfaces too large for the convexity test

  std::size_t bytes() const {
    return vertices.capacity() * sizeof(vertices[0]) + triangles.capacity() * sizeof(triangles[0]) +
           shells.capacity() * sizeof(shells[0]);
  }
};

/// Builds the shape of the meshes that `meshIndices` lists, which share a frame. Indices are valid,
/// coordinates finite.
Shape buildShape(std::span<const Mesh> meshes, std::span<const std::uint32_t> meshIndices);

/// The vertices of these shells, unique and ascending.
std::vector<std::uint32_t> collectVertices(const Shape& shape, std::span<const Shell> shells);

/// True if the corners are not collinear, exactly.
bool hasExactArea(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

}  // namespace enfilade::scene
