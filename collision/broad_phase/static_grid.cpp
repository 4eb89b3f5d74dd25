// Finding the boxes about a place, and editing the cells.
//
// Only cells that hold a box exist; they are found by hashing their place. A cell's entries stand
// in one array and tell in 16 bits a half-axis where a box lies in it, so that those that miss a
// mover's surroundings, which are most, cost a few instructions and no memory but the array's. The
// places are monotone in the coordinates: what overlaps is never passed over.
//
// A box is met in several cells, and told in one: where, on every axis, either its own low corner
// or that of what is asked about lies.
//
// A box that comes is entered in each cell that it lies in, one that goes is taken out. A cell that
// outgrows its room moves to a block of its own; the room is reclaimed by the next build of
// everything, which also measures the cells anew. The build itself is in still_cells_build.cpp.

#include "collision/broad_phase/static_grid.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace enfilade::collision {
namespace {

constexpr std::size_t kRowOffset = 12;      // bytes, in an entry
constexpr std::size_t kEntriesPerLine = 4;  // of a cache
constexpr std::size_t kFewPlaces = 64;      // of a level, that are looked up side by side

using Shorts = std::int16_t __attribute__((vector_size(16)));

/// Whether no lane of the half-axes is set in either.
bool noneOf(Shorts a, Shorts b) {
#ifdef __SSE2__
  using Chars = char __attribute__((vector_size(16)));
  return (__builtin_ia32_pmovmskb128(reinterpret_cast<Chars>(a | b)) & 0xfff) == 0;
#else
  bool none = true;
  for (std::size_t k = 0; k < 6; ++k) none &= (a[k] | b[k]) == 0;
  return none;
#endif
}

}  // namespace

// ---- entries -----------------------------------------------------------------------------------

StillCells::Entry StillCells::lanesOf(const FinePlaces& places, const CellPlace& cell) {
  const auto lane = [&](std::size_t k, std::int64_t corner) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int16_t>::max();
    return static_cast<std::int16_t>(std::clamp(places[k] - corner, -kMost, kMost));
  };
  const std::int64_t x = std::int64_t{cell[0]} << kFineBits;
  const std::int64_t y = std::int64_t{cell[1]} << kFineBits;
  const std::int64_t z = std::int64_t{cell[2]} << kFineBits;
  return Entry{lane(0, -x), lane(1, -y), lane(2, -z), lane(3, x), lane(4, y), lane(5, z), 0, 0};
}

StillCells::Entry StillCells::entryOf(const FinePlaces& reach, const CellPlace& cell, Row row) {
  const FinePlaces onset{-reach[3], -reach[4], -reach[5], -reach[0], -reach[1], -reach[2]};
  Entry entry = lanesOf(onset, cell);
  std::memcpy(reinterpret_cast<char*>(&entry) + kRowOffset, &row, sizeof(row));
  return entry;
}

StillCells::Row StillCells::rowOf(const Entry& entry) {
  Row row;
  std::memcpy(&row, reinterpret_cast<const char*>(&entry) + kRowOffset, sizeof(row));
  return row;
}

// ---- cells -------------------------------------------------------------------------------------

/// The slot that holds the cell, or the free one where it belongs. At most half of the slots are
/// taken, so the search ends.
std::size_t StillCells::slotOf(std::size_t level, const CellPlace& at) const {
  return probe(hashOf(level, at) & (slots_.size() - 1), level, at);
}

std::size_t StillCells::probe(std::size_t slot, std::size_t level, const CellPlace& at) const {
  while (slots_[slot] != kNoCell) {
    const CellData& cell = cells_[slots_[slot]];
    if (cell.level == level && cell.at[0] == at[0] && cell.at[1] == at[1] && cell.at[2] == at[2])
      break;
    slot = (slot + 1) & (slots_.size() - 1);
  }
  return slot;
}

StillCells::Cell StillCells::findOrAdd(std::size_t level, const CellPlace& at) {
  const std::size_t slot = slotOf(level, at);
  if (slots_[slot] != kNoCell) return slots_[slot];
  const Cell added = static_cast<Cell>(cells_.size());
  slots_[slot] = added;
  cells_.push_back({at, static_cast<std::uint32_t>(level), nullptr, 0, 0});
  const auto place = std::lower_bound(usedLevels_.begin(), usedLevels_.end(), level);
  if (place == usedLevels_.end() || *place != level) usedLevels_.insert(place, level);
  if (2 * cells_.size() > slots_.size()) rebuildSlots(2 * slots_.size());
  return added;
}

void StillCells::rebuildSlots(std::size_t size) {
  std::size_t power = 64;
  while (power < size) power *= 2;
  slots_.assign(power, kNoCell);
  slots_.shrink_to_fit();
  for (Cell cell = 0; cell < cells_.size(); ++cell) {
    slots_[slotOf(cells_[cell].level, cells_[cell].at)] = cell;
  }
}

template <typename Visit>
void StillCells::forEachCell(std::size_t level, const CellRange& range, Visit&& visit) const {
  if (range.count() > static_cast<double>(cells_.size())) {  // to look at all of them is less
    for (const CellData& cell : cells_) {
      if (cell.level == level && range.contains(cell.at)) visit(cell);
    }
    return;
  }
  forEachPlace(range, [&](const CellPlace& at) {
    const Cell cell = slots_[slotOf(level, at)];
    if (cell != kNoCell) visit(cells_[cell]);
  });
}

