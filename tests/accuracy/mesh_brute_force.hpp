// A convex body against every triangle of a mesh, one after the other: the slow twin of the mesh
// queries.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "tests/accuracy/case_file.hpp"

namespace enfilade::accuracy {

/// Triangles are closed and have no thickness; the mesh has no inside.
struct MeshContact {
  collision::Verdict verdict = collision::Verdict::separated;
  collision::DecidedBy decidedBy = collision::DecidedBy::filter;  ///< the hardest of all triangles
  double distance = 0;                                            ///< metres; 0 unless separated
  double errorBound = 0;                                          ///< metres
  Vec3 pointA = Vec3::Zero(), pointB = Vec3::Zero();  ///< world; of A and the nearest triangle
  std::optional<std::uint32_t> nearest;  ///< a triangle with the least distance; none: no triangles
  std::vector<std::uint32_t> penetrated, touched;  ///< all of them, ascending
};

/// `refined`: the distance by refine(), else by decide().
MeshContact bruteForceContact(const collision::ConvexBody& body, std::span<const Triangle> mesh,
                              bool refined);

}  // namespace enfilade::accuracy
