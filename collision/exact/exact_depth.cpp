// Every facet of M = B - A comes from A and B. It is a face of B and a vertex of A, a vertex of B
// and a face of A, or an edge of each. The depth is therefore the minimum extent of M along the
// normals of all faces and of all pairs of edges. The extent along any direction is an upper bound
// of the depth. Edge pairs that form no facet are therefore harmless, and flat bodies need no
// special case. Steps
//  1. Reject, in doubles, pairs of edges whose plane is farther from the origin than the depth
//     bound. M extends at least to that plane, so the pair is not the nearest facet.
//  2. Compute the extents along the other directions in extended precision, with an error bound.
//  3. Compute those that the bound does not rule out in integers, and compare them.
#include "collision/exact/exact_depth.hpp"

#include <cmath>
#include <optional>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

/// A direction as a cross product of two edges: two of one face, or one of each body.
struct Candidate {
  enum class Source : std::uint8_t { faceOfA, faceOfB, edges } source;
  std::array<std::uint32_t, 2> first, second;  ///< vertices: the edge from [0] to [1]
  bool reversed = false;                       ///< the direction is second x first
};

struct Edge {
  std::array<std::uint32_t, 2> ends;
  LongVec3 direction;
  Vec3 rounded;
};

struct ConvexFeatures {
  const Hull* hull;
  bool isRotation;  ///< the matrix is a rotation up to rounding, without mirroring
  std::vector<LongVec3> points;
  std::vector<Edge> edges;
};

ConvexFeatures computeFeatures(const BoundedConvex& convex) {
  const Mat3* rotation = convex.shape->rotation;
  ConvexFeatures features{
      convex.shape->hull, rotation == nullptr || rotation->determinant() > 0.5, {}, {}};
  for (std::uint32_t i = 0; i < convex.vertexCount(); ++i)
    features.points.push_back(convex.rotated<LongReal>(i));
  for (std::uint32_t i = 0; i < convex.vertexCount(); ++i) {
    for (const std::uint32_t j : features.hull->getNeighbours(i)) {
      const LongVec3 direction = features.points[j] - features.points[i];
      if (i < j) features.edges.push_back({{i, j}, direction, direction.cast<double>()});
    }
  }
  return features;
}

/// Collects candidates whose extent may be the minimum.
class CandidateFilter {
 public:
  CandidateFilter(const MinkowskiDifference& difference, double depthBound)
      : difference_(difference), depthBound_(depthBound) {}

  /// False: the plane through both edges is certified to be farther than the depth bound. `w`: a
  /// point of the plane.
  bool mayBeNearest(const Vec3& first, const Vec3& second, const Vec3& w) const {
    const Vec3 normal = first.cross(second);
    const double length = normal.norm();
    // The normal's error from the errors of the edges. If it is small relative to the normal, the
    // direction is off by less than 2^-20. The plane's distance is then off by less than four times
    // that.
    const double off = 64 * kRoundoff * difference_.reach * (first.norm() + second.norm());
    if (!(off < 0x1p-20 * length)) return true;
    const bool farther =
        std::abs(normal.dot(w)) > (depthBound_ + 0x1p-17 * difference_.reach) * length;
    return !farther;  // also true if doubles overflow
  }

  /// `bothDirections`: the opposite direction may also be a facet's normal.
  void consider(Candidate candidate, const LongVec3& first, const LongVec3& second,
                bool bothDirections) {
    const LongVec3 normal = first.cross(second);
    // An edge is off by 2 sqrt(3) pointError; the product's own rounding is of the same order.
    const LongReal off = 8 * difference_.pointError() * (first.norm() + second.norm());
    const LongReal length = normal.norm();
    const bool known = off < 0x1p-20L * length;
    for (int sense = 0; sense < (bothDirections ? 2 : 1); ++sense) {
      candidate.reversed = sense == 1;
      LongReal extent = 0, error = std::numeric_limits<LongReal>::infinity();
      if (known) {
        const LongVec3 direction = sense == 1 ? LongVec3(-normal) : normal;
        const CertifiedSupport support =
            findCertifiedSupport(difference_, -direction, length, hint_);
        extent = -support.projection / length;
        error = (support.projection - support.lowerBound) / length +
                2 * off / length * difference_.reach;
      }
      if (extent - error > depthBound_) continue;
      depthBound_ = std::min(depthBound_, extent + error);
      kept_.push_back({extent - error, candidate});
    }
  }
  std::vector<Candidate> survivors() const {
    std::vector<Candidate> result;
    for (const auto& [lowerBound, candidate] : kept_)
      if (lowerBound <= depthBound_) result.push_back(candidate);
    return result;
  }

