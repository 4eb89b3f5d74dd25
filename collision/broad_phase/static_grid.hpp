// The still boxes, binned into cells. Built at once; then boxes come and go one by one, and only
// the cells that they lie in are touched.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/broad_phase/cell_grid.hpp"
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
  const CellGrid& grid() const { return grid_; }

  /// Rows at the front of a vector that never shrinks, so that none are written but those asked
  /// for.
  struct RowList {
    std::vector<Row> rows;
    std::size_t count = 0;
    std::span<Row> all() { return std::span(rows).first(count); }
  };
  /// Appends the rows of all boxes that meet `reach`, each once, and some that miss it narrowly.
  void gather(const HalfAxes& reach, RowList& rows) const;

  // ---- boxes that come and go ----

  /// Whether `count` more boxes fit; when not, build anew. A build leaves room for half as many
  /// edits as it took boxes, so that building costs O(log n) an edit in the long run.
  bool hasRoomFor(std::size_t count) const;
  void insert(const Box& box, std::uint32_t id);
  void remove(Row row);
  Row rowOf(std::uint32_t id);  ///< kNoRow if there is none; O(1), but O(n) when first asked

  /// Bytes held besides 48 for each box.
  std::size_t bytesBesidesBoxes() const;

 private:
  /// A box in a cell. In 16 bytes: on each half-axis the fine place of its onset, counted from the
  /// cell's low corner and clamped to 16 bits; and its row in the last two lanes.
  using Entry = std::int16_t __attribute__((vector_size(16)));
  struct CellData {
    CellPlace at;
    std::uint32_t level;
    Entry* entries;
    std::uint32_t count, room;
  };
  struct Placed;  // of the build: which cells each box lies in

  static Entry lanesOf(const FinePlaces& places, const CellPlace& cell);
  static Entry entryOf(const FinePlaces& reach, const CellPlace& cell, Row row);
  static Row rowOf(const Entry& entry);
  void gatherFrom(const CellData& cell, const FinePlaces& reach, const CellRange& range,
                  RowList& rows) const;
  template <typename Visit>
  void forEachCell(std::size_t level, const CellRange& range, Visit&& visit) const;

  void gatherPlaces(std::size_t level, const FinePlaces& places, const CellRange& range,
                    RowList& rows) const;

  std::size_t slotOf(std::size_t level, const CellPlace& at) const;
  std::size_t probe(std::size_t slot, std::size_t level, const CellPlace& at) const;
  Cell findOrAdd(std::size_t level, const CellPlace& at);
  void rebuildSlots(std::size_t size);

  Placed placeBoxes(std::span<const Box> boxes);
  std::vector<Cell> orderCells();
  void fill(std::span<const Box> boxes, std::span<const std::uint32_t> ids, const Placed& placed);

  Cell openCell(std::size_t level, const CellPlace& at);
  void growCell(CellData& cell);

  CellGrid grid_;
  std::vector<HalfAxes> onsets_;
  std::vector<std::uint32_t> ids_;
  std::vector<CellData> cells_;
  std::vector<Cell> slots_;              ///< open addressing, a power of two; kNoCell where free
  std::vector<std::size_t> usedLevels_;  ///< that have a cell, ascending
  std::vector<Entry> entries_;           ///< as built, cell after cell

  std::vector<std::vector<Entry>> grown_;  ///< the entries of cells that outgrew their room
  std::vector<Row> rowOf_;                 ///< by id; empty until first asked
  std::vector<Row> freeRows_;
  std::size_t editCount_ = 0, mostEdits_ = 0;
};

}  // namespace enfilade::collision
