// Who is in which trigger volume: an avatar or a body that touches or penetrates it, by the exact
// verdict. Only movers are asked for, and only those that moved since the last tick.
#include <algorithm>
#include <limits>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

using collision::Decision;

/// Someone near a trigger: an avatar, or a body that is no trigger.
struct Visitor {
  EntityId id = 0;
  bool moved = true;
  const Avatar* avatar = nullptr;
  const Body* body = nullptr;
};

std::vector<Visitor> visitorsOf(const WorldState& world, const Body& trigger) {
  std::vector<Visitor> visitors;
  for (const auto& partner : world.broadPhase.partners(trigger.mover)) {
    if (!partner.moves) continue;
    if (const auto name = world.avatarOfMover.find(partner.id); name != world.avatarOfMover.end()) {
      const auto avatar = world.avatars.find(name->second);
      if (avatar != world.avatars.end())
        visitors.push_back({avatar->second.id, !avatar->second.resting, &avatar->second, nullptr});
    } else if (const auto index = world.bodyOfMover.find(partner.id);
               index != world.bodyOfMover.end()) {
      const Body& body = world.bodies[index->second];
      if (body.spec->kind != BodyKind::trigger)
        visitors.push_back({body.id, body.moved, nullptr, &body});
    }
  }
  std::sort(visitors.begin(), visitors.end(),
            [](const Visitor& a, const Visitor& b) { return a.id < b.id; });
  return visitors;
}

std::vector<collision::ConvexBody> partsOf(const Visitor& visitor) {
  std::vector<collision::ConvexBody> parts;
  if (visitor.avatar) {
    for (const AvatarPart& part : visitor.avatar->shape->parts)
      parts.push_back(bodyAt(part, visitor.avatar->feet));
    return parts;
  }
  for (std::uint32_t i = 0; i < visitor.body->shape->parts.size(); ++i)
    parts.push_back(partOf(*visitor.body, i));
  return parts;
}

/// How near the visitor is to the trigger's volume.
Decision decide(const Visitor& visitor, const Body& trigger, QueryCount& count) {
  Decision best;
  best.distance = std::numeric_limits<double>::infinity();
  for (const collision::ConvexBody& part : partsOf(visitor)) {
    for (std::uint32_t i = 0; i < trigger.shape->parts.size(); ++i) {
      collision::FeatureCache cache;
      const Decision decision = collision::decide(part, partOf(trigger, i), cache);
      ++count.narrow;
      if (decision.decidedBy == collision::DecidedBy::rational) ++count.rational;
      if (nearer(decision, best)) best = decision;
    }
  }
  return best;
}

void tell(const WorldState& world, ContactEvent::Kind kind, EntityId who, const Body& trigger,
          const Decision& decision, std::vector<ContactEvent>& events) {
  Contact contact;
  contact.other = trigger.id;
  contact.decision = decision;
  events.push_back(eventOf(world, kind, who, contact));
}

/// An avatar or a body of the world, or nobody.
Visitor visitorOf(const WorldState& world, EntityId who) {
  Visitor visitor{who, true, nullptr, nullptr};
  for (const auto& [name, avatar] : world.avatars)
    if (avatar.id == who) visitor.avatar = &avatar;
  if (const auto body = world.bodyOfId.find(who); body != world.bodyOfId.end())
    visitor.body = &world.bodies[body->second];
  return visitor;
}

void watch(const WorldState& world, Body& trigger, TickReport& report, QueryCount& count) {
  std::vector<EntityId> inside;
  std::vector<EntityId> near;
  const bool first = world.tick == 1;  // who stands in it from the beginning enters it then
  for (const Visitor& visitor : visitorsOf(world, trigger)) {
    const bool moved = visitor.moved || first;
    near.push_back(visitor.id);
    const bool was = std::binary_search(trigger.inside.begin(), trigger.inside.end(), visitor.id);
    if (!moved && was) inside.push_back(visitor.id);
    if (!moved) continue;
    const Decision decision = decide(visitor, trigger, count);
    const bool is = decision.verdict != collision::Verdict::separated;
    if (is) inside.push_back(visitor.id);
    if (is != was)
      tell(world, is ? ContactEvent::Kind::enter : ContactEvent::Kind::leave, visitor.id, trigger,
           decision, report.contacts);
  }
  for (const EntityId id : trigger.inside)  // those whose reach has left the trigger
    if (!std::binary_search(near.begin(), near.end(), id))
      tell(world, ContactEvent::Kind::leave, id, trigger,
           decide(visitorOf(world, id), trigger, count), report.contacts);
  trigger.inside = std::move(inside);
}

}  // namespace

void watchTriggers(WorldState& world, TickReport& report, QueryCount& count) {
  for (const std::uint32_t i : world.triggers) watch(world, world.bodies[i], report, count);
}

void leaveTriggers(WorldState& world, EntityId who, ContactEvent::Reason reason,
                   std::vector<ContactEvent>& events) {
  for (const std::uint32_t i : world.triggers) {
    Body& trigger = world.bodies[i];
    const auto at = std::lower_bound(trigger.inside.begin(), trigger.inside.end(), who);
    if (at == trigger.inside.end() || *at != who) continue;
    trigger.inside.erase(at);
    QueryCount count;
    tell(world, ContactEvent::Kind::leave, who, trigger,
         decide(visitorOf(world, who), trigger, count), events);
    events.back().reason = reason;
  }
}

}  // namespace enfilade::scene
