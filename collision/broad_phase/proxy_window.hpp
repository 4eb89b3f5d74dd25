// Proxy window: the space in which a dynamic proxy stays for some ticks, with the sorted endpoints
// of the static boxes in it. A local form of sort and sweep (Lin 1993, section 5.2.2).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/broad_phase/cell_grid.hpp"
#include "collision/broad_phase/static_grid.hpp"

namespace enfilade::collision {

/// On each signed axis the proxy's maximum endpoint lies in [minBounds, maxBounds). The sorted list
/// of that axis holds the minimum endpoints of static boxes in this range, between two sentinels.
struct ProxyWindow {
  static constexpr std::uint32_t kSentinel = static_cast<std::uint32_t>(-1);
  struct StaticEndpoint {
    double value;
    std::uint32_t staticIndex;  ///< into `statics`, or kSentinel
  };
  struct StaticProxy {
    std::uint32_t id;
    std::uint8_t separatedMask;  ///< bit k: separated on signed axis k; 0: the boxes overlap
    std::uint8_t listedMask;     ///< bit k: its endpoint is in list k, as of the build
  };

  SignedBounds minBounds{}, maxBounds{};  ///< range of the maximum endpoints
  std::array<std::uint32_t, 6> next{};    ///< by signed axis: first endpoint above the proxy's
  std::vector<StaticEndpoint>
      endpoints;  ///< six ascending lists, each with two sentinels; spare room behind
  std::vector<StaticProxy> statics;  ///< all static boxes in the window; spare room behind

  /// Builds the lists from the boxes of `rows`, all of which overlap `maxBounds`. Set the bounds
  /// first. Sets `overlapping` to the ids of the boxes that overlap `maxEndpoints`, in row order.
  void build(const StaticGrid& staticGrid, std::span<const StaticGrid::Row> rows,
             const SignedBounds& maxEndpoints, std::vector<std::uint32_t>& overlapping);

  /// Prefetches the data read when endpoints are crossed: the first endpoints (for most windows
  /// all of them) and the static boxes.
  void prefetch() const {
    constexpr std::size_t kEndpointsPerLine = 4, kMaxPrefetched = 32;
    for (std::size_t k = 0; k < std::min(kMaxPrefetched, endpoints.size());
         k += kEndpointsPerLine) {
      __builtin_prefetch(&endpoints[k]);
    }
    __builtin_prefetch(statics.data());
  }

  /// Endpoints directly below and above the proxy's own on signed axis `k`.
  double endpointBefore(std::size_t k) const { return endpoints[next[k] - 1].value; }
  double endpointAfter(std::size_t k) const { return endpoints[next[k]].value; }
};

}  // namespace enfilade::collision