void StillCells::gatherFrom(const CellData& cell, const FinePlaces& reach, const CellRange& range,
                            RowList& rows) const {
  const Entry most = lanesOf(reach, cell.at);
  constexpr std::int16_t kAny = std::numeric_limits<std::int16_t>::min();
  Entry least = {kAny, kAny, kAny, kAny, kAny, kAny, kAny, kAny};
  for (std::size_t axis = 0; axis < 3; ++axis) {  // lest the box is told twice
    if (cell.at[axis] != range.low[axis]) least[axis + 3] = 0;
  }
  // Most miss, and which do is past guessing: every row is written, and counted if it is right.
  if (rows.rows.size() < rows.count + cell.count) rows.rows.resize(2 * (rows.count + cell.count));
  Row* next = rows.rows.data() + rows.count;
  for (const Entry *entry = cell.entries, *end = entry + cell.count; entry != end; ++entry) {
    *next = rowOf(*entry);
    next += noneOf(*entry > most, *entry < least) ? 1 : 0;
  }
  rows.count = static_cast<std::size_t>(next - rows.rows.data());
}

void StillCells::gatherPlaces(std::size_t level, const FinePlaces& places, const CellRange& range,
                              RowList& rows) const {
  // What is needed of all cells is asked for before any is used: a mover enters where no cache has
  // been for long.
  std::array<std::size_t, kFewPlaces> slots;
  std::array<CellPlace, kFewPlaces> at;
  std::size_t count = 0;
  forEachPlace(range, [&](const CellPlace& place) {
    at[count] = place;
    slots[count] = hashOf(level, place) & (slots_.size() - 1);
    __builtin_prefetch(&slots_[slots[count++]]);
  });
  for (std::size_t k = 0; k < count; ++k) {
    const Cell cell = slots_[slots[k]];
    if (cell != kNoCell) __builtin_prefetch(&cells_[cell]);
  }
  std::size_t found = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Cell cell = slots_[probe(slots[k], level, at[k])];
    if (cell == kNoCell) continue;
    slots[found++] = cell;
    const CellData& data = cells_[cell];
    for (std::uint32_t e = 0; e < data.count; e += kEntriesPerLine) {
      __builtin_prefetch(data.entries + e);
    }
  }
  for (std::size_t k = 0; k < found; ++k) gatherFrom(cells_[slots[k]], places, range, rows);
}

void StillCells::gather(const HalfAxes& reach, RowList& rows) const {
  const FinePlaces finest = grid_.finePlacesOf(reach);
  for (const std::size_t level : usedLevels_) {
    const FinePlaces places = grid_.onLevel(level, finest);
    const CellRange range = rangeOf(places);
    if (range.count() <= kFewPlaces) {
      gatherPlaces(level, places, range, rows);
    } else {
      forEachCell(level, range,
                  [&](const CellData& cell) { gatherFrom(cell, places, range, rows); });
    }
  }
}

std::size_t StillCells::bytesBesidesBoxes() const {
  std::size_t bytes = sizeof(*this) + onsets_.capacity() * sizeof(HalfAxes) -
                      (onsets_.size() - freeRows_.size()) * sizeof(HalfAxes) +
                      (ids_.capacity() + rowOf_.capacity() + freeRows_.capacity()) * sizeof(Row) +
                      cells_.capacity() * sizeof(CellData) + slots_.capacity() * sizeof(Cell) +
                      entries_.capacity() * sizeof(Entry);
  for (const auto& block : grown_) bytes += block.capacity() * sizeof(Entry) + sizeof(block);
  return bytes;
}

// ---- boxes that come and go --------------------------------------------------------------------

bool StillCells::hasRoomFor(std::size_t count) const {
  return editCount_ + count <= mostEdits_;
}

StillCells::Row StillCells::rowOf(std::uint32_t id) {
  if (rowOf_.empty()) {
    for (Row row = 0; row < ids_.size(); ++row) {
      if (ids_[row] >= rowOf_.size()) rowOf_.resize(ids_[row] + std::size_t{1}, kNoRow);
      rowOf_[ids_[row]] = row;
    }
  }
  return id < rowOf_.size() ? rowOf_[id] : kNoRow;
}

void StillCells::growCell(CellData& cell) {
  const std::uint32_t room = cell.room + cell.room / 2 + 4;
  std::vector<Entry>& block = grown_.emplace_back(room);
  std::copy_n(cell.entries, cell.count, block.data());
  cell.entries = block.data();
  cell.room = room;
}

void StillCells::insert(const Box& box, std::uint32_t id) {
  ++editCount_;
  rowOf(id);  // makes the index
  Row row = static_cast<Row>(onsets_.size());
  if (freeRows_.empty()) {
    onsets_.push_back(onsetOf(box));
    ids_.push_back(id);
  } else {
    row = freeRows_.back();
    freeRows_.pop_back();
    onsets_[row] = onsetOf(box);
    ids_[row] = id;
  }
  if (id >= rowOf_.size()) rowOf_.resize(id + std::size_t{1}, kNoRow);
  rowOf_[id] = row;
  FinePlaces places = grid_.finePlacesOf(reachOf(box));
  const std::size_t level = grid_.levelFor(places);
  forEachPlace(rangeOf(places), [&](const CellPlace& at) {
    CellData& cell = cells_[findOrAdd(level, at)];
    if (cell.count == cell.room) growCell(cell);
    cell.entries[cell.count++] = entryOf(places, at, row);
  });
}

void StillCells::remove(Row row) {
  ++editCount_;
  FinePlaces places = grid_.finePlacesOf(reachOf(boxOfOnset(onsets_[row])));
  const std::size_t level = grid_.levelFor(places);
  forEachPlace(rangeOf(places), [&](const CellPlace& at) {
    CellData& cell = cells_[slots_[slotOf(level, at)]];
    Entry* const last = cell.entries + --cell.count;
    *std::find_if(cell.entries, last, [row](const Entry& e) { return rowOf(e) == row; }) = *last;
  });
  rowOf_[ids_[row]] = kNoRow;
  freeRows_.push_back(row);
}

}  // namespace enfilade::collision
