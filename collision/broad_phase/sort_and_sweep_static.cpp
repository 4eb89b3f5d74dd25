// Movers against still boxes: guards, exchanges, cells that are laid; and still boxes that come and
// go.

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "collision/broad_phase/sort_and_sweep_state.hpp"

namespace enfilade::collision {
namespace {

// A cell is laid for so many ticks at the rate of the last ones.
constexpr double kHorizon = 40;
// One mover in so many is looked at in a tick, and its cell laid anew if it will have left it when
// it is looked at next.
constexpr std::size_t kVisitEvery = 32;
// Room for a change of course: so many ticks at the greatest rate of all half-axes, and a share of
// the mover's greatest size; all of that while nothing is known of its course: when it is new, and
// when it went farther than its own size in a tick, which is taken for a jump.
constexpr double kSlackTicks = 3;
constexpr double kSlackOfSize = 1.0 / 64;
// A cell exceeds the mover by no more than this share of its size, or of an edge of the finest
// cells, so that what jumps does not gather half of the scene.
constexpr double kMostOfSize = 1.5;
constexpr double kMostOfEdge = 0.5;
// More still boxes that come and go at once disturb all movers.
constexpr std::size_t kFewEdits = 256;

constexpr double kLargest = std::numeric_limits<double>::max();

bool within(const HalfAxes& low, const HalfAxes& reach, const HalfAxes& high) {
  return (beyond(low, reach) | (0x3f & ~beyond(high, reach))) == 0;
}

/// Sets the guards of half-axis `k` to the ends beside the reach.
void guard(Mover& mover, std::size_t k) {
  mover.low[k] = mover.cell.endBefore(k);
  mover.high[k] = mover.cell.endBeyond(k);
}

HalfAxes after(const HalfAxes& reach, const HalfAxes& rate, double ticks) {
  HalfAxes later = reach;
  for (std::size_t k = 0; k < 6; ++k) later[k] += ticks * rate[k];
  return later;
}

}  // namespace

// ---- laying a cell -----------------------------------------------------------------------------

HalfAxes SortAndSweep::State::rateOf(MoverId id) const {
  const Mover& mover = movers[id];
  const HalfAxes& reach = reaches[id];
  HalfAxes rate = mover.rate;
  if (tick == mover.laidAt) return rate;
  const double share = 1 / static_cast<double>(tick - mover.laidAt);
  for (std::size_t k = 0; k < 6; ++k) rate[k] = (reach[k] - mover.laidReach[k]) * share;
  return rate;
}

void SortAndSweep::State::setBorders(MoverId id) {
  Mover& mover = movers[id];
  const HalfAxes& reach = reaches[id];
  mover.rate = rateOf(id);
  mover.laidReach = reach;
  mover.laidAt = tick;
  double fastest = 0, widest = 0;
  for (const double rate : mover.rate) fastest = std::max(fastest, std::abs(rate));
  for (std::size_t axis = 0; axis < 3; ++axis)
    widest = std::max(widest, reach[axis] + reach[axis + 3]);
  const bool unknown = mover.presence == Presence::fresh || (widest > 0 && fastest > widest);
  if (unknown) mover.rate.fill(0);
  const double slack = unknown ? widest : kSlackTicks * fastest + kSlackOfSize * widest;
  const double least = kMostOfEdge * still.grid().edge();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double size = reach[axis] + reach[axis + 3];
    const double most = std::max(kMostOfSize * size, least);
    for (const std::size_t k : {axis, axis + 3}) {
      const double course = kHorizon * mover.rate[k];
      const double ahead = std::min(slack + std::max(course, 0.0), most);
      const double behind = std::min(slack - std::min(course, 0.0), most);
      double farthest = reach[k] + ahead;
      if (!(farthest > reach[k])) farthest = std::nextafter(reach[k], kLargest);
      mover.cell.farthest[k] = std::min(farthest, kLargest);
      mover.cell.nearest[k] = std::max(reach[k] - behind, -kLargest);
    }
  }
}

void SortAndSweep::State::layCell(MoverId id) {
  Mover& mover = movers[id];
  setBorders(id);
  rows.count = 0;
  still.gather(mover.cell.farthest, rows);
  for (const Row row : rows.all()) __builtin_prefetch(&still.onset(row));
  counters.boxTests += rows.count;
  ++counters.cellsLaid;
  std::size_t kept = 0;
  for (const Row row : rows.all()) {
    rows.rows[kept] = row;
    kept += meets(still.onset(row), mover.cell.farthest) ? 1 : 0;
  }
  mover.cell.lay(still, std::span(rows.rows).first(kept), reaches[id], inReach);
  for (std::size_t k = 0; k < 6; ++k) guard(mover, k);
  replaceStill(id);
  if (mover.relaid) return;
  mover.relaid = true;
  relaid.push_back(id);
}

