// Whether a live broad phase is right: its pairs against brute force, on ticks of the caller's
// choice.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"

namespace enfilade::collision {

struct BroadPhaseAudit {
  std::size_t pairs = 0;        ///< that brute force found among those asked about
  std::vector<BoxPair> missed;  ///< overlap, but the sweep does not hold them; sorted
  std::vector<BoxPair> extra;   ///< the sweep holds them, but they do not overlap; sorted
  bool right() const { return missed.empty() && extra.empty(); }
};

/// Compares the pairs that `sweep` holds after an update() with brute force over the boxes that it
/// was given: `stillBoxes` by StillId (an empty Box where there is none), all live movers with
/// their ids. Costs movers * (still + movers) box tests of some 5 ns.
BroadPhaseAudit compareWithBruteForce(const SortAndSweep& sweep, std::span<const Box> stillBoxes,
                                      std::span<const std::pair<MoverId, Box>> moverBoxes);

/// The same for the pairs in which a mover of `asked` takes part, so that a large scene can be
/// audited some movers at a time.
BroadPhaseAudit compareWithBruteForce(const SortAndSweep& sweep, std::span<const Box> stillBoxes,
                                      std::span<const std::pair<MoverId, Box>> moverBoxes,
                                      std::span<const MoverId> asked);

}  // namespace enfilade::collision
