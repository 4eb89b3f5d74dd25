// Sort and sweep with temporal coherence (M. C. Lin, thesis 1993, section 5.2.2; J. Cohen, M. C.
// Lin, D. Manocha and M. Ponamgi, "I-COLLIDE", 1995), optimised for mostly static scenes.
//
// Each dynamic proxy has a window: its box, inflated by its predicted motion over some ticks. Six
// sorted lists, one per signed axis, hold the endpoints of the static boxes that the proxy can
// cross inside the window (cell_grid.hpp, proxy_window.hpp). A dynamic and a static box overlap if
// the proxy's maximum endpoint has crossed the static minimum endpoint on all six axes. Six bits
// per static box mark the axes that still separate. Each proxy owns its lists, so a steady tick
// reads only its own data.
//
// Steps of an update, in this order:
// 0. Removed proxies end their pairs.
// 1. Pending insertions and removals of static boxes are applied (static_grid.cpp). The windows
//    that they overlap are rebuilt.
// 2. For each moved proxy, its maximum endpoint on each signed axis is compared with a bracket: the
//    two adjacent endpoints of the list. move() already detects proxies that stay inside; they need
//    no further work. A crossed endpoint changes a bit, and the last bit adds or removes a pair.
//    Inward crossings come first, so a pair is never added and removed in one update.
// 3. A proxy that leaves its window gets a new one; a grid finds the static boxes near it
//    (static_grid.cpp). Some windows are rebuilt in advance, in turn, so that rebuilds are spread
//    over the ticks.
// 4. Dynamic proxies are tested against each other, with endpoint lists of their windows
//    (sort_and_sweep_dynamic.cpp). Where these would exchange too many endpoints, this is done in a
//    batch (sort_and_sweep_batch.cpp).
//
// Departures from the source: each proxy has its own lists instead of three for the whole scene. A
// walker thus crosses only endpoints near it, and static objects cost nothing. Between two builds
// of a window, pairs follow from endpoint swaps alone. A build (a jump forces one at once) replaces
// the pairs of the proxy by the overlaps among the gathered boxes. Endpoint lists of the windows
// find the windows that overlap; the boxes of two such proxies are compared when one moves. Where
// everything moves, exchanges grow with the square of the proxies, and a batch finds all pairs of
// dynamic proxies without the lists. The pairs and the order of their changes are the same.
//
// Limits: 2^31 - 1 dynamic proxies, 2^32 - 2 static boxes, 2^32 - 2 cells; otherwise memory.

#include "collision/broad_phase/sort_and_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "collision/assert.hpp"
#include "collision/broad_phase/sort_and_sweep_batch.hpp"
#include "collision/broad_phase/sort_and_sweep_dynamic.hpp"
#include "collision/broad_phase/sort_and_sweep_pairs.hpp"
#include "collision/broad_phase/sort_and_sweep_state.hpp"
#include "collision/broad_phase/sort_and_sweep_static.hpp"

namespace enfilade::collision {
namespace {

constexpr StaticId kMaxStaticIds = 0xfffffffe;

bool isFinite(const Aabb& box) {
  constexpr double kMaxDouble = std::numeric_limits<double>::max();
  bool finite = true;  // also false for NaN: its comparisons are false
  for (int axis = 0; axis < 3; ++axis) {
    finite &= std::abs(box.min[axis]) <= kMaxDouble;
    finite &= std::abs(box.max[axis]) <= kMaxDouble;
  }
  return finite;
}

[[noreturn]] void throwInvalidAabb(const Aabb& box, const char* what, std::size_t index) {
  throw std::invalid_argument(
      std::string(what) + " " + std::to_string(index) +
      (isFinite(box) ? ": the box is empty (min > max on some axis)" : ": the box is not finite"));
}

void requireValidAabb(const Aabb& box, const char* what, std::size_t index) {
  constexpr double kMaxDouble = std::numeric_limits<double>::max();
  const SignedBounds maxEndpoints = toMaxEndpoints(box);
  bool good = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    good &= maxEndpoints[axis] <= kMaxDouble && maxEndpoints[axis + 3] <= kMaxDouble &&
            -maxEndpoints[axis] <= maxEndpoints[axis + 3];
  }
  if (!good) throwInvalidAabb(box, what, index);
}

[[noreturn]] void throwUnknownId(const char* what, std::size_t id) {
  throw std::invalid_argument(std::string(what) + " " + std::to_string(id) + " does not exist");
}

DynamicProxy& requireProxy(std::vector<DynamicProxy>& proxies, ProxyId id) {
  if (id >= proxies.size() || proxies[id].state == ProxyState::unused ||
      proxies[id].state == ProxyState::removed) {
    throwUnknownId("dynamic proxy", id);
  }
  return proxies[id];
}

/// Maximum endpoints of a box in vector registers, and a test that the box is not empty.
struct MovedEndpoints {
  std::array<Double2, 3> maxEndpoints;
  bool notEmpty;

