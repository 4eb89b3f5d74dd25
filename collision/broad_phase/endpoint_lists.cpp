// Insertion sort, one proxy after the other. While the first proxies are sorted, the endpoints of
// the others still have their old positions. A later step of the same update may undo a
// swap. The boxes before and after the update therefore decide whether a swap changes an overlap.
// No change is missed. If the overlap of a pair changed, a lower and an upper endpoint of the two
// changed their order on some axis. They were therefore swapped in that direction at least once.

#include "collision/broad_phase/endpoint_lists.hpp"

#include <algorithm>

#include "collision/assert.hpp"
#include "collision/broad_phase/box_table.hpp"

namespace enfilade::collision {

void EndpointLists::growTo(std::uint32_t proxy) {
  maxEndpoints_.resize(proxy + std::size_t{1});
  committedMaxEndpoints_.resize(proxy + std::size_t{1});
  endpointIndices_.resize(proxy + std::size_t{1});
  marked_.resize(proxy + std::size_t{1}, 0);
  swapped_.resize(2 * (proxy + std::size_t{1}));
}

void EndpointLists::commit(std::span<const std::uint32_t> proxies) {
  for (const std::uint32_t proxy : proxies) committedMaxEndpoints_[proxy] = maxEndpoints_[proxy];
}

void EndpointLists::renumber(std::size_t axis) {
  const EndpointList& endpoints = endpoints_[axis];
  for (std::uint32_t k = 1; k + 1 < endpoints.size(); ++k)
    endpointIndex(axis, endpoints[k].tag) = k;
}

void EndpointLists::remove(std::span<const std::uint32_t> proxies) {
  if (proxies.empty()) return;
  for (const std::uint32_t proxy : proxies) {
    ENFILADE_ASSERT(proxy < marked_.size());
    marked_[proxy] = 1;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EndpointList& endpoints = endpoints_[axis];
    endpoints.erase(
        std::remove_if(endpoints.begin() + 1, endpoints.end() - 1,
                       [this](const Endpoint& endpoint) { return marked_[endpoint.proxy()] != 0; }),
        endpoints.end() - 1);
    renumber(axis);
  }
  for (const std::uint32_t proxy : proxies) marked_[proxy] = 0;
}

/// An endpoint of `proxy` was swapped with the opposite endpoint of each of the first `count`
/// proxies in `swapped_`. Appends the pairs whose overlap began (`added`) or ended.
void EndpointLists::recordSwaps(std::uint32_t proxy, std::size_t count, bool added,
                                std::vector<PairChange>& changes) {
  aabbTests += count;
  // Test the rarer condition first: most boxes whose endpoints swap on one axis are far apart.
  const std::vector<SignedBounds>&with = added ? maxEndpoints_ : committedMaxEndpoints_,
        &without = added ? committedMaxEndpoints_ : maxEndpoints_;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t other = swapped_[k];
    ENFILADE_ASSERT(other != proxy);  // the two endpoints of a proxy are never swapped
    if (overlapsByMaxEndpoints(with[proxy], with[other]) &&
        !overlapsByMaxEndpoints(without[proxy], without[other])) {
      changes.push_back({std::min(proxy, other), std::max(proxy, other), added});
    }
  }
}

// The kind (lower or upper) of the swapped endpoints is unpredictable, so the loops have no branch.
// Each proxy is written, and counted only if its endpoint is of the opposite kind.

template <bool isUp>
void EndpointLists::bubble(std::size_t axis, Endpoint endpoint, std::vector<PairChange>& changes) {
  Endpoint* const endpoints = endpoints_[axis].data();
  const std::uint32_t from = endpointIndex(axis, endpoint.tag);
  std::uint32_t at = from;
  std::size_t count = 0;
  for (;;) {
    const std::uint32_t next = isUp ? at + 1 : at - 1;
    const Endpoint other = endpoints[next];
    if (!(isUp ? isBefore(other, endpoint) : isBefore(endpoint, other))) break;
    swapped_[count] = other.proxy();
    count += other.isUpper() != endpoint.isUpper() ? 1 : 0;
    endpoints[at] = other;
    endpointIndex(axis, other.tag) = at;
    at = next;
  }
  swaps += isUp ? at - from : from - at;
  endpoints[at] = endpoint;
  endpointIndex(axis, endpoint.tag) = at;
  recordSwaps(endpoint.proxy(), count, endpoint.isUpper() == isUp, changes);
}

