// Seed 5.2.1: the cube of a body's sphere, and the tight box from last tick's extremal vertices.
//
// tightBox(), an axis and sense at a time: from last tick's vertex go to a neighbour that is more
// extreme until none is: one dot product of the matrix' row with each vertex looked at, since the
// other two coordinates do not matter. The thesis stops there. In rounded arithmetic that is not
// enough: along a face that is nearly square to the axis every step may be below the rounding error
// and the walk may stop far from the extremal vertex. So vertices that cannot be told from the
// highest are looked around as well (firstHigher), which is the whole of a level top.
//
// tightBoxByWalls() is the thesis' other method: a wall square to the axis beyond the body, its
// point nearest to last tick's vertex, and that point against the planes of the vertex' Voronoi
// region. The vertex always lies in the wall's region, so that the other half of the vertex-face
// test of chapter 3 is left out. It ends in the same look around.
//
// Which box? Instructions a box, bodies of 8 / 20 / 60 vertices turning by 2 degrees a tick
// (tests/benchmarks/bounding_box_bench.cpp under callgrind):
//   cube 136   climbing 1663 / 1814 / 1900   walls 2099 / 2364 / 2489   all 1648 / 3592 / 10072
// so climbing is the tight box's method. A larger box asks the narrow phase about more pairs, at
// some 2000 instructions a pair that it finds clear (decideWithin(), warm). Boxes met in a
// furnished storey, cube and tight box, by half-axes in metres, 20 vertices:
//   0.25 round 0.53 0.46    0.5 round 1.98 1.60    0.2 x 0.1 x 0.1  0.38 0.20
//   0.5 x 0.25 x 0.25  1.88 0.76     1 x 0.25 x 0.25  7.68 1.41     2 x 0.5 x 0.5  60.8 9.5
// boxMethodFor() estimates that difference from the radius and the mean width, the density of
// objects and their size, and takes the tight box where it saves more than it costs. As I-COLLIDE
// found (1995, section 4), cubes win but for oblong bodies; what it could not show in its sparse
// scenes is that large bodies among many things count as well.
//
// Rounding. Let e = 2^-53 and r the greatest norm of a vertex. The matrix comes from a quaternion
// whose squared norm is within 16e of 1; an entry is off by at most 5e on the diagonal and 2e
// elsewhere, so a row by less than 6e, and the rotation that normalising would give is within 39e
// of it. The dot product of a computed row adds at most 3.1e r. Together: less than 49e r, and
// kRotationError = 64e takes in the rounding of r. Adding the translation and the bound itself
// costs 2e of the sum; kSumError = 4e. Comparing two vertices uses one computed matrix, which is an
// exact linear map of its own: two dots are ordered surely when they differ by more than 6.2e r.

