// Movers against still boxes: guards, cursors, cells that are entered; and still boxes that come
// and go.
//
// Joining a cell takes one pass over its boxes, which counts on each half-axis those within reach
// (that is the cursor) and tests each box. Six binary searches would look at fewer boxes, but one
// after the other, and a cell that a walker enters lies in no cache: all of its boxes are asked for
// at once instead. Only cells of many boxes are searched.
//
// That leaves the wait for memory, which would make the tick of an entry stand out. So a mover that
// comes near a border of cells asks for what lies behind it, the lists in one tick and the boxes in
// the next (lookAhead): hints to the processor, which no answer depends on.

#include <algorithm>
#include <cstring>
#include <limits>

#include "collision/sort_and_sweep_state.hpp"

namespace enfilade::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// End points that one cursor may pass before the cell is joined anew, which costs about as much.
constexpr int kMostPassed = 32;
constexpr std::size_t kFewRows = 64;  // that are joined by a pass over all of them
// How near a border a mover looks beyond it, in edges of the finest cells. In cells of 2 m that is
// ten ticks of a walker; what comes faster than in two waits for memory.
constexpr double kLookAhead = 0.125;
constexpr std::uint8_t kAllSeen = 2;  // steps of looking ahead: lists, then boxes
constexpr std::size_t kRowsPerLine = 64 / sizeof(StillCells::Row);  // of a cache

// Two half-axes at once, in a form that gcc and clang know on every processor. A comparison gives
// -1 where it holds and 0 elsewhere.
using Lanes = double __attribute__((vector_size(16)));
using LaneMask = long long __attribute__((vector_size(16)));

Lanes lanesOf(const HalfAxes& values, std::size_t pair) {
  Lanes lanes;
  std::memcpy(&lanes, values.data() + 2 * pair, sizeof(lanes));
  return lanes;
}

bool within(const HalfAxes& low, const HalfAxes& reach, const HalfAxes& high) {
  bool inside = true;
  for (std::size_t k = 0; k < 6; ++k) inside &= low[k] <= reach[k] && reach[k] < high[k];
  return inside;
}

}  // namespace

void Mover::leaveCells() {
  cells.clear();
  ranges.clear();
  low.fill(kInfinity);
  cellLow.fill(kInfinity);
}

// ---- joining cells -----------------------------------------------------------------------------

/// Sets the guards of a half-axis to the end points beside the cursor.
void SortAndSweep::State::guard(Membership& m, std::size_t k) const {
  const auto rows = still.sorted(m.cell, k);
  const std::uint32_t at = m.cursor[k];
  m.low[k] = at > 0 ? still.onset(rows[at - 1])[k] : -kInfinity;
  m.high[k] = at < rows.size() ? still.onset(rows[at])[k] : kInfinity;
}

void SortAndSweep::State::placeByScan(const Mover& mover, Membership& m) {
  const auto rows = still.sorted(m.cell, 0);
  const std::array<Lanes, 3> reach{lanesOf(mover.reach, 0), lanesOf(mover.reach, 1),
                                   lanesOf(mover.reach, 2)};
  std::array<LaneMask, 3> reached{};  // minus the number of boxes
  for (const Row row : rows) {
    const HalfAxes& onset = still.onset(row);
    LaneMask met = {-1, -1};
    for (std::size_t pair = 0; pair < 3; ++pair) {
      const LaneMask inside = lanesOf(onset, pair) <= reach[pair];
      reached[pair] += inside;
      met &= inside;
    }
    if ((met[0] & met[1]) != 0) found.push_back({{still.idOf(row), false}, row});
  }
  counters.boxTests += rows.size();
  for (std::size_t k = 0; k < 6; ++k) {
    m.cursor[k] = static_cast<std::uint32_t>(-reached[k / 2][k % 2]);
  }
}

/// Cursors by binary search, then every box that overlaps on the half-axis where the fewest do.
void SortAndSweep::State::placeBySearch(const Mover& mover, Membership& m) {
  std::size_t shortest = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    const auto rows = still.sorted(m.cell, k);
    const auto end =
        std::upper_bound(rows.begin(), rows.end(), mover.reach[k],
                         [&](double reach, Row row) { return reach < still.onset(row)[k]; });
    m.cursor[k] = static_cast<std::uint32_t>(end - rows.begin());
    if (m.cursor[k] < m.cursor[shortest]) shortest = k;
  }
  for (const Row row : still.sorted(m.cell, shortest).first(m.cursor[shortest])) test(mover, row);
}

