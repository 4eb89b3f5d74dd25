// Hierarchical uniform grid: maps boxes to cells. It finds the static boxes that may overlap the
// window of a dynamic proxy.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/broad_phase/signed_bounds.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

using CellCoords = std::array<std::int32_t, 3>;

/// Cells from `low` to `high`, inclusive, on one level. Default: empty.
struct CellRange {
  CellCoords low{0, 0, 0};
  CellCoords high{-1, -1, -1};

  bool contains(const CellCoords& at) const {
    return low[0] <= at[0] && at[0] <= high[0] && low[1] <= at[1] && at[1] <= high[1] &&
           low[2] <= at[2] && at[2] <= high[2];
  }
  double count() const {
    return (1.0 + high[0] - low[0]) * (1.0 + high[1] - low[1]) * (1.0 + high[2] - low[2]);
  }
};

using FineCoords = std::array<std::int64_t, 6>;
constexpr int kFineBits = 6;  ///< subcell bits of a fine coordinate: 64 steps per cell

/// Cells of a box whose maximum endpoints have these fine coordinates.
inline CellRange toCellRange(const FineCoords& maxCoords) {
  CellRange range;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    range.low[axis] = static_cast<std::int32_t>(-maxCoords[axis] >> kFineBits);
    range.high[axis] = static_cast<std::int32_t>(maxCoords[axis + 3] >> kFineBits);
  }
  return range;
}

template <typename Visit>
void forEachCoords(const CellRange& range, Visit&& visit) {
  for (std::int32_t x = range.low[0]; x <= range.high[0]; ++x) {
    for (std::int32_t y = range.low[1]; y <= range.high[1]; ++y) {
      for (std::int32_t z = range.low[2]; z <= range.high[2]; ++z) visit(CellCoords{x, y, z});
    }
  }
}

/// Hierarchy of grids of cubic cells. Each level has cells four times as wide as the previous one.
/// The last level has one cell, which covers all of space. On the other levels coordinates end at
/// +-2^30 and the outermost cells are unbounded, so every finite box has cells on every level.
class CellGrid {
 public:
  static constexpr double kMaxCells = 8;  ///< maximum number of cells of a box on its level

  /// Chooses the cell size from `boxes`; 1 m if there are none.
  explicit CellGrid(std::span<const Aabb> boxes);

  std::size_t levelCount() const { return levelCount_; }
  double edge() const { return edge_; }  ///< edge of the finest cells, metres

  /// Maximum endpoints of a box on the finest level, in 64ths of a cell, rounded down. The mapping
  /// is monotone despite rounding, so fine coordinates compare like the endpoints themselves.
  FineCoords toFineCoords(const SignedBounds& maxEndpoints) const;
  /// Converts coordinates of the finest level to another level.
  FineCoords toLevel(std::size_t level, const FineCoords& finest) const;
  /// Finest level on which the box lies in at most kMaxCells cells. Converts `fineCoords` to it.
  std::size_t chooseLevel(FineCoords& fineCoords) const;

 private:
  std::int64_t toFineCoord(std::size_t axis, double x) const;

  std::array<double, 3> origin_{0, 0, 0};
  double edge_ = 1, inverseEdge_ = 1;  ///< of the finest cells, metres and 1/metres
  std::size_t levelCount_ = 2;
};

std::uint64_t hashCell(std::size_t level, const CellCoords& at);

}  // namespace enfilade::collision
