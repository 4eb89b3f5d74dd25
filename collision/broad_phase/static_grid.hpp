// Hierarchical grid of the static boxes. It is built at once. Boxes can then be inserted and
// removed one by one, which changes only the cells that they lie in.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/broad_phase/cell_grid.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

class StaticGrid {
 public:
  /// Internal index of a static box. A build orders rows by cell: neighbours are close in memory.
  using Row = std::uint32_t;
  using Cell = std::uint32_t;  ///< index of a cell that holds or once held a box
  static constexpr Cell kNoCell = static_cast<Cell>(-1);
  static constexpr Row kNoRow = static_cast<Row>(-1);

  /// `ids[i]` is the id of `boxes[i]`; boxes must be finite and not empty. Throws std::length_error
  /// above 2^32 - 2 boxes or 2^32 - 2 cells. Memory alone limits the entries (a box in a cell).
  StaticGrid(std::span<const Aabb> boxes, std::span<const std::uint32_t> ids);

  const SignedBounds& minEndpoints(Row row) const { return minEndpoints_[row]; }
  std::uint32_t getId(Row row) const { return ids_[row]; }
  const CellGrid& grid() const { return grid_; }

  /// The first `count` rows of a vector that never shrinks, which avoids its initialisation.
  struct RowList {
    std::vector<Row> rows;
    std::size_t count = 0;
    std::span<Row> all() { return std::span(rows).first(count); }
  };
  /// Appends the rows of all boxes that overlap `maxEndpoints`, each once, and possibly of some
  /// boxes close to it.
  void gather(const SignedBounds& maxEndpoints, RowList& rows) const;

  // ---- insertion and removal ----

  /// True if `count` more edits fit; rebuild otherwise. A build allows half as many edits as it has
  /// boxes, so rebuilds cost O(log n) per edit, amortised.
  bool hasCapacityFor(std::size_t count) const;
  void insert(const Aabb& box, std::uint32_t id);
  void remove(Row row);
  Row findRow(std::uint32_t id);  ///< kNoRow for an unknown id; O(1), but O(n) at the first call

  /// Memory in bytes without 48 bytes per box.
  std::size_t overheadBytes() const;

 private:
  /// A box in a cell, in 16 bytes. Six lanes are fine coordinates of its minimum endpoints relative
  /// to the cell's low corner, clamped to 16 bits. The last two hold its row.
  using Entry = std::int16_t __attribute__((vector_size(16)));
  struct CellData {
    CellCoords coords;
    std::uint32_t level;
    Entry* entries;
    std::uint32_t count, capacity;
  };
  struct CellAssignment;  // of the build: the cells of each box

  static Entry toCellOffsets(const FineCoords& fineCoords, const CellCoords& cell);
  static Entry makeEntry(const FineCoords& maxCoords, const CellCoords& cell, Row row);
  static Row extractRow(const Entry& entry);
  void gatherFromCell(const CellData& cell, const FineCoords& maxCoords, const CellRange& range,
                      RowList& rows) const;
  template <typename Visit>
  void forEachCell(std::size_t level, const CellRange& range, Visit&& visit) const;

  void gatherFromSmallRange(std::size_t level, const FineCoords& fineCoords, const CellRange& range,
                            RowList& rows) const;

  std::size_t findSlot(std::size_t level, const CellCoords& at) const;
  std::size_t probeSlots(std::size_t slot, std::size_t level, const CellCoords& at) const;
  Cell findOrAddCell(std::size_t level, const CellCoords& at);
  void rebuildSlots(std::size_t size);

  CellAssignment assignCells(std::span<const Aabb> boxes);
  std::vector<Cell> sortCells();
  void fillEntries(std::span<const Aabb> boxes, std::span<const std::uint32_t> ids,
                   const CellAssignment& assignment);

  void growCell(CellData& cell);

  CellGrid grid_;
  std::vector<SignedBounds> minEndpoints_;
  std::vector<std::uint32_t> ids_;
  std::vector<CellData> cells_;
  std::vector<Cell> slots_;              ///< hash table: open addressing, size 2^n; kNoCell: free
  std::vector<std::size_t> usedLevels_;  ///< levels that have a cell, ascending
  std::vector<Entry> entries_;           ///< as built, cell after cell

  std::vector<std::vector<Entry>>
      overflowBlocks_;        ///< entries of cells that outgrew their capacity
  std::vector<Row> rowById_;  ///< by id; empty until first needed
  std::vector<Row> freeRows_;
  std::size_t editCount_ = 0, maxEdits_ = 0;
};

}  // namespace enfilade::collision