void SortAndSweep::State::visitMovers() {
  if (movers.empty()) return;
  std::size_t visits = (movers.size() + kVisitEvery - 1) / kVisitEvery;
  const double ticks = static_cast<double>(movers.size()) / static_cast<double>(visits);
  visits -= std::min(visits, relaid.size());  // those that could not wait take their turn
  for (std::size_t k = 0; k < visits; ++k) {
    const auto id = static_cast<MoverId>(nextVisited++ % movers.size());
    const Mover& mover = movers[id];
    if (mover.presence != Presence::live || mover.relaid) continue;
    const HalfAxes later = after(reaches[id], rateOf(id), ticks);
    if (!within(mover.cell.nearest, later, mover.cell.farthest)) layCell(id);
  }
}

// ---- from tick to tick -------------------------------------------------------------------------

/// Moves on where the reach has shrunk, past an end at least; false if it has left its cell.
bool SortAndSweep::State::passInward(MoverId id, std::size_t k) {
  Mover& mover = movers[id];
  MoverCell& cell = mover.cell;
  const double reach = reaches[id][k];
  do {
    const std::uint32_t passed = cell.ends[cell.next[k] - 1].box;
    if (passed == MoverCell::kBorder) return false;
    ++counters.exchanges;
    MoverCell::StillBox& box = cell.boxes[passed];
    if (box.apart == 0) endStill(id, box.id);
    box.apart = static_cast<std::uint8_t>(box.apart | 1u << k);
    --cell.next[k];
  } while (cell.endBefore(k) > reach);
  guard(mover, k);
  return true;
}

/// Moves on where the reach has grown, past an end at least; false if it has left its cell.
bool SortAndSweep::State::passOutward(MoverId id, std::size_t k) {
  Mover& mover = movers[id];
  MoverCell& cell = mover.cell;
  const double reach = reaches[id][k];
  do {
    const std::uint32_t passed = cell.ends[cell.next[k]].box;
    if (passed == MoverCell::kBorder) return false;
    ++counters.exchanges;
    MoverCell::StillBox& box = cell.boxes[passed];
    box.apart = static_cast<std::uint8_t>(box.apart & ~(1u << k));
    if (box.apart == 0) beginStill(id, box.id);
    ++cell.next[k];
  } while (cell.endBeyond(k) <= reach);
  guard(mover, k);
  return true;
}

/// All that ends is ended before anything begins, so that a pair is told once at most.
void SortAndSweep::State::passEnds(MoverId id) {
  const Mover& mover = movers[id];
  const unsigned inward = beyond(mover.low, reaches[id]);
  const unsigned outward = 0x3f & ~beyond(mover.high, reaches[id]);
  for (unsigned bits = inward | outward << 6; bits != 0; bits &= bits - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(bits));
    if (!(k < 6 ? passInward(id, k) : passOutward(id, k - 6))) {
      layCell(id);
      return;
    }
  }
}

void SortAndSweep::State::updateStill() {
  for (std::size_t k = 0; k < moved.size(); ++k) {
    if (k + kAskedAhead < moved.size()) movers[moved[k + kAskedAhead]].cell.prefetch();
    Mover& mover = movers[moved[k]];
    mover.moved = false;
    if (mover.presence == Presence::live) passEnds(moved[k]);
  }
}

// ---- still boxes that come and go --------------------------------------------------------------

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
}

void SortAndSweep::State::applyEdits() {
  const std::size_t edits = stagedIn.size() + stagedOut.size();
  if (edits == 0) return;
  counters.stillEdits = edits;
  std::vector<HalfAxes> edited;
  for (const StillId id : stagedOut) edited.push_back(still.onset(still.rowOf(id)));
  for (const auto& [id, box] : stagedIn) edited.push_back(onsetOf(box));
  if (still.hasRoomFor(edits)) {
    for (const StillId id : stagedOut) still.remove(still.rowOf(id));
    for (const auto& [id, box] : stagedIn) still.insert(box, id);
  } else {
    rebuildStill();
  }
  for (MoverId id = 0; id < movers.size(); ++id) {
    if (movers[id].presence != Presence::live) continue;
    const HalfAxes& farthest = movers[id].cell.farthest;
    const auto touches = [&](const HalfAxes& onset) { return meets(onset, farthest); };
    if (edits > kFewEdits || std::any_of(edited.begin(), edited.end(), touches)) layCell(id);
  }
  stillCount += stagedIn.size();
  stillCount -= stagedOut.size();
  freeStillIds.insert(freeStillIds.end(), stagedOut.begin(), stagedOut.end());
  stagedIn.clear();
  stagedOut.clear();
}

}  // namespace enfilade::collision
