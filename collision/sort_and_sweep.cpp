// Sort and sweep with status changes (M. C. Lin, thesis 1993, section 5.2.2; J. Cohen, M. C. Lin,
// D. Manocha and M. Ponamgi, "I-COLLIDE", 1995), laid out for a scene that mostly stands still.
//
// An update, for each mover that moved:
// 1. On each of six half-axes (still_cells.hpp) the mover's reach is compared with two guards: the
//    nearest end points on either side over all of its cells, and the borders of those cells. While
//    it stays between them nothing has been exchanged and nothing more is done.
// 2. Where it has not, the mover's cursors into the sorted end points of its cells advance. An end
//    point that is passed outward opens an overlap on that axis: a full box test tells whether a
//    pair begins. One that is passed inward closes it: the pair ends if it was held.
// 3. If the mover has crossed a border of cells, it drops the cells that it left, joins those that
//    it entered (a binary search a half-axis, then one pass over the shortest of their overlaps),
//    and tests the pairs that it holds once more.
// 4. Movers against movers: three sorted lists, repaired by insertion (mover_lists.hpp).
//
// Departures from the source: still end points lie in immutable arrays a cell instead of three
// lists over the whole scene, so that a walker passes the end points of its room only and still
// objects cost nothing; and since the boxes of an update are final before any list is repaired, an
// exchange is judged by them, so that a pair never begins and ends within one update.

#include "collision/sort_and_sweep.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "collision/mover_lists.hpp"
#include "collision/still_cells.hpp"

namespace enfilade::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// End points that one cursor may pass before the cell is joined anew, which costs about as much.
constexpr int kMostPassed = 32;
// Up to so many new partners are inserted one by one; more are merged, lest it becomes quadratic.
constexpr std::size_t kFewFound = 16;

using Cell = StillCells::Cell;
using Row = StillCells::Row;
using Partner = SortAndSweep::Partner;

void requireBox(const Box& box, const char* what, std::size_t index) {
  if (!box.min.allFinite() || !box.max.allFinite()) {
    throw std::invalid_argument(std::string(what) + " " + std::to_string(index) +
                                ": the box is not finite");
  }
  if (box.empty()) {
    throw std::invalid_argument(std::string(what) + " " + std::to_string(index) +
                                ": the box is empty (min > max on some axis)");
  }
}

/// A mover's place in the sorted lists of one cell: on each half-axis the number of boxes whose
/// onset is within the mover's reach.
struct Membership {
  Cell cell;
  std::array<std::uint32_t, 6> cursor;
};

struct Found {
  Partner partner;
  Row row;
};

enum class Presence : std::uint8_t { free, fresh, live, leaving };

struct Mover {
  HalfAxes reach{};
  HalfAxes low{}, high{};  ///< while low <= reach < high on a half-axis no cursor there moves
  HalfAxes cellLow{}, cellHigh{};  ///< the same for the cells that the mover lies in
  std::vector<Membership> cells;
  std::vector<CellRange> ranges;  ///< by level
  std::vector<Partner> partners;  ///< sorted
  std::vector<Row> rows;          ///< of the still partners, beside `partners`
  Presence presence = Presence::free;
  bool moved = false;
};

bool within(const Mover& mover) {
  bool inside = true;
  for (std::size_t k = 0; k < 6; ++k) {
    inside &= mover.low[k] <= mover.reach[k] && mover.reach[k] < mover.high[k];
  }
  return inside;
}

Mover& known(std::vector<Mover>& movers, MoverId id) {
  if (id >= movers.size() || movers[id].presence == Presence::free ||
      movers[id].presence == Presence::leaving) {
    throw std::invalid_argument("mover " + std::to_string(id) + " is not there");
  }
  return movers[id];
}

bool addPartner(std::vector<Partner>& partners, MoverId id) {
  const Partner partner{id, true};
  const auto at = std::lower_bound(partners.begin(), partners.end(), partner);
  if (at != partners.end() && *at == partner) return false;
  partners.insert(at, partner);
  return true;
}

