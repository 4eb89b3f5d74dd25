// The grids that tell which still boxes may stand in a mover's own cell, and nothing more.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/broad_phase/signed_bounds.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

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
};

using FinePlaces = std::array<std::int64_t, 6>;
constexpr int kFineBits = 6;  ///< of a fine place lie below its cell's

/// The cells of a box whose reach has these fine places.
inline CellRange rangeOf(const FinePlaces& reach) {
  CellRange range;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    range.low[axis] = static_cast<std::int32_t>(-reach[axis] >> kFineBits);
    range.high[axis] = static_cast<std::int32_t>(reach[axis + 3] >> kFineBits);
  }
  return range;
}

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

  std::size_t levelCount() const { return levelCount_; }
  double edge() const { return edge_; }  ///< metres, of the finest cells

  /// Where a box lies on the finest level, in 64ths of a cell, rounded down: on each half-axis the
  /// place of its reach, by which boxes can be compared as by the reach itself: the place of a
  /// coordinate is a monotone function of it, however rounded.
  FinePlaces finePlacesOf(const HalfAxes& reach) const;
  /// The same on another level, by what they are on the finest.
  FinePlaces onLevel(std::size_t level, const FinePlaces& finest) const;
  /// The finest level on which the box lies in at most kMostCells cells; `places` become those on
  /// it.
  std::size_t levelFor(FinePlaces& places) const;

 private:
  std::int64_t finePlaceOf(std::size_t axis, double x) const;

  std::array<double, 3> origin_{0, 0, 0};
  double edge_ = 1, inverseEdge_ = 1;  ///< metres, of the finest cells
  std::size_t levelCount_ = 2;
};

std::uint64_t hashOf(std::size_t level, const CellPlace& at);

}  // namespace enfilade::collision
