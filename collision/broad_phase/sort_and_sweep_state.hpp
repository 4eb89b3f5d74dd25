// State of SortAndSweep: plain data. Only the files of SortAndSweep include this header.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "collision/broad_phase/box_table.hpp"
#include "collision/broad_phase/cell_grid.hpp"
#include "collision/broad_phase/endpoint_lists.hpp"
#include "collision/broad_phase/proxy_window.hpp"
#include "collision/broad_phase/static_grid.hpp"
#include "collision/broad_phase/sweep_result.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

enum class ProxyState : std::uint8_t { unused, added, active, removed };

/// Prefetch lead, in proxies: the proxies of a crowd do not fit into the near caches.
constexpr std::size_t kPrefetchDistance = 6;

/// Another dynamic proxy whose window overlaps one's own.
struct Neighbour {
  static constexpr std::uint8_t kOverlapping = 6;

  ProxyId id;
  std::uint8_t separatingAxis;  ///< own signed axis on which the boxes were last found separated;
                                ///< kOverlapping: they overlap, as of the last update
  bool isOverlapping() const { return separatingAxis == kOverlapping; }
};

struct alignas(64) DynamicProxy {
  // The fields that a steady tick reads come first: two cache lines.
  SignedBounds bracketLow{},
      bracketHigh{};  ///< bracket: no endpoint is crossed while low <= maxEndpoints < high
  std::vector<Neighbour> neighbours;   ///< sorted by id
  std::vector<ProxyOverlap> overlaps;  ///< sorted

  ProxyWindow window;
  ProxyState state = ProxyState::unused;
  bool leftBrackets = false;         ///< may have left its bracket since the last update
  bool rebuilt = false;              ///< its window was rebuilt in this update
  std::uint64_t builtAt = 0;         ///< tick of the last window build
  SignedBounds builtMaxEndpoints{};  ///< maximum endpoints at that tick
  SignedBounds velocity{};  ///< velocity of the maximum endpoints at that tick, metres per tick
};

/// The overlapping dynamic proxies of each proxy.
struct OverlapLists {
  std::vector<std::uint32_t> start;  ///< by proxy: its first one; and the end of the last list
  std::vector<ProxyId> overlapping;  ///< ascending for each proxy
  std::span<const ProxyId> of(ProxyId id) const {
    if (id + std::size_t{1} >= start.size()) return {};
    return std::span(overlapping).subspan(start[id], start[id + 1] - start[id]);
  }
};

/// State of batch updates (sort_and_sweep_batch.cpp).
struct BatchState {
  bool isActive = false;                ///< else the endpoint lists find the pairs
  std::vector<ProxyId> moving;          ///< all proxies that do not rest
  std::vector<std::uint8_t> isResting;  ///< by proxy: its box is that of restingTable
  std::vector<std::uint8_t> hasMoved;   ///< by proxy: since the last review
  BoxTable movingTable, restingTable;
  std::vector<ProxyId> woken;  ///< resting proxies that have moved in this update
  OverlapLists known;          ///< as found in the last update: without pairs that both rest
  OverlapLists next;           ///< scratch
  std::vector<std::uint32_t> writeAt;   ///< scratch
  std::vector<ProxyId> unsorted;        ///< scratch
  std::vector<BoxTable::IdPair> found;  ///< scratch: each pair once
  std::uint64_t reviewAt = 0;           ///< tick
  std::array<double, 3> travel{};  ///< metres on each axis, of window endpoints, since the review
  std::uint64_t rebuiltSinceReview = 0;  ///< windows
  std::uint64_t movedSinceReview = 0;    ///< moved proxies, each once in an update
};

struct SweepState {
  SweepState(StaticGrid grid, std::size_t boxes)
      : staticGrid(std::move(grid)), staticIdCount(boxes), staticCount(boxes) {}

  StaticGrid staticGrid;
  std::map<StaticId, Aabb> pendingInserts;  ///< static boxes to insert
  std::set<StaticId> pendingRemovals;       ///< static boxes to remove
  std::vector<StaticId> freeStaticIds;
  std::size_t staticIdCount = 0;  ///< number of distinct ids assigned so far
  std::size_t staticCount = 0;

  EndpointLists windowLists;  ///< of the proxy windows
  BatchState batch;
  std::array<double, 3> travel{};    ///< metres on each axis, of window endpoints in this update
  std::uint64_t neighbourTests = 0;  ///< of the last update
  std::vector<DynamicProxy> proxies;
  // Separate arrays for the fields that neighbours read of a proxy.
  std::vector<SignedBounds> proxyMaxEndpoints;
  std::vector<std::uint8_t> hasMoved;  ///< moved since the last update, and has neighbours
  std::vector<ProxyId> freeIds;
  std::vector<ProxyId> outsideBrackets, moved, added, removed;  ///< since the last update
  std::vector<ProxyId> rebuilt;                                 ///< in this update
  std::uint64_t tick = 0;
  std::size_t nextRefreshed = 0;

  std::vector<PairChange> changes;           ///< scratch
  StaticGrid::RowList rows;                  ///< scratch: static boxes near a proxy
  std::vector<StaticId> overlappingStatics;  ///< scratch: static boxes that overlap it
  std::vector<ProxyOverlap> merged;          ///< scratch
  std::vector<ProxyPair> addedPairs, removedPairs;
  std::size_t pairCount = 0;
  SweepCounters counters;
};

}  // namespace enfilade::collision
