// Hill climbing (Lin 1993, section 5.2.1) handles one side of one axis at a time. It starts at the
// last tick's vertex and moves to the most extreme neighbour while that is more extreme. A test is
// one dot product with a row of the rotation matrix. The neighbours of a vertex lie together in
// memory, two to a SIMD register. Lin stops there. In rounded arithmetic that is not enough: along
// a face that is nearly perpendicular to the axis, every step may be below the rounding error. The
// climb may then stop far from the extremal vertex. findHigherVertex() therefore also searches the
// neighbours of all vertices that rounding cannot distinguish from the highest one (the plateau).
//
// Both tight methods return the maximum of the same rounded projections. Let e = 2^-53 and r the
// radius. A dot product of a computed row errs by at most 3.1e r. A vertex may have been moved by
// 2e r since the hull was built. Let v be the last vertex of a climb and t the extremal one of the
// hull as built. Along some path of edges from v to t the exact projections rise. Every vertex of
// the path therefore has a computed projection of at least that of v minus 10.2e r. kPlateau = 16e
// exceeds that: the search of the plateau meets every vertex that may be the maximum.
//
// Rounding of a box. The matrix comes from a quaternion whose squared norm is within 16e of 1. An
// entry has an error of at most 5e on the diagonal and 2e elsewhere, so a row has less than 6e. The
// normalised rotation is within 39e of it. With the dot product the sum is less than 49e r, and
// kRotationError = 64e covers the rounding of r. Adding the translation and the margin costs 2e of
// the sums, which are below the sum of their terms; kSumError = 4e. The rest, 2e of the sizes, is
// for a translation that a caller rounds once more (placeBoxOutward() of the scene).
#include "collision/bounds/bounding_box.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/double2.hpp"
#include "collision/floating_point.hpp"
#include "collision/sine_cosine.hpp"

namespace enfilade::collision {
namespace {

constexpr double kRotationError = 64 * kRoundoff;
constexpr double kSumError = 4 * kRoundoff;
constexpr double kPlateau = 16 * kRoundoff;
constexpr double kUnderflow = 0x1p-1000;  // above the loss of a few products to underflow

// Nanoseconds, measured by `./dev bench boxes` (tests/benchmarks/report/boxes.md). A pair is a
// warm narrow-phase query of two bodies that are clear.
constexpr double kCubeCost = 4, kScanCost = 3.2, kScanCostPerVertex = 1.18;
constexpr double kClimbCost = 46;       // of a body that hardly turns
constexpr double kClimbTurnCost = 150;  // a radian of turn, times the fourth root of the vertices
constexpr double kPairCost = 200;
constexpr double kUsualTurn = 0.035;  // radians a tick: 2 degrees

constexpr std::size_t kBlock = 6;  // doubles a block: two vertices
// Neighbours of a vertex at least, some repeated: most loops over them have one length then, which
// the processor predicts.
constexpr std::size_t kMinFan = 8;
const Double2 kLowest = {-std::numeric_limits<double>::infinity(),
                         -std::numeric_limits<double>::infinity()};

double project(const Vec3& direction, const Vec3& v) {
  return direction.x() * v.x() + direction.y() * v.y() + direction.z() * v.z();
}

/// Projections of the two vertices of a block; the same operations as in project().
Double2 projectBlock(const Vec3& direction, const double* block) {
  return direction.x() * loadDouble2(block) + direction.y() * loadDouble2(block + 2) +
         direction.z() * loadDouble2(block + 4);
}

Double2 chooseLarger(Double2 a, Double2 b) {
  return a > b ? a : b;
}
double chooseLarger(Double2 lanes) {
  return std::max(lanes[0], lanes[1]);
}

void appendFans(const Hull& hull, SupportTable& table) {
  for (std::uint32_t v = 0; v < hull.vertices.size(); ++v) {
    table.fanOffsets.push_back(static_cast<std::uint32_t>(table.fans.size() / kBlock));
    const auto neighbours = hull.getNeighbours(v);
    const std::size_t count = neighbours.empty() ? 0 : std::max(neighbours.size(), kMinFan);
    for (std::size_t k = 0; k < count; k += 2) {
      const std::size_t last = neighbours.size() - 1;
      const std::uint32_t first = neighbours[std::min(k, last)],
                          second = neighbours[std::min(k + 1, last)];
      table.fanVertices.insert(table.fanVertices.end(), {first, second});
      for (int axis = 0; axis < 3; ++axis)
        table.fans.insert(table.fans.end(),
                          {hull.vertices[first][axis], hull.vertices[second][axis]});
    }
  }
  table.fanOffsets.push_back(static_cast<std::uint32_t>(table.fans.size() / kBlock));
}

/// A vertex, and its projection on a signed axis.
struct Top {
  std::uint32_t vertex;
  double height;
};

/// Finds the extremal vertex along one signed axis.
struct Climber {
  const Hull& hull;
  const SupportTable& table;
  Vec3 direction;
  std::uint64_t& looked;

