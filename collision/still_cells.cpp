// How the cells are laid. The grid chooses which end points share a list, and nothing more.
//
// 1. The edge of the finest cells is measured (finestEdge): the smallest at which a box still lies
//    in few cells on average, which bounds memory, and in company, which bounds the cells that a
//    mover has to join.
// 2. Each coarser level has cells four times as wide. A box goes to the finest level on which it
//    lies in at most kMostCells cells, so a floor slab or a terrain costs no more than a chair.
// 3. Only cells that hold a box exist; they are found by hashing their place.
// 4. Per cell and half-axis the boxes are sorted once by their onset.

#include "collision/still_cells.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace enfilade::collision {
namespace {

constexpr double kMostCells = 8;      // that one box may lie in on its level
constexpr double kMostEntries = 1.8;  // cells a box, on average, on the finest level
constexpr double kLeastCompany = 12;  // boxes in a box' cell, on average
constexpr double kLevelRatio = 4;     // of the edges of a level and the next finer one
constexpr double kMostCellsAlongAxis = 0x1p30;
constexpr double kSampledBoxes = 4096;
constexpr std::size_t kSampledCells = 32768;  // above so many boxes only some cells are counted

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::uint64_t mixed(std::uint64_t x) {  // the finaliser of SplitMix64
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9u;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

std::uint64_t hashOf(std::uint64_t level, const std::array<std::int32_t, 3>& at) {
  const auto low = static_cast<std::uint64_t>(at[0]) | (static_cast<std::uint64_t>(at[1]) << 32);
  return mixed(low * 0x9e3779b97f4a7c15u +
               mixed(static_cast<std::uint64_t>(at[2]) + (level << 32)));
}

Box boundsOf(std::span<const Box> boxes) {
  Box bounds;
  for (const Box& box : boxes) bounds.include(box);
  return bounds;
}

/// Cells a box lies in, on average over where it may stand in the grid.
double meanEntries(std::span<const Box> boxes, double edge) {
  const double stride = std::max(1.0, static_cast<double>(boxes.size()) / kSampledBoxes);
  double sum = 0, count = 0;
  for (double at = 0; at < static_cast<double>(boxes.size()); at += stride) {
    const Vec3 size = boxes[static_cast<std::size_t>(at)].size() / edge;
    sum += std::min(kMostCells, (1 + size.x()) * (1 + size.y()) * (1 + size.z()));
    count += 1;
  }
  return sum / count;
}

/// Boxes in the cell of a box' lower corner, on average over the boxes.
double meanCompany(std::span<const Box> boxes, const Vec3& origin, double edge) {
  const std::uint64_t cellsCounted =
      boxes.size() > kSampledCells ? boxes.size() / kSampledCells : 1;
  std::vector<std::uint64_t> keys;
  const double inverse = 1 / edge;
  for (const Box& box : boxes) {
    const Vec3 place = ((box.min - origin) * inverse).cwiseMin(kMostCellsAlongAxis);
    const std::uint64_t key =
        hashOf(0, {static_cast<std::int32_t>(place.x()), static_cast<std::int32_t>(place.y()),
                   static_cast<std::int32_t>(place.z())});
    if ((key >> 16) % cellsCounted == 0) keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  double squares = 0;
  for (std::size_t first = 0, last = 0; first < keys.size(); first = last) {
    while (last < keys.size() && keys[last] == keys[first]) ++last;
    squares += static_cast<double>(last - first) * static_cast<double>(last - first);
  }
  return keys.empty() ? kLeastCompany : squares / static_cast<double>(keys.size());
}

double finestEdge(std::span<const Box> boxes, const Box& bounds) {
  const double widest = std::min(bounds.size().maxCoeff(), 1e300);
  if (!(widest > 1e-290)) return 1;
  const auto edgeAt = [widest](int step) {  // in steps of the square root of 2
    return std::ldexp(widest * (step % 2 == 0 ? 1.0 : 1.4142135623730951), -(step + 1) / 2);
  };
  const auto wideEnough = [&](double edge) {
    return meanEntries(boxes, edge) <= kMostEntries &&
           meanCompany(boxes, bounds.min, edge) >= kLeastCompany;
  };
  int good = 0, bad = 58;  // steps; 2^-29 of the widest stays below kMostCellsAlongAxis
  while (bad - good > 1) {
    const int middle = (good + bad) / 2;
    (wideEnough(edgeAt(middle)) ? good : bad) = middle;
  }
  return edgeAt(good);
}

}  // namespace

StillCells::StillCells(std::span<const Box> boxes) {
  if (boxes.empty()) return;
  layLevels(boxes);
  addCells(boxes);
  dropUnusedLevels();
  orderCells();
  orderRows(boxes);
  fillCells();
  sortCells();
}

void StillCells::layLevels(std::span<const Box> boxes) {
  const Box bounds = boundsOf(boxes);
  const double widest = std::min(bounds.size().maxCoeff(), 1e300);
  for (double edge = finestEdge(boxes, bounds);; edge *= kLevelRatio) {
    Level level;
    level.edge = edge;
    level.inverseEdge = 1 / edge;
    level.origin = bounds.min;
    for (int axis = 0; axis < 3; ++axis) {
      const double along = std::min(bounds.size()[axis] / edge + 1, kMostCellsAlongAxis);
      level.cells[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(along);
    }
    if (edge >= widest) level.cells = {1, 1, 1};
    levels_.push_back(level);
    if (edge >= widest) return;
  }
}

std::int32_t StillCells::cellOf(const Level& level, int axis, double x) const {
  const std::int32_t last = level.cells[static_cast<std::size_t>(axis)] - 1;
  const double place = (x - level.origin[axis]) * level.inverseEdge;
  if (!(place > 0)) return 0;
  return place >= last ? last : static_cast<std::int32_t>(place);
}

CellRange StillCells::rangeOf(std::size_t level, const HalfAxes& reach) const {
  CellRange range;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    range.low[axis] = cellOf(levels_[level], static_cast<int>(axis), -reach[axis + 3]);
    range.high[axis] = cellOf(levels_[level], static_cast<int>(axis), reach[axis]);
  }
  return range;
}

void StillCells::narrowToRange(std::size_t levelIndex, const HalfAxes& reach,
                               const CellRange& range, HalfAxes& low, HalfAxes& high) const {
  const Level& level = levels_[levelIndex];
  for (std::size_t k = 0; k < 6; ++k) {
    const std::size_t axis = k % 3;
    const int a = static_cast<int>(axis);
    const std::int32_t cell = k < 3 ? range.high[axis] : range.low[axis];
    const double x = k < 3 ? reach[k] : -reach[k];
    // Where the cell ought to end, a little inside; kept only if cellOf() agrees, since then all
    // coordinates between agree as well.
    double from = level.origin[a] + (cell + 1e-9) * level.edge;
    double to = level.origin[a] + (cell + (1 - 1e-9)) * level.edge;
    if (!(from < x) || cellOf(level, a, from) != cell) from = x;
    if (!(to > x) || cellOf(level, a, to) != cell) to = x;
    if (cell == 0) from = -kInfinity;
    if (cell == level.cells[axis] - 1) to = kInfinity;
    low[k] = std::max(low[k], k < 3 ? from : -to);
    high[k] = std::min(high[k], k < 3 ? to : -from);
  }
}

std::size_t StillCells::levelFor(const HalfAxes& reach, CellRange& range) const {
  std::size_t level = 0;
  for (;; ++level) {  // on the last level everything lies in the one cell
    range = rangeOf(level, reach);
    if (range.count() <= kMostCells) return level;
  }
}

void StillCells::addCells(std::span<const Box> boxes) {
  rebuildSlots(std::max<std::size_t>(64, boxes.size() / 4));
  for (const Box& box : boxes) {
    CellRange range;
    const std::size_t level = levelFor(reachOf(box), range);
    for (std::int32_t x = range.low[0]; x <= range.high[0]; ++x) {
      for (std::int32_t y = range.low[1]; y <= range.high[1]; ++y) {
        for (std::int32_t z = range.low[2]; z <= range.high[2]; ++z) {
          ++cells_[findOrAdd(level, {x, y, z})].count;
        }
      }
    }
  }
}

/// A mover looks at every level, so those without a box go.
void StillCells::dropUnusedLevels() {
  std::vector<std::uint32_t> used(levels_.size(), 0);
  for (const CellData& cell : cells_) used[cell.level] = 1;
  std::vector<Level> kept;
  std::vector<std::uint32_t> newLevel(levels_.size(), 0);
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    newLevel[level] = static_cast<std::uint32_t>(kept.size());
    if (used[level] != 0) kept.push_back(levels_[level]);
  }
  for (CellData& cell : cells_) cell.level = newLevel[cell.level];
  levels_ = std::move(kept);
}

void StillCells::orderCells() {
  std::sort(cells_.begin(), cells_.end(), [](const CellData& a, const CellData& b) {
    return a.level != b.level ? a.level < b.level : a.at < b.at;
  });
  std::uint32_t first = 0;
  for (CellData& cell : cells_) {
    cell.first = first;
    first += cell.count;
  }
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    levels_[level].begin = static_cast<Cell>(
        std::lower_bound(cells_.begin(), cells_.end(), level,
                         [](const CellData& c, std::size_t l) { return c.level < l; }) -
        cells_.begin());
  }
  cells_.shrink_to_fit();
  rebuildSlots(2 * cells_.size());
}