#include "collision/bounds/bounding_box.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::collision {
namespace {

constexpr double kEpsilon = 0x1p-53;
constexpr double kRotationError = 64 * kEpsilon;
constexpr double kSumError = 4 * kEpsilon;
constexpr double kDotError = 8 * kEpsilon;
constexpr double kUnderflow = 0x1p-1000;  // above what a few products can lose to underflow

// Instructions, measured as the head of this file says.
constexpr double kCubeCost = 136;
constexpr double kTightCost = 1800;
constexpr double kPairCost = 2000;

/// A linear function of the vertices: the coordinate along one half-axis.
struct Height {
  const Hull& hull;
  Vec3 direction;
  double operator()(std::uint32_t vertex) const {
    const Vec3& v = hull.vertices[vertex];
    return direction.x() * v.x() + direction.y() * v.y() + direction.z() * v.z();
  }
};

/// Outward of height + translation + clearance by what computing it may have lost.
double outward(double height, double translation, double radius, double clearance) {
  const double sum = height + translation;
  const double lost =
      kRotationError * radius + kSumError * (std::abs(sum) + clearance) + kUnderflow;
  return sum + (lost + clearance);
}

std::uint32_t bruteForceHighest(const Height& height) {
  std::uint32_t highest = 0;
  for (std::uint32_t v = 1; v < height.hull.vertices.size(); ++v) {
    if (height(v) > height(highest)) highest = v;
  }
  return highest;
}

/// Looks at all vertices joined to `top` by vertices that cannot be told to be lower; mostly these
/// are its neighbours. Returns the first higher one when there is one; else `top`, which is then
/// the highest within the error of a dot: heights rise along some path of edges from `top` to the
/// true highest vertex.
std::uint32_t firstHigher(const Height& height, std::uint32_t top, double slack) {
  constexpr std::size_t kMost = 64;  // vertices of a plateau; beyond, brute force is as good
  std::array<std::uint32_t, kMost> plateau;
  std::size_t size = 0;
  plateau[size++] = top;
  const double best = height(top);
  for (std::size_t k = 0; k < size; ++k) {
    for (const std::uint32_t next : height.hull.neighboursOf(plateau[k])) {
      const double candidate = height(next);
      if (candidate < best - slack) continue;
      if (candidate > best) return next;
      if (std::find(plateau.begin(), plateau.begin() + size, next) != plateau.begin() + size) {
        continue;
      }
      if (size == kMost) return bruteForceHighest(height);
      plateau[size++] = next;
    }
  }
  return top;
}

std::uint32_t highest(const Height& height, std::uint32_t start) {
  const double slack = kDotError * height.hull.radius + kUnderflow;
  std::uint32_t vertex = start < height.hull.vertices.size() ? start : 0;
  for (;;) {  // heights rise strictly: at most one visit a vertex
    const std::uint32_t higher = firstHigher(height, vertex, slack);
    if (!(height(higher) > height(vertex))) return vertex;
    vertex = higher;
  }
}

/// From vertex to vertex towards an imaginary wall square to `direction`, as long as the point of
/// the wall that is nearest to the vertex lies outside one of the planes that bound the vertex'
/// Voronoi region (one an edge). The wall may stand anywhere beyond the body; this one stands at
/// twice its radius. Rounding may send the walk round, so it is bounded by the number of vertices.
std::uint32_t walkToWall(const Hull& hull, const Vec3& direction, std::uint32_t vertex) {
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

/// Where the walk ends the same look around as in highest() makes it sure.
std::uint32_t highestByWall(const Height& height, std::uint32_t start) {
  const std::uint32_t vertex =
      walkToWall(height.hull, height.direction, start < height.hull.vertices.size() ? start : 0);
  const double slack = kDotError * height.hull.radius + kUnderflow;
  const std::uint32_t beyond = firstHigher(height, vertex, slack);
  return beyond == vertex ? vertex : highest(height, beyond);
}

template <typename FindHighest>
Box boxOf(const Hull& hull, const Pose& worldFromBody, double clearance, FindHighest&& find) {
  const Mat3 rotation = worldFromBody.rotation.toRotationMatrix();
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 row = rotation.row(axis).transpose();
    const double translation = worldFromBody.translation[axis];
    for (const int upper : {0, 1}) {
      const Height height{hull, upper == 1 ? row : Vec3(-row)};
      const double extent = height(find(height, 2 * axis + upper));
      if (upper == 1) {
        box.max[axis] = outward(extent, translation, hull.radius, clearance);
      } else {
        box.min[axis] = -outward(extent, -translation, hull.radius, clearance);
      }
    }
  }
  return box;
}

/// The width of the hull, on average over 13 directions: a cube's axes, face diagonals and space
/// diagonals.
double meanWidth(const Hull& hull) {
  double sum = 0;
  int directions = 0;
  for (int code = 14; code < 27; ++code) {  // the half of {-1, 0, 1}^3 that follows 0 0 0
    const Vec3 direction(code / 9 - 1, code / 3 % 3 - 1, code % 3 - 1);
    const Height up{hull, direction}, down{hull, -direction};
    sum += (up(bruteForceHighest(up)) + down(bruteForceHighest(down))) / direction.norm();
    ++directions;
  }
  return sum / directions;
}

}  // namespace

Box fixedCube(const Hull& hull, const Pose& worldFromBody, double clearance) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const double at = worldFromBody.translation[axis];
    box.max[axis] = outward(hull.radius, at, hull.radius, clearance);
    box.min[axis] = -outward(hull.radius, -at, hull.radius, clearance);
  }
  return box;
}

Box tightBox(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last,
             double clearance) {
  return boxOf(hull, worldFromBody, clearance, [&last](const Height& height, int side) {
    std::uint32_t& vertex = last.vertex[static_cast<std::size_t>(side)];
    vertex = highest(height, vertex);
    return vertex;
  });
}

Box tightBoxByWalls(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last,
                    double clearance) {
  return boxOf(hull, worldFromBody, clearance, [&last](const Height& height, int side) {
    std::uint32_t& vertex = last.vertex[static_cast<std::size_t>(side)];
    vertex = highestByWall(height, vertex);
    return vertex;
  });
}

Box tightBoxBruteForce(const Hull& hull, const Pose& worldFromBody, double clearance) {
  return boxOf(hull, worldFromBody, clearance,
               [](const Height& height, int) { return bruteForceHighest(height); });
}

BoxMethod boxMethodFor(const Hull& hull, const Surroundings& surroundings) {
  const auto boxesMet = [&](double edge) {
    const double reach = edge + surroundings.meanEdge;
    return surroundings.objectsPerCubicMetre * reach * reach * reach;
  };
  const double falsePairs = boxesMet(2 * hull.radius) - boxesMet(meanWidth(hull));
  return falsePairs * kPairCost > kTightCost - kCubeCost ? BoxMethod::tightBox
                                                         : BoxMethod::fixedCube;
}

}  // namespace enfilade::collision
