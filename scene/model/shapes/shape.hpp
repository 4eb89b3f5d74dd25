// What the triangles of an object are as a body: welded by position, cleaned, and split into
// connected surfaces, of which some are closed and some of those bound convex solids.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// A surface: triangles joined by edges that exactly two of them share.
struct Shell {
  enum class Kind : std::uint8_t {
    open,    ///< an edge with one triangle, or with three and more, or one-sided as a Möbius strip
    closed,  ///< each edge has two triangles; it bounds a solid that is not convex
    convex,  ///< closed; every triangle lies exactly in a face of the hull of the vertices
    rounded,  ///< closed; as convex, up to the rounding of the coordinates (convex_surface.hpp)
  };
  Kind kind = Kind::open;
  bool inward = false;      ///< closed: its faces look into what it encloses
  bool hollow = false;      ///< closed and outward: another surface looks into its inside, a cavity
  std::uint32_t first = 0;  ///< into Shape::triangles
  std::uint32_t count = 0;  ///< at least 1

  bool bounds() const { return kind != Kind::open; }
  bool isConvex() const { return kind == Kind::convex || kind == Kind::rounded; }
};

/// In the meshes' frame and unit.
struct Shape {
  std::vector<Eigen::Vector3f> vertices;  ///< no two equal; each used by a triangle
  /// Those of one surface are neighbours in the list, wound alike (as most of them were).
  /// Counter-clockwise is outside, unless the surface is `inward`.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Shell> shells;

  // What was left out or mended.
  std::uint32_t degenerate = 0;     ///< triangles whose corners lie on one line, exactly
  std::uint32_t duplicate = 0;      ///< triangles with the same corners as an earlier one
  std::uint32_t rewound = 0;        ///< triangles that were wound against their surface
  std::uint32_t boundaryEdges = 0;  ///< with one triangle
  std::uint32_t crowdedEdges = 0;   ///< with three or more
  std::uint32_t untried = 0;        ///< closed surfaces too large for the test of convexity

  std::size_t bytes() const {
    return vertices.capacity() * sizeof(vertices[0]) + triangles.capacity() * sizeof(triangles[0]) +
           shells.capacity() * sizeof(shells[0]);
  }
};

/// The shape of those of the meshes that `which` lists, which share a frame. Indices are valid,
/// coordinates finite.
Shape shapeOf(std::span<const Mesh> meshes, std::span<const std::uint32_t> which);

/// The vertices of these surfaces of the shape, each once, ascending.
std::vector<std::uint32_t> verticesOf(const Shape& shape, std::span<const Shell> shells);

/// Whether a triangle has an area: its corners lie on no line, exactly.
bool hasArea(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

}  // namespace enfilade::scene
