// Run-time check of the broad phase: compares its pairs with brute force, on request.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"

namespace enfilade::collision {

/// Reference implementation: all overlapping pairs by brute force, sorted. `dynamicBoxes` holds the
/// active dynamic proxies with their ids.
std::vector<ProxyPair> findPairsBruteForce(std::span<const Aabb> staticBoxes,
                                           std::span<const std::pair<ProxyId, Aabb>> dynamicBoxes);

/// The result of compareWithBruteForce().
struct BroadPhaseAudit {
  std::size_t pairs = 0;          ///< number of overlapping pairs by brute force
  std::vector<ProxyPair> missed;  ///< overlapping pairs that the sweep lacks; sorted
  std::vector<ProxyPair> extra;   ///< pairs of the sweep that do not overlap; sorted
};

/// Compares the pairs of `sweep` after an update() with brute force over its boxes. These are
/// `staticBoxes` by StaticId (an empty Aabb for an unused id), and all active dynamic proxies with
/// their ids. Costs dynamic * (static + dynamic) box tests of about 5 ns.
BroadPhaseAudit compareWithBruteForce(const SortAndSweep& sweep, std::span<const Aabb> staticBoxes,
                                      std::span<const std::pair<ProxyId, Aabb>> dynamicBoxes);

/// The same for pairs that contain a proxy of `selected`. A large scene can thus be audited a few
/// proxies at a time.
BroadPhaseAudit compareWithBruteForce(const SortAndSweep& sweep, std::span<const Aabb> staticBoxes,
                                      std::span<const std::pair<ProxyId, Aabb>> dynamicBoxes,
                                      std::span<const ProxyId> selected);

}  // namespace enfilade::collision
