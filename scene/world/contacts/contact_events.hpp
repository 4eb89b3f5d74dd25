// Makes and emits the events of contacts and near misses of any two entities.
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
/// Creates an event of the near miss `contact` of `a`.
ContactEvent makeNearMissEvent(const WorldData& world, EntityId a, const Contact& contact,
                               ContactEvent::Phase phase);
/// Reports the contact or near miss of `a` that began. `before`: of the previous tick, or null.
void emitContactBegin(const WorldData& world, EntityId a, const Contact* before, Contact& now,
                      std::vector<ContactEvent>& events);
/// Reports the contact or near miss `before` that ended. `now`: of this tick, or null; then
/// `separationAtEnd` computes the current separation.
void emitContactEnd(const WorldData& world, EntityId a, const Contact& before, const Contact* now,
                    const std::function<collision::SeparationResult()>& separationAtEnd,
                    std::vector<ContactEvent>& events);

}  // namespace enfilade::scene
