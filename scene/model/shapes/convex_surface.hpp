// Classification of closed surfaces: a surface that bounds a convex solid can be replaced by the
// hull H of its vertices.
// The rule has two levels:
// - `convex`: each triangle lies in one face of H, by exact orientation tests, and all face the
//   same way. A closed surface in the boundary of H is that boundary, so H is exactly the solid.
// - `nearlyConvex`: floats cannot hold a rotated box, whose quads are bent by the rounding of their
//   corners. Each triangle's corners lie within d below the plane of one face of H. Here d = 6
//   (|n_x| h_x + |n_y| h_y + |n_z| h_z). The face's unit normal is n, and h_i is half a unit of
//   rounding of the largest coordinate on axis i. The surface encloses more than half of H's
//   volume.
// Then no point of the surface is farther than d from H's boundary (out along n it leaves H). The
// solid and H differ by at most d. Every solid whose faces were planar before rounding passes:
// rounding moves a corner by at most e = d/6 along n. At the triangle's centroid H's face lies
// within e of the plane, at its corners not below -e. It is thus at most 5e above it, and 6e above
// the stored corner.
// H contains the surface in either case: a shape that is clear of H is clear of every triangle.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "scene/model/shapes/shell.hpp"

namespace enfilade::scene {

struct ConvexityResult {
  Shell::Kind kind = Shell::Kind::closed;  ///< closed, convex or nearlyConvex
  bool inward = false;                     ///< the triangles face into the solid
  bool notTested = false;  ///< the tests would exceed the work limit; reported as closed
};

/// `triangles` are those of one closed shell with uniform winding; corners index `vertices`.
ConvexityResult classifyConvexity(std::span<const Eigen::Vector3f> vertices,
                                  std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace enfilade::scene