void SortAndSweep::State::place(const Mover& mover, Membership& m) {
  if (still.sorted(m.cell, 0).size() <= kFewRows) {
    placeByScan(mover, m);
  } else {
    placeBySearch(mover, m);
  }
  for (std::size_t k = 0; k < 6; ++k) guard(m, k);
}

/// Joins the cells in `entered`. What is needed of all of them is asked for before any is used.
void SortAndSweep::State::joinCells(MoverId id) {
  counters.cellEntries += entered.size();
  for (const Cell cell : entered) __builtin_prefetch(still.sorted(cell, 0).data());
  for (const Cell cell : entered) {
    const auto rows = still.sorted(cell, 0);
    for (const Row row : rows.first(std::min(rows.size(), kFewRows))) {
      __builtin_prefetch(&still.onset(row));
    }
  }
  for (const Cell cell : entered) {
    Membership membership{
        {}, {}, {}, cell, still.placeOf(cell), static_cast<std::uint32_t>(still.levelOf(cell))};
    place(movers[id], membership);
    movers[id].cells.push_back(membership);
  }
  entered.clear();
}

void SortAndSweep::State::enterRanges(MoverId id) {
  Mover& mover = movers[id];
  mover.ranges.resize(still.grid().levelCount());
  mover.cellLow.fill(-kInfinity);
  mover.cellHigh.fill(kInfinity);
  mover.ahead.fill(0);
  for (const std::size_t level : still.levels()) {
    const CellRange from = mover.ranges[level];
    const CellRange to = still.grid().rangeOf(level, mover.reach);
    still.grid().narrowToRange(level, mover.reach, to, mover.cellLow, mover.cellHigh);
    if (from == to) continue;
    mover.ranges[level] = to;
    mover.recheck |= std::erase_if(mover.cells, [&](const Membership& m) {
                       return m.level == level && !to.contains(m.at);
                     }) > 0;
    still.forEachCell(level, to, from, [&](Cell cell) { entered.push_back(cell); });
  }
  joinCells(id);
}

// ---- looking ahead -----------------------------------------------------------------------------

/// Asks for the cells that the mover will enter on half-axis `k`: first their lists, then the boxes
/// of these.
void SortAndSweep::State::lookAhead(const Mover& mover, std::size_t k) const {
  HalfAxes reach = mover.reach;
  reach[k] += kLookAhead * still.grid().edge(0);
  for (const std::size_t level : still.levels()) {
    const CellRange to = still.grid().rangeOf(level, reach);
    if (to == mover.ranges[level]) continue;
    still.forEachCell(level, to, mover.ranges[level], [&](Cell cell) {
      const auto rows = still.sorted(cell, 0);
      if (rows.size() > kFewRows) return;
      if (mover.ahead[k] == 0) {
        for (std::size_t r = 0; r < 6 * rows.size(); r += kRowsPerLine) {
          __builtin_prefetch(rows.data() + r);
        }
      } else {
        for (const Row row : rows) __builtin_prefetch(&still.onset(row));
      }
    });
  }
}

/// From which reach on the mover is to be looked at because of the border of its cells.
double SortAndSweep::State::border(Mover& mover, std::size_t k) const {
  const double high = mover.cellHigh[k];
  if (mover.ahead[k] == kAllSeen) return high;
  const double near = high - kLookAhead * still.grid().edge(0);
  if (mover.reach[k] < near) return near;
  lookAhead(mover, k);
  return ++mover.ahead[k] == kAllSeen ? high : mover.reach[k];
}

// ---- from tick to tick -------------------------------------------------------------------------

