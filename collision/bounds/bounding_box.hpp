// Bounding boxes of moving convex bodies (Lin 1993, section 5.2.1; Cohen et al. 1995, section 4):
// the cube of the bounding sphere, and the tight box. The tight box comes from hill climbing from
// the last tick's extremal vertices or from a scan of all vertices.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "collision/shapes/hull.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

enum class AabbMethod : std::uint8_t {
  sphereCube,  ///< cube of the bounding sphere about the body's origin
  vertexScan,  ///< tight: looks at all vertices
  hillClimb    ///< tight: looks at the neighbours of the last climb's extremal vertices, unless the
               ///< body has turned so far since the last box that a scan costs less
};

/// The method that is used for a hull and, for hill climbing, the coordinates of the neighbours of
/// each vertex, which lie together.
struct SupportTable {
  AabbMethod method = AabbMethod::vertexScan;
  /// 1 + 2 cos of the largest turn since the last box after which it climbs; -infinity: always.
  double minTurnTrace = 0;
  /// Neighbours of vertex v: blocks fanOffsets[v] to fanOffsets[v + 1] of `fans`. Each block has
  /// two neighbours as x x y y z z, with their indices in `fanVertices`. The blocks of a vertex may
  /// repeat its last neighbour.
  std::vector<std::uint32_t> fanOffsets, fanVertices;
  std::vector<double> fans;
};

/// `hull` as buildHull() makes it. Each vertex may since have been moved by up to 2 units of
/// rounding of the radius.
SupportTable buildSupportTable(const Hull& hull, AabbMethod method);
/// With the method that chooseAabbMethod() returns.
SupportTable buildSupportTable(const Hull& hull);

/// Extremal vertices of the last climb: vertex indices for -x, +x, -y, +y, -z, +z. They influence
/// cost only: every box is the same to the last bit whatever these indices are.
struct ExtremalVertices {
  std::array<std::uint32_t, 6> vertex{};
  /// Of the last box; NaN before the first one, which is climbed, so that the second has a start.
  Mat3 rotation = Mat3::Constant(std::numeric_limits<double>::quiet_NaN());
};

// The boxes below contain the exact box of all vertices at rotation * v + translation, inflated by
// `clearance` (metres, >= 0, finite). The rotation is this matrix and also the unit quaternion that
// it was computed from. `rotation`: from a quaternion with |q|^2 = 1 up to 16 units of rounding;
// all values finite.

/// Box by the method of `table`, which is that of `hull`. Adds the vertices that it looks at to
/// `looked`, repeated ones too.
Aabb computeAabb(const Hull& hull, const SupportTable& table, const Mat3& rotation,
                 const Vec3& translation, ExtremalVertices& last, std::uint64_t& looked,
                 double clearance = 0);

/// Tight box by a scan of all vertices: the same as by hill climbing, to the last bit.
Aabb computeTightAabb(const Hull& hull, const Mat3& rotation, const Vec3& translation,
                      double clearance = 0);

/// The method that costs least per tick for a body that turns by a few degrees. The cost includes
/// the narrow-phase queries that a larger box causes among bodies of its own size.
AabbMethod chooseAabbMethod(const Hull& hull);
/// The tight method that costs less for a body that turns by 2 degrees a tick.
AabbMethod chooseTightMethod(const Hull& hull);

}  // namespace enfilade::collision