/// Rows in the order of the cell of their lower corner: what is near in space is near in memory.
void StillCells::orderRows(std::span<const Box> boxes) {
  std::vector<Cell> home(boxes.size());
  std::vector<std::uint32_t> start(cells_.size() + 1, 0);
  for (std::size_t id = 0; id < boxes.size(); ++id) {
    CellRange range;
    const std::size_t level = levelFor(reachOf(boxes[id]), range);
    home[id] = find(level, range.low);
    ++start[home[id] + 1];
  }
  for (std::size_t c = 1; c < start.size(); ++c) start[c] += start[c - 1];
  onsets_.resize(boxes.size());
  ids_.resize(boxes.size());
  for (std::size_t id = 0; id < boxes.size(); ++id) {
    const Row row = start[home[id]]++;
    onsets_[row] = onsetOf(boxes[id]);
    ids_[row] = static_cast<std::uint32_t>(id);
  }
}

/// Puts each cell's rows into the first of its lists.
void StillCells::fillCells() {
  const std::size_t entries = std::size_t{cells_.back().first} + cells_.back().count;
  sorted_.resize(6 * entries);
  std::vector<std::uint32_t> filled(cells_.size(), 0);
  for (Row row = 0; row < onsets_.size(); ++row) {
    const HalfAxes& o = onsets_[row];
    CellRange range;
    const std::size_t level = levelFor({-o[3], -o[4], -o[5], -o[0], -o[1], -o[2]}, range);
    for (std::int32_t x = range.low[0]; x <= range.high[0]; ++x) {
      for (std::int32_t y = range.low[1]; y <= range.high[1]; ++y) {
        for (std::int32_t z = range.low[2]; z <= range.high[2]; ++z) {
          const Cell cell = find(level, {x, y, z});
          sorted_[6 * std::size_t{cells_[cell].first} + filled[cell]++] = row;
        }
      }
    }
  }
}

