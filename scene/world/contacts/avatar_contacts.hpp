// Detects the contacts of avatars after the motion of a tick.
#pragma once

#include <vector>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Updates the contacts of avatars, and reports those that began or ended.
void detectAvatarContacts(WorldData& world, TickReport& report);
/// Reports a blocked avatar: the entity that blocked it last, and the current separation.
void emitBlocked(const WorldData& world, Avatar& avatar, TickReport& report, QueryCount& count);

/// Ends all contacts of `avatar` and those of others with it.
void endAvatarContacts(WorldData& world, Avatar& avatar, ContactEvent::Reason reason,
                       std::vector<ContactEvent>& events);

}  // namespace enfilade::scene
