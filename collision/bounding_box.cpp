// Seed 5.2.1: the cube of a body's sphere, and the tight box from last tick's extremal vertices.
//
// tightBox() climbs, an axis and sense at a time, from last tick's vertex to its most extreme
// neighbour until none is more extreme: one dot product of the matrix' row with each vertex looked
// at, since the other two coordinates do not matter. The thesis stops there. In rounded arithmetic
// that is not enough: along a face that is nearly square to the axis every step may be below the
// rounding error and the walk may stop far from the extremal vertex. So vertices that no neighbour
// can be told from are looked at too (firstBeyondPlateau), which is the whole of a level top.
//
// Rounding. Let e = 2^-53 and r the greatest norm of a vertex. The matrix comes from a quaternion
// whose squared norm is within 16e of 1; an entry is off by at most 5e on the diagonal and 2e
// elsewhere, so a row by less than 6e, and the rotation that normalising would give is within 39e
// of it. The dot product of a computed row adds at most 3.1e r. Together: less than 49e r, and
// kRotationError = 64e takes in the rounding of r. Adding the translation and the bound itself
// costs 2e of the sum; kSumError = 4e. Comparing two vertices uses one computed matrix, which is an
// exact linear map of its own: two dots are ordered surely when they differ by more than 6.2e r.

#include "collision/bounding_box.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::collision {
namespace {

constexpr double kEpsilon = 0x1p-53;
constexpr double kRotationError = 64 * kEpsilon;
constexpr double kSumError = 4 * kEpsilon;
constexpr double kDotError = 8 * kEpsilon;
constexpr double kUnderflow = 0x1p-1000;  // above what a few products can lose to underflow

/// A linear function of the vertices: the coordinate along one half-axis.
struct Height {
  const Hull& hull;
  Vec3 direction;
  double operator()(std::uint32_t vertex) const {
    const Vec3& v = hull.vertices[vertex];
    return direction.x() * v.x() + direction.y() * v.y() + direction.z() * v.z();
  }
};

/// Outward of `sum` by what computing it may have lost.
double outward(double height, double translation, double radius) {
  const double sum = height + translation;
  return sum + (kRotationError * radius + kSumError * std::abs(sum) + kUnderflow);
}

std::uint32_t climb(const Height& height, std::uint32_t vertex) {
  double best = height(vertex);
  for (bool climbing = true; climbing;) {  // heights rise strictly: at most one visit a vertex
    climbing = false;
    for (const std::uint32_t next : height.hull.neighboursOf(vertex)) {
      const double candidate = height(next);
      if (candidate > best) {
        best = candidate;
        vertex = next;
        climbing = true;
        break;
      }
    }
  }
  return vertex;
}

std::uint32_t bruteForceHighest(const Height& height) {
  std::uint32_t highest = 0;
  for (std::uint32_t v = 1; v < height.hull.vertices.size(); ++v) {
    if (height(v) > height(highest)) highest = v;
  }
  return highest;
}

/// Looks at all vertices joined to `top` by vertices that cannot be told to be lower. Returns a
/// higher one when there is one; else `top`, which is then the highest within the error of a dot:
/// heights rise along some path of edges from `top` to the true highest vertex.
std::uint32_t firstBeyondPlateau(const Height& height, std::uint32_t top, double slack) {
  constexpr std::size_t kMost = 64;  // vertices of a plateau; beyond, brute force is as good
  std::array<std::uint32_t, kMost> plateau;
  std::size_t size = 0;
  plateau[size++] = top;
  const double best = height(top);
  for (std::size_t k = 0; k < size; ++k) {
    for (const std::uint32_t next : height.hull.neighboursOf(plateau[k])) {
      const double candidate = height(next);
      if (candidate > best) return next;
      if (candidate < best - slack) continue;
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
  for (;;) {  // heights rise strictly: ends
    vertex = climb(height, vertex);
    const std::uint32_t beyond = firstBeyondPlateau(height, vertex, slack);
    if (!(height(beyond) > height(vertex))) return vertex;
    vertex = beyond;
  }
}

template <typename FindHighest>
Box boxOf(const Hull& hull, const Pose& worldFromBody, FindHighest&& find) {
  const Mat3 rotation = worldFromBody.rotation.toRotationMatrix();
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 row = rotation.row(axis).transpose();
    const double translation = worldFromBody.translation[axis];
    for (const int upper : {0, 1}) {
      const Height height{hull, upper == 1 ? row : Vec3(-row)};
      const double extent = height(find(height, 2 * axis + upper));
      if (upper == 1) {
        box.max[axis] = outward(extent, translation, hull.radius);
      } else {
        box.min[axis] = -outward(extent, -translation, hull.radius);
      }
    }
  }
  return box;
}

}  // namespace

Box fixedCube(const Hull& hull, const Pose& worldFromBody) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.max[axis] = outward(hull.radius, worldFromBody.translation[axis], hull.radius);
    box.min[axis] = -outward(hull.radius, -worldFromBody.translation[axis], hull.radius);
  }
  return box;
}

Box tightBox(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last) {
  return boxOf(hull, worldFromBody, [&last](const Height& height, int side) {
    std::uint32_t& vertex = last.vertex[static_cast<std::size_t>(side)];
    vertex = highest(height, vertex);
    return vertex;
  });
}

Box tightBoxBruteForce(const Hull& hull, const Pose& worldFromBody) {
  return boxOf(hull, worldFromBody,
               [](const Height& height, int) { return bruteForceHighest(height); });
}

}  // namespace enfilade::collision