  explicit MovedEndpoints(const Aabb& box) {
    static_assert(sizeof(Aabb) == 6 * sizeof(double));
    const double *const min = box.min.data(), *const max = box.max.data();
    maxEndpoints = {-loadDouble2(min), loadDouble2(min + 2) * Double2{-1, 1}, loadDouble2(max + 1)};
    notEmpty = toBits(loadDouble2(min) <= loadDouble2(max)) == 3 && min[2] <= max[2];
  }
  bool isWithin(const SignedBounds& low, const SignedBounds& high) const {
    const auto pair = [&](std::size_t k) {
      return toBits(loadDouble2(&low[2 * k]) <= maxEndpoints[k]) &
             toBits(maxEndpoints[k] < loadDouble2(&high[2 * k]));
    };
    return (pair(0) & pair(1) & pair(2)) == 3;
  }
};

std::vector<StaticId> makeSequentialIds(std::size_t count) {
  std::vector<StaticId> ids(count);
  std::iota(ids.begin(), ids.end(), StaticId{0});
  return ids;
}

Aabb makeAabbFromMaxEndpoints(const SignedBounds& r) {
  return {Vec3(-r[0], -r[1], -r[2]), Vec3(r[3], r[4], r[5])};
}

/// Checks that each id below the total occurs exactly once: active, removed or free. Throws
/// std::invalid_argument otherwise.
void validateProxyTable(std::span<const std::pair<ProxyId, Aabb>> active,
                        const SortAndSweep::ProxyTable& table) {
  std::vector<ProxyId> ids(table.freeIds);
  for (const auto& [id, box] : active) ids.push_back(id);
  for (const auto& [id, box] : table.removed) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (ids[i] != i) throw std::invalid_argument("proxy ids are missing or duplicate");
}

/// Marks a proxy with neighbours as moved if `maxEndpoints` differ from the current ones. Call it
/// before these are overwritten.
void markMoved(SweepState& sweep, ProxyId id, const void* maxEndpoints) {
  if (sweep.hasMoved[id] != 0 ||
      std::memcmp(maxEndpoints, &sweep.proxyMaxEndpoints[id], sizeof(SignedBounds)) == 0)
    return;
  sweep.hasMoved[id] = 1;
  sweep.moved.push_back(id);
}

/// Slow path of move(): the proxy left its bracket, or has none.
void moveOutsideBrackets(SweepState& sweep, ProxyId id, const Aabb& box) {
  DynamicProxy& proxy = requireProxy(sweep.proxies, id);
  requireValidAabb(box, "dynamic proxy", id);
  const SignedBounds maxEndpoints = toMaxEndpoints(box);
  if (sweep.batch.isActive || !proxy.neighbours.empty()) markMoved(sweep, id, &maxEndpoints);
  sweep.proxyMaxEndpoints[id] = maxEndpoints;
  if (proxy.leftBrackets || proxy.state == ProxyState::added) return;
  proxy.leftBrackets = true;
  sweep.outsideBrackets.push_back(id);
}

void removeAllOverlaps(SweepState& sweep, ProxyId id) {
  DynamicProxy& proxy = sweep.proxies[id];
  while (!proxy.neighbours.empty()) removeNeighbours(sweep, id, proxy.neighbours.back().id);
  while (!proxy.overlaps.empty() && proxy.overlaps.back().isDynamic)
    removeDynamicOverlap(sweep, id, proxy.overlaps.back().id);
  sweep.overlappingStatics.clear();
  replaceStaticOverlaps(sweep, id);
}

/// Step 4 of an update: in a batch where this is cheaper.
void updateDynamicOverlaps(SweepState& sweep) {
  if (!sweep.batch.isActive && isBatchCheaper(sweep)) enterBatch(sweep);
  if (sweep.batch.isActive) {
    updateBatch(sweep);
  } else {
    updateNeighbours(sweep);
  }
  sweep.counters.swaps += std::exchange(sweep.windowLists.swaps, 0);
  sweep.counters.aabbTests += std::exchange(sweep.windowLists.aabbTests, 0);
}

}  // namespace

// ---- the interface -----------------------------------------------------------------------------