  double computeHeight(std::uint32_t vertex) const {
    return project(direction, hull.vertices[vertex]);
  }

  Top findHighestVertex() {
    looked += hull.vertices.size();
    Top top{0, computeHeight(0)};
    for (std::uint32_t v = 1; v < hull.vertices.size(); ++v)
      if (const double height = computeHeight(v); height > top.height) top = {v, height};
    return top;
  }

  /// Searches all vertices that are connected to `top` through vertices not provably lower.
  /// Returns the first higher vertex, or `top` if no vertex is higher; it is then extremal.
  Top findHigherVertex(const Top& top, double slack) {
    constexpr std::size_t kMaxPlateau = 64;  // plateau size above which a scan is as good
    std::array<std::uint32_t, kMaxPlateau> plateau;
    std::size_t size = 0;
    plateau[size++] = top.vertex;
    for (std::size_t k = 0; k < size; ++k) {
      const auto neighbours = hull.getNeighbours(plateau[k]);
      looked += neighbours.size();
      for (const std::uint32_t next : neighbours) {
        const double height = computeHeight(next);
        if (height < top.height - slack) continue;
        if (height > top.height) return {next, height};
        if (std::find(plateau.begin(), plateau.begin() + size, next) != plateau.begin() + size)
          continue;
        if (size == kMaxPlateau) return findHighestVertex();
        plateau[size++] = next;
      }
    }
    return top;
  }

  /// The height of the highest neighbour of `vertex`, or minus infinity if it has none. The result
  /// has the block of its first neighbour in place of a vertex.
  Top findHighestNeighbour(std::uint32_t vertex) {
    const std::uint32_t from = table.fanOffsets[vertex], to = table.fanOffsets[vertex + 1];
    looked += 2 * (to - from);
    Double2 highest = kLowest;
    for (std::uint32_t k = from; k < to; ++k)
      highest = chooseLarger(highest, projectBlock(direction, &table.fans[kBlock * k]));
    return {from, chooseLarger(highest)};
  }

  /// Index of the first neighbour of this height in the blocks from `block` on.
  std::uint32_t findNeighbour(std::uint32_t block, double height) const {
    for (;; ++block) {
      const Double2 heights = projectBlock(direction, &table.fans[kBlock * block]);
      if (heights[0] == height) return table.fanVertices[2 * block];
      if (heights[1] == height) return table.fanVertices[2 * block + 1];
    }
  }

