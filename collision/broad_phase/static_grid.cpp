// Queries and edits of the static grid.
//
// Only cells that hold a box exist; a hash of their coordinates finds them. The entries of a cell
// are one array, with 16 bits per signed axis for the position of a box in the cell. Most entries
// miss the query box; they cost a few instructions and no further memory access. Coordinates are
// mapped monotonically, so no overlap is missed.
//
// A box that lies in several cells is reported in exactly one of them. On every axis, this cell
// contains either the low corner of the box or that of the query.
//
// An inserted box is added to each of its cells, a removed box is erased from them. A cell that
// outgrows its capacity moves to a block of its own. The next full build reclaims that memory and
// chooses the cell size again.
//
// Build. The time is linear in the boxes, except for the sort of the cells.
//
// 1. A counting sort brings the boxes into spatial order, by the cell of their lower corner. The
//    order of the scene is arbitrary and would cause a cache miss at every box in the next steps.
// 2. Each box is assigned to the cells of its level. Cells are created on demand.
// 3. Cells are sorted by level and coordinates, and boxes by the cell of their lower corner (again
//    a counting sort). Boxes that are close in space are then close in memory.
// 4. In that order each box gets its row and is entered in each of its cells.
#include "collision/broad_phase/static_grid.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

using Row = StaticGrid::Row;

constexpr std::size_t kMaxRows = 0xfffffffe;
constexpr std::size_t kMinEdits = 64;         // edits before a full rebuild
constexpr std::size_t kSpareRowDivisor = 32;  // spare rows: 1/32 of the boxes, for later insertions
constexpr std::size_t kPrefetchAhead = 8;     // boxes; they are read in random order
constexpr std::size_t kRowOffset = 12;        // bytes, in an entry
constexpr std::size_t kEntriesPerLine = 4;    // per cache line
constexpr std::size_t kSmallRangeThreshold =
    64;  // cells of a level that are looked up with prefetching

using Shorts = std::int16_t __attribute__((vector_size(16)));

/// True if the first six lanes (the signed axes) are 0 in both masks.
bool isNoneSet(Shorts a, Shorts b) {
#ifdef __SSE2__
  using Chars = char __attribute__((vector_size(16)));
  return (__builtin_ia32_pmovmskb128(reinterpret_cast<Chars>(a | b)) & 0xfff) == 0;
#else
  bool none = true;
  for (std::size_t k = 0; k < 6; ++k) none &= (a[k] | b[k]) == 0;
  return none;
#endif
}

/// Stable counting sort: the items 0 .. keys.size() - 1 in the order of their keys. Keys are below
/// `keyCount`.
std::vector<Row> sortByCounting(std::span<const std::uint32_t> keys, std::size_t keyCount) {
  std::vector<Row> start(keyCount + 1, 0);
  for (const std::uint32_t key : keys) {
    ENFILADE_ASSERT(key < keyCount);
    ++start[key + std::size_t{1}];
  }
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<Row> order(keys.size());
  for (Row k = 0; k < keys.size(); ++k) order[start[keys[k]]++] = k;
  return order;
}

/// Box indices in the order of the cell of their lower corner. The cells are those of the finest
/// level with at most as many cells as there are boxes (the last level has one cell).
std::vector<Row> sortSpatially(std::span<const Aabb> boxes, const CellGrid& grid) {
  Aabb bounds;
  for (const Aabb& box : boxes) bounds.include(box);
  std::size_t level = 0;
  const FineCoords finest = grid.toFineCoords(toMaxEndpoints(bounds));
  CellRange all = toCellRange(finest);
  while (all.count() > static_cast<double>(boxes.size()) && level + 1 < grid.levelCount()) {
    all = toCellRange(grid.toLevel(++level, finest));
  }
  const auto across = [&all](std::size_t axis) {
    return static_cast<std::uint32_t>(all.high[axis] - all.low[axis]) + 1;
  };
  std::vector<std::uint32_t> keys;
  keys.reserve(boxes.size());
  for (const Aabb& box : boxes) {
    const CellCoords at =
        toCellRange(grid.toLevel(level, grid.toFineCoords(toMaxEndpoints({box.min, box.min})))).low;
    const auto from = [&](std::size_t axis) {
      return static_cast<std::uint32_t>(at[axis] - all.low[axis]);
    };
    keys.push_back((from(0) * across(1) + from(1)) * across(2) + from(2));
  }
  return sortByCounting(keys, static_cast<std::size_t>(all.count()));
}

}  // namespace