SortAndSweep::SortAndSweep(std::span<const Aabb> staticBoxes) {
  for (std::size_t i = 0; i < staticBoxes.size(); ++i)
    requireValidAabb(staticBoxes[i], "static box", i);
  const std::size_t count = staticBoxes.size();
  state_ = std::make_unique<SweepState>(StaticGrid(staticBoxes, makeSequentialIds(count)), count);
}
SortAndSweep::~SortAndSweep() = default;
SortAndSweep::SortAndSweep(SortAndSweep&&) noexcept = default;
SortAndSweep& SortAndSweep::operator=(SortAndSweep&&) noexcept = default;

ProxyId SortAndSweep::insert(const Aabb& box) {
  SweepState& s = *state_;
  const ProxyId id = s.freeIds.empty() ? static_cast<ProxyId>(s.proxies.size()) : s.freeIds.back();
  requireValidAabb(box, "dynamic proxy", id);
  if (id >= EndpointLists::kMaxProxies)
    throw std::length_error("more than 2^31 - 1 dynamic proxies");
  if (s.freeIds.empty()) {
    s.proxies.emplace_back();
    s.proxyMaxEndpoints.emplace_back();
    s.hasMoved.push_back(0);
  } else {
    s.freeIds.pop_back();
  }
  ENFILADE_ASSERT(s.proxies.size() == s.proxyMaxEndpoints.size() &&
                  s.proxies.size() == s.hasMoved.size());
  DynamicProxy& proxy = s.proxies[id];
  ENFILADE_ASSERT(proxy.state == ProxyState::unused);
  s.proxyMaxEndpoints[id] = proxy.builtMaxEndpoints = toMaxEndpoints(box);
  proxy.velocity.fill(0);
  proxy.bracketLow.fill(std::numeric_limits<double>::infinity());  // forces the slow path of move()
  proxy.state = ProxyState::added;
  s.added.push_back(id);
  return id;
}

void SortAndSweep::move(ProxyId id, const Aabb& box) {
  SweepState& s = *state_;
  const MovedEndpoints moved(box);
  if (id < s.proxies.size()) [[likely]] {
    DynamicProxy& proxy = s.proxies[id];
    // Brackets are finite, so endpoints inside them are finite, too.
    if (moved.isWithin(proxy.bracketLow, proxy.bracketHigh) && moved.notEmpty) {
      if (s.batch.isActive || !proxy.neighbours.empty())
        markMoved(s, id, moved.maxEndpoints.data());
      std::memcpy(&s.proxyMaxEndpoints[id], &moved.maxEndpoints, sizeof(SignedBounds));
      return;
    }
  }
  moveOutsideBrackets(s, id, box);
}

void SortAndSweep::remove(ProxyId id) {
  SweepState& s = *state_;
  DynamicProxy& proxy = requireProxy(s.proxies, id);
  if (proxy.state == ProxyState::added) {
    std::erase(s.added, id);
    proxy.state = ProxyState::unused;
    s.freeIds.push_back(id);
    return;
  }
  proxy.state = ProxyState::removed;
  proxy.bracketLow.fill(std::numeric_limits<double>::infinity());  // forces the slow path of move()
  s.removed.push_back(id);
}

StaticId SortAndSweep::insertStatic(const Aabb& box) {
  SweepState& s = *state_;
  const std::size_t id = s.freeStaticIds.empty() ? s.staticIdCount : s.freeStaticIds.back();
  requireValidAabb(box, "static box", id);
  if (id >= kMaxStaticIds) throw std::length_error("more than 2^32 - 2 static boxes");
  if (s.freeStaticIds.empty()) {
    ++s.staticIdCount;
  } else {
    s.freeStaticIds.pop_back();
  }
  s.pendingInserts.emplace(static_cast<StaticId>(id), box);
  return static_cast<StaticId>(id);
}

void SortAndSweep::removeStatic(StaticId id) {
  SweepState& s = *state_;
  if (s.pendingInserts.erase(id) > 0) {
    s.freeStaticIds.push_back(id);
    return;
  }
  if (s.staticGrid.findRow(id) == StaticGrid::kNoRow || !s.pendingRemovals.insert(id).second) {
    throwUnknownId("static box", id);
  }
}

