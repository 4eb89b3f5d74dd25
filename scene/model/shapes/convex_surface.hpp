// Whether a closed surface bounds a convex solid, so that collision may take the hull of its
// vertices for it.
//
// H is the hull of the surface's vertices. The rule has two levels:
//
// - `convex`: each triangle lies in one face of H, by exact orientation tests, and all look the
// same
//   way out of it. A closed surface in the boundary of H is that boundary, so that H is exactly the
//   solid.
// - `rounded`: floats cannot hold a turned box, whose quads are bent by the rounding of their
//   corners. Each triangle's corners lie within d below the plane of one face of H, where
//   d = 6 (|n_x| h_x + |n_y| h_y + |n_z| h_z), n is the face's unit normal and h_i half a unit of
//   rounding of the greatest coordinate on axis i; and the surface encloses more than half of H's
//   volume. Then no point of the surface is farther than d from H's boundary (out along n it leaves
//   H), and the solid and H differ by no more than d. Every body whose faces were plane before its
//   coordinates were rounded passes: rounding moves a corner by e = d/6 along n at most, so
//   that at the triangle's centroid H's face lies within e of the plane, at its corners not below
//   -e, so at most 5e above it, and 6e above what is stored there.
//
// H holds the surface in either case: who is clear of H is clear of every triangle.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "scene/model/shapes/shape.hpp"

namespace enfilade::scene {

struct ConvexityVerdict {
  Shell::Kind kind = Shell::Kind::closed;  ///< closed, convex or rounded
  bool inward = false;                     ///< the triangles look into the solid
  bool untried = false;  ///< the tests would take too many steps; it is told as closed
};

/// `triangles` are those of one closed shell, wound alike, corners into `vertices`.
ConvexityVerdict judgeConvexity(std::span<const Eigen::Vector3f> vertices,
                                std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace enfilade::scene
