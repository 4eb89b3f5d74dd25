// Reference implementation of the mesh queries: a convex body against every triangle of a mesh.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "tests/accuracy/case_file.hpp"

namespace enfilade::accuracy {

/// Contact of a body and a mesh. Triangles are closed and have no thickness; the mesh has no
/// interior.
struct MeshContact {
  collision::Verdict verdict = collision::Verdict::separated;
  collision::Certificate decidedBy = collision::Certificate::filter;  ///< the costliest used
  double distance = 0;                                ///< metres; 0 unless separated
  double errorBound = 0;                              ///< metres
  Vec3 pointA = Vec3::Zero(), pointB = Vec3::Zero();  ///< world; of A and the nearest triangle
  std::optional<std::uint32_t> nearest;  ///< a triangle at minimum distance; nullopt: no triangles
  std::vector<std::uint32_t> penetrated, touched;  ///< all of them, ascending
};

/// Computes the contact. `refined`: the distance by refineSeparation(), otherwise by
/// computeSeparation().
MeshContact findContactByBruteForce(const collision::PlacedConvex& body,
                                    std::span<const Triangle> mesh, bool refined);

}  // namespace enfilade::accuracy
