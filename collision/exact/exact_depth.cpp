// Every facet of M = B - A is a face of B and a vertex of A, a vertex of B and a face of A, or an
// edge of each. So the least extent of M along the normals of all faces and of all pairs of edges
// is the depth: the extent along any direction bounds it from above, so that pairs of edges that
// make no facet do no harm, and flat bodies need no case of their own. Steps
//  1. Pairs of edges whose own plane is farther from the origin than the depth can be are left out,
//     by doubles: M extends at least to that plane, so it holds no facet that matters.
//  2. The extents along the other directions in extended precision, with a bound of the error.
//  3. Those that the bound does not rule out are computed in integers and compared.
#include "collision/exact/exact_depth.hpp"

#include <cmath>
#include <optional>

namespace enfilade::collision {
namespace {

/// A direction as a cross product of two edges: of one body's face, or one of each body.
struct Candidate {
  enum class Of : std::uint8_t { faceOfA, faceOfB, edges } of;
  std::array<std::uint32_t, 2> first, second;  ///< vertices: the edge from [0] to [1]
  bool reversed = false;                       ///< the direction is second x first
};

struct Edge {
  std::array<std::uint32_t, 2> ends;
  WideVec along;
  Vec3 rounded;
};

struct BodyFeatures {
  const Hull* hull;
  bool turns;  ///< the pose is a rotation, up to rounding, and mirrors nothing
  std::vector<WideVec> points;
  std::vector<Edge> edges;
};

BodyFeatures featuresOf(const PlacedBody& placed) {
  const Mat3* rotation = placed.body->rotation;
  BodyFeatures features{
      placed.body->hull, rotation == nullptr || rotation->determinant() > 0.5, {}, {}};
  for (std::uint32_t i = 0; i < placed.vertexCount(); ++i)
    features.points.push_back(placed.turned<Wide>(i));
  for (std::uint32_t i = 0; i < placed.vertexCount(); ++i) {
    for (const std::uint32_t j : features.hull->neighboursOf(i)) {
      const WideVec along = features.points[j] - features.points[i];
      if (i < j) features.edges.push_back({{i, j}, along, along.cast<double>()});
    }
  }
  return features;
}

/// Collects candidates whose extent may be the least.
class Sieve {
 public:
  Sieve(const MinkowskiDifference& difference, double atMost)
      : difference_(difference), atMost_(atMost) {}

  /// False: the plane through both edges is proved farther away than the depth. `w`: a point of it.
  bool mayMatter(const Vec3& first, const Vec3& second, const Vec3& w) const {
    const Vec3 normal = first.cross(second);
    const double length = normal.norm();
    // Of the normal, by the edges' own errors; where it is small beside the normal, the direction
    // is off by less than 2^-20, and the plane's distance by less than four times that.
    const double off = 64 * kUnit * difference_.reach * (first.norm() + second.norm());
    if (!(off < 0x1p-20 * length)) return true;
    const bool farther = std::abs(normal.dot(w)) > (atMost_ + 0x1p-17 * difference_.reach) * length;
    return !farther;  // true where doubles overflow, too
  }

  /// `bothWays`: the opposite direction may be a facet's as well.
  void consider(Candidate candidate, const WideVec& first, const WideVec& second, bool bothWays) {
    const WideVec normal = first.cross(second);
    // An edge is off by 2 sqrt(3) pointError, and the product's own rounding is of that order too.
    const Wide off = 8 * difference_.pointError() * (first.norm() + second.norm());
    const Wide length = normal.norm();
    const bool known = off < 0x1p-20L * length;
    for (int way = 0; way < (bothWays ? 2 : 1); ++way) {
      candidate.reversed = way == 1;
      Wide extent = 0, error = std::numeric_limits<Wide>::infinity();
      if (known) {
        const WideVec direction = way == 1 ? WideVec(-normal) : normal;
        const Least least = leastAlong(difference_, -direction, length, hint_);
        extent = -least.along / length;
        error = (least.along - least.bound) / length + 2 * off / length * difference_.reach;
      }
      if (extent - error > atMost_) continue;
      atMost_ = std::min(atMost_, extent + error);
      kept_.push_back({extent - error, candidate});
    }
  }
  std::vector<Candidate> survivors() const {
    std::vector<Candidate> result;
    for (const auto& [atLeast, candidate] : kept_)
      if (atLeast <= atMost_) result.push_back(candidate);
    return result;
  }

