// The still boxes, binned into cells, with the sorted end points of each cell. Immutable once
// built.
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
inline bool meets(const HalfAxes& onset, const HalfAxes& reach) {
  bool met = true;
  for (std::size_t k = 0; k < 6; ++k) met &= onset[k] <= reach[k];
  return met;
}

/// Cells from `low` to `high`, both included, on one level.
struct CellRange {
  std::array<std::int32_t, 3> low{0, 0, 0};
  std::array<std::int32_t, 3> high{-1, -1, -1};

  bool contains(const std::array<std::int32_t, 3>& at) const {
    return low[0] <= at[0] && at[0] <= high[0] && low[1] <= at[1] && at[1] <= high[1] &&
           low[2] <= at[2] && at[2] <= high[2];
  }
  double count() const {
    return (high[0] - low[0] + 1.0) * (high[1] - low[1] + 1.0) * (high[2] - low[2] + 1.0);
  }
  bool operator==(const CellRange&) const = default;
};

class StillCells {
 public:
  using Row =
      std::uint32_t;  ///< a still box in our own order: by cell, so that neighbours are near
  using Cell = std::uint32_t;  ///< index of a cell that holds at least one box
  static constexpr Cell kNoCell = static_cast<Cell>(-1);

  explicit StillCells(std::span<const Box> boxes);

  const HalfAxes& onset(Row row) const { return onsets_[row]; }
  std::uint32_t idOf(Row row) const { return ids_[row]; }  ///< index into the boxes given

  /// Rows of a cell, ascending by their onset on half-axis `k`, ties by row.
  std::span<const Row> sorted(Cell cell, std::size_t k) const {
    const CellData& c = cells_[cell];
    return {sorted_.data() + 6 * std::size_t{c.first} + k * c.count, c.count};
  }
  std::uint32_t sizeOf(Cell cell) const { return cells_[cell].count; }
  std::size_t levelOf(Cell cell) const { return cells_[cell].level; }
  const std::array<std::int32_t, 3>& placeOf(Cell cell) const { return cells_[cell].at; }

  std::size_t levelCount() const { return levels_.size(); }
  /// The cells of a level are cellsBegin(level) .. cellsBegin(level + 1) - 1.
  Cell cellsBegin(std::size_t level) const;
  Cell find(std::size_t level, const std::array<std::int32_t, 3>& at) const;

  /// Calls `visit` with each cell of a level that lies in `range` and not in `except`.
  template <typename Visit>
  void forEachCell(std::size_t level, const CellRange& range, const CellRange& except,
                   Visit&& visit) const;

  /// The cells of a level that a box lies in. Boxes that overlap share at least one cell of every
  /// level, because the cell of a coordinate is a monotone function of it, however rounded.
  CellRange rangeOf(std::size_t level, const HalfAxes& reach) const;
  /// Narrows `low` <= reach < `high` to reaches that surely give the same range.
  void narrowToRange(std::size_t level, const HalfAxes& reach, const CellRange& range,
                     HalfAxes& low, HalfAxes& high) const;

  /// Bytes held besides the boxes themselves.
  std::size_t bytesBesidesBoxes() const;
  double edge() const { return levels_.empty() ? 0 : levels_.front().edge; }

 private:
  struct Level {
    double edge = 1;  ///< metres
    double inverseEdge = 1;
    Vec3 origin = Vec3::Zero();
    std::array<std::int32_t, 3> cells{1, 1, 1};  ///< along each axis; the outer ones are endless
    Cell begin = 0;                              ///< first cell of this level
  };
  struct CellData {
    std::array<std::int32_t, 3> at;
    std::uint32_t level;
    std::uint32_t first;  ///< entries of the cells before
    std::uint32_t count;
  };

  std::int32_t cellOf(const Level& level, int axis, double x) const;
  std::size_t slotOf(std::size_t level, const std::array<std::int32_t, 3>& at) const;
  Cell findOrAdd(std::size_t level, const std::array<std::int32_t, 3>& at);
  void rebuildSlots(std::size_t size);
  void layLevels(std::span<const Box> boxes);
  std::size_t levelFor(const HalfAxes& reach, CellRange& range) const;
  void addCells(std::span<const Box> boxes);
  void dropUnusedLevels();
  void orderCells();
  void orderRows(std::span<const Box> boxes);
  void fillCells();
  void sortCells();

  std::vector<HalfAxes> onsets_;
  std::vector<std::uint32_t> ids_;
  std::vector<Level> levels_;
  std::vector<CellData> cells_;
  std::vector<Cell> slots_;  ///< open addressing, a power of two; kNoCell where free
  std::vector<Row> sorted_;  ///< per cell six lists
};

template <typename Visit>
void StillCells::forEachCell(std::size_t level, const CellRange& range, const CellRange& except,
                             Visit&& visit) const {
  const Cell begin = cellsBegin(level);
  const Cell end = cellsBegin(level + 1);
  if (range.count() > end - begin) {  // larger than the level: all of its cells are fewer
    for (Cell cell = begin; cell < end; ++cell) {
      if (range.contains(placeOf(cell)) && !except.contains(placeOf(cell))) visit(cell);
    }
    return;
  }
  for (std::int32_t x = range.low[0]; x <= range.high[0]; ++x) {
    for (std::int32_t y = range.low[1]; y <= range.high[1]; ++y) {
      for (std::int32_t z = range.low[2]; z <= range.high[2]; ++z) {
        if (except.contains({x, y, z})) continue;
        const Cell cell = find(level, {x, y, z});
        if (cell != kNoCell) visit(cell);
      }
    }
  }
}

}  // namespace enfilade::collision
