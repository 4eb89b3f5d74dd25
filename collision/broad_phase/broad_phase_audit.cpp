// Brute force shares no code with the sweep except overlaps().

#include "collision/broad_phase/broad_phase_audit.hpp"

#include <algorithm>
#include <iterator>

namespace enfilade::collision {
namespace {

/// Sorts and removes duplicates: a pair of two selected proxies is found twice.
void sortUniquePairs(std::vector<ProxyPair>& pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

ProxyPair makeDynamicPair(ProxyId a, ProxyId b) {
  return {std::min(a, b), std::max(a, b), true};
}

std::vector<ProxyPair> collectSweepPairs(const SortAndSweep& sweep,
                                         std::span<const ProxyId> selected) {
  std::vector<ProxyPair> pairs;
  for (const ProxyId id : selected) {
    for (const ProxyOverlap& overlap : sweep.getOverlaps(id)) {
      pairs.push_back(overlap.isDynamic ? makeDynamicPair(id, overlap.id)
                                        : ProxyPair{id, overlap.id, false});
    }
  }
  sortUniquePairs(pairs);
  return pairs;
}

std::vector<ProxyPair> findOverlaps(const std::pair<ProxyId, Aabb>& proxy,
                                    std::span<const Aabb> staticBoxes,
                                    std::span<const std::pair<ProxyId, Aabb>> dynamicBoxes) {
  std::vector<ProxyPair> pairs = findPairsBruteForce(staticBoxes, std::span(&proxy, 1));
  for (const auto& [id, box] : dynamicBoxes) {
    if (id != proxy.first && overlaps(box, proxy.second)) {
      pairs.push_back(makeDynamicPair(id, proxy.first));
    }
  }
  return pairs;
}

BroadPhaseAudit comparePairs(const std::vector<ProxyPair>& expected,
                             const std::vector<ProxyPair>& held) {
  BroadPhaseAudit audit;
  audit.pairs = expected.size();
  std::set_difference(expected.begin(), expected.end(), held.begin(), held.end(),
                      std::back_inserter(audit.missed));
  std::set_difference(held.begin(), held.end(), expected.begin(), expected.end(),
                      std::back_inserter(audit.extra));
  return audit;
}

}  // namespace

std::vector<ProxyPair> findPairsBruteForce(std::span<const Aabb> staticBoxes,
                                           std::span<const std::pair<ProxyId, Aabb>> dynamicBoxes) {
  std::vector<ProxyPair> pairs;
  for (const auto& [id, box] : dynamicBoxes) {
    for (std::size_t other = 0; other < staticBoxes.size(); ++other) {
      if (overlaps(box, staticBoxes[other])) {
        pairs.push_back({id, static_cast<std::uint32_t>(other), false});
      }
    }
    for (const auto& [otherId, otherBox] : dynamicBoxes) {
      if (id < otherId && overlaps(box, otherBox)) pairs.push_back({id, otherId, true});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

BroadPhaseAudit compareWithBruteForce(const SortAndSweep& sweep, std::span<const Aabb> staticBoxes,
                                      std::span<const std::pair<ProxyId, Aabb>> dynamicBoxes,
                                      std::span<const ProxyId> selected) {
  std::vector<ProxyPair> expected;
  for (const auto& proxy : dynamicBoxes) {
    if (std::find(selected.begin(), selected.end(), proxy.first) == selected.end()) continue;
    const std::vector<ProxyPair> pairs = findOverlaps(proxy, staticBoxes, dynamicBoxes);
    expected.insert(expected.end(), pairs.begin(), pairs.end());
  }
  sortUniquePairs(expected);
  return comparePairs(expected, collectSweepPairs(sweep, selected));
}

BroadPhaseAudit compareWithBruteForce(const SortAndSweep& sweep, std::span<const Aabb> staticBoxes,
                                      std::span<const std::pair<ProxyId, Aabb>> dynamicBoxes) {
  std::vector<ProxyId> all;
  for (const auto& [id, box] : dynamicBoxes) all.push_back(id);
  return compareWithBruteForce(sweep, staticBoxes, dynamicBoxes, all);
}

}  // namespace enfilade::collision
