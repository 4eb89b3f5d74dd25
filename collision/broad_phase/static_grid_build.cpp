// How the cells are built, in time linear in the boxes but for the sort of the cells.
//
// 1. The boxes are brought into a spatial order (a counting sort by the place of their lower
//    corner), since a scene lists them in an order of its own, and what follows would otherwise
//    wait for memory at every box.
// 2. Each box is entered into the cells of its level, which are made as they are met.
// 3. Cells are ordered by level and place, and boxes by the cell of their lower corner (a counting
//    sort again): what is near in space is near in memory.
// 4. In that order each box gets its row and is entered in each of its cells.

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "collision/broad_phase/static_grid.hpp"

namespace enfilade::collision {
namespace {

using Row = StillCells::Row;

constexpr std::size_t kMostRows = 0xfffffffe;
constexpr std::size_t kLeastEdits = 64;    // before a build of everything
constexpr std::size_t kRoomShare = 32;     // of the boxes: room for those that come later
constexpr std::size_t kPrefetchAhead = 8;  // boxes, which are read in no order

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
  const FinePlaces finest = grid.finePlacesOf(reachOf(bounds));
  CellRange all = rangeOf(finest);
  while (all.count() > static_cast<double>(boxes.size()) && level + 1 < grid.levelCount()) {
    all = rangeOf(grid.onLevel(++level, finest));
  }
  const auto across = [&all](std::size_t axis) {
    return static_cast<std::uint32_t>(all.high[axis] - all.low[axis]) + 1;
  };
  std::vector<std::uint32_t> keys;
  keys.reserve(boxes.size());
  for (const Box& box : boxes) {
    const CellPlace at =
        rangeOf(grid.onLevel(level, grid.finePlacesOf(reachOf({box.min, box.min})))).low;
    const auto from = [&](std::size_t axis) {
      return static_cast<std::uint32_t>(at[axis] - all.low[axis]);
    };
    keys.push_back((from(0) * across(1) + from(1)) * across(2) + from(2));
  }
  return countingSort(keys, static_cast<std::size_t>(all.count()));
}

}  // namespace

struct StillCells::Placed {
  std::vector<Row> boxes;            ///< indices of the boxes, in spatial order
  std::vector<Cell> cells;           ///< of the first of these boxes, then of the second, ...
  std::vector<std::uint8_t> counts;  ///< cells of each of them, at most CellGrid::kMostCells
};

StillCells::StillCells(std::span<const Box> boxes, std::span<const std::uint32_t> ids)
    : grid_(boxes) {
  if (boxes.size() > kMostRows) throw std::length_error("more than 2^32 - 2 still boxes");
  mostEdits_ = kLeastEdits + boxes.size() / 2;
  Placed placed = placeBoxes(boxes);
  const std::vector<Cell> newIndex = orderCells();
  for (Cell& cell : placed.cells) cell = newIndex[cell];
  fill(boxes, ids, placed);
}

StillCells::Placed StillCells::placeBoxes(std::span<const Box> boxes) {
  Placed placed;
  if (!boxes.empty()) placed.boxes = spatialOrder(boxes, grid_);
  placed.counts.reserve(boxes.size());
  placed.cells.reserve(2 * boxes.size());
  rebuildSlots(boxes.size() / 4);
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    if (k + kPrefetchAhead < boxes.size()) {
      __builtin_prefetch(&boxes[placed.boxes[k + kPrefetchAhead]]);
    }
    FinePlaces places = grid_.finePlacesOf(reachOf(boxes[placed.boxes[k]]));
    const std::size_t level = grid_.levelFor(places);
    const std::size_t before = placed.cells.size();
    forEachPlace(rangeOf(places), [&](const CellPlace& at) {
      const Cell cell = findOrAdd(level, at);
      ++cells_[cell].count;
      placed.cells.push_back(cell);
    });
    placed.counts.push_back(static_cast<std::uint8_t>(placed.cells.size() - before));
  }
  if (cells_.size() > kMostRows) throw std::length_error("more than 2^32 - 2 cells");
  return placed;
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
                      const Placed& placed) {
  entries_.resize(placed.cells.size());
  Entry* next = entries_.data();
  for (CellData& cell : cells_) {
    cell.entries = next;
    cell.room = cell.count;
    next += cell.count;
    cell.count = 0;
  }
  // Boxes by the cell of their lower corner.
  std::vector<std::size_t> firstCell(boxes.size());
  std::vector<Cell> home(boxes.size());
  for (std::size_t k = 0, first = 0; k < boxes.size(); first += placed.counts[k++]) {
    firstCell[k] = first;
    home[k] = placed.cells[first];
  }
  const std::vector<Row> order = countingSort(home, cells_.size());
  // Rows in that order, with room for some that come later.
  const std::size_t room = boxes.size() + boxes.size() / kRoomShare + 1;
  onsets_.reserve(room);
  ids_.reserve(room);
  for (Row row = 0; row < boxes.size(); ++row) {
    if (row + kPrefetchAhead < boxes.size()) {
      __builtin_prefetch(&boxes[placed.boxes[order[row + kPrefetchAhead]]]);
    }
    const Row at = order[row];
    const Row box = placed.boxes[at];
    onsets_.push_back(onsetOf(boxes[box]));
    ids_.push_back(ids[box]);
    const FinePlaces places =
        grid_.onLevel(cells_[home[at]].level, grid_.finePlacesOf(reachOf(boxes[box])));
    for (std::size_t e = 0; e < placed.counts[at]; ++e) {
      CellData& cell = cells_[placed.cells[firstCell[at] + e]];
      cell.entries[cell.count++] = entryOf(places, cell.at, row);
    }
  }
}

}  // namespace enfilade::collision
