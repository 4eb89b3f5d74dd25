// Sorted endpoint lists of the dynamic proxies on three axes, updated by insertion sort (Lin 1993,
// section 5.2.2; Cohen et al. 1995).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "collision/broad_phase/signed_bounds.hpp"

namespace enfilade::collision {

/// Two proxies whose overlap began (`added`) or ended. `a` < `b`.
struct PairChange {
  std::uint32_t a, b;
  bool added;
};

/// One ascending list of interval endpoints per axis. At equal coordinates lower endpoints come
/// first, so that touching closed intervals have the same order as overlapping ones.
class EndpointLists {
 public:
  static constexpr std::uint32_t kMaxProxies = 0x7fffffff;  ///< all ids are smaller

  /// Sets the box of a proxy. In an update, set all boxes first; then change the lists.
  void setMaxEndpoints(std::uint32_t proxy, const SignedBounds& maxEndpoints) {
    if (proxy >= maxEndpoints_.size()) growTo(proxy);
    maxEndpoints_[proxy] = maxEndpoints;
  }

  /// Removes proxies from the lists without reporting changes.
  void remove(std::span<const std::uint32_t> proxies);
  /// Restores the order after the box of a proxy changed. Appends to `changes` each swap of a lower
  /// and an upper endpoint that the boxes confirm as a change; a change may occur twice.
  void move(std::uint32_t proxy, std::vector<PairChange>& changes);
  /// Inserts proxies into the lists and appends their overlaps with all proxies in the lists.
  void insert(std::span<const std::uint32_t> proxies, std::vector<PairChange>& changes);

  /// Ends an update for all moved and inserted proxies: their current box becomes the previous one.
  void commit(std::span<const std::uint32_t> proxies);

  std::uint64_t swaps = 0;  ///< counter, reset by the caller
  std::uint64_t aabbTests = 0;

 private:
  struct Endpoint {
    double value;
    std::uint32_t tag;  ///< 2 * proxy + (1 for the upper endpoint)
    bool isUpper() const { return (tag & 1) != 0; }
    std::uint32_t proxy() const { return tag >> 1; }
  };
  static bool isBefore(const Endpoint& a, const Endpoint& b) {
    return a.value != b.value ? a.value < b.value : a.isUpper() < b.isUpper();
  }
  /// Each list starts with a sentinel at -infinity and ends with one at +infinity, so that every
  /// endpoint has two neighbours.
  using EndpointList = std::vector<Endpoint>;
  static EndpointList makeSentinels() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return {{-kInfinity, 0}, {kInfinity, 1}};
  }

  void growTo(std::uint32_t proxy);
  void repair(std::size_t axis, Endpoint lower, Endpoint upper, std::vector<PairChange>& changes);
  template <bool isUp>
  void bubble(std::size_t axis, Endpoint endpoint, std::vector<PairChange>& changes);
  void recordSwaps(std::uint32_t proxy, std::size_t count, bool added,
                   std::vector<PairChange>& changes);
  void renumber(std::size_t axis);
  void findNewPairs(std::span<const std::uint32_t> newProxies, std::vector<PairChange>& changes);
  std::uint32_t& endpointIndex(std::size_t axis, std::uint32_t tag) {
    return endpointIndices_[tag >> 1][2 * axis + (tag & 1)];
  }

  std::vector<SignedBounds> maxEndpoints_;           ///< by proxy
  std::vector<SignedBounds> committedMaxEndpoints_;  ///< by proxy: as of the last update
  std::array<EndpointList, 3> endpoints_{makeSentinels(), makeSentinels(), makeSentinels()};
  std::vector<std::array<std::uint32_t, 6>>
      endpointIndices_;                 ///< by proxy: its endpoints in the lists
  std::vector<std::uint8_t> marked_;    ///< by proxy: removed or new
  std::vector<std::uint32_t> swapped_;  ///< scratch: proxies of swapped endpoints
};

}  // namespace enfilade::collision