bool erasePartner(std::vector<Partner>& partners, MoverId id) {
  const Partner partner{id, true};
  const auto at = std::lower_bound(partners.begin(), partners.end(), partner);
  if (at == partners.end() || *at != partner) return false;
  partners.erase(at);
  return true;
}

}  // namespace

struct SortAndSweep::State {
  explicit State(std::span<const Box> stillBoxes) : still(stillBoxes) {}

  StillCells still;
  MoverLists lists;
  std::vector<Mover> movers;
  std::vector<MoverId> freeIds;
  std::vector<MoverId> moved, fresh, leaving;  ///< since the last update
  std::vector<MoverChange> changes;            ///< scratch
  std::vector<Found> found;                    ///< scratch: what one mover was found to meet
  std::vector<BoxPair> begun, ended;
  std::size_t pairs = 0;
  SweepCounters counters;

  void test(const Mover& mover, Row row);
  void tellStill(MoverId id, Partner partner);
  void insertFound(MoverId id);
  void mergeFound(MoverId id);
  void takeFound(MoverId id);
  void endStill(MoverId id, Row row);
  void beginMoving(MoverId a, MoverId b);
  void endMoving(MoverId a, MoverId b);
  void dropAll(MoverId id);
  void recheck(MoverId id);

  void updateStill(MoverId id);
  void enterRanges(MoverId id);
  void joinCell(MoverId id, Cell cell);
  void place(MoverId id, Membership& membership);
  bool advance(MoverId id, Membership& membership, std::size_t k);
  void updateMoving();
};

// ---- pairs -------------------------------------------------------------------------------------

void SortAndSweep::State::test(const Mover& mover, Row row) {
  ++counters.boxTests;
  if (meets(still.onset(row), mover.reach)) found.push_back({{still.idOf(row), false}, row});
}

void SortAndSweep::State::tellStill(MoverId id, Partner partner) {
  begun.push_back({id, partner.id, false});
  ++pairs;
}

void SortAndSweep::State::insertFound(MoverId id) {
  Mover& mover = movers[id];
  for (const Found& f : found) {
    const auto at = std::lower_bound(mover.partners.begin(), mover.partners.end(), f.partner);
    if (at != mover.partners.end() && *at == f.partner) continue;  // known from another cell
    mover.rows.insert(mover.rows.begin() + (at - mover.partners.begin()), f.row);
    mover.partners.insert(at, f.partner);
    tellStill(id, f.partner);
  }
}

void SortAndSweep::State::mergeFound(MoverId id) {
  Mover& mover = movers[id];
  const auto byPartner = [](const Found& a, const Found& b) { return a.partner < b.partner; };
  const auto samePartner = [](const Found& a, const Found& b) { return a.partner == b.partner; };
  std::sort(found.begin(), found.end(), byPartner);
  found.erase(std::unique(found.begin(), found.end(), samePartner), found.end());
  std::erase_if(found, [&](const Found& f) {
    return std::binary_search(mover.partners.begin(), mover.partners.end(), f.partner);
  });
  const auto added = static_cast<std::ptrdiff_t>(found.size());
  for (const Found& f : found) tellStill(id, f.partner);
  for (std::size_t i = 0; i < mover.rows.size(); ++i) {
    found.push_back({mover.partners[i], mover.rows[i]});
  }
  std::inplace_merge(found.begin(), found.begin() + added, found.end(), byPartner);
  mover.partners.insert(mover.partners.begin(), static_cast<std::size_t>(added), Partner{});
  mover.rows.resize(found.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    mover.partners[i] = found[i].partner;
    mover.rows[i] = found[i].row;
  }
}

/// Takes in the still boxes that were found to overlap; some are known already.
void SortAndSweep::State::takeFound(MoverId id) {
  if (found.size() <= kFewFound) {
    insertFound(id);
  } else {
    mergeFound(id);
  }
  found.clear();
}

void SortAndSweep::State::endStill(MoverId id, Row row) {
  Mover& mover = movers[id];
  const Partner partner{still.idOf(row), false};
  const auto at = std::lower_bound(mover.partners.begin(), mover.partners.end(), partner);
  if (at == mover.partners.end() || *at != partner) return;
  mover.rows.erase(mover.rows.begin() + (at - mover.partners.begin()));
  mover.partners.erase(at);
  ended.push_back({id, partner.id, false});
  --pairs;
}