 private:
  const MinkowskiDifference& difference_;
  VertexPair hint_;
  Wide atMost_;  ///< the depth, metres
  std::vector<std::pair<Wide, Candidate>> kept_;
};

/// Outward normals of M: a face of B as it is, a face of A turned around. A matrix that is no
/// rotation may turn faces inside out.
void considerFaces(const BodyFeatures& features, Candidate::Of of, Sieve& sieve) {
  const auto& p = features.points;
  for (const std::vector<std::uint32_t>& face : features.hull->faces) {
    Candidate candidate{of, {face[0], face[1]}, {face[0], face[2]}};
    if (of == Candidate::Of::faceOfA) std::swap(candidate.first, candidate.second);
    sieve.consider(candidate, p[candidate.first[1]] - p[face[0]],
                   p[candidate.second[1]] - p[face[0]], !features.turns);
  }
}

std::vector<Candidate> candidates(const MinkowskiDifference& difference, double atMost) {
  const BodyFeatures a = featuresOf(difference.a), b = featuresOf(difference.b);
  Sieve sieve(difference, atMost);
  considerFaces(a, Candidate::Of::faceOfA, sieve);
  considerFaces(b, Candidate::Of::faceOfB, sieve);
  for (const Edge& ofA : a.edges) {
    for (const Edge& ofB : b.edges) {
      const Vec3 w = difference.point<double>({ofA.ends[0], ofB.ends[0]});
      if (!sieve.mayMatter(ofA.rounded, ofB.rounded, w)) continue;
      sieve.consider({Candidate::Of::edges, ofA.ends, ofB.ends}, ofA.along, ofB.along, true);
    }
  }
  return sieve.survivors();
}

ExactPoint edgeOf(ExactDifference& difference, const std::array<std::uint32_t, 2>& edge, bool ofA) {
  return ofA ? difference.pointA(edge[1]) - difference.pointA(edge[0])
             : difference.pointB(edge[1]) - difference.pointB(edge[0]);
}

ExactPoint exactNormal(ExactDifference& difference, const Candidate& candidate) {
  const ExactPoint first =
      edgeOf(difference, candidate.first, candidate.of != Candidate::Of::faceOfB);
  const ExactPoint second =
      edgeOf(difference, candidate.second, candidate.of == Candidate::Of::faceOfA);
  return candidate.reversed ? cross(second, first) : cross(first, second);
}

/// offset / |normal| of one less than that of the other; offsets > 0.
bool nearer(const ExactFacet& a, const ExactFacet& b) {
  return a.offset * a.offset * dot(b.normal, b.normal) <
         b.offset * b.offset * dot(a.normal, a.normal);
}

/// The body with a hull of its own: `hull` is filled when there was none.
ConvexBody withHull(const ConvexBody& body, std::optional<Hull>& hull) {
  if (body.hull) return body;
  hull = buildHull(body.vertices);
  return {hull->vertices, body.translation, body.rotation, &*hull};
}

}  // namespace

ExactFacet nearestFacetExactly(const ConvexBody& bodyA, const ConvexBody& bodyB, double atMost) {
  std::optional<Hull> hullA, hullB;
  const ConvexBody a = withHull(bodyA, hullA), b = withHull(bodyB, hullB);
  ExactDifference difference(a, b);
  std::optional<ExactFacet> nearest;
  VertexPair hint;
  for (const Candidate& candidate : candidates(MinkowskiDifference(a, b), atMost)) {
    ExactFacet facet{exactNormal(difference, candidate), {}, difference.scale()};
    if (isZero(facet.normal)) continue;
    const ExactPoint inward = Integer(-1) * facet.normal;
    facet.offset = -dot(inward, difference(difference.leastAlong(inward, hint)));
    if (!nearest || nearer(facet, *nearest)) nearest = std::move(facet);
  }
  return nearest.value();
}

}  // namespace enfilade::collision
