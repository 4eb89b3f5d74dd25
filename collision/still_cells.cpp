// Finding cells, and editing them.
//
// Only cells that hold a box exist; they are found by hashing their place. A box that comes is put
// into the six sorted lists of each cell that it lies in, one that goes is taken out of them: a
// binary search and a short move of memory a list. The alternatives are an overlay of new boxes,
// which every mover would have to look at besides its cells until it is merged, and a new build of
// the touched cells, which sorts what is sorted. Lists that outgrow their room move to a block of
// their own; the room is reclaimed by the next build of everything, which also measures the cells
// anew. The build itself is in still_cells_build.cpp.

#include "collision/still_cells.hpp"

#include <algorithm>
#include <limits>

namespace enfilade::collision {

StillCells::Cell StillCells::find(std::size_t level, const CellPlace& at) const {
  return slots_[slotOf(level, at)];
}

/// The slot that holds the cell, or the free one where it belongs. At most half of the slots are
/// taken, so the search ends.
std::size_t StillCells::slotOf(std::size_t level, const CellPlace& at) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = hashOf(level, at) & mask;
  while (slots_[slot] != kNoCell) {
    const CellData& cell = cells_[slots_[slot]];
    if (cell.level == level && cell.at == at) break;
    slot = (slot + 1) & mask;
  }
  return slot;
}

StillCells::Cell StillCells::findOrAdd(std::size_t level, const CellPlace& at) {
  const std::size_t slot = slotOf(level, at);
  if (slots_[slot] != kNoCell) return slots_[slot];
  const Cell added = static_cast<Cell>(cells_.size());
  slots_[slot] = added;
  cells_.push_back({at, static_cast<std::uint16_t>(level), false, nullptr, 0, 0});
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

std::size_t StillCells::bytesBesidesBoxes() const {
  std::size_t bytes = sizeof(*this) + (ids_.size() + rowOf_.capacity()) * sizeof(Row) +
                      cells_.capacity() * sizeof(CellData) +
                      (slots_.capacity() + cells_.size()) * sizeof(Cell) +
                      sortedSize_ * sizeof(Row);
  for (const auto& block : grown_) bytes += block.capacity() * sizeof(Row) + sizeof(block);
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

void StillCells::touch(Cell cell) {
  if (cells_[cell].edited) return;
  cells_[cell].edited = true;
  edits_.cells.push_back(cell);
}

StillCells::Cell StillCells::openCell(std::size_t level, const CellPlace& at) {
  const std::size_t before = cells_.size();
  const Cell cell = findOrAdd(level, at);
  if (cells_.size() == before) return cell;
  edits_.added.push_back(cell);
  if (cellsOfLevel_[level].empty()) {
    usedLevels_.insert(std::upper_bound(usedLevels_.begin(), usedLevels_.end(), level), level);
    edits_.levelAdded = true;
  }
  cellsOfLevel_[level].push_back(cell);
  return cell;
}

void StillCells::growCell(CellData& cell) {
  const std::uint32_t room = cell.room + cell.room / 2 + 4;
  std::vector<Row>& block = grown_.emplace_back(6 * std::size_t{room});
  for (std::size_t k = 0; k < 6; ++k) {
    std::copy_n(cell.rows + k * cell.room, cell.count, block.data() + k * room);
  }
  cell.rows = block.data();
  cell.room = room;
}

void StillCells::insertIntoCell(Cell at, Row row) {
  CellData& cell = cells_[at];
  if (cell.count == cell.room) growCell(cell);
  for (std::size_t k = 0; k < 6; ++k) {
    Row* const list = cell.rows + k * cell.room;
    Row* const place = std::upper_bound(list, list + cell.count, row, [&](Row a, Row b) {
      const double x = onsets_[a][k], y = onsets_[b][k];
      return x != y ? x < y : a < b;
    });
    std::copy_backward(place, list + cell.count, list + cell.count + 1);
    *place = row;
  }
  ++cell.count;
  touch(at);
}

void StillCells::removeFromCell(Cell at, Row row) {
  CellData& cell = cells_[at];
  for (std::size_t k = 0; k < 6; ++k) {
    Row* const list = cell.rows + k * cell.room;
    Row* const place = std::find(list, list + cell.count, row);
    std::copy(place + 1, list + cell.count, place);
  }
  --cell.count;
  touch(at);
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
  CellRange range;
  const std::size_t level = grid_.levelFor(reachOf(box), range);
  forEachPlace(range, [&](const CellPlace& at) { insertIntoCell(openCell(level, at), row); });
}

void StillCells::remove(Row row) {
  ++editCount_;
  CellRange range;
  const std::size_t level = grid_.levelFor(reachOf(boxOfOnset(onsets_[row])), range);
  forEachPlace(range, [&](const CellPlace& at) { removeFromCell(find(level, at), row); });
  onsets_[row].fill(std::numeric_limits<double>::infinity());
  rowOf_[ids_[row]] = kNoRow;
  removedRows_.push_back(row);
}

void StillCells::clearEdits() {
  for (const Cell cell : edits_.cells) cells_[cell].edited = false;
  edits_ = {};
  freeRows_.insert(freeRows_.end(), removedRows_.begin(), removedRows_.end());
  removedRows_.clear();
}

}  // namespace enfilade::collision
