// Contact events of any two entities, and the contacts of avatars after the motion.
#pragma once

#include <functional>
#include <vector>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Order: penetrating, touching, separated; then by distance.
bool isCloser(const collision::SeparationResult& a, const collision::SeparationResult& b);
/// Distances below which a pair is reported, metres; contact <= reportLimit.
struct ContactDistances {
  double contact;      ///< contact; 2 contactOffset (Lin 1993, section 5.1.1)
  double reportLimit;  ///< contact or near miss
};
ContactDistances computeContactDistances(const WorldSettings& settings);
/// Creates an event of this tick, reported by `a`.
ContactEvent makeContactEvent(const WorldData& world, ContactEvent::Kind kind, EntityId a,
                              const Contact& contact);
/// Reports the contact or near miss of `a` that began. `before`: of the previous tick, or null.
void emitContactBegin(const WorldData& world, EntityId a, const Contact* before, Contact& now,
                      std::vector<ContactEvent>& events);
/// Reports the contact or near miss `before` that ended. `now`: of this tick, or null; then
/// `separationAtEnd` computes the current separation.
void emitContactEnd(const WorldData& world, EntityId a, const Contact& before, const Contact* now,
                    const std::function<collision::SeparationResult()>& separationAtEnd,
                    std::vector<ContactEvent>& events);

/// Updates the contacts of avatars, and reports those that began or ended.
void detectAvatarContacts(WorldData& world, TickReport& report);
/// Reports a blocked avatar: the entity that blocked it last, and the current separation.
void emitBlocked(const WorldData& world, Avatar& avatar, TickReport& report, QueryCount& count);

/// Ends all contacts of `avatar` and those of others with it.
void endAvatarContacts(WorldData& world, Avatar& avatar, ContactEvent::Reason reason,
                       std::vector<ContactEvent>& events);

}  // namespace enfilade::scene
