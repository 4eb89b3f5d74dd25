// Sort and sweep with status changes (M. C. Lin, thesis 1993, section 5.2.2; J. Cohen, M. C. Lin,
// D. Manocha and M. Ponamgi, "I-COLLIDE", 1995), laid out for a scene that mostly stands still.
//
// Each mover has a cell of its own: its box, grown by the way that it will go in some ticks. Of the
// still boxes that meet the cell, those end points that the mover can come to in it stand in six
// sorted lists, one a half-axis (cell_grid.hpp, mover_cell.hpp). A pair of a mover and a still box
// overlaps when the mover's reach has passed its onset on all six; which of the six are lacking is
// kept as six bits. The lists are the mover's, so that its steady tick reads what is its own.
//
// An update, in this order:
// 0. Movers that leave end their pairs.
// 1. Still boxes that were staged come and go (still_cells.cpp), and the movers whose cells they
//    meet have them laid anew.
// 2. For each mover that moved: on each half-axis its reach is compared with two guards, the ends
//    on either side. While it stays between them nothing has been exchanged and nothing more is
//    done: that is found out in move() already. What it passes changes a bit, and the last bit
//    begins or ends a pair. First all that is passed inward, then what is passed outward, so that a
//    pair never begins and ends in one update.
// 3. A mover that leaves its cell has the next one laid: a grid finds the still boxes about it
//    (still_cells.cpp). Lest many do so in one tick, some movers are visited in turn and have
//    theirs laid before they need it.
// 4. Movers against movers (sort_and_sweep_moving.cpp).
//
// Departures from the source: lists a mover instead of three over the whole scene, so that a walker
// passes the end points about it only and still objects cost nothing. Between two layings of a cell
// pairs follow from exchanges alone; when one is laid, which a jump does at once, the pairs of its
// mover are those of the boxes that were gathered for it. Movers are sorted by their cells, and
// exchanges there tell which cells meet; the boxes of two such movers are compared when one moves.
//
// Limits: 2^31 - 1 movers, 2^32 - 2 still boxes and as many cells; else memory alone.

#include "collision/broad_phase/sort_and_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "collision/broad_phase/sort_and_sweep_state.hpp"

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
  constexpr double kMost = std::numeric_limits<double>::max();
  const HalfAxes reach = reachOf(box);
  bool good = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    good &= reach[axis] <= kMost && reach[axis + 3] <= kMost && -reach[axis] <= reach[axis + 3];
  }
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

/// A box' reach, and whether the box is not empty.
struct MovedReach {
  std::array<Lanes, 3> reach;
  bool full;

  explicit MovedReach(const Box& box) {
    static_assert(sizeof(Box) == 6 * sizeof(double));
    const double *const min = box.min.data(), *const max = box.max.data();
    reach = {-lanesAt(min), lanesAt(min + 2) * Lanes{-1, 1}, lanesAt(max + 1)};
    full = bitsOf(lanesAt(min) <= lanesAt(max)) == 3 && min[2] <= max[2];
  }
  bool within(const HalfAxes& low, const HalfAxes& high) const {
    const auto pair = [&](std::size_t k) {
      return bitsOf(lanesAt(&low[2 * k]) <= reach[k]) & bitsOf(reach[k] < lanesAt(&high[2 * k]));
    };
    return (pair(0) & pair(1) & pair(2)) == 3;
  }
};

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
    s.reaches.emplace_back();
    s.isStirred.push_back(0);
  } else {
    s.freeIds.pop_back();
  }
  Mover& mover = s.movers[id];
  s.reaches[id] = mover.laidReach = reachOf(box);
  mover.rate.fill(0);
  mover.low.fill(std::numeric_limits<double>::infinity());  // move() is not to let it pass
  mover.presence = Presence::fresh;
  s.fresh.push_back(id);
  return id;
}

void SortAndSweep::move(MoverId id, const Box& box) {
  State& s = *state_;
  const MovedReach moved(box);
  if (id < s.movers.size()) [[likely]] {
    Mover& mover = s.movers[id];
    // Guards are finite: a reach between them is as well.
    if (moved.within(mover.low, mover.high) && moved.full) {
      if (!mover.neighbours.empty()) s.stir(id, moved.reach.data());
      std::memcpy(&s.reaches[id], &moved.reach, sizeof(HalfAxes));
      return;
    }
  }
  s.moveFarther(id, box);
}

/// Before a mover that has neighbours takes its new reach.
void SortAndSweep::State::stir(MoverId id, const void* reach) {
  if (isStirred[id] != 0 || std::memcmp(reach, &reaches[id], sizeof(HalfAxes)) == 0) return;
  isStirred[id] = 1;
  stirred.push_back(id);
}

/// A mover that has passed a guard, or has none.
void SortAndSweep::State::moveFarther(MoverId id, const Box& box) {
  Mover& mover = known(movers, id);
  requireBox(box, "mover", id);
  const HalfAxes reach = reachOf(box);
  if (!mover.neighbours.empty()) stir(id, &reach);
  reaches[id] = reach;
  if (mover.moved || mover.presence == Presence::fresh) return;
  mover.moved = true;
  moved.push_back(id);
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
  mover.low.fill(std::numeric_limits<double>::infinity());  // move() is not to let it pass
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
  ++s.tick;
  for (const MoverId id : s.leaving) s.dropAll(id);
  s.lists.remove(s.leaving);
  s.applyEdits();
  s.updateStill();
  for (const MoverId id : s.fresh) s.layCell(id);
  s.visitMovers();
  s.updateMoving();
  for (const MoverId id : s.stirred) s.isStirred[id] = 0;
  for (const MoverId id : s.relaid) s.movers[id].relaid = false;
  for (const MoverId id : s.fresh) s.movers[id].presence = Presence::live;
  for (const MoverId id : s.leaving) s.movers[id].presence = Presence::free;
  s.freeIds.insert(s.freeIds.end(), s.leaving.begin(), s.leaving.end());
  for (auto* ids : {&s.moved, &s.stirred, &s.relaid, &s.fresh, &s.leaving}) ids->clear();
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
  requireBox(box, "box asked about, number", 0);
  const StillCells& still = state_->still;
  const HalfAxes reach = reachOf(box);
  StillCells::RowList rows;
  still.gather(reach, rows);
  std::vector<StillId> ids;
  for (const StillCells::Row row : rows.all()) {
    if (meets(still.onset(row), reach)) ids.push_back(still.idOf(row));
  }
  std::sort(ids.begin(), ids.end());
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
