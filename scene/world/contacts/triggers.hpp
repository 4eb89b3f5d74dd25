// Trigger volumes: the avatars and bodies inside each.
#pragma once

#include <vector>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Updates the entities inside each trigger, and reports enter and leave.
void updateTriggers(WorldData& world, TickReport& report, QueryCount& count);
/// Removes an entity from all triggers and reports each leave.
void removeFromTriggers(WorldData& world, EntityId entity, ContactEvent::Reason reason,
                        std::vector<ContactEvent>& events);

}  // namespace enfilade::scene
