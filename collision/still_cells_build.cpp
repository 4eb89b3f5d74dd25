// How the lists are built, in time linear in the boxes but for the sorts within a cell.
//
// 1. The boxes are brought into a spatial order (a counting sort by the place of their lower
//    corner), since a scene lists them in an order of its own, and what follows would otherwise
//    wait for memory at every box.
// 2. Each box is entered into the cells of its level, which are made as they are met.
// 3. Cells are ordered by level and place, and boxes by the cell of their lower corner (a counting
//    sort again): what is near in space is near in memory.
// 4. In that order each box gets its row and is put into the first list of each of its cells.
// 5. Each cell's six lists are sorted. The order on +x starts that on -x and so on, back to front:
//    boxes that are small in their cell end in nearly the order in which they begin, so that
//    sorting by insertion has little to do.

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "collision/still_cells.hpp"

namespace enfilade::collision {
namespace {

using Row = StillCells::Row;

constexpr std::size_t kMostRows = 0xfffffffe;
constexpr std::size_t kLeastEdits = 64;    // before a build of everything
constexpr std::size_t kFewRows = 48;       // that insertion sorts; above, std::sort does
constexpr std::size_t kPrefetchAhead = 8;  // boxes, which are read in no order

struct Keyed {
  double key;
  Row row;
  bool operator<(const Keyed& o) const { return key != o.key ? key < o.key : row < o.row; }
};

void insertionSort(std::span<Keyed> items) {
  for (std::size_t i = 1; i < items.size(); ++i) {
    const Keyed item = items[i];
    std::size_t at = i;
    for (; at > 0 && item < items[at - 1]; --at) items[at] = items[at - 1];
    items[at] = item;
  }
}

void sortKeyed(std::span<Keyed> items) {
  if (items.size() <= kFewRows) {
    insertionSort(items);
  } else {
    std::sort(items.begin(), items.end());
  }
}

/// Sorts the six lists of a cell, the first of which holds its rows.
void sortLists(Row* lists, std::size_t count, const std::vector<HalfAxes>& onsets,
               std::vector<Keyed>& scratch) {
  scratch.resize(count);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Row* const forth = lists + axis * count;
    Row* const back = lists + (axis + 3) * count;
    for (std::size_t r = 0; r < count; ++r) scratch[r] = {onsets[lists[r]][axis], lists[r]};
    sortKeyed(scratch);
    for (std::size_t r = 0; r < count; ++r) forth[r] = scratch[r].row;
    for (std::size_t r = 0; r < count; ++r) {
      const Row row = forth[count - 1 - r];
      scratch[r] = {onsets[row][axis + 3], row};
    }
    sortKeyed(scratch);
    for (std::size_t r = 0; r < count; ++r) back[r] = scratch[r].row;
  }
}

/// The items 0 .. keys.size() - 1 by their key, stably. Keys are below `keyCount`.
std::vector<Row> countingSort(std::span<const std::uint32_t> keys, std::size_t keyCount) {
  std::vector<Row> start(keyCount + 1, 0);
  for (const std::uint32_t key : keys) ++start[key + std::size_t{1}];
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<Row> order(keys.size());
  for (Row k = 0; k < keys.size(); ++k) order[start[keys[k]]++] = k;
  return order;
}

/// The boxes by the place of their lower corner on the finest level that has at most as many places
/// as there are boxes (the last level has one).
std::vector<Row> spatialOrder(std::span<const Box> boxes, const CellGrid& grid) {
  Box bounds;
  for (const Box& box : boxes) bounds.include(box);
  std::size_t level = 0;
  CellRange all = grid.rangeOf(level, reachOf(bounds));
  while (all.count() > static_cast<double>(boxes.size()) && level + 1 < grid.levelCount()) {
    all = grid.rangeOf(++level, reachOf(bounds));
  }
  const auto across = [&all](std::size_t axis) {
    return static_cast<std::uint32_t>(all.high[axis] - all.low[axis]) + 1;
  };
  std::vector<std::uint32_t> keys;
  keys.reserve(boxes.size());
  for (const Box& box : boxes) {
    const CellPlace at = grid.rangeOf(level, reachOf({box.min, box.min})).low;
    const auto from = [&](std::size_t axis) {
      return static_cast<std::uint32_t>(at[axis] - all.low[axis]);
    };
    keys.push_back((from(0) * across(1) + from(1)) * across(2) + from(2));
  }
  return countingSort(keys, static_cast<std::size_t>(all.count()));
}

}  // namespace