// ---- entries -----------------------------------------------------------------------------------

StaticGrid::Entry StaticGrid::toCellOffsets(const FineCoords& fineCoords, const CellCoords& cell) {
  const auto lane = [&](std::size_t k, std::int64_t corner) {
    constexpr std::int64_t kMaxOffset = std::numeric_limits<std::int16_t>::max();
    return static_cast<std::int16_t>(std::clamp(fineCoords[k] - corner, -kMaxOffset, kMaxOffset));
  };
  const std::int64_t x = std::int64_t{cell[0]} << kFineBits;
  const std::int64_t y = std::int64_t{cell[1]} << kFineBits;
  const std::int64_t z = std::int64_t{cell[2]} << kFineBits;
  return Entry{lane(0, -x), lane(1, -y), lane(2, -z), lane(3, x), lane(4, y), lane(5, z), 0, 0};
}

StaticGrid::Entry StaticGrid::makeEntry(const FineCoords& maxCoords, const CellCoords& cell,
                                        Row row) {
  const FineCoords minCoords{-maxCoords[3], -maxCoords[4], -maxCoords[5],
                             -maxCoords[0], -maxCoords[1], -maxCoords[2]};
  Entry entry = toCellOffsets(minCoords, cell);
  std::memcpy(reinterpret_cast<char*>(&entry) + kRowOffset, &row, sizeof(row));
  return entry;
}

StaticGrid::Row StaticGrid::extractRow(const Entry& entry) {
  Row row;
  std::memcpy(&row, reinterpret_cast<const char*>(&entry) + kRowOffset, sizeof(row));
  return row;
}

// ---- cells -------------------------------------------------------------------------------------

/// Slot of the cell, or the free slot where it belongs. At most half of the slots are in use, so
/// the search ends.
std::size_t StaticGrid::findSlot(std::size_t level, const CellCoords& at) const {
  return probeSlots(hashCell(level, at) & (slots_.size() - 1), level, at);
}

std::size_t StaticGrid::probeSlots(std::size_t slot, std::size_t level,
                                   const CellCoords& at) const {
  ENFILADE_ASSERT(slot < slots_.size());
  while (slots_[slot] != kNoCell) {
    const CellData& cell = cells_[slots_[slot]];
    if (cell.level == level && cell.coords[0] == at[0] && cell.coords[1] == at[1] &&
        cell.coords[2] == at[2])
      break;
    slot = (slot + 1) & (slots_.size() - 1);
  }
  return slot;
}

StaticGrid::Cell StaticGrid::findOrAddCell(std::size_t level, const CellCoords& at) {
  const std::size_t slot = findSlot(level, at);
  if (slots_[slot] != kNoCell) return slots_[slot];
  const Cell added = static_cast<Cell>(cells_.size());
  slots_[slot] = added;
  cells_.push_back({at, static_cast<std::uint32_t>(level), nullptr, 0, 0});
  const auto position = std::lower_bound(usedLevels_.begin(), usedLevels_.end(), level);
  if (position == usedLevels_.end() || *position != level) usedLevels_.insert(position, level);
  if (2 * cells_.size() > slots_.size()) rebuildSlots(2 * slots_.size());
  return added;
}

void StaticGrid::rebuildSlots(std::size_t size) {
  std::size_t power = 64;
  while (power < size) power *= 2;
  ENFILADE_ASSERT(2 * cells_.size() <= power);  // probing ends
  slots_.assign(power, kNoCell);
  slots_.shrink_to_fit();
  for (Cell cell = 0; cell < cells_.size(); ++cell) {
    slots_[findSlot(cells_[cell].level, cells_[cell].coords)] = cell;
  }
}

