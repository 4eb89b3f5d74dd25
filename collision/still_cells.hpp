// The still boxes, binned into cells, with the sorted end points of each cell. Built at once; then
// boxes come and go one by one, and only the cells that they lie in are touched.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "collision/cell_grid.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

class StillCells {
 public:
  /// A still box in our own order: those of the build by cell, so that neighbours are near.
  using Row = std::uint32_t;
  using Cell = std::uint32_t;  ///< index of a cell that holds at least one box, or held one once
  static constexpr Cell kNoCell = static_cast<Cell>(-1);
  static constexpr Row kNoRow = static_cast<Row>(-1);

  /// `ids` beside `boxes`; boxes are finite and not empty. Throws std::length_error above 2^32 - 2
  /// boxes or 2^32 - 2 cells; entries (a box in a cell) are limited by memory alone.
  StillCells(std::span<const Box> boxes, std::span<const std::uint32_t> ids);

  const HalfAxes& onset(Row row) const { return onsets_[row]; }
  std::uint32_t idOf(Row row) const { return ids_[row]; }

  /// Rows of a cell, ascending by their onset on half-axis `k`, ties by row.
  std::span<const Row> sorted(Cell cell, std::size_t k) const {
    const CellData& c = cells_[cell];
    return {c.rows + k * c.room, c.count};
  }
  std::size_t levelOf(Cell cell) const { return cells_[cell].level; }
  const CellPlace& placeOf(Cell cell) const { return cells_[cell].at; }
  const CellGrid& grid() const { return grid_; }

  /// Levels that have a cell, ascending.
  std::span<const std::size_t> levels() const { return usedLevels_; }
  std::span<const Cell> cellsOf(std::size_t level) const { return cellsOfLevel_[level]; }
  Cell find(std::size_t level, const CellPlace& at) const;

  /// Calls `visit` with each cell of a level that lies in `range` and not in `except`.
  template <typename Visit>
  void forEachCell(std::size_t level, const CellRange& range, const CellRange& except,
                   Visit&& visit) const;

  // ---- boxes that come and go ----

  /// What edits have touched since clearEdits().
  struct Edits {
    std::vector<Cell> cells;  ///< each once, whose lists changed
    std::vector<Cell> added;  ///< those of them that are new
    bool levelAdded = false;  ///< a level has its first cell
    bool any() const { return !cells.empty(); }
  };
  const Edits& edits() const { return edits_; }
  bool edited(Cell cell) const { return cells_[cell].edited; }

  /// Whether `count` more boxes fit; when not, build anew. A build leaves room for half as many
  /// edits as it took boxes, so that building costs O(log n) an edit in the long run.
  bool hasRoomFor(std::size_t count) const;
  void insert(const Box& box, std::uint32_t id);
  /// Until clearEdits() the row stays, with the same id, and is met by nothing.
  void remove(Row row);
  Row rowOf(std::uint32_t id);  ///< kNoRow if there is none; O(1), but O(n) when first asked
  void clearEdits();

  /// Bytes held besides the boxes themselves. Room that was never touched is not counted.
  std::size_t bytesBesidesBoxes() const;

 private:
  struct CellData {
    CellPlace at;
    std::uint16_t level;
    bool edited;
    Row* rows;            ///< six lists, `room` apart
    std::uint32_t count;  ///< of each list
    std::uint32_t room;
  };
  struct Entries;  // of the build: which cells each box lies in

  std::size_t slotOf(std::size_t level, const CellPlace& at) const;
  Cell findOrAdd(std::size_t level, const CellPlace& at);
  void rebuildSlots(std::size_t size);

  Entries enterBoxes(std::span<const Box> boxes);
  std::vector<Cell> orderCells();
  void fill(std::span<const Box> boxes, std::span<const std::uint32_t> ids, const Entries& entries);
  void listLevels();

  void touch(Cell cell);
  Cell openCell(std::size_t level, const CellPlace& at);
  void growCell(CellData& cell);
  void insertIntoCell(Cell cell, Row row);
  void removeFromCell(Cell cell, Row row);

  CellGrid grid_;
  std::vector<HalfAxes> onsets_;
  std::vector<std::uint32_t> ids_;
  std::vector<CellData> cells_;
  std::vector<Cell> slots_;  ///< open addressing, a power of two; kNoCell where free
  std::vector<std::size_t> usedLevels_;
  std::vector<std::vector<Cell>> cellsOfLevel_;
  std::unique_ptr<Row[]> sorted_;  ///< the lists as built, cell after cell
  std::size_t sortedSize_ = 0;

  std::vector<std::vector<Row>> grown_;  ///< the lists of cells that outgrew their room
  std::vector<Row> rowOf_;               ///< by id; empty until first asked
  std::vector<Row> freeRows_, removedRows_;
  Edits edits_;
  std::size_t editCount_ = 0, mostEdits_ = 0;
};

template <typename Visit>
void StillCells::forEachCell(std::size_t level, const CellRange& range, const CellRange& except,
                             Visit&& visit) const {
  const std::span<const Cell> all = cellsOf(level);
  if (range.count() > static_cast<double>(all.size())) {  // to look at all of them is less
    for (const Cell cell : all) {
      if (range.contains(placeOf(cell)) && !except.contains(placeOf(cell))) visit(cell);
    }
    return;
  }
  forEachPlace(range, [&](const CellPlace& at) {
    if (except.contains(at)) return;
    const Cell cell = find(level, at);
    if (cell != kNoCell) visit(cell);
  });
}

}  // namespace enfilade::collision
