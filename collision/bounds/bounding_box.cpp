// Bounding cube and tight box from the last tick's extremal vertices (Lin 1993, section 5.2.1).
//
// tightAabb() handles one side of one axis at a time. It starts at the last tick's vertex and moves
// to a more extreme neighbour while there is one. Each test is one dot product with a row of the
// rotation matrix. Lin stops there. In rounded arithmetic that is not enough: along a face that is
// nearly perpendicular to the axis, every step may be below the rounding error, and the climb may
// stop far from the extremal vertex. findHigherVertex() therefore also searches the neighbours of
// all vertices that rounding cannot distinguish from the highest one (the plateau).
//
// tightAabbVoronoi() is Lin's other method. It places a plane perpendicular to the axis outside the
// body and takes the plane's point nearest to the last tick's vertex. It tests that point against
// the bounding planes of the vertex' Voronoi region. The vertex always lies in the region of the
// plane, so the other half of the vertex-face test (Lin 1993, chapter 3) is omitted. It ends with
// the same plateau search.
//
// Choice of the box. Instructions per box, bodies of 8 / 20 / 60 vertices that rotate by 2 degrees
// per tick, measured with callgrind:
//   cube 136   climbing 1663 / 1814 / 1900   Voronoi 2099 / 2364 / 2489   all 1648 / 3592 / 10072
// Hill climbing is therefore the method of the tight box. A larger box causes more narrow-phase
// queries, each about 2000 instructions for a pair that is clear (computeSeparationWithin(), warm).
// Overlapping boxes in a furnished storey, cube and tight box, by half extents in metres, 20
// vertices:
//   0.25 round 0.53 0.46    0.5 round 1.98 1.60    0.2 x 0.1 x 0.1  0.38 0.20
//   0.5 x 0.25 x 0.25  1.88 0.76     1 x 0.25 x 0.25  7.68 1.41     2 x 0.5 x 0.5  60.8 9.5
// chooseAabbMethod() estimates this difference from the radius, the mean width, and the density and
// size of the objects. It takes the tight box if that saves more than it costs. Cubes win except
// for oblong bodies (Cohen et al. 1995, section 4) and for large bodies among many objects.
//
// Rounding. Let e = 2^-53 and r the maximum norm of a vertex. The matrix comes from a quaternion
// whose squared norm is within 16e of 1. An entry has an error of at most 5e on the diagonal and 2e
// elsewhere, so a row has less than 6e. The normalised rotation is within 39e of it. The dot
// product of a computed row adds at most 3.1e r. The sum is less than 49e r, and kRotationError =
// 64e covers the rounding of r. Adding the translation and the bound itself costs 2e of the sum;
// kSumError = 4e. The comparison of two vertices uses one computed matrix, which is an exact linear
// map: the order of two dot products is certain if they differ by more than 6.2e r.

#include "collision/bounds/bounding_box.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"