void SortAndSweep::State::beginMoving(MoverId a, MoverId b) {
  if (!addPartner(movers[a].partners, b)) return;
  addPartner(movers[b].partners, a);
  begun.push_back({a, b, true});
  ++pairs;
}

void SortAndSweep::State::endMoving(MoverId a, MoverId b) {
  if (!erasePartner(movers[a].partners, b)) return;
  erasePartner(movers[b].partners, a);
  ended.push_back({a, b, true});
  --pairs;
}

void SortAndSweep::State::dropAll(MoverId id) {
  Mover& mover = movers[id];
  while (!mover.partners.empty()) {
    const Partner last = mover.partners.back();
    if (last.moves) {
      endMoving(std::min(id, last.id), std::max(id, last.id));
    } else {
      endStill(id, mover.rows.back());
    }
  }
  mover.cells.clear();
  mover.ranges.clear();
}

/// Drops the still partners that the mover no longer meets.
void SortAndSweep::State::recheck(MoverId id) {
  Mover& mover = movers[id];
  std::size_t kept = 0;
  for (std::size_t i = 0; i < mover.rows.size(); ++i) {
    ++counters.boxTests;
    if (meets(still.onset(mover.rows[i]), mover.reach)) {
      mover.rows[kept] = mover.rows[i];
      mover.partners[kept++] = mover.partners[i];
    } else {
      ended.push_back({id, mover.partners[i].id, false});
      --pairs;
    }
  }
  const auto first = static_cast<std::ptrdiff_t>(kept);
  const auto last = static_cast<std::ptrdiff_t>(mover.rows.size());
  mover.partners.erase(mover.partners.begin() + first, mover.partners.begin() + last);
  mover.rows.resize(kept);
}

// ---- movers against still boxes ----------------------------------------------------------------

/// Cursors by binary search, then every box of the cell that overlaps on the half-axis where the
/// fewest do.
void SortAndSweep::State::place(MoverId id, Membership& membership) {
  std::size_t shortest = 0;
  const Mover& mover = movers[id];
  for (std::size_t k = 0; k < 6; ++k) {
    const auto rows = still.sorted(membership.cell, k);
    const auto end =
        std::upper_bound(rows.begin(), rows.end(), mover.reach[k],
                         [&](double reach, Row row) { return reach < still.onset(row)[k]; });
    membership.cursor[k] = static_cast<std::uint32_t>(end - rows.begin());
    if (membership.cursor[k] < membership.cursor[shortest]) shortest = k;
  }
  const auto rows = still.sorted(membership.cell, shortest);
  for (const Row row : rows.first(membership.cursor[shortest])) test(mover, row);
}

void SortAndSweep::State::joinCell(MoverId id, Cell cell) {
  ++counters.cellEntries;
  Membership membership{cell, {}};
  place(id, membership);
  movers[id].cells.push_back(membership);
}

void SortAndSweep::State::enterRanges(MoverId id) {
  Mover& mover = movers[id];
  mover.ranges.resize(still.levelCount());
  mover.cellLow.fill(-kInfinity);
  mover.cellHigh.fill(kInfinity);
  for (std::size_t level = 0; level < still.levelCount(); ++level) {
    const CellRange from = mover.ranges[level];
    const CellRange to = still.rangeOf(level, mover.reach);
    still.narrowToRange(level, mover.reach, to, mover.cellLow, mover.cellHigh);
    if (from == to) continue;
    mover.ranges[level] = to;
    std::erase_if(mover.cells, [&](const Membership& m) {
      return still.levelOf(m.cell) == level && !to.contains(still.placeOf(m.cell));
    });
    still.forEachCell(level, to, from, [&](Cell cell) { joinCell(id, cell); });
  }
}