 private:
  const MinkowskiDifference& difference_;
  VertexPair hint_;
  LongReal depthBound_;  ///< the depth, metres
  std::vector<std::pair<LongReal, Candidate>> kept_;
};

/// Outward normals of M: those of B's faces, and those of A's faces negated. A matrix that is not a
/// rotation may turn faces inside out.
void considerFaces(const ConvexFeatures& features, Candidate::Source source,
                   CandidateFilter& filter) {
  const auto& p = features.points;
  for (const std::vector<std::uint32_t>& face : features.hull->faces) {
    ENFILADE_ASSERT(face.size() >= 3);
    Candidate candidate{source, {face[0], face[1]}, {face[0], face[2]}};
    if (source == Candidate::Source::faceOfA) std::swap(candidate.first, candidate.second);
    filter.consider(candidate, p[candidate.first[1]] - p[face[0]],
                    p[candidate.second[1]] - p[face[0]], !features.isRotation);
  }
}

std::vector<Candidate> collectCandidates(const MinkowskiDifference& difference, double depthBound) {
  const ConvexFeatures a = computeFeatures(difference.a), b = computeFeatures(difference.b);
  CandidateFilter filter(difference, depthBound);
  considerFaces(a, Candidate::Source::faceOfA, filter);
  considerFaces(b, Candidate::Source::faceOfB, filter);
  for (const Edge& ofA : a.edges) {
    for (const Edge& ofB : b.edges) {
      const Vec3 w = difference.point<double>({ofA.ends[0], ofB.ends[0]});
      if (!filter.mayBeNearest(ofA.rounded, ofB.rounded, w)) continue;
      filter.consider({Candidate::Source::edges, ofA.ends, ofB.ends}, ofA.direction, ofB.direction,
                      true);
    }
  }
  return filter.survivors();
}

ExactPoint computeExactEdge(ExactMinkowskiDifference& difference,
                            const std::array<std::uint32_t, 2>& edge, bool ofA) {
  return ofA ? difference.pointA(edge[1]) - difference.pointA(edge[0])
             : difference.pointB(edge[1]) - difference.pointB(edge[0]);
}

ExactPoint computeExactNormal(ExactMinkowskiDifference& difference, const Candidate& candidate) {
  const ExactPoint first =
      computeExactEdge(difference, candidate.first, candidate.source != Candidate::Source::faceOfB);
  const ExactPoint second = computeExactEdge(difference, candidate.second,
                                             candidate.source == Candidate::Source::faceOfA);
  return candidate.reversed ? cross(second, first) : cross(first, second);
}

/// Whether offset / |normal| of `a` is less than that of `b`; offsets > 0.
bool isCloser(const ExactFacet& a, const ExactFacet& b) {
  return a.offset * a.offset * dot(b.normal, b.normal) <
         b.offset * b.offset * dot(a.normal, a.normal);
}

/// The body with a hull; builds it into `hull` if the body has none.
PlacedConvex ensureHull(const PlacedConvex& convex, std::optional<Hull>& hull) {
  if (convex.hull) return convex;
  hull = buildHull(convex.vertices);
  return {hull->vertices, convex.translation, convex.rotation, &*hull};
}

}  // namespace

ExactFacet findNearestFacetExactly(const PlacedConvex& bodyA, const PlacedConvex& bodyB,
                                   double depthBound) {
  std::optional<Hull> hullA, hullB;
  const PlacedConvex a = ensureHull(bodyA, hullA), b = ensureHull(bodyB, hullB);
  ExactMinkowskiDifference difference(a, b);
  std::optional<ExactFacet> nearest;
  VertexPair hint;
  for (const Candidate& candidate : collectCandidates(MinkowskiDifference(a, b), depthBound)) {
    ExactFacet facet{computeExactNormal(difference, candidate), {}, difference.scale()};
    if (isZero(facet.normal)) continue;
    const ExactPoint inward = Integer(-1) * facet.normal;
    facet.offset = -dot(inward, difference(difference.findSupport(inward, hint)));
    if (!nearest || isCloser(facet, *nearest)) nearest = std::move(facet);
  }
  return nearest.value();
}

}  // namespace enfilade::collision