/// Moves one cursor to its place and tells what it passed.
void SortAndSweep::State::advance(MoverId id, Membership& m, std::size_t k) {
  Mover& mover = movers[id];
  const auto rows = still.sorted(m.cell, k);
  const double reach = mover.reach[k];
  std::uint32_t at = m.cursor[k];
  int passed = 0;
  for (; at < rows.size() && still.onset(rows[at])[k] <= reach; ++at) {
    if (++passed > kMostPassed) break;
    test(mover, rows[at]);
  }
  for (; at > 0 && still.onset(rows[at - 1])[k] > reach; --at) {
    if (++passed > kMostPassed) break;
    endStill(id, rows[at - 1]);
  }
  counters.exchanges += static_cast<std::uint64_t>(passed);
  if (passed > kMostPassed) {
    mover.recheck = true;
    place(mover, m);
  } else {
    m.cursor[k] = at;
    guard(m, k);
  }
}

void SortAndSweep::State::updateStill(MoverId id) {
  Mover& mover = movers[id];
  if (within(mover.low, mover.reach, mover.high)) return;
  const bool sameCells = within(mover.cellLow, mover.reach, mover.cellHigh);
  if (!sameCells) enterRanges(id);
  for (std::size_t k = 0; k < 6; ++k) {
    const double reach = mover.reach[k];
    if (sameCells && mover.low[k] <= reach && reach < mover.high[k]) continue;
    double low = mover.cellLow[k], high = border(mover, k);
    for (Membership& m : mover.cells) {
      if (!(m.low[k] <= reach && reach < m.high[k])) advance(id, m, k);
      low = std::max(low, m.low[k]);
      high = std::min(high, m.high[k]);
    }
    mover.low[k] = low;
    mover.high[k] = high;
  }
  if (mover.recheck) recheck(id);
  mover.recheck = false;
  if (!found.empty()) takeFound(id);
}

// ---- still boxes that come and go --------------------------------------------------------------

bool SortAndSweep::State::touchedByEdits(const Mover& mover) const {
  for (const Membership& m : mover.cells) {
    if (still.edited(m.cell)) return true;
  }
  for (const Cell cell : still.edits().added) {
    if (mover.ranges[still.levelOf(cell)].contains(still.placeOf(cell))) return true;
  }
  return still.edits().levelAdded;
}

/// The partners that a live mover holds have other rows now, or have gone.
void SortAndSweep::State::renumberRows(MoverId id) {
  Mover& mover = movers[id];
  for (std::size_t i = mover.rows.size(); i-- > 0;) {
    mover.rows[i] = still.rowOf(mover.partners[i].id);
    if (mover.rows[i] != StillCells::kNoRow) continue;
    ended.push_back({id, mover.partners[i].id, false});
    --pairs;
    mover.rows.erase(mover.rows.begin() + static_cast<std::ptrdiff_t>(i));
    mover.partners.erase(mover.partners.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void SortAndSweep::State::rebuildStill() {
  ++counters.rebuilds;
  std::vector<Box> boxes;
  std::vector<StillId> ids;
  for (StillId id = 0; id < stillIds; ++id) {
    const Row row = stagedOut.contains(id) ? StillCells::kNoRow : still.rowOf(id);
    if (row == StillCells::kNoRow) continue;
    boxes.push_back(boxOfOnset(still.onset(row)));
    ids.push_back(id);
  }
  for (const auto& [id, box] : stagedIn) {
    boxes.push_back(box);
    ids.push_back(id);
  }
  still = StillCells(boxes, ids);
  for (MoverId id = 0; id < movers.size(); ++id) renumberRows(id);
}

void SortAndSweep::State::applyEdits() {
  const std::size_t edits = stagedIn.size() + stagedOut.size();
  if (edits == 0) return;
  counters.stillEdits = edits;
  const bool anew = !still.hasRoomFor(edits);
  if (anew) {
    rebuildStill();
  } else {
    for (const StillId id : stagedOut) still.remove(still.rowOf(id));
    for (const auto& [id, box] : stagedIn) still.insert(box, id);
  }
  for (MoverId id = 0; id < movers.size(); ++id) {
    Mover& mover = movers[id];
    if (mover.presence != Presence::live || !(anew || touchedByEdits(mover))) continue;
    mover.leaveCells();
    mover.recheck = true;
    updateStill(id);
  }
  stillCount += stagedIn.size();
  stillCount -= stagedOut.size();
  freeStillIds.insert(freeStillIds.end(), stagedOut.begin(), stagedOut.end());
  stagedIn.clear();
  stagedOut.clear();
}

}  // namespace enfilade::collision