void SortAndSweep::update() {
  SweepState& s = *state_;
  s.addedPairs.clear();
  s.removedPairs.clear();
  s.counters = {};
  s.travel.fill(0);
  ++s.tick;
  for (const ProxyId id : s.removed) removeAllOverlaps(s, id);
  if (!s.batch.isActive) s.windowLists.remove(s.removed);
  applyStaticEdits(s);
  updateStaticOverlaps(s);
  for (const ProxyId id : s.added) rebuildWindow(s, id);
  refreshWindows(s);
  updateDynamicOverlaps(s);
  for (const ProxyId id : s.moved) s.hasMoved[id] = 0;
  for (const ProxyId id : s.rebuilt) s.proxies[id].rebuilt = false;
  for (const ProxyId id : s.added) s.proxies[id].state = ProxyState::active;
  for (const ProxyId id : s.removed) s.proxies[id].state = ProxyState::unused;
  s.freeIds.insert(s.freeIds.end(), s.removed.begin(), s.removed.end());
  for (auto* ids : {&s.outsideBrackets, &s.moved, &s.rebuilt, &s.added, &s.removed}) ids->clear();
  std::sort(s.addedPairs.begin(), s.addedPairs.end());
  std::sort(s.removedPairs.begin(), s.removedPairs.end());
  ENFILADE_ASSERT(std::ranges::adjacent_find(s.addedPairs) == s.addedPairs.end());
  ENFILADE_ASSERT(std::ranges::adjacent_find(s.removedPairs) == s.removedPairs.end());
}

std::span<const ProxyPair> SortAndSweep::addedPairs() const {
  return state_->addedPairs;
}
std::span<const ProxyPair> SortAndSweep::removedPairs() const {
  return state_->removedPairs;
}

std::span<const ProxyOverlap> SortAndSweep::getOverlaps(ProxyId proxy) const {
  if (proxy >= state_->proxies.size()) return {};
  return state_->proxies[proxy].overlaps;
}

std::span<const ProxyOverlap> SortAndSweep::getDynamicOverlaps(ProxyId proxy) const {
  const std::span<const ProxyOverlap> all = getOverlaps(proxy);
  std::size_t first = all.size();
  while (first > 0 && all[first - 1].isDynamic) --first;
  return all.subspan(first);
}

std::vector<StaticId> SortAndSweep::overlapStatic(const Aabb& box) const {
  requireValidAabb(box, "query box", 0);
  const StaticGrid& staticGrid = state_->staticGrid;
  const SignedBounds maxEndpoints = toMaxEndpoints(box);
  StaticGrid::RowList rows;
  staticGrid.gather(maxEndpoints, rows);
  std::vector<StaticId> ids;
  for (const StaticGrid::Row row : rows.all()) {
    if (overlaps(staticGrid.minEndpoints(row), maxEndpoints)) ids.push_back(staticGrid.getId(row));
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::size_t SortAndSweep::staticCount() const {
  return state_->staticCount;
}
std::size_t SortAndSweep::staticOverheadBytes() const {
  return state_->staticGrid.overheadBytes();
}
std::size_t SortAndSweep::pairCount() const {
  return state_->pairCount;
}
const SweepCounters& SortAndSweep::counters() const {
  return state_->counters;
}

// ---- saving and restoring the dynamic proxies --------------------------------------------------
//
// Pairs follow from the boxes and are reported in the order of ids, so boxes and ids are
// sufficient. Windows do not affect the pairs.

SortAndSweep::ProxyTable SortAndSweep::saveProxies() const {
  const SweepState& s = *state_;
  ProxyTable table{s.freeIds, {}, s.tick > 0};
  for (const ProxyId id : s.removed)
    table.removed.emplace_back(id, makeAabbFromMaxEndpoints(s.proxyMaxEndpoints[id]));
  return table;
}

void SortAndSweep::restoreProxies(std::span<const std::pair<ProxyId, Aabb>> active,
                                  const ProxyTable& table) {
  SweepState& s = *state_;
  if (s.tick > 0) throw std::invalid_argument("restore proxies before the first update");
  validateProxyTable(active, table);
  std::vector<std::pair<ProxyId, Aabb>> all(active.begin(), active.end());
  all.insert(all.end(), table.removed.begin(), table.removed.end());
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });

  const std::size_t count = all.size() + table.freeIds.size();
  s.proxies.clear();
  s.proxies.resize(count);
  s.proxyMaxEndpoints.assign(count, {});
  s.hasMoved.assign(count, 0);
  s.added.clear();
  s.freeIds.clear();
  for (const auto& [id, box] : all) {  // insert() reuses the last freed id
    s.freeIds.push_back(id);
    insert(box);
  }
  s.freeIds = table.freeIds;
  if (!table.updated) return;
  update();
  s.addedPairs.clear();
  for (const auto& [id, box] : table.removed) remove(id);
}

}  // namespace enfilade::collision
