// Batch updates of the dynamic pairs.
//
// The moving proxies are put into a table in each update (box_table.hpp), which finds their pairs.
// Proxies that have not moved for some time rest. They are in a second table, which is built
// rarely, and pairs of two of them are not looked at. A heap asleep thus costs nothing.
//
// The cheaper method is predicted from the work of each, in estimated nanoseconds, not from clocks.
// Runs are reproducible, and both methods yield the same pairs in the same order.
#include "collision/broad_phase/sort_and_sweep_batch.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "collision/assert.hpp"
#include "collision/broad_phase/sort_and_sweep_dynamic.hpp"
#include "collision/broad_phase/sort_and_sweep_pairs.hpp"
#include "collision/broad_phase/sort_and_sweep_static.hpp"

namespace enfilade::collision {
namespace {

using IdPair = BoxTable::IdPair;

// Estimated costs, nanoseconds.
constexpr double kSwapCost = 6, kNeighbourTestCost = 6;
constexpr double kBatchProxyCost = 90, kBatchPairCost = 15;
// The present method is kept unless the other one is cheaper by this factor.
constexpr double kEnterRatio = 1.5, kLeaveRatio = 1.15;
constexpr std::size_t kMinBatchProxies = 256;  // fewer proxies are never a batch
constexpr std::uint64_t kReviewInterval = 32;  // updates, in a batch
constexpr std::uint64_t kCheckInterval = 8;    // updates, of the lists

bool isPresent(const SweepState& sweep, ProxyId id) {
  const ProxyState state = sweep.proxies[id].state;
  return state == ProxyState::active || state == ProxyState::added;
}

std::size_t countPresent(const SweepState& sweep) {
  return sweep.proxies.size() - sweep.freeIds.size() - sweep.removed.size();
}

/// Predicts the cost of the swaps when `windows` windows travel this far in sum on each axis. The
/// density of the endpoints is that between the octiles of a sample: where most proxies are.
double predictSwapCost(const SweepState& sweep, const std::array<double, 3>& travel,
                       std::size_t windows) {
  constexpr std::size_t kSample = 64;
  constexpr double kShare = 0.75;  // of the proxies lies between the octiles
  std::array<ProxyId, kSample> ids;
  std::size_t count = 0;
  for (std::size_t k = 0; k < kSample; ++k) {
    const auto id = static_cast<ProxyId>(k * sweep.proxies.size() / kSample);
    if (isPresent(sweep, id)) ids[count++] = id;
  }
  if (count == 0) return 0;
  double swaps = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<double, kSample> positions;
    for (std::size_t k = 0; k < count; ++k)
      positions[k] = sweep.proxyMaxEndpoints[ids[k]][axis + 3];
    std::sort(positions.begin(), positions.begin() + static_cast<std::ptrdiff_t>(count));
    const double width = positions[count * 7 / 8] - positions[count / 8];
    const double endpoints = 2 * kShare * static_cast<double>(countPresent(sweep));
    // Both endpoints of a window pass at most all others: on a storey all have one height.
    const double passed = 2 * static_cast<double>(windows);
    swaps += (travel[axis] < passed * width ? travel[axis] / width : passed) * endpoints;
  }
  return kSwapCost * swaps;
}

double predictBatchCost(std::size_t moving, std::size_t pairs) {
  return kBatchProxyCost * static_cast<double>(moving) +
         kBatchPairCost * static_cast<double>(pairs);
}

// ---- pairs -------------------------------------------------------------------------------------

/// Lists the proxies that overlap each proxy, ascending. Uses two counting sorts. The pairs are
/// symmetric, so the second one, which takes the lists of the first in the order of ids, writes
/// ascending lists.
void listDynamicOverlaps(std::span<const IdPair> pairs, std::size_t proxies, BatchState& batch) {
  std::vector<std::uint32_t>& start = batch.next.start;
  start.assign(proxies + 1, 0);
  for (const auto& [a, b] : pairs) ++start[a], ++start[b];
  std::exclusive_scan(start.begin(), start.end(), start.begin(), std::uint32_t{0});
  batch.unsorted.resize(2 * pairs.size());
  batch.next.overlapping.resize(2 * pairs.size());
  batch.writeAt.assign(start.begin(), start.end());
  for (const auto& [a, b] : pairs) {
    batch.unsorted[batch.writeAt[a]++] = b;
    batch.unsorted[batch.writeAt[b]++] = a;
  }
  batch.writeAt.assign(start.begin(), start.end());
  for (ProxyId id = 0; id < proxies; ++id) {
    for (std::uint32_t k = start[id]; k < start[id + 1]; ++k)
      batch.next.overlapping[batch.writeAt[batch.unsorted[k]]++] = id;
  }
}

/// Replaces the dynamic overlaps of a moving proxy by `overlapping`, and records the differences.
/// The other moving proxies replace their own.
void replaceDynamicOverlaps(SweepState& sweep, ProxyId id, std::span<const ProxyId> overlapping) {
  std::vector<ProxyOverlap>& overlapList = sweep.proxies[id].overlaps;
  const auto firstDynamic = std::ranges::find(overlapList, true, &ProxyOverlap::isDynamic);
  auto before = firstDynamic;
  auto now = overlapping.begin();
  bool differs = false;
  while (before != overlapList.end() || now != overlapping.end()) {
    const bool ends =
        now == overlapping.end() || (before != overlapList.end() && before->id < *now);
    if (!ends && before != overlapList.end() && before->id == *now) {
      ++before, ++now;
      continue;
    }
    differs = true;
    const ProxyId other = ends ? (before++)->id : *now++;
    if (!sweep.batch.isResting[other] && other < id) continue;
    recordDynamicChange(sweep, id, other, !ends);
    if (sweep.batch.isResting[other]) changeDynamicOverlap(sweep, other, id, !ends);
  }
  if (!differs) return;
  overlapList.erase(firstDynamic, overlapList.end());
  for (const ProxyId other : overlapping) overlapList.push_back({other, true});
}

/// Brings the list of moving proxies up to date.
void updateMembers(SweepState& sweep) {
  BatchState& batch = sweep.batch;
  batch.isResting.resize(sweep.proxies.size(), 0);
  batch.hasMoved.resize(sweep.proxies.size(), 0);
  for (const ProxyId id : sweep.removed) batch.isResting[id] = 0;
  if (!sweep.removed.empty())
    std::erase_if(batch.moving, [&](ProxyId id) { return !isPresent(sweep, id); });
  for (const ProxyId id : sweep.added) {
    ENFILADE_ASSERT(!batch.isResting[id]);
    batch.moving.push_back(id);
    batch.hasMoved[id] = 1;
  }
  for (const ProxyId id : sweep.moved) {
    batch.hasMoved[id] = 1;
    if (!batch.isResting[id] || !isPresent(sweep, id)) continue;
    batch.isResting[id] = 0;
    batch.moving.push_back(id);
    batch.woken.push_back(id);
  }
}

void findPairs(SweepState& sweep) {
  BatchState& batch = sweep.batch;
  batch.found.clear();
  batch.movingTable.build(sweep.proxyMaxEndpoints, batch.moving);
  batch.movingTable.findPairs(batch.found);
  if (batch.restingTable.ids().empty()) return;
  const std::size_t ofMoving = batch.found.size();
  for (const ProxyId id : batch.moving)
    batch.restingTable.findOverlaps(sweep.proxyMaxEndpoints[id], id, batch.found);
  // Proxies that no longer rest are still in the table, with their old boxes.
  batch.found.erase(
      std::remove_if(batch.found.begin() + static_cast<std::ptrdiff_t>(ofMoving), batch.found.end(),
                     [&](const IdPair& pair) { return !batch.isResting[pair.second]; }),
      batch.found.end());
}

/// Brings the overlaps of all moving proxies up to date.
void updateOverlaps(SweepState& sweep) {
  BatchState& batch = sweep.batch;
  listDynamicOverlaps(batch.found, sweep.proxies.size(), batch);
  const bool isFirst = batch.known.start.empty();
  for (const ProxyId id : batch.moving) {
    if (isFirst || !std::ranges::equal(batch.known.of(id), batch.next.of(id)))
      replaceDynamicOverlaps(sweep, id, batch.next.of(id));
  }
  // The known overlaps of a proxy that rested lack those that rested, too.
  for (const ProxyId id : batch.woken) replaceDynamicOverlaps(sweep, id, batch.next.of(id));
  batch.woken.clear();
  std::swap(batch.known, batch.next);
}

// ---- reviews -----------------------------------------------------------------------------------

/// Proxies that have not moved since the last review rest from now on.
void reviewResting(SweepState& sweep) {
  BatchState& batch = sweep.batch;
  std::vector<ProxyId> moving, resting;
  for (const ProxyId id : batch.moving) (batch.hasMoved[id] ? moving : resting).push_back(id);
  std::fill(batch.hasMoved.begin(), batch.hasMoved.end(), std::uint8_t{0});
  if (resting.empty()) return;
  for (const ProxyId id : resting) batch.isResting[id] = 1;
  for (const ProxyId id : batch.restingTable.ids()) {
    if (batch.isResting[id]) resting.push_back(id);
  }
  // An id that was removed and assigned again is in the list twice.
  std::sort(resting.begin(), resting.end());
  resting.erase(std::unique(resting.begin(), resting.end()), resting.end());
  batch.moving = std::move(moving);
  batch.restingTable.build(sweep.proxyMaxEndpoints, resting);
}

/// Predicts the cost of an update with the endpoint lists, from the motion since the last review.
double predictListCost(SweepState& sweep, std::span<const ProxyId> present,
                       std::size_t neighbours) {
  const BatchState& batch = sweep.batch;
  const double updates = static_cast<double>(kReviewInterval);
  const double movedShare =
      static_cast<double>(batch.movedSinceReview) /
      (updates * static_cast<double>(std::max<std::size_t>(present.size(), 1)));
  return predictSwapCost(sweep, batch.travel, batch.rebuiltSinceReview) / updates +
         kNeighbourTestCost * 2 * movedShare * static_cast<double>(neighbours);
}

/// Counts the overlapping windows, which would be neighbours. Rebuilds all windows: they may be
/// wide from a faster motion.
std::size_t countNeighbours(SweepState& sweep, std::span<const ProxyId> present) {
  std::vector<SignedBounds> windows(sweep.proxies.size());
  for (const ProxyId id : present) {
    rebuildWindow(sweep, id);
    windows[id] = sweep.proxies[id].window.maxBounds;
  }
  BoxTable table;
  table.build(windows, present);
  std::vector<IdPair> pairs;
  table.findPairs(pairs);
  return pairs.size();
}

/// Returns to the endpoint lists if these are cheaper.
void reviewCost(SweepState& sweep) {
  BatchState& batch = sweep.batch;
  std::vector<ProxyId> present = batch.moving;
  for (const ProxyId id : batch.restingTable.ids()) {
    if (batch.isResting[id]) present.push_back(id);
  }
  std::sort(present.begin(), present.end());
  ENFILADE_ASSERT(present.size() == countPresent(sweep));
  const double limit = predictBatchCost(batch.moving.size(), sweep.pairCount) / kLeaveRatio;
  const bool isSmall = present.size() < kMinBatchProxies;
  const bool leaves =
      isSmall || (predictListCost(sweep, present, 0) < limit &&
                  predictListCost(sweep, present, countNeighbours(sweep, present)) < limit);
  batch.travel.fill(0);
  batch.movedSinceReview = batch.rebuiltSinceReview = 0;
  if (!leaves) return;
  for (const ProxyId id : present)
    sweep.windowLists.setMaxEndpoints(id, sweep.proxies[id].window.maxBounds);
  sweep.changes.clear();
  sweep.windowLists.insert(present, sweep.changes);
  sweep.windowLists.commit(present);
  for (const PairChange& change : sweep.changes) addNeighbours(sweep, change.a, change.b);
  batch = {};
}

}  // namespace

