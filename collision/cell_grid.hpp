// The grids that choose which still boxes share their sorted lists, and nothing more.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::collision {

/// A closed interval has two ends and space three axes: six half-axes, +x +y +z -x -y -z. On each a
/// mover has a reach (how far its box goes: max, or -min) and a still box has an onset (from which
/// reach on it is met: min, or -max). Boxes overlap exactly if every onset <= the reach beside it.
using HalfAxes = std::array<double, 6>;

inline HalfAxes reachOf(const Box& box) {
  return {box.max.x(), box.max.y(), box.max.z(), -box.min.x(), -box.min.y(), -box.min.z()};
}
inline HalfAxes onsetOf(const Box& box) {
  return {box.min.x(), box.min.y(), box.min.z(), -box.max.x(), -box.max.y(), -box.max.z()};
}
inline Box boxOfOnset(const HalfAxes& o) {
  return {Vec3(o[0], o[1], o[2]), Vec3(-o[3], -o[4], -o[5])};
}
inline bool meets(const HalfAxes& onset, const HalfAxes& reach) {
  bool met = true;
  for (std::size_t k = 0; k < 6; ++k) met &= onset[k] <= reach[k];
  return met;
}

using CellPlace = std::array<std::int32_t, 3>;

/// Cells from `low` to `high`, both included, on one level. As made: none.
struct CellRange {
  CellPlace low{0, 0, 0};
  CellPlace high{-1, -1, -1};

  bool contains(const CellPlace& at) const {
    return low[0] <= at[0] && at[0] <= high[0] && low[1] <= at[1] && at[1] <= high[1] &&
           low[2] <= at[2] && at[2] <= high[2];
  }
  double count() const {
    return (1.0 + high[0] - low[0]) * (1.0 + high[1] - low[1]) * (1.0 + high[2] - low[2]);
  }
  bool operator==(const CellRange&) const = default;
};

template <typename Visit>
void forEachPlace(const CellRange& range, Visit&& visit) {
  for (std::int32_t x = range.low[0]; x <= range.high[0]; ++x) {
    for (std::int32_t y = range.low[1]; y <= range.high[1]; ++y) {
      for (std::int32_t z = range.low[2]; z <= range.high[2]; ++z) visit(CellPlace{x, y, z});
    }
  }
}

/// A ladder of grids of cubes, each four times as wide as the one before. The last has one cell,
/// which holds all of space; on the others places end at +-2^30, and the outermost cells are
/// endless, so that every finite box has a place on every level.
class CellGrid {
 public:
  static constexpr double kMostCells = 8;  ///< that one box may lie in on its level

  /// Measures `boxes`; without any, cells of one metre.
  explicit CellGrid(std::span<const Box> boxes);

  std::size_t levelCount() const { return levels_.size(); }
  double edge(std::size_t level) const { return levels_[level].edge; }  ///< metres; last: infinite

  /// The cells of a level that a box lies in. Boxes that overlap share at least one cell of every
  /// level, because the place of a coordinate is a monotone function of it, however rounded.
  CellRange rangeOf(std::size_t level, const HalfAxes& reach) const;
  /// The finest level on which the box lies in at most kMostCells cells; `range` becomes those.
  std::size_t levelFor(const HalfAxes& reach, CellRange& range) const;
  /// Narrows `low` <= reach < `high` to reaches that surely give the same range.
  void narrowToRange(std::size_t level, const HalfAxes& reach, const CellRange& range,
                     HalfAxes& low, HalfAxes& high) const;

 private:
  struct Level {
    double edge;         ///< metres
    double inverseEdge;  ///< 0 on the last level
  };
  std::int32_t placeOf(const Level& level, std::size_t axis, double x) const;

  std::array<double, 3> origin_{0, 0, 0};
  std::vector<Level> levels_;
};

std::uint64_t hashOf(std::size_t level, const CellPlace& at);

}  // namespace enfilade::collision
