// Sort and sweep with status changes (M. C. Lin, thesis 1993, section 5.2.2; J. Cohen, M. C. Lin,
// D. Manocha and M. Ponamgi, "I-COLLIDE", 1995), laid out for a scene that mostly stands still.
//
// An update, in this order:
// 1. Still boxes that were staged come and go (still_cells.cpp), and the movers whose cells that
//    touched join those cells anew.
// 2. For each mover that moved: on each of six half-axes (cell_grid.hpp) its reach is compared with
//    two guards: the nearest end points on either side over all of its cells, and the borders of
//    those cells. While it stays between them nothing has been exchanged and nothing more is done.
//    a. Where it has not, and its cells are the same, its cursors into the sorted end points of the
//       cells in question advance. An end point that is passed outward opens an overlap on that
//       axis: a full box test tells whether a pair begins. One that is passed inward closes it: the
//       pair ends if it was held.
//    b. If it has crossed a border of cells, it drops the cells that it left, joins those that it
//       entered (sort_and_sweep_still.cpp), and if it left one tests the pairs that it holds.
// 3. Movers against movers: three sorted lists, repaired by insertion (mover_lists.hpp).
//
// Departures from the source: still end points lie in sorted arrays a cell instead of three lists
// over the whole scene, so that a walker passes the end points of its room only and still objects
// cost nothing; and since the boxes of an update are final before any list is repaired, an exchange
// is judged by them, so that a pair never begins and ends within one update.
//
// Limits: 2^31 - 1 movers, 2^32 - 2 still boxes and as many cells; else memory alone.

#include "collision/sort_and_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "collision/sort_and_sweep_state.hpp"