template <typename Visit>
void StaticGrid::forEachCell(std::size_t level, const CellRange& range, Visit&& visit) const {
  if (range.count() > static_cast<double>(cells_.size())) {  // a scan of all cells is cheaper
    for (const CellData& cell : cells_) {
      if (cell.level == level && range.contains(cell.coords)) visit(cell);
    }
    return;
  }
  forEachCoords(range, [&](const CellCoords& at) {
    const Cell cell = slots_[findSlot(level, at)];
    if (cell != kNoCell) visit(cells_[cell]);
  });
}

void StaticGrid::gatherFromCell(const CellData& cell, const FineCoords& maxCoords,
                                const CellRange& range, RowList& rows) const {
  const Entry maxOffsets = toCellOffsets(maxCoords, cell.coords);
  constexpr std::int16_t kAny = std::numeric_limits<std::int16_t>::min();
  Entry minOffsets = {kAny, kAny, kAny, kAny, kAny, kAny, kAny, kAny};
  for (std::size_t axis = 0; axis < 3; ++axis) {  // avoids duplicates
    if (cell.coords[axis] != range.low[axis]) minOffsets[axis + 3] = 0;
  }
  // Branch-free, because hits are unpredictable: every row is written, and counted if it is a hit.
  if (rows.rows.size() < rows.count + cell.count) rows.rows.resize(2 * (rows.count + cell.count));
  Row* next = rows.rows.data() + rows.count;
  for (const Entry *entry = cell.entries, *end = entry + cell.count; entry != end; ++entry) {
    *next = extractRow(*entry);
    next += isNoneSet(*entry > maxOffsets, *entry < minOffsets) ? 1 : 0;
  }
  rows.count = static_cast<std::size_t>(next - rows.rows.data());
}

void StaticGrid::gatherFromSmallRange(std::size_t level, const FineCoords& fineCoords,
                                      const CellRange& range, RowList& rows) const {
  // Prefetch the data of all cells before using any of it: a proxy enters a region that is not in
  // the cache.
  std::array<std::size_t, kSmallRangeThreshold> slots;
  std::array<CellCoords, kSmallRangeThreshold> at;
  std::size_t count = 0;
  forEachCoords(range, [&](const CellCoords& cellCoords) {
    at[count] = cellCoords;
    slots[count] = hashCell(level, cellCoords) & (slots_.size() - 1);
    __builtin_prefetch(&slots_[slots[count++]]);
  });
  for (std::size_t k = 0; k < count; ++k) {
    const Cell cell = slots_[slots[k]];
    if (cell != kNoCell) __builtin_prefetch(&cells_[cell]);
  }
  std::size_t found = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Cell cell = slots_[probeSlots(slots[k], level, at[k])];
    if (cell == kNoCell) continue;
    slots[found++] = cell;
    const CellData& data = cells_[cell];
    for (std::uint32_t e = 0; e < data.count; e += kEntriesPerLine) {
      __builtin_prefetch(data.entries + e);
    }
  }
  for (std::size_t k = 0; k < found; ++k) gatherFromCell(cells_[slots[k]], fineCoords, range, rows);
}

void StaticGrid::gather(const SignedBounds& maxEndpoints, RowList& rows) const {
  const FineCoords finest = grid_.toFineCoords(maxEndpoints);
  for (const std::size_t level : usedLevels_) {
    const FineCoords fineCoords = grid_.toLevel(level, finest);
    const CellRange range = toCellRange(fineCoords);
    if (range.count() <= kSmallRangeThreshold) {
      gatherFromSmallRange(level, fineCoords, range, rows);
    } else {
      forEachCell(level, range,
                  [&](const CellData& cell) { gatherFromCell(cell, fineCoords, range, rows); });
    }
  }
}

std::size_t StaticGrid::overheadBytes() const {
  std::size_t bytes = sizeof(*this) + minEndpoints_.capacity() * sizeof(SignedBounds) -
                      (minEndpoints_.size() - freeRows_.size()) * sizeof(SignedBounds) +
                      (ids_.capacity() + rowById_.capacity() + freeRows_.capacity()) * sizeof(Row) +
                      cells_.capacity() * sizeof(CellData) + slots_.capacity() * sizeof(Cell) +
                      entries_.capacity() * sizeof(Entry);
  for (const auto& block : overflowBlocks_)
    bytes += block.capacity() * sizeof(Entry) + sizeof(block);
  return bytes;
}

