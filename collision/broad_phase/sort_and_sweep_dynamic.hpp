// Overlaps of the dynamic proxies with each other. Internal to SortAndSweep.
#pragma once

#include "collision/broad_phase/sort_and_sweep_state.hpp"

namespace enfilade::collision {

/// Updates the endpoint lists of the windows, and neighbours and pairs of the moved, added and
/// rebuilt proxies (step 4).
void updateNeighbours(SweepState& sweep);

/// Two proxies whose windows overlap become neighbours, and their boxes may be a pair.
void addNeighbours(SweepState& sweep, ProxyId a, ProxyId b);
/// Two proxies whose windows no longer overlap cease to be neighbours, and their pair ends.
void removeNeighbours(SweepState& sweep, ProxyId a, ProxyId b);

}  // namespace enfilade::collision