namespace enfilade::collision {
namespace {

constexpr StillId kMostStillIds = 0xfffffffe;

bool isFinite(const Box& box) {
  constexpr double kMost = std::numeric_limits<double>::max();
  bool finite = true;  // not a NaN either: comparisons with it are false
  for (int axis = 0; axis < 3; ++axis) {
    finite &= std::abs(box.min[axis]) <= kMost;
    finite &= std::abs(box.max[axis]) <= kMost;
  }
  return finite;
}

[[noreturn]] void refuse(const Box& box, const char* what, std::size_t index) {
  throw std::invalid_argument(
      std::string(what) + " " + std::to_string(index) +
      (isFinite(box) ? ": the box is empty (min > max on some axis)" : ": the box is not finite"));
}

void requireBox(const Box& box, const char* what, std::size_t index) {
  bool good = isFinite(box);
  for (int axis = 0; axis < 3; ++axis) good &= box.min[axis] <= box.max[axis];
  if (!good) refuse(box, what, index);
}

[[noreturn]] void refuseUnknown(const char* what, std::size_t id) {
  throw std::invalid_argument(std::string(what) + " " + std::to_string(id) + " is not there");
}

Mover& known(std::vector<Mover>& movers, MoverId id) {
  if (id >= movers.size() || movers[id].presence == Presence::free ||
      movers[id].presence == Presence::leaving) {
    refuseUnknown("mover", id);
  }
  return movers[id];
}

std::vector<StillId> numbered(std::size_t count) {
  std::vector<StillId> ids(count);
  std::iota(ids.begin(), ids.end(), StillId{0});
  return ids;
}

}  // namespace

SortAndSweep::State::State(std::span<const Box> stillBoxes)
    : still(stillBoxes, numbered(stillBoxes.size())),
      stillIds(stillBoxes.size()),
      stillCount(stillBoxes.size()) {}

// ---- movers against movers ----

void SortAndSweep::State::updateMoving() {
  lists.exchanges = lists.boxTests = 0;
  changes.clear();
  for (const MoverId id : moved) {
    if (movers[id].presence == Presence::live) lists.move(id, changes);
  }
  lists.insert(fresh, changes);
  lists.settle(moved);
  lists.settle(fresh);
  for (const MoverChange& change : changes) {
    if (change.begins) {
      beginMoving(change.a, change.b);
    } else {
      endMoving(change.a, change.b);
    }
  }
  counters.exchanges += lists.exchanges;
  counters.boxTests += lists.boxTests;
}

// ---- the interface -----------------------------------------------------------------------------

SortAndSweep::SortAndSweep(std::span<const Box> stillBoxes) {
  for (std::size_t i = 0; i < stillBoxes.size(); ++i) requireBox(stillBoxes[i], "still box", i);
  state_ = std::make_unique<State>(stillBoxes);
}
SortAndSweep::~SortAndSweep() = default;
SortAndSweep::SortAndSweep(SortAndSweep&&) noexcept = default;
SortAndSweep& SortAndSweep::operator=(SortAndSweep&&) noexcept = default;

MoverId SortAndSweep::insert(const Box& box) {
  State& s = *state_;
  const MoverId id = s.freeIds.empty() ? static_cast<MoverId>(s.movers.size()) : s.freeIds.back();
  requireBox(box, "mover", id);
  if (id >= MoverLists::kMostMovers) throw std::length_error("more than 2^31 - 1 movers");
  if (s.freeIds.empty()) {
    s.movers.emplace_back();
  } else {
    s.freeIds.pop_back();
  }
  Mover& mover = s.movers[id];
  mover.reach = reachOf(box);
  mover.leaveCells();
  mover.presence = Presence::fresh;
  s.lists.setBox(id, box);
  s.fresh.push_back(id);
  return id;
}

void SortAndSweep::move(MoverId id, const Box& box) {
  State& s = *state_;
  Mover& mover = known(s.movers, id);
  requireBox(box, "mover", id);
  mover.reach = reachOf(box);
  s.lists.setBox(id, box);
  if (mover.moved || mover.presence == Presence::fresh) return;
  mover.moved = true;
  s.moved.push_back(id);
}

void SortAndSweep::remove(MoverId id) {
  State& s = *state_;
  Mover& mover = known(s.movers, id);
  if (mover.presence == Presence::fresh) {
    std::erase(s.fresh, id);
    mover.presence = Presence::free;
    s.freeIds.push_back(id);
    return;
  }
  mover.presence = Presence::leaving;
  s.leaving.push_back(id);
}

StillId SortAndSweep::insertStill(const Box& box) {
  State& s = *state_;
  const std::size_t id = s.freeStillIds.empty() ? s.stillIds : s.freeStillIds.back();
  requireBox(box, "still box", id);
  if (id >= kMostStillIds) throw std::length_error("more than 2^32 - 2 still boxes");
  if (s.freeStillIds.empty()) {
    ++s.stillIds;
  } else {
    s.freeStillIds.pop_back();
  }
  s.stagedIn.emplace(static_cast<StillId>(id), box);
  return static_cast<StillId>(id);
}

void SortAndSweep::removeStill(StillId id) {
  State& s = *state_;
  if (s.stagedIn.erase(id) > 0) {
    s.freeStillIds.push_back(id);
    return;
  }
  if (s.still.rowOf(id) == StillCells::kNoRow || !s.stagedOut.insert(id).second) {
    refuseUnknown("still box", id);
  }
}

void SortAndSweep::update() {
  State& s = *state_;
  s.begun.clear();
  s.ended.clear();
  s.counters = {};
  for (const MoverId id : s.leaving) s.dropAll(id);
  s.lists.remove(s.leaving);
  s.applyEdits();
  for (const MoverId id : s.moved) {
    if (s.movers[id].presence == Presence::live) s.updateStill(id);
  }
  for (const MoverId id : s.fresh) s.updateStill(id);
  s.updateMoving();
  for (const MoverId id : s.moved) s.movers[id].moved = false;
  for (const MoverId id : s.fresh) s.movers[id].presence = Presence::live;
  for (const MoverId id : s.leaving) s.movers[id].presence = Presence::free;
  s.freeIds.insert(s.freeIds.end(), s.leaving.begin(), s.leaving.end());
  s.still.clearEdits();
  s.moved.clear();
  s.fresh.clear();
  s.leaving.clear();
  std::sort(s.begun.begin(), s.begun.end());
  std::sort(s.ended.begin(), s.ended.end());
}

std::span<const BoxPair> SortAndSweep::begun() const {
  return state_->begun;
}
std::span<const BoxPair> SortAndSweep::ended() const {
  return state_->ended;
}

std::span<const SortAndSweep::Partner> SortAndSweep::partners(MoverId mover) const {
  if (mover >= state_->movers.size()) return {};
  return state_->movers[mover].partners;
}

std::vector<StillId> SortAndSweep::stillOverlapping(const Box& box) const {
  const StillCells& still = state_->still;
  const HalfAxes reach = reachOf(box);
  std::vector<StillId> ids;
  for (const std::size_t level : still.levels()) {
    const CellRange range = still.grid().rangeOf(level, reach);
    still.forEachCell(level, range, CellRange{}, [&](StillCells::Cell cell) {
      for (const StillCells::Row row : still.sorted(cell, 0)) {
        if (meets(still.onset(row), reach)) ids.push_back(still.idOf(row));
      }
    });
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());  // met in several cells
  return ids;
}

std::size_t SortAndSweep::stillCount() const {
  return state_->stillCount;
}
std::size_t SortAndSweep::bytesBesidesStillBoxes() const {
  return state_->still.bytesBesidesBoxes();
}
std::size_t SortAndSweep::pairCount() const {
  return state_->pairs;
}
const SweepCounters& SortAndSweep::counters() const {
  return state_->counters;
}

}  // namespace enfilade::collision