struct StillCells::Entries {
  std::vector<Row> boxes;            ///< indices of the boxes, in spatial order
  std::vector<Cell> cells;           ///< of the first of these boxes, then of the second, ...
  std::vector<std::uint8_t> counts;  ///< cells of each of them, at most CellGrid::kMostCells
};

StillCells::StillCells(std::span<const Box> boxes, std::span<const std::uint32_t> ids)
    : grid_(boxes), cellsOfLevel_(grid_.levelCount()) {
  if (boxes.size() > kMostRows) throw std::length_error("more than 2^32 - 2 still boxes");
  mostEdits_ = kLeastEdits + boxes.size() / 2;
  Entries entries = enterBoxes(boxes);
  const std::vector<Cell> newIndex = orderCells();
  for (Cell& cell : entries.cells) cell = newIndex[cell];
  fill(boxes, ids, entries);
  std::vector<Keyed> scratch;
  for (const CellData& cell : cells_) sortLists(cell.rows, cell.count, onsets_, scratch);
  listLevels();
}

StillCells::Entries StillCells::enterBoxes(std::span<const Box> boxes) {
  Entries entries;
  if (!boxes.empty()) entries.boxes = spatialOrder(boxes, grid_);
  entries.counts.reserve(boxes.size());
  entries.cells.reserve(2 * boxes.size());
  rebuildSlots(boxes.size() / 4);
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    if (k + kPrefetchAhead < boxes.size()) {
      __builtin_prefetch(&boxes[entries.boxes[k + kPrefetchAhead]]);
    }
    CellRange range;
    const std::size_t level = grid_.levelFor(reachOf(boxes[entries.boxes[k]]), range);
    const std::size_t before = entries.cells.size();
    forEachPlace(range, [&](const CellPlace& at) {
      const Cell cell = findOrAdd(level, at);
      ++cells_[cell].count;
      entries.cells.push_back(cell);
    });
    entries.counts.push_back(static_cast<std::uint8_t>(entries.cells.size() - before));
  }
  if (cells_.size() > kMostRows) throw std::length_error("more than 2^32 - 2 cells");
  return entries;
}

/// Returns the new index of each cell.
std::vector<StillCells::Cell> StillCells::orderCells() {
  std::vector<Cell> order(cells_.size());
  std::iota(order.begin(), order.end(), Cell{0});
  std::sort(order.begin(), order.end(), [this](Cell a, Cell b) {
    const CellData &x = cells_[a], &y = cells_[b];
    return x.level != y.level ? x.level < y.level : x.at < y.at;
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

void StillCells::fill(std::span<const Box> boxes, std::span<const std::uint32_t> ids,
                      const Entries& entries) {
  sortedSize_ = 6 * entries.cells.size();
  sorted_ = std::make_unique_for_overwrite<Row[]>(sortedSize_);
  Row* next = sorted_.get();
  for (CellData& cell : cells_) {
    cell.rows = next;
    cell.room = cell.count;
    next += 6 * std::size_t{cell.count};
    cell.count = 0;
  }
  // Boxes by the cell of their lower corner.
  std::vector<std::size_t> firstEntry(boxes.size());
  std::vector<Cell> home(boxes.size());
  for (std::size_t k = 0, entry = 0; k < boxes.size(); entry += entries.counts[k++]) {
    firstEntry[k] = entry;
    home[k] = entries.cells[entry];
  }
  const std::vector<Row> order = countingSort(home, cells_.size());
  // Rows in that order. The reserve is address space; it costs memory when it is used.
  onsets_.reserve(boxes.size() + mostEdits_);
  ids_.reserve(boxes.size() + mostEdits_);
  for (Row row = 0; row < boxes.size(); ++row) {
    if (row + kPrefetchAhead < boxes.size()) {
      __builtin_prefetch(&boxes[entries.boxes[order[row + kPrefetchAhead]]]);
    }
    const Row at = order[row];
    const Row box = entries.boxes[at];
    onsets_.push_back(onsetOf(boxes[box]));
    ids_.push_back(ids[box]);
    for (std::size_t e = 0; e < entries.counts[at]; ++e) {
      CellData& cell = cells_[entries.cells[firstEntry[at] + e]];
      cell.rows[cell.count++] = row;
    }
  }
}

void StillCells::listLevels() {
  for (Cell cell = 0; cell < cells_.size(); ++cell) {
    cellsOfLevel_[cells_[cell].level].push_back(cell);
  }
  for (std::size_t level = 0; level < cellsOfLevel_.size(); ++level) {
    if (!cellsOfLevel_[level].empty()) usedLevels_.push_back(level);
  }
}

}  // namespace enfilade::collision
