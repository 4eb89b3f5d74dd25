// Collects the active contacts of a world between two ticks, as events.
#pragma once

#include <vector>

#include "scene/world/world.hpp"

namespace enfilade::scene {

/// Returns the active contacts as events of the last tick, sorted by (a, b, kind). These are
/// `begin`, with the current separation, for each contact that has not ended, and `enter`, without
/// a separation, for each entity in a trigger. The world does not store when they began.
std::vector<ContactEvent> collectActiveContacts(const World& world);

}  // namespace enfilade::scene
