// Trigger volumes: an avatar or a body is inside if it touches or penetrates the volume, by the
// exact verdict. Only entities with a dynamic proxy that moved since the last tick are queried.
#include "scene/world/contacts/triggers.hpp"

#include <algorithm>
#include <limits>

#include "collision/assert.hpp"
#include "scene/world/contacts/contact_events.hpp"

namespace enfilade::scene {
namespace {

using collision::SeparationResult;

/// An entity near a trigger: an avatar, or a body that is not a trigger.
struct Visitor {
  EntityId id = 0;
  bool moved = true;
  const Avatar* avatar = nullptr;
  const Body* body = nullptr;
};

std::vector<Visitor> findVisitors(const WorldData& world, const Body& trigger) {
  std::vector<Visitor> visitors;
  for (const auto& overlap : world.broadPhase.getOverlaps(trigger.proxy)) {
    if (!overlap.isDynamic) continue;
    if (const Avatar* avatar = world.findAvatarByProxy(overlap.id)) {
      visitors.push_back({avatar->id, !avatar->idle, avatar, nullptr});
    } else if (const std::uint32_t index = world.findBodyByProxy(overlap.id); index != kNoBody) {
      const Body& body = world.bodies[index];
      if (!isTrigger(body.spec->kind)) visitors.push_back({body.id, body.moved, nullptr, &body});
    }
  }
  std::sort(visitors.begin(), visitors.end(),
            [](const Visitor& a, const Visitor& b) { return a.id < b.id; });
  return visitors;
}

std::vector<collision::PlacedConvex> makePlacedParts(const Visitor& visitor) {
  std::vector<collision::PlacedConvex> parts;
  if (visitor.avatar) {
    for (const AvatarPart& part : visitor.avatar->shape->parts)
      parts.push_back(placeAvatarPart(part, visitor.avatar->footPosition));
    return parts;
  }
  for (std::uint32_t i = 0; i < visitor.body->shape->parts.size(); ++i)
    parts.push_back(makePlacedPart(*visitor.body, i));
  return parts;
}

/// Separation of the visitor and the trigger's volume.
SeparationResult computeVisitorSeparation(const Visitor& visitor, const Body& trigger,
                                          QueryCount& count) {
  SeparationResult best;
  best.distance = std::numeric_limits<double>::infinity();
  for (const collision::PlacedConvex& part : makePlacedParts(visitor)) {
    for (std::uint32_t i = 0; i < trigger.shape->parts.size(); ++i) {
      collision::FeatureCache cache;
      const SeparationResult separation =
          collision::computeSeparation(part, makePlacedPart(trigger, i), cache);
      ++count.narrow;
      if (separation.certificate == collision::Certificate::rational) ++count.rational;
      if (isCloser(separation, best)) best = separation;
    }
  }
  return best;
}

void emitTriggerEvent(const WorldData& world, ContactEvent::Kind kind, EntityId visitor,
                      const Body& trigger, const SeparationResult& separation,
                      std::vector<ContactEvent>& events) {
  Contact contact;
  contact.other = trigger.id;
  contact.separation = separation;
  events.push_back(makeContactEvent(world, kind, visitor, contact));
}

/// The avatar or body with id `entity`; without either, both pointers stay null.
Visitor findVisitor(const WorldData& world, EntityId entity) {
  Visitor visitor{entity, true, world.findAvatar(entity), nullptr};
  if (const auto body = world.bodyIndexById.find(entity); body != world.bodyIndexById.end())
    visitor.body = &world.bodies[body->second];
  return visitor;
}

void updateTrigger(const WorldData& world, Body& trigger, TickReport& report, QueryCount& count) {
  std::vector<EntityId> inside;
  std::vector<EntityId> nearby;
  const bool first = world.tick == 1;  // an entity that starts inside enters in the first tick
  for (const Visitor& visitor : findVisitors(world, trigger)) {
    const bool moved = visitor.moved || first;
    nearby.push_back(visitor.id);
    const bool wasInside =
        std::binary_search(trigger.occupants.begin(), trigger.occupants.end(), visitor.id);
    if (!moved && wasInside) inside.push_back(visitor.id);
    if (!moved) continue;
    const SeparationResult separation = computeVisitorSeparation(visitor, trigger, count);
    const bool isInside = separation.verdict != collision::Verdict::separated;
    if (isInside) inside.push_back(visitor.id);
    if (isInside != wasInside)
      emitTriggerEvent(world, isInside ? ContactEvent::Kind::enter : ContactEvent::Kind::leave,
                       visitor.id, trigger, separation, report.contacts);
  }
  ENFILADE_ASSERT(std::ranges::is_sorted(nearby));
  for (const EntityId id : trigger.occupants)  // entities whose motion bounds have left the trigger
    if (!std::binary_search(nearby.begin(), nearby.end(), id))
      emitTriggerEvent(world, ContactEvent::Kind::leave, id, trigger,
                       computeVisitorSeparation(findVisitor(world, id), trigger, count),
                       report.contacts);
  trigger.occupants = std::move(inside);
}

}  // namespace

void updateTriggers(WorldData& world, TickReport& report, QueryCount& count) {
  for (const std::uint32_t i : world.triggers) updateTrigger(world, world.bodies[i], report, count);
}

void removeFromTriggers(WorldData& world, EntityId entity, ContactEvent::Reason reason,
                        std::vector<ContactEvent>& events) {
  for (const std::uint32_t i : world.triggers) {
    Body& trigger = world.bodies[i];
    const auto at = std::lower_bound(trigger.occupants.begin(), trigger.occupants.end(), entity);
    if (at == trigger.occupants.end() || *at != entity) continue;
    trigger.occupants.erase(at);
    QueryCount count;
    emitTriggerEvent(world, ContactEvent::Kind::leave, entity, trigger,
                     computeVisitorSeparation(findVisitor(world, entity), trigger, count), events);
    events.back().reason = reason;
  }
}

}  // namespace enfilade::scene
