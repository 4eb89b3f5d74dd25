// Queries of a convex body against a static triangle mesh: nearest, penetrated and touched
// triangles.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "collision/compound/hull_planes.hpp"
#include "collision/compound/query_bounds.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::collision {

/// State of one body against one mesh that is kept between queries. Call reset() before use with
/// another body, other vertices or another mesh. Poses may change arbitrarily.
struct MeshCache {
  /// A nearby triangle and its last verdict.
  struct Candidate {
    std::uint32_t triangle = 0;
    Verdict verdict = Verdict::separated;
    bool isDecided = false;  ///< false: only `margin` is known; `verdict` is separated or unknown
    double margin = 0;     ///< metres, >= 0: the verdict holds while the body moves less than this
    double decidedAt = 0;  ///< accumulatedMotion at the time of the verdict
    FeatureCache features;
  };
  std::vector<Candidate> candidates;  ///< ascending in `triangle`
  std::uint32_t nearest = 0;          ///< index into `candidates`
  double candidateRadius = -1;        ///< metres: every triangle that is no candidate was farther
                                      ///< than this when accumulatedMotion was 0; negative: unknown
  double accumulatedMotion = 0;       ///< metres: upper bound of the motion of any body point since
  double lastStep = 0;                ///< motion between the last two queries, metres
  double separatedUntil = -1;         ///< no triangle touches while accumulatedMotion is less
  Vec3 translation = Vec3::Zero();    ///< of the last query
  Mat3 rotation = Mat3::Identity();
  double radius = -1;  ///< of the body about its own origin; negative: not computed
  HullPlanes planes;   ///< of the body's hull, computed on demand
  QueryBounds bounds;  ///< scratch of the search
  std::uint64_t broadUpdates = 0, separationQueries = 0;  ///< counters, for metrics and tests

  void reset() { *this = MeshCache{}; }
};

struct NearestTriangle {
  std::uint32_t triangle = 0;   ///< index into mesh.triangles()
  SeparationResult separation;  ///< of the body (A) and the triangle (B)
};

/// Finds a triangle at the minimum distance, up to SeparationResult::errorBound. If any triangle is
/// touched or penetrated, returns one of those. nullopt if the mesh is empty, or if all triangles
/// are proved farther away than `limit` (metres).
std::optional<NearestTriangle> findNearestTriangle(
    const PlacedConvex& body, const TriangleTree& mesh, MeshCache& cache,
    double limit = std::numeric_limits<double>::infinity());

/// Indices into mesh.triangles(), ascending; complete and exact. Each triangle is a closed body
/// without thickness, and a mesh has no interior.
struct MeshContacts {
  std::vector<std::uint32_t> penetrated;
  std::vector<std::uint32_t> touched;  ///< and not penetrated

  Verdict verdict() const {
    if (!penetrated.empty()) return Verdict::penetrating;
    return touched.empty() ? Verdict::separated : Verdict::touching;
  }
};

void findMeshContacts(const PlacedConvex& body, const TriangleTree& mesh, MeshCache& cache,
                      MeshContacts& contacts);

/// True if any triangle is closer than `limit` (metres, exactly this double). Exact.
bool isAnyTriangleWithin(const PlacedConvex& body, const TriangleTree& mesh, double limit,
                         MeshCache& cache);

}  // namespace enfilade::collision