  /// Height of the extremal vertex; `start` becomes that vertex.
  double climb(std::uint32_t& start) {
    const double slack = kPlateau * hull.radius + kUnderflow;
    Top top{start < hull.vertices.size() ? start : 0, 0};
    top.height = computeHeight(top.vertex);
    for (;;) {  // heights rise strictly: at most one visit per vertex
      const Top next = findHighestNeighbour(top.vertex);
      if (next.height > top.height) {
        top = {findNeighbour(next.vertex, next.height), next.height};
        continue;
      }
      if (next.height < top.height - slack) break;
      const Top higher = findHigherVertex(top, slack);
      if (!(higher.height > top.height)) break;
      top = higher;
    }
    start = top.vertex;
    return top.height;
  }
};

Aabb climbSides(const Hull& hull, const SupportTable& table, const Mat3& rotation,
                ExtremalVertices& last, std::uint64_t& looked) {
  Aabb extents;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 row = rotation.row(axis).transpose();
    const auto side = static_cast<std::size_t>(2 * axis);
    extents.min[axis] = -Climber{hull, table, -row, looked}.climb(last.vertex[side]);
    extents.max[axis] = Climber{hull, table, row, looked}.climb(last.vertex[side + 1]);
  }
  return extents;
}

// Inlined: a call costs a tenth of a box of 8 vertices.

/// Rows 0 and 1 of the rotation side by side, row 2 alone. The same sums as in project(), in the
/// same order.
[[gnu::always_inline]] inline Aabb scanVertices(const Hull& hull, const Mat3& rotation) {
  const Double2 column0 = {rotation(0, 0), rotation(1, 0)},
                column1 = {rotation(0, 1), rotation(1, 1)},
                column2 = {rotation(0, 2), rotation(1, 2)};
  const Vec3 row2 = rotation.row(2).transpose();
  Double2 highest = kLowest, lowest = -kLowest;
  double highest2 = highest[0], lowest2 = lowest[0];
  for (const Vec3& v : hull.vertices) {
    const Double2 heights = column0 * v.x() + column1 * v.y() + column2 * v.z();
    const double height2 = project(row2, v);
    highest = chooseLarger(highest, heights);
    lowest = lowest < heights ? lowest : heights;
    highest2 = std::max(highest2, height2);
    lowest2 = std::min(lowest2, height2);
  }
  return {Vec3(lowest[0], lowest[1], lowest2), Vec3(highest[0], highest[1], highest2)};
}

/// `extents` at `translation`, inflated by the bound of its rounding error and by `clearance`.
[[gnu::always_inline]] inline Aabb placeExtents(const Aabb& extents, const Vec3& translation,
                                                double radius, double clearance) {
  const double size = 2 * radius + translation.cwiseAbs().maxCoeff() + clearance;
  const double margin = kRotationError * radius + kSumError * size + kUnderflow + clearance;
  return inflate({extents.min + translation, extents.max + translation}, margin);
}

/// Mean width of the hull over 13 directions: axes, face diagonals and space diagonals of a cube.
double computeMeanWidth(const Hull& hull) {
  double sum = 0;
  int directions = 0;
  for (int code = 14; code < 27; ++code) {  // the half of {-1, 0, 1}^3 after 0 0 0
    const Vec3 direction(code / 9 - 1, code / 3 % 3 - 1, code % 3 - 1);
    double highest = -std::numeric_limits<double>::infinity(), lowest = -highest;
    for (const Vec3& v : hull.vertices) {
      const double height = project(direction, v);
      highest = std::max(highest, height);
      lowest = std::min(lowest, height);
    }
    sum += (highest - lowest) / direction.norm();
    ++directions;
  }
  return sum / directions;
}

double estimateScanCost(const Hull& hull) {
  return kScanCost + kScanCostPerVertex * static_cast<double>(hull.vertices.size());
}

/// Of a climb after a turn, per radian.
double estimateTurnCost(const Hull& hull) {
  return kClimbTurnCost * std::sqrt(std::sqrt(static_cast<double>(hull.vertices.size())));
}

double estimateClimbCost(const Hull& hull, double turn) {
  return kClimbCost + estimateTurnCost(hull) * turn;
}

/// The turn up to which a climb costs no more than a scan: radians, 0 to a half turn.
double findMaxClimbTurn(const Hull& hull) {
  return std::clamp((estimateScanCost(hull) - kClimbCost) / estimateTurnCost(hull), 0.0, 3.0);
}

/// Bodies of its own kind that overlap the cube of a body and not its tight box, if these bodies
/// lie side by side. This is an upper bound for what the cube costs.
double estimateFalsePairs(const Hull& hull) {
  const double width = computeMeanWidth(hull);
  if (!(width > 0)) return 0;
  const double cube = 2 * hull.radius / width + 1, tight = 2;  // of two boxes together, in widths
  return cube * cube * cube - tight * tight * tight;
}

}  // namespace

SupportTable buildSupportTable(const Hull& hull, AabbMethod method) {
  ENFILADE_ASSERT(!hull.vertices.empty());
  SupportTable table;
  table.method = method;
  table.minTurnTrace =
      1 + 2 * computeSineCosineOfDegrees(kDegreesPerRadian * findMaxClimbTurn(hull)).cosine;
  if (method == AabbMethod::hillClimb) appendFans(hull, table);
  return table;
}

SupportTable buildSupportTable(const Hull& hull) {
  return buildSupportTable(hull, chooseAabbMethod(hull));
}

Aabb computeAabb(const Hull& hull, const SupportTable& table, const Mat3& rotation,
                 const Vec3& translation, ExtremalVertices& last, std::uint64_t& looked,
                 double clearance) {
  switch (table.method) {
    case AabbMethod::sphereCube: {
      const Vec3 extent = Vec3::Constant(hull.radius);
      return placeExtents({-extent, extent}, translation, hull.radius, clearance);
    }
    case AabbMethod::hillClimb: {
      const double trace = rotation.cwiseProduct(last.rotation).sum();  // of the turn's matrix
      last.rotation = rotation;
      if (!(trace < table.minTurnTrace))
        return placeExtents(climbSides(hull, table, rotation, last, looked), translation,
                            hull.radius, clearance);
      break;
    }
    case AabbMethod::vertexScan:
      break;
  }
  looked += hull.vertices.size();
  return computeTightAabb(hull, rotation, translation, clearance);
}

Aabb computeTightAabb(const Hull& hull, const Mat3& rotation, const Vec3& translation,
                      double clearance) {
  return placeExtents(scanVertices(hull, rotation), translation, hull.radius, clearance);
}

AabbMethod chooseAabbMethod(const Hull& hull) {
  const double cube = kCubeCost + kPairCost * estimateFalsePairs(hull);
  const double tight = std::min(estimateScanCost(hull), estimateClimbCost(hull, kUsualTurn));
  return cube < tight ? AabbMethod::sphereCube : chooseTightMethod(hull);
}

AabbMethod chooseTightMethod(const Hull& hull) {
  return estimateScanCost(hull) <= estimateClimbCost(hull, kUsualTurn) ? AabbMethod::vertexScan
                                                                       : AabbMethod::hillClimb;
}

}  // namespace enfilade::collision
