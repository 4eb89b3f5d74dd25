// Overlaps of the dynamic proxies with each other where coherence is lost. Each update finds all
// pairs from scratch, and the changes follow from a comparison with the last ones. Internal to
// SortAndSweep.
#pragma once

#include "collision/broad_phase/sort_and_sweep_state.hpp"

namespace enfilade::collision {

/// Whether the endpoint lists would cost more in this update than a search for all pairs.
bool isBatchCheaper(const SweepState& sweep);

/// Empties the endpoint lists and the neighbours. The pairs remain.
void enterBatch(SweepState& sweep);

/// Updates the pairs. From time to time it also looks for proxies at rest, and returns to the
/// endpoint lists if these have become cheaper.
void updateBatch(SweepState& sweep);

}  // namespace enfilade::collision
