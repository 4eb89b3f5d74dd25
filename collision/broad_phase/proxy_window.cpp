// One branch-free pass per signed axis collects the endpoints inside the window, because branches
// would be unpredictable. Most lists are short and are sorted by insertion.

#include "collision/broad_phase/proxy_window.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

using StaticEndpoint = ProxyWindow::StaticEndpoint;

constexpr std::size_t kSmallListThreshold = 24;  // list length up to which insertion sort is used

bool isBefore(const StaticEndpoint& a, const StaticEndpoint& b) {
  return a.value < b.value;
}

void sortEndpoints(StaticEndpoint* first, StaticEndpoint* last) {
  if (static_cast<std::size_t>(last - first) > kSmallListThreshold) {
    std::sort(first, last, isBefore);
    return;
  }
  for (StaticEndpoint* end = first; end != last; ++end) {
    const StaticEndpoint moving = *end;
    StaticEndpoint* to = end;
    for (; to != first && moving.value < to[-1].value; --to) *to = to[-1];
    *to = moving;
  }
}

/// Writes the endpoints inside the window on signed axis `k`, sorted. Returns the end of the list.
StaticEndpoint* collectEndpoints(const StaticGrid& staticGrid,
                                 std::span<const StaticGrid::Row> rows, std::size_t k,
                                 std::span<const ProxyWindow::StaticProxy> boxes,
                                 StaticEndpoint* endpoints) {
  StaticEndpoint* picked = endpoints;
  for (std::uint32_t r = 0; r < rows.size(); ++r) {
    picked->staticIndex = r;
    picked += boxes[r].listedMask >> k & 1;
  }
  for (StaticEndpoint* end = endpoints; end != picked; ++end)
    end->value = staticGrid.minEndpoints(rows[end->staticIndex])[k];
  sortEndpoints(endpoints, picked);
  return picked;
}

/// Grows the storage to `size` entries. Frees it first if it is far larger than needed.
template <class T>
void resizeStorage(std::vector<T>& room, std::size_t size) {
  // Entries. Storage is kept while the size varies by less than a factor of eight, and always up to
  // 16 kB. Rebuilds, of about 1 µs, thus rarely allocate.
  constexpr std::size_t kShrinkFactor = 8, kShrinkSlack = 1024;
  if (room.size() > kShrinkFactor * size + kShrinkSlack) room = std::vector<T>();
  if (room.size() < size) room.resize(size);
}

}  // namespace

void ProxyWindow::build(const StaticGrid& staticGrid, std::span<const StaticGrid::Row> rows,
                        const SignedBounds& maxEndpoints, std::vector<std::uint32_t>& overlapping) {
  resizeStorage(statics, rows.size());
  if (overlapping.size() < rows.size()) overlapping.resize(rows.size());
  std::size_t overlapCount = 0;
  // Two sentinels and room for one endpoint of each box per signed axis: collectEndpoints() writes
  // past the end of its list.
  const std::size_t endpointCount = 12 + 6 * rows.size();
  unsigned anyListed = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const SignedBounds& minEndpoints = staticGrid.minEndpoints(rows[r]);
    const unsigned separated = findGreater(minEndpoints, maxEndpoints),
                   listed = findGreater(minEndpoints, minBounds);
    const std::uint32_t id = staticGrid.getId(rows[r]);
    statics[r] = {id, static_cast<std::uint8_t>(separated), static_cast<std::uint8_t>(listed)};
    overlapping[overlapCount] = id;
    overlapCount += separated == 0 ? 1 : 0;
    anyListed |= listed;
  }
  resizeStorage(endpoints, endpointCount);
  overlapping.resize(overlapCount);
  StaticEndpoint* end = endpoints.data();
  for (std::size_t k = 0; k < 6; ++k) {
    ENFILADE_ASSERT(minBounds[k] <= maxEndpoints[k] && maxEndpoints[k] <= maxBounds[k]);
    *end++ = {minBounds[k], kSentinel};
    StaticEndpoint* firstGreater = end;
    if ((anyListed >> k & 1) != 0) {
      end = collectEndpoints(staticGrid, rows, k, statics, end);
      while (firstGreater != end && firstGreater->value <= maxEndpoints[k]) ++firstGreater;
    }
    next[k] = static_cast<std::uint32_t>(firstGreater - endpoints.data());
    *end++ = {maxBounds[k], kSentinel};
  }
  ENFILADE_ASSERT(end <= endpoints.data() + endpoints.size());
}

}  // namespace enfilade::collision