// ---- build --------------------------------------------------------------------------------------

struct StaticGrid::CellAssignment {
  std::vector<Row> boxes;            ///< box indices in spatial order
  std::vector<Cell> cells;           ///< cells of the first box, then of the second, and so on
  std::vector<std::uint8_t> counts;  ///< cells per box, at most CellGrid::kMaxCells
};

StaticGrid::StaticGrid(std::span<const Aabb> boxes, std::span<const std::uint32_t> ids)
    : grid_(boxes) {
  if (boxes.size() > kMaxRows) throw std::length_error("more than 2^32 - 2 static boxes");
  maxEdits_ = kMinEdits + boxes.size() / 2;
  CellAssignment assignment = assignCells(boxes);
  const std::vector<Cell> newIndex = sortCells();
  for (Cell& cell : assignment.cells) cell = newIndex[cell];
  fillEntries(boxes, ids, assignment);
}

StaticGrid::CellAssignment StaticGrid::assignCells(std::span<const Aabb> boxes) {
  CellAssignment assignment;
  if (!boxes.empty()) assignment.boxes = sortSpatially(boxes, grid_);
  assignment.counts.reserve(boxes.size());
  assignment.cells.reserve(2 * boxes.size());
  rebuildSlots(boxes.size() / 4);
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    if (k + kPrefetchAhead < boxes.size()) {
      __builtin_prefetch(&boxes[assignment.boxes[k + kPrefetchAhead]]);
    }
    FineCoords fineCoords = grid_.toFineCoords(toMaxEndpoints(boxes[assignment.boxes[k]]));
    const std::size_t level = grid_.chooseLevel(fineCoords);
    const std::size_t before = assignment.cells.size();
    forEachCoords(toCellRange(fineCoords), [&](const CellCoords& at) {
      const Cell cell = findOrAddCell(level, at);
      ++cells_[cell].count;
      assignment.cells.push_back(cell);
    });
    assignment.counts.push_back(static_cast<std::uint8_t>(assignment.cells.size() - before));
  }
  if (cells_.size() > kMaxRows) throw std::length_error("more than 2^32 - 2 cells");
  return assignment;
}

/// Sorts the cells. Returns the new index of each cell.
std::vector<StaticGrid::Cell> StaticGrid::sortCells() {
  std::vector<Cell> order(cells_.size());
  std::iota(order.begin(), order.end(), Cell{0});
  std::sort(order.begin(), order.end(), [this](Cell a, Cell b) {
    const CellData &x = cells_[a], &y = cells_[b];
    return x.level != y.level ? x.level < y.level : x.coords < y.coords;
  });
  std::vector<Cell> newIndex(cells_.size());
  std::vector<CellData> ordered;
  ordered.reserve(cells_.size());
  for (const Cell cell : order) {
    newIndex[cell] = static_cast<Cell>(ordered.size());
    ordered.push_back(cells_[cell]);
  }
  cells_ = std::move(ordered);
  rebuildSlots(2 * cells_.size());
  return newIndex;
}