bool isBatchCheaper(const SweepState& sweep) {
  const std::size_t present = countPresent(sweep);
  if (present < kMinBatchProxies) return false;
  if (2 * sweep.added.size() >= present) return true;  // their motion is not known yet
  // Many windows at once may be a burst; otherwise a look from time to time suffices.
  const bool isBurst = 4 * sweep.rebuilt.size() >= present;
  if (!isBurst && sweep.tick % kCheckInterval != 0) return false;
  const double listCost = predictSwapCost(sweep, sweep.travel, sweep.rebuilt.size()) +
                          kNeighbourTestCost * static_cast<double>(sweep.neighbourTests);
  return listCost > kEnterRatio * predictBatchCost(present, sweep.pairCount);
}

void enterBatch(SweepState& sweep) {
  sweep.batch = {};
  sweep.batch.isActive = true;
  sweep.batch.reviewAt = sweep.tick + kReviewInterval;
  sweep.batch.isResting.assign(sweep.proxies.size(), 0);
  for (ProxyId id = 0; id < sweep.proxies.size(); ++id) {
    if (sweep.proxies[id].state == ProxyState::active) sweep.batch.moving.push_back(id);
  }
  sweep.windowLists.remove(sweep.batch.moving);
  for (DynamicProxy& proxy : sweep.proxies) proxy.neighbours.clear();
}

void updateBatch(SweepState& sweep) {
  BatchState& batch = sweep.batch;
  for (std::size_t axis = 0; axis < 3; ++axis) batch.travel[axis] += sweep.travel[axis];
  batch.movedSinceReview += sweep.moved.size();
  batch.rebuiltSinceReview += sweep.rebuilt.size();
  if (!sweep.moved.empty() || !sweep.rebuilt.empty() || !sweep.removed.empty()) {
    updateMembers(sweep);
    findPairs(sweep);
    updateOverlaps(sweep);
    sweep.counters.batched = batch.moving.size();
  }
  if (sweep.tick < batch.reviewAt) return;
  batch.reviewAt = sweep.tick + kReviewInterval;
  reviewResting(sweep);
  reviewCost(sweep);
}

}  // namespace enfilade::collision