/// Moves the two endpoints of a proxy to their new positions. The leading endpoint moves first, so
/// that the two endpoints of a proxy are never swapped.
void EndpointLists::repair(std::size_t axis, Endpoint lower, Endpoint upper,
                           std::vector<PairChange>& changes) {
  const double wasLower = endpoints_[axis][endpointIndex(axis, lower.tag)].value;
  const double wasUpper = endpoints_[axis][endpointIndex(axis, upper.tag)].value;
  if (upper.value > wasUpper) bubble<true>(axis, upper, changes);
  if (lower.value > wasLower) bubble<true>(axis, lower, changes);
  if (lower.value < wasLower) bubble<false>(axis, lower, changes);
  if (upper.value < wasUpper) bubble<false>(axis, upper, changes);
}

void EndpointLists::move(std::uint32_t proxy, std::vector<PairChange>& changes) {
  const SignedBounds& maxEndpoints = maxEndpoints_[proxy];
  const std::array<std::uint32_t, 6> position = endpointIndices_[proxy];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = -maxEndpoints[axis], high = maxEndpoints[axis + 3];
    Endpoint* const lower = &endpoints_[axis][position[2 * axis]];
    Endpoint* const upper = &endpoints_[axis][position[2 * axis + 1]];
    ENFILADE_ASSERT(low <= high);
    ENFILADE_ASSERT(lower->tag == 2 * proxy && upper->tag == 2 * proxy + 1);
    if (lower->value == low && upper->value == high) continue;
    // Usually neither endpoint is swapped. repair() handles ties.
    if (lower[-1].value < low && low < lower[1].value && upper[-1].value < high &&
        high < upper[1].value) {
      lower->value = low;
      upper->value = high;
    } else {
      repair(axis, {low, 2 * proxy}, {high, 2 * proxy + 1}, changes);
    }
  }
}

void EndpointLists::insert(std::span<const std::uint32_t> proxies,
                           std::vector<PairChange>& changes) {
  if (proxies.empty()) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EndpointList& endpoints = endpoints_[axis];
    const Endpoint last = endpoints.back();
    endpoints.pop_back();
    const auto old = static_cast<std::ptrdiff_t>(endpoints.size());
    for (const std::uint32_t proxy : proxies) {
      endpoints.push_back({-maxEndpoints_[proxy][axis], 2 * proxy});
      endpoints.push_back({maxEndpoints_[proxy][axis + 3], 2 * proxy + 1});
    }
    std::stable_sort(endpoints.begin() + old, endpoints.end(), isBefore);
    std::inplace_merge(endpoints.begin(), endpoints.begin() + old, endpoints.end(), isBefore);
    endpoints.push_back(last);
    ENFILADE_ASSERT(std::is_sorted(endpoints.begin(), endpoints.end(), isBefore));
    renumber(axis);
  }
  findNewPairs(proxies, changes);
}

void EndpointLists::findNewPairs(std::span<const std::uint32_t> newProxies,
                                 std::vector<PairChange>& changes) {
  constexpr std::size_t kMaxComparedWithAll = 8;
  for (const std::uint32_t proxy : newProxies) marked_[proxy] = 1;
  std::vector<std::uint32_t> all;
  for (std::size_t k = 1; k + 1 < endpoints_[0].size(); ++k)
    if (!endpoints_[0][k].isUpper()) all.push_back(endpoints_[0][k].proxy());
  std::vector<BoxTable::IdPair> pairs;
  if (newProxies.size() <= kMaxComparedWithAll) {
    aabbTests += newProxies.size() * all.size();
    for (const std::uint32_t proxy : newProxies) {
      for (const std::uint32_t other : all) {
        if ((marked_[other] == 0 || other < proxy) &&
            overlapsByMaxEndpoints(maxEndpoints_[proxy], maxEndpoints_[other]))
          pairs.emplace_back(proxy, other);
      }
    }
  } else {
    BoxTable table;
    table.build(maxEndpoints_, all);
    table.findPairs(pairs);
    aabbTests += pairs.size();
  }
  for (const auto& [a, b] : pairs) {
    if (marked_[a] != 0 || marked_[b] != 0)
      changes.push_back({std::min(a, b), std::max(a, b), true});
  }
  for (const std::uint32_t proxy : newProxies) marked_[proxy] = 0;
}

}  // namespace enfilade::collision
