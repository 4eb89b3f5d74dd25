#include "collision/broad_phase/sort_and_sweep_pairs.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

bool insertOverlap(std::vector<ProxyOverlap>& overlapList, const ProxyOverlap& overlap) {
  const auto at = std::lower_bound(overlapList.begin(), overlapList.end(), overlap);
  if (at != overlapList.end() && *at == overlap) return false;
  overlapList.insert(at, overlap);
  return true;
}

bool eraseOverlap(std::vector<ProxyOverlap>& overlapList, const ProxyOverlap& overlap) {
  const auto at = std::lower_bound(overlapList.begin(), overlapList.end(), overlap);
  if (at == overlapList.end() || *at != overlap) return false;
  overlapList.erase(at);
  return true;
}

}  // namespace

void addStaticOverlap(SweepState& sweep, ProxyId id, StaticId other) {
  if (!insertOverlap(sweep.proxies[id].overlaps, {other, false})) return;
  sweep.addedPairs.push_back({id, other, false});
  ++sweep.pairCount;
}

void removeStaticOverlap(SweepState& sweep, ProxyId id, StaticId other) {
  if (!eraseOverlap(sweep.proxies[id].overlaps, {other, false})) return;
  sweep.removedPairs.push_back({id, other, false});
  --sweep.pairCount;
}

void replaceStaticOverlaps(SweepState& sweep, ProxyId id) {
  std::vector<ProxyOverlap>& overlapList = sweep.proxies[id].overlaps;
  std::sort(sweep.overlappingStatics.begin(), sweep.overlappingStatics.end());
  ENFILADE_ASSERT(std::adjacent_find(sweep.overlappingStatics.begin(),
                                     sweep.overlappingStatics.end()) ==
                  sweep.overlappingStatics.end());  // the grid reports each box once
  sweep.merged.clear();
  auto held = overlapList.begin();
  const auto endHeldBefore = [&](StaticId limit) {
    for (; held != overlapList.end() && !held->isDynamic && held->id < limit; ++held) {
      sweep.removedPairs.push_back({id, held->id, false});
      --sweep.pairCount;
    }
  };
  for (const StaticId other : sweep.overlappingStatics) {
    endHeldBefore(other);
    if (held != overlapList.end() && !held->isDynamic && held->id == other) {
      ++held;
    } else {
      sweep.addedPairs.push_back({id, other, false});
      ++sweep.pairCount;
    }
    sweep.merged.push_back({other, false});
  }
  endHeldBefore(static_cast<StaticId>(-1));
  sweep.merged.insert(sweep.merged.end(), held, overlapList.end());
  ENFILADE_ASSERT(std::is_sorted(sweep.merged.begin(), sweep.merged.end()));
  overlapList.assign(sweep.merged.begin(), sweep.merged.end());
}

void changeDynamicOverlap(SweepState& sweep, ProxyId id, ProxyId other, bool added) {
  std::vector<ProxyOverlap>& overlapList = sweep.proxies[id].overlaps;
  [[maybe_unused]] const bool changed =
      added ? insertOverlap(overlapList, {other, true}) : eraseOverlap(overlapList, {other, true});
  ENFILADE_ASSERT(changed);
}

void recordDynamicChange(SweepState& sweep, ProxyId a, ProxyId b, bool added) {
  (added ? sweep.addedPairs : sweep.removedPairs).push_back({std::min(a, b), std::max(a, b), true});
  ENFILADE_ASSERT(added || sweep.pairCount > 0);
  sweep.pairCount += added ? 1 : -1;
}

void addDynamicOverlap(SweepState& sweep, ProxyId a, ProxyId b) {
  if (!insertOverlap(sweep.proxies[a].overlaps, {b, true})) return;
  changeDynamicOverlap(sweep, b, a, true);
  recordDynamicChange(sweep, a, b, true);
}

void removeDynamicOverlap(SweepState& sweep, ProxyId a, ProxyId b) {
  if (!eraseOverlap(sweep.proxies[a].overlaps, {b, true})) return;
  changeDynamicOverlap(sweep, b, a, false);
  recordDynamicChange(sweep, a, b, false);
}

}  // namespace enfilade::collision