void StillCells::sortCells() {
  std::vector<std::pair<double, Row>> keyed;
  std::vector<Row> rows;
  for (const CellData& cell : cells_) {
    Row* lists = sorted_.data() + 6 * std::size_t{cell.first};
    rows.assign(lists, lists + cell.count);
    keyed.resize(cell.count);
    for (std::size_t k = 0; k < 6; ++k) {
      for (std::size_t r = 0; r < cell.count; ++r) keyed[r] = {onsets_[rows[r]][k], rows[r]};
      std::sort(keyed.begin(), keyed.end());
      for (std::size_t r = 0; r < cell.count; ++r) lists[k * cell.count + r] = keyed[r].second;
    }
  }
}

// ---- finding cells -----------------------------------------------------------------------------

StillCells::Cell StillCells::cellsBegin(std::size_t level) const {
  return level < levels_.size() ? levels_[level].begin : static_cast<Cell>(cells_.size());
}

/// The slot that holds the cell, or the free one where it belongs.
std::size_t StillCells::slotOf(std::size_t level, const std::array<std::int32_t, 3>& at) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = hashOf(level, at) & mask;
  while (slots_[slot] != kNoCell) {
    const CellData& cell = cells_[slots_[slot]];
    if (cell.level == level && cell.at == at) break;
    slot = (slot + 1) & mask;
  }
  return slot;
}

StillCells::Cell StillCells::find(std::size_t level, const std::array<std::int32_t, 3>& at) const {
  return slots_[slotOf(level, at)];
}

StillCells::Cell StillCells::findOrAdd(std::size_t level, const std::array<std::int32_t, 3>& at) {
  const std::size_t slot = slotOf(level, at);
  if (slots_[slot] != kNoCell) return slots_[slot];
  const Cell added = static_cast<Cell>(cells_.size());
  slots_[slot] = added;
  cells_.push_back({at, static_cast<std::uint32_t>(level), 0, 0});
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
  return sizeof(*this) + ids_.capacity() * sizeof(ids_[0]) + levels_.capacity() * sizeof(Level) +
         cells_.capacity() * sizeof(CellData) + slots_.capacity() * sizeof(Cell) +
         sorted_.capacity() * sizeof(Row);
}

}  // namespace enfilade::collision