void StaticGrid::fillEntries(std::span<const Aabb> boxes, std::span<const std::uint32_t> ids,
                             const CellAssignment& assignment) {
  entries_.resize(assignment.cells.size());
  Entry* next = entries_.data();
  for (CellData& cell : cells_) {
    cell.entries = next;
    cell.capacity = cell.count;
    next += cell.count;
    cell.count = 0;
  }
  // Sort boxes by the cell of their lower corner.
  std::vector<std::size_t> firstCell(boxes.size());
  std::vector<Cell> home(boxes.size());
  for (std::size_t k = 0, first = 0; k < boxes.size(); first += assignment.counts[k++]) {
    firstCell[k] = first;
    home[k] = assignment.cells[first];
  }
  const std::vector<Row> order = sortByCounting(home, cells_.size());
  // Assign rows in that order, with spare room for insertions.
  const std::size_t capacity = boxes.size() + boxes.size() / kSpareRowDivisor + 1;
  minEndpoints_.reserve(capacity);
  ids_.reserve(capacity);
  for (Row row = 0; row < boxes.size(); ++row) {
    if (row + kPrefetchAhead < boxes.size()) {
      __builtin_prefetch(&boxes[assignment.boxes[order[row + kPrefetchAhead]]]);
    }
    const Row at = order[row];
    const Row box = assignment.boxes[at];
    minEndpoints_.push_back(toMinEndpoints(boxes[box]));
    ids_.push_back(ids[box]);
    const FineCoords fineCoords =
        grid_.toLevel(cells_[home[at]].level, grid_.toFineCoords(toMaxEndpoints(boxes[box])));
    for (std::size_t e = 0; e < assignment.counts[at]; ++e) {
      CellData& cell = cells_[assignment.cells[firstCell[at] + e]];
      ENFILADE_ASSERT(cell.count < cell.capacity);
      cell.entries[cell.count++] = makeEntry(fineCoords, cell.coords, row);
    }
  }
}

// ---- insertion and removal ---------------------------------------------------------------------

bool StaticGrid::hasCapacityFor(std::size_t count) const {
  return editCount_ + count <= maxEdits_;
}

StaticGrid::Row StaticGrid::findRow(std::uint32_t id) {
  if (rowById_.empty()) {
    for (Row row = 0; row < ids_.size(); ++row) {
      if (ids_[row] >= rowById_.size()) rowById_.resize(ids_[row] + std::size_t{1}, kNoRow);
      rowById_[ids_[row]] = row;
    }
  }
  return id < rowById_.size() ? rowById_[id] : kNoRow;
}

void StaticGrid::growCell(CellData& cell) {
  const std::uint32_t capacity = cell.capacity + cell.capacity / 2 + 4;
  std::vector<Entry>& block = overflowBlocks_.emplace_back(capacity);
  std::copy_n(cell.entries, cell.count, block.data());
  cell.entries = block.data();
  cell.capacity = capacity;
}

void StaticGrid::insert(const Aabb& box, std::uint32_t id) {
  ++editCount_;
  findRow(id);  // builds rowById_
  Row row = static_cast<Row>(minEndpoints_.size());
  if (freeRows_.empty()) {
    minEndpoints_.push_back(toMinEndpoints(box));
    ids_.push_back(id);
  } else {
    row = freeRows_.back();
    freeRows_.pop_back();
    minEndpoints_[row] = toMinEndpoints(box);
    ids_[row] = id;
  }
  if (id >= rowById_.size()) rowById_.resize(id + std::size_t{1}, kNoRow);
  ENFILADE_ASSERT(rowById_[id] == kNoRow);
  rowById_[id] = row;
  FineCoords fineCoords = grid_.toFineCoords(toMaxEndpoints(box));
  const std::size_t level = grid_.chooseLevel(fineCoords);
  forEachCoords(toCellRange(fineCoords), [&](const CellCoords& at) {
    CellData& cell = cells_[findOrAddCell(level, at)];
    if (cell.count == cell.capacity) growCell(cell);
    cell.entries[cell.count++] = makeEntry(fineCoords, at, row);
  });
}

void StaticGrid::remove(Row row) {
  ENFILADE_ASSERT(row < minEndpoints_.size() && rowById_[ids_[row]] == row);
  ++editCount_;
  FineCoords fineCoords =
      grid_.toFineCoords(toMaxEndpoints(makeAabbFromMinEndpoints(minEndpoints_[row])));
  const std::size_t level = grid_.chooseLevel(fineCoords);
  forEachCoords(toCellRange(fineCoords), [&](const CellCoords& at) {
    const Cell index = slots_[findSlot(level, at)];
    ENFILADE_ASSERT(index != kNoCell && cells_[index].count > 0);
    CellData& cell = cells_[index];
    Entry* const last = cell.entries + --cell.count;
    *std::find_if(cell.entries, last, [row](const Entry& e) { return extractRow(e) == row; }) =
        *last;
  });
  rowById_[ids_[row]] = kNoRow;
  freeRows_.push_back(row);
}

}  // namespace enfilade::collision
