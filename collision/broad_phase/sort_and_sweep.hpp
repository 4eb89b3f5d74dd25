// Broad phase: sort and sweep with temporal coherence (Lin 1993, section 5.2.2; Cohen et al. 1995).
// Reports overlapping boxes as changes from tick to tick.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "collision/broad_phase/sweep_result.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

struct SweepState;  // internal

/// Maintains the exact set of overlapping pairs of closed boxes: after update() it equals the
/// result of brute force. Pairs of two static boxes are never reported.
class SortAndSweep {
 public:
  /// `staticBoxes` must be finite and not empty, else throws std::invalid_argument with the index.
  explicit SortAndSweep(std::span<const Aabb> staticBoxes);
  ~SortAndSweep();
  SortAndSweep(SortAndSweep&&) noexcept;
  SortAndSweep& operator=(SortAndSweep&&) noexcept;

  /// Insert, move and remove dynamic proxies between updates; the next update() changes the pairs.
  /// Boxes must be finite and not empty and ids must exist. Otherwise these functions throw
  /// std::invalid_argument and change nothing. insert() throws std::length_error above 2^31 - 1
  /// proxies.
  ProxyId insert(const Aabb& box);
  void move(ProxyId proxy, const Aabb& box);
  void remove(ProxyId proxy);

  /// State of the proxies apart from the active boxes. A copy needs it to assign the same ids and
  /// to report the same changes.
  struct ProxyTable {
    std::vector<ProxyId> freeIds;                   ///< reused from the back
    std::vector<std::pair<ProxyId, Aabb>> removed;  ///< removed since the last update, in order
    bool updated = false;                           ///< update() was called
  };
  ProxyTable saveProxies() const;
  /// Replaces all proxies by `active` (ascending ids, without those of `table`), in their state
  /// after an update. Allowed only before the first update. The ids must come from saveProxies() of
  /// a broad phase. Throws std::invalid_argument if the ids are inconsistent.
  void restoreProxies(std::span<const std::pair<ProxyId, Aabb>> active, const ProxyTable& table);

  /// Insert and remove static boxes between updates; the next update() changes the pairs. An id can
  /// be reused only after the update that reports the end of its pairs. A few edits per tick are
  /// cheap; after edits of half of the boxes the whole grid is rebuilt. The first edit costs O(n).
  /// insertStatic() throws std::length_error above 2^32 - 2 boxes, removeStatic()
  /// std::invalid_argument for an unknown id.
  StaticId insertStatic(const Aabb& box);
  void removeStatic(StaticId id);

  /// Updates the sorted lists and the pairs.
  void update();

  /// Pairs that the last update() added and removed, sorted; deterministic. Valid until the next
  /// update().
  std::span<const ProxyPair> addedPairs() const;
  std::span<const ProxyPair> removedPairs() const;
  /// All current overlaps of a dynamic proxy, sorted: static boxes first. Empty for an unknown id.
  /// Valid until the next update().
  std::span<const ProxyOverlap> getOverlaps(ProxyId proxy) const;
  /// Those of getOverlaps() with dynamic proxies. Costs no look at the static ones.
  std::span<const ProxyOverlap> getDynamicOverlaps(ProxyId proxy) const;
  /// Static boxes that overlap an arbitrary box, ascending, as of the last update(). For single
  /// queries, such as a free-space test. The cost is linear in the boxes of the cells it covers.
  /// Throws std::invalid_argument for a box that is empty or not finite.
  std::vector<StaticId> overlapStatic(const Aabb& box) const;

  std::size_t pairCount() const;
  std::size_t staticCount() const;          ///< as of the last update()
  std::size_t staticOverheadBytes() const;  ///< static-side memory without 48 bytes per box
  const SweepCounters& counters() const;

 private:
  std::unique_ptr<SweepState> state_;
};

}  // namespace enfilade::collision