namespace enfilade::collision {
namespace {

constexpr double kRotationError = 64 * kRoundoff;
constexpr double kSumError = 4 * kRoundoff;
constexpr double kDotError = 8 * kRoundoff;
constexpr double kUnderflow = 0x1p-1000;  // above the loss of a few products to underflow

// Instructions; measurements at the head of this file.
constexpr double kCubeCost = 136;
constexpr double kTightCost = 1800;
constexpr double kPairCost = 2000;

/// Projection of the vertices on one signed axis.
struct Projection {
  const Hull& hull;
  Vec3 direction;
  double operator()(std::uint32_t vertex) const {
    const Vec3& v = hull.vertices[vertex];
    return direction.x() * v.x() + direction.y() * v.y() + direction.z() * v.z();
  }
};

/// projection + translation + clearance, increased by the bound of its rounding error.
double roundOutward(double projection, double translation, double radius, double clearance) {
  const double sum = projection + translation;
  const double lost =
      kRotationError * radius + kSumError * (std::abs(sum) + clearance) + kUnderflow;
  return sum + (lost + clearance);
}

std::uint32_t findExtremalBruteForce(const Projection& projection) {
  std::uint32_t highest = 0;
  for (std::uint32_t v = 1; v < projection.hull.vertices.size(); ++v) {
    if (projection(v) > projection(highest)) highest = v;
  }
  return highest;
}

/// Searches all vertices connected to `top` through vertices that are not provably lower; usually
/// these are its neighbours. Returns the first higher vertex, or `top` if no vertex is higher.
/// `top` is then extremal within the error of a dot product, because projections rise along some
/// path of edges from `top` to the true extremal vertex.
std::uint32_t findHigherVertex(const Projection& projection, std::uint32_t top, double slack) {
  constexpr std::size_t kMaxPlateau = 64;  // plateau size above which brute force is as good
  ENFILADE_ASSERT(top < projection.hull.vertices.size());
  std::array<std::uint32_t, kMaxPlateau> plateau;
  std::size_t size = 0;
  plateau[size++] = top;
  const double best = projection(top);
  for (std::size_t k = 0; k < size; ++k) {
    for (const std::uint32_t next : projection.hull.neighboursOf(plateau[k])) {
      const double candidate = projection(next);
      if (candidate < best - slack) continue;
      if (candidate > best) return next;
      if (std::find(plateau.begin(), plateau.begin() + size, next) != plateau.begin() + size) {
        continue;
      }
      if (size == kMaxPlateau) return findExtremalBruteForce(projection);
      plateau[size++] = next;
    }
  }
  return top;
}

std::uint32_t hillClimb(const Projection& projection, std::uint32_t start) {
  const double slack = kDotError * projection.hull.radius + kUnderflow;
  std::uint32_t vertex = start < projection.hull.vertices.size() ? start : 0;
  for (;;) {  // projections rise strictly: at most one visit per vertex
    const std::uint32_t higher = findHigherVertex(projection, vertex, slack);
    if (!(projection(higher) > projection(vertex))) return vertex;
    vertex = higher;
  }
}

/// Walks from vertex to vertex towards a plane perpendicular to `direction`. Continues while the
/// plane's point nearest to the vertex violates a bounding plane of the vertex' Voronoi region (one
/// per edge). The plane may lie anywhere outside the body; here at twice its radius. Rounding can
/// cause a cycle, so the number of vertices limits the steps.
std::uint32_t walkVoronoiRegions(const Hull& hull, const Vec3& direction, std::uint32_t vertex) {
  for (std::size_t steps = 0; steps < hull.vertices.size(); ++steps) {
    const Vec3& from = hull.vertices[vertex];
    const Vec3 toNearest = (2 * hull.radius - direction.dot(from)) * direction;
    const auto neighbours = hull.neighboursOf(vertex);
    const auto violated =
        std::find_if(neighbours.begin(), neighbours.end(), [&](std::uint32_t neighbour) {
          return toNearest.dot(hull.vertices[neighbour] - from) > 0;
        });
    if (violated == neighbours.end()) break;
    vertex = *violated;
  }
  return vertex;
}

/// Voronoi walk, then the same plateau search as in hillClimb().
std::uint32_t findExtremalVoronoi(const Projection& projection, std::uint32_t start) {
  const std::uint32_t vertex = walkVoronoiRegions(
      projection.hull, projection.direction, start < projection.hull.vertices.size() ? start : 0);
  const double slack = kDotError * projection.hull.radius + kUnderflow;
  const std::uint32_t higher = findHigherVertex(projection, vertex, slack);
  return higher == vertex ? vertex : hillClimb(projection, higher);
}

template <typename FindHighest>
Aabb computeTightAabb(const Hull& hull, const Pose& worldFromBody, double clearance,
                      FindHighest&& find) {
  const Mat3 rotation = worldFromBody.rotation.toRotationMatrix();
  Aabb box;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 row = rotation.row(axis).transpose();
    const double translation = worldFromBody.translation[axis];
    for (const int upper : {0, 1}) {
      const Projection projection{hull, upper == 1 ? row : Vec3(-row)};
      const double extent = projection(find(projection, 2 * axis + upper));
      if (upper == 1) {
        box.max[axis] = roundOutward(extent, translation, hull.radius, clearance);
      } else {
        box.min[axis] = -roundOutward(extent, -translation, hull.radius, clearance);
      }
    }
  }
  return box;
}

/// Mean width of the hull over 13 directions: axes, face diagonals and space diagonals of a cube.
double computeMeanWidth(const Hull& hull) {
  double sum = 0;
  int directions = 0;
  for (int code = 14; code < 27; ++code) {  // the half of {-1, 0, 1}^3 after 0 0 0
    const Vec3 direction(code / 9 - 1, code / 3 % 3 - 1, code % 3 - 1);
    const Projection up{hull, direction}, down{hull, -direction};
    sum += (up(findExtremalBruteForce(up)) + down(findExtremalBruteForce(down))) / direction.norm();
    ++directions;
  }
  return sum / directions;
}

}  // namespace

Aabb boundingSphereCube(const Hull& hull, const Pose& worldFromBody, double clearance) {
  Aabb box;
  for (int axis = 0; axis < 3; ++axis) {
    const double at = worldFromBody.translation[axis];
    box.max[axis] = roundOutward(hull.radius, at, hull.radius, clearance);
    box.min[axis] = -roundOutward(hull.radius, -at, hull.radius, clearance);
  }
  return box;
}

Aabb tightAabb(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last,
               double clearance) {
  return computeTightAabb(hull, worldFromBody, clearance,
                          [&last](const Projection& projection, int side) {
                            std::uint32_t& vertex = last.vertex[static_cast<std::size_t>(side)];
                            vertex = hillClimb(projection, vertex);
                            return vertex;
                          });
}

Aabb tightAabbVoronoi(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last,
                      double clearance) {
  return computeTightAabb(hull, worldFromBody, clearance,
                          [&last](const Projection& projection, int side) {
                            std::uint32_t& vertex = last.vertex[static_cast<std::size_t>(side)];
                            vertex = findExtremalVoronoi(projection, vertex);
                            return vertex;
                          });
}

Aabb tightAabbBruteForce(const Hull& hull, const Pose& worldFromBody, double clearance) {
  return computeTightAabb(hull, worldFromBody, clearance, [](const Projection& projection, int) {
    return findExtremalBruteForce(projection);
  });
}

AabbMethod chooseAabbMethod(const Hull& hull, const SceneDensity& density) {
  const auto countOverlaps = [&](double edge) {
    const double combinedEdge = edge + density.meanObjectSize;
    return density.objectsPerCubicMetre * combinedEdge * combinedEdge * combinedEdge;
  };
  const double falsePairs = countOverlaps(2 * hull.radius) - countOverlaps(computeMeanWidth(hull));
  return falsePairs * kPairCost > kTightCost - kCubeCost ? AabbMethod::tightAabb
                                                         : AabbMethod::boundingSphereCube;
}

}  // namespace enfilade::collision
