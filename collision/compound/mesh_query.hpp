// A convex body against the triangles of a still mesh: nearest, penetrated and touched triangles.
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

/// What is kept from query to query of one body against one mesh: call reset() before it serves
/// another body, other vertices, or another mesh. The poses may be any.
struct MeshCache {
  /// A triangle that may matter soon, and what is known of it.
  struct Candidate {
    std::uint32_t triangle = 0;
    Verdict verdict = Verdict::separated;
    bool decided = false;  ///< else only `margin` is known, and `verdict` is separated or unknown
    double margin = 0;     ///< metres >= 0: the verdict holds while the body moved less than this
    double since = 0;      ///< the odometer when that was known
    FeatureCache features;
  };
  std::vector<Candidate> candidates;  ///< ascending in `triangle`
  std::uint32_t nearest = 0;          ///< index into `candidates`
  double horizon = -1;              ///< metres: when the odometer was 0, every triangle that is no
                                    ///< candidate was farther than this; negative: nothing is known
  double odometer = 0;              ///< metres: no point of the body went farther since
  double step = 0;                  ///< metres: of the last query
  double quietUntil = -1;           ///< while the odometer is less, nothing touches
  Vec3 translation = Vec3::Zero();  ///< of the last query
  Mat3 rotation = Mat3::Identity();
  double radius = -1;  ///< of the body, about its own origin; negative: not measured
  HullPlanes planes;   ///< of the body's hull, made when first needed
  MeshProbe probe;     ///< the storage of the search
  std::uint64_t gathers = 0, decisions = 0;  ///< counters, for metrics and tests

  void reset() { *this = MeshCache{}; }
};

struct NearestTriangle {
  std::uint32_t triangle = 0;  ///< index into mesh.triangles()
  Decision decision;           ///< of the body (A) and the triangle (B)
};

/// A triangle that attains the least distance, up to Decision::errorBound; when any is touched or
/// penetrated, one of those. nullopt when the mesh has no triangles, or when all are proved farther
/// away than `limit` (metres).
std::optional<NearestTriangle> nearestTriangle(
    const ConvexBody& body, const TriangleTree& mesh, MeshCache& cache,
    double limit = std::numeric_limits<double>::infinity());

/// Indices into mesh.triangles(), ascending. Complete and exact; each triangle is a closed body
/// without thickness, and a mesh has no inside.
struct MeshContacts {
  std::vector<std::uint32_t> penetrated;
  std::vector<std::uint32_t> touched;  ///< and not penetrated

  Verdict verdict() const {
    if (!penetrated.empty()) return Verdict::penetrating;
    return touched.empty() ? Verdict::separated : Verdict::touching;
  }
};

void findContacts(const ConvexBody& body, const TriangleTree& mesh, MeshCache& cache,
                  MeshContacts& contacts);

/// Whether any triangle is nearer than `limit` (metres, exactly this double): exact.
bool isAnythingNearer(const ConvexBody& body, const TriangleTree& mesh, double limit,
                      MeshCache& cache);

}  // namespace enfilade::collision
