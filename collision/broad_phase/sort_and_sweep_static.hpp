// Overlaps of the dynamic proxies with the static boxes. Internal to SortAndSweep.
#pragma once

#include "collision/broad_phase/sort_and_sweep_state.hpp"

namespace enfilade::collision {

/// Applies the pending insertions and removals of static boxes (step 1).
void applyStaticEdits(SweepState& sweep);

/// Updates the pairs of the proxies that left their bracket (step 2).
void updateStaticOverlaps(SweepState& sweep);

/// Builds the proxy's window for its present box, and replaces its static overlaps.
void rebuildWindow(SweepState& sweep, ProxyId id);

/// Rebuilds in advance some windows that their proxies are about to leave (step 3).
void refreshWindows(SweepState& sweep);

}  // namespace enfilade::collision