/// Moves one cursor to its place and tells what it passed; narrows the mover's guards to the end
/// points beside it. False when it passed so much that the cell was joined anew.
bool SortAndSweep::State::advance(MoverId id, Membership& membership, std::size_t k) {
  Mover& mover = movers[id];
  const auto rows = still.sorted(membership.cell, k);
  const double reach = mover.reach[k];
  std::uint32_t at = membership.cursor[k];
  double low = -kInfinity, high = kInfinity;
  int passed = 0;
  for (; at < rows.size(); ++at) {
    high = still.onset(rows[at])[k];
    if (reach < high || ++passed > kMostPassed) break;
    test(mover, rows[at]);
    high = kInfinity;
  }
  for (; at > 0; --at) {
    low = still.onset(rows[at - 1])[k];
    if (low <= reach || ++passed > kMostPassed) break;
    high = low;
    endStill(id, rows[at - 1]);
    low = -kInfinity;
  }
  counters.exchanges += static_cast<std::uint64_t>(passed);
  if (passed > kMostPassed) {
    place(id, membership);
    at = membership.cursor[k];
    low = at > 0 ? still.onset(rows[at - 1])[k] : -kInfinity;
    high = at < rows.size() ? still.onset(rows[at])[k] : kInfinity;
  }
  membership.cursor[k] = at;
  mover.low[k] = std::max(mover.low[k], low);
  mover.high[k] = std::min(mover.high[k], high);
  return passed <= kMostPassed;
}

void SortAndSweep::State::updateStill(MoverId id) {
  Mover& mover = movers[id];
  if (within(mover)) return;
  bool sameCells = true;
  for (std::size_t k = 0; k < 6; ++k) {
    sameCells &= mover.cellLow[k] <= mover.reach[k] && mover.reach[k] < mover.cellHigh[k];
  }
  if (!sameCells) enterRanges(id);
  bool recheckHeld = !sameCells;
  for (std::size_t k = 0; k < 6; ++k) {
    if (sameCells && mover.low[k] <= mover.reach[k] && mover.reach[k] < mover.high[k]) continue;
    mover.low[k] = mover.cellLow[k];
    mover.high[k] = mover.cellHigh[k];
    for (Membership& membership : mover.cells) recheckHeld |= !advance(id, membership, k);
  }
  if (recheckHeld) recheck(id);
  if (!found.empty()) takeFound(id);
}

// ---- movers against movers ---------------------------------------------------------------------

void SortAndSweep::State::updateMoving() {
  lists.exchanges = lists.boxTests = 0;
  changes.clear();
  for (const MoverId id : moved) {
    if (movers[id].presence == Presence::live) lists.move(id, changes);
  }
  lists.insert(fresh, changes);
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
  if (s.freeIds.empty()) {
    s.movers.emplace_back();
  } else {
    s.freeIds.pop_back();
  }
  Mover& mover = s.movers[id];
  mover.reach = reachOf(box);
  mover.cellLow.fill(kInfinity);  // in no cell yet
  mover.low.fill(kInfinity);
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

void SortAndSweep::update() {
  State& s = *state_;
  s.begun.clear();
  s.ended.clear();
  s.counters = {};
  for (const MoverId id : s.leaving) s.dropAll(id);
  s.lists.remove(s.leaving);
  for (const MoverId id : s.moved) {
    if (s.movers[id].presence == Presence::live) s.updateStill(id);
  }
  for (const MoverId id : s.fresh) s.updateStill(id);
  s.updateMoving();
  for (const MoverId id : s.moved) s.movers[id].moved = false;
  for (const MoverId id : s.fresh) s.movers[id].presence = Presence::live;
  for (const MoverId id : s.leaving) s.movers[id].presence = Presence::free;
  s.freeIds.insert(s.freeIds.end(), s.leaving.begin(), s.leaving.end());
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
  for (std::size_t level = 0; level < still.levelCount(); ++level) {
    still.forEachCell(level, still.rangeOf(level, reach), CellRange{}, [&](Cell cell) {
      for (const Row row : still.sorted(cell, 0)) {
        if (meets(still.onset(row), reach)) ids.push_back(still.idOf(row));
      }
    });
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());  // met in several cells
  return ids;
}

std::size_t SortAndSweep::pairCount() const {
  return state_->pairs;
}
const SweepCounters& SortAndSweep::counters() const {
  return state_->counters;
}

}  // namespace enfilade::collision
