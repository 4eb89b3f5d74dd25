// Contacts between bodies, and of bodies with static objects.
#pragma once

#include <vector>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Updates and reports contacts between bodies and non-avatars.
void detectBodyContacts(WorldData& world, TickReport& report, QueryCount& count);
void endBodyContacts(WorldData& world, ContactEvent::Reason reason,
                     std::vector<ContactEvent>& events);

}  // namespace enfilade::scene
