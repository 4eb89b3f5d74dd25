// The results of a sweep (SortAndSweep): pairs of proxies whose boxes overlap, and counters of its
// work.
#pragma once

#include <compare>
#include <cstdint>

namespace enfilade::collision {

using StaticId = std::uint32_t;  ///< index into the constructor's boxes, or from insertStatic()
using ProxyId = std::uint32_t;   ///< from insert(); reused after remove() and update()

/// A dynamic and a static proxy, or two dynamic ones (then `proxy` < `other`).
struct ProxyPair {
  ProxyId proxy;
  std::uint32_t other;  ///< a StaticId, or a ProxyId if `otherIsDynamic`
  bool otherIsDynamic;

  auto operator<=>(const ProxyPair&) const = default;
};

/// A box that overlaps a given dynamic proxy.
struct ProxyOverlap {
  std::uint32_t id;
  bool isDynamic;
  auto operator<=>(const ProxyOverlap& o) const {
    return isDynamic != o.isDynamic ? isDynamic <=> o.isDynamic : id <=> o.id;
  }
  bool operator==(const ProxyOverlap&) const = default;
};

/// Counters of the last SortAndSweep::update(), for metrics and complexity tests.
struct SweepCounters {
  std::uint64_t swaps = 0;         ///< endpoint swaps on all axes
  std::uint64_t windowsBuilt = 0;  ///< proxy windows that were built
  std::uint64_t staticEdits = 0;   ///< static boxes inserted or removed
  std::uint64_t rebuilds = 0;      ///< 1 if the whole static grid was rebuilt
  std::uint64_t batched = 0;       ///< dynamic proxies in a batch update (sort_and_sweep_batch.cpp)
  std::uint64_t aabbTests = 0;  ///< full box tests: of window builds and of nearby dynamic proxies
};

}  // namespace enfilade::collision
