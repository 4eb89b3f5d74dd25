#include "scene/world/contacts/contact_events.hpp"

#include <algorithm>

namespace enfilade::scene {

bool isCloser(const collision::SeparationResult& a, const collision::SeparationResult& b) {
  return a.verdict != b.verdict ? a.verdict > b.verdict : a.distance < b.distance;
}

ContactDistances computeContactDistances(const WorldSettings& settings) {
  const double contact = computeContactThreshold(settings);
  return {contact, std::max(contact, settings.nearMissDistance)};
}

ContactEvent makeContactEvent(const WorldData& world, ContactEvent::Kind kind, EntityId a,
                              const Contact& contact) {
  ContactEvent event;
  event.tick = world.tick;
  event.time = static_cast<double>(world.tick) * world.settings.tickDuration;
  event.kind = kind;
  event.a = a;
  event.b = contact.other;
  event.separation = contact.separation;
  return event;
}

ContactEvent makeNearMissEvent(const WorldData& world, EntityId a, const Contact& contact,
                               ContactEvent::Phase phase) {
  ContactEvent event = makeContactEvent(world, ContactEvent::Kind::nearMiss, a, contact);
  event.phase = phase;
  if (phase == ContactEvent::Phase::min) {
    event.tick = contact.closestTick;
    event.time = static_cast<double>(contact.closestTick) * world.settings.tickDuration;
    event.separation = contact.closest;
  }
  return event;
}

void emitContactBegin(const WorldData& world, EntityId a, const Contact* before, Contact& now,
                      std::vector<ContactEvent>& events) {
  if (now.touching) {
    if (!before || !before->touching)
      events.push_back(makeContactEvent(world, ContactEvent::Kind::begin, a, now));
    return;
  }
  if (before && !before->nearMissReported) return;  // the end of a contact is not a near miss
  now.nearMissReported = true;
  if (before) now.closest = before->closest, now.closestTick = before->closestTick;
  if (!before || now.separation.distance < now.closest.distance)
    now.closest = now.separation, now.closestTick = world.tick;
  if (!before) events.push_back(makeNearMissEvent(world, a, now, ContactEvent::Phase::begin));
}

void emitContactEnd(const WorldData& world, EntityId a, const Contact& before, const Contact* now,
                    const std::function<collision::SeparationResult()>& separationAtEnd,
                    std::vector<ContactEvent>& events) {
  const bool contactEnds = before.touching && !(now && now->touching);
  const bool nearEnds = before.nearMissReported && !(now && now->nearMissReported);
  if (!contactEnds && !nearEnds) return;
  Contact last = before;
  last.separation = now ? now->separation : separationAtEnd();
  if (contactEnds) events.push_back(makeContactEvent(world, ContactEvent::Kind::end, a, last));
  if (!nearEnds) return;
  if (!now) events.push_back(makeNearMissEvent(world, a, last, ContactEvent::Phase::min));
  events.push_back(makeNearMissEvent(world, a, last, ContactEvent::Phase::end));
}

}  // namespace enfilade::scene
