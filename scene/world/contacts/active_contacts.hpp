// Which contacts live in a world between two ticks.
#pragma once

#include <vector>

#include "scene/world/world.hpp"

namespace enfilade::scene {

/// As events of the last tick, sorted by (a, b, kind): `begin` for each contact that has not ended,
/// with its decision of now, and `enter`, without a decision, for who is in a trigger. The world
/// does not know when they began.
std::vector<ContactEvent> livingContacts(const World& world);

}  // namespace enfilade::scene
