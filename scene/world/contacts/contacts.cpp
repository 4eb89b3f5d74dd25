// Who touches what after the motion: for each avatar and each entity in its reach the nearest
// convex piece decides. A contact is d < 2 epsilon (seed 5.1.1). Begin and end are differences to
// the last tick.
#include <algorithm>
#include <iterator>
#include <limits>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

using collision::Decision;
using collision::Verdict;

double depthOf(const collision::ConvexBody& part, const Obstacle& obstacle,
               const collision::FeatureCache& cache, const Decision& decision) {
  if (decision.verdict != Verdict::penetrating) return 0;
  collision::DepthCache none;  // avatars do not penetrate, so there is nothing to be coherent with
  return collision::penetrationDepth(part, obstacle.body, cache, none).depth;
}

std::optional<Decision> decideCounted(const collision::ConvexBody& part, const Obstacle& obstacle,
                                      double limit, collision::FeatureCache& cache,
                                      QueryCount& count) {
  ++count.narrow;
  const auto decision = collision::decideWithin(part, obstacle.body, limit, cache);
  if (decision && decision->decidedBy == collision::DecidedBy::rational) ++count.rational;
  return decision;
}

/// Adds what part `i` of the avatar has to do with the obstacle to what was found so far.
void addNear(const Avatar& avatar, std::size_t i, Obstacle& obstacle, const Nearness& nearness,
             std::vector<Contact>& found, QueryCount& count) {
  const double limit = nearness.limit;
  const AvatarPart& part = avatar.shape->parts[i];
  if (!overlaps(grown(boxAt(part.box, avatar.feet), limit), obstacle.box)) return;
  const bool known = !found.empty() && found.back().other == obstacle.entity;
  const double within = known ? std::max(found.back().decision.distance, nearness.contact) : limit;
  const collision::ConvexBody body = bodyAt(part, avatar.feet);
  collision::FeatureCache& cache = obstacle.cacheOf(i);
  const auto decision = decideCounted(body, obstacle, within, cache, count);
  if (!decision || !collision::isNearerThan(*decision, body, obstacle.body, limit, cache)) return;
  if (!known) {
    found.emplace_back();
    found.back().other = obstacle.entity;
    found.back().decision = *decision;
  } else if (nearer(*decision, found.back().decision)) {
    found.back().decision = *decision;
  }
  Contact& contact = found.back();
  contact.touching =
      contact.touching || nearness.contact == limit ||
      collision::isNearerThan(*decision, body, obstacle.body, nearness.contact, cache);
  double& penetration = contact.penetration;
  penetration = std::max(penetration, depthOf(body, obstacle, cache, *decision));
}

/// All entities nearer than the limit, each with its nearest piece, ascending.
std::vector<Contact> nearOnes(Avatar& avatar, const Nearness& nearness, QueryCount& count) {
  std::vector<Contact> found;
  const std::size_t parts = avatar.shape->parts.size();
  const Box box = grown(boxAt(avatar.shape->box, avatar.feet), nearness.limit);
  for (Obstacle& obstacle : avatar.obstacles) {
    if (!overlaps(box, obstacle.box)) continue;
    for (std::size_t i = 0; i < parts; ++i) addNear(avatar, i, obstacle, nearness, found, count);
  }
  return found;
}

/// How the avatar and `other` stand to one another now; nullopt if `other` is out of reach.
std::optional<Decision> decisionWith(Avatar& avatar, EntityId other, QueryCount& count) {
  std::optional<Decision> best;
  for (Obstacle& obstacle : avatar.obstacles) {
    if (obstacle.entity != other) continue;
    for (std::size_t i = 0; i < avatar.shape->parts.size(); ++i) {
      const auto decision =
          decideCounted(bodyAt(avatar.shape->parts[i], avatar.feet), obstacle,
                        std::numeric_limits<double>::infinity(), obstacle.cacheOf(i), count);
      if (!best || nearer(*decision, *best)) best = decision;
    }
  }
  return best;
}

const Contact* find(const std::vector<Contact>& contacts, EntityId other) {
  const auto at = std::lower_bound(contacts.begin(), contacts.end(), other,
                                   [](const Contact& c, EntityId id) { return c.other < id; });
  return at != contacts.end() && at->other == other ? &*at : nullptr;
}

void tellBegins(const WorldState& world, const Avatar& avatar, std::vector<Contact>& now,
                std::vector<ContactEvent>& events) {
  for (Contact& contact : now)
    tellBegin(world, avatar.id, find(avatar.contacts, contact.other), contact, events);
}

void tellEnds(const WorldState& world, Avatar& avatar, const std::vector<Contact>& now,
              std::vector<ContactEvent>& events, QueryCount& count) {
  for (const Contact& before : avatar.contacts)
    tellEnd(
        world, avatar.id, before, find(now, before.other),
        [&] { return decisionWith(avatar, before.other, count).value_or(before.decision); },
        events);
}

Contact stopped(EntityId by, const Decision& decision) {
  Contact contact;
  contact.other = by;
  contact.decision = decision;
  return contact;
}

/// A contact with a body that the avatar touched in this tick and is apart from again; nothing
/// where it still touches it.
template <class Touch>
void addTouched(EntityId body, const Touch& touch, std::vector<Contact>& now) {
  const auto at = std::ranges::lower_bound(now, body, {}, &Contact::other);
  const bool listed = at != now.end() && at->other == body;
  if (listed && at->touching) return;
  const std::optional<Decision> decision = touch();
  if (!decision) return;
  Contact contact = stopped(body, *decision);
  contact.touching = true;
  if (listed) {
    *at = contact;
  } else {
    now.insert(at, contact);
  }
}

/// How the avatar and a body touch that are brought together the shortest way.
std::optional<Decision> touchWith(const WorldState& world, Avatar& avatar, EntityId body,
                                  QueryCount& count) {
  const std::optional<Decision> apart = decisionWith(avatar, body, count);
  if (!apart) return std::nullopt;
  std::vector<Obstacle> parts;
  std::ranges::copy_if(avatar.obstacles, std::back_inserter(parts),
                       [&](const Obstacle& obstacle) { return obstacle.entity == body; });
  const Stop stop = sweepShape(*avatar.shape, avatar.feet, apart->distance * apart->normal, parts,
                               bandOf(world.lengths), count);
  return stop.entity == body ? std::optional(stop.atStop) : std::nullopt;
}

/// Who stopped the avatar in this tick touched it, even if it has given way since; so did free
/// bodies that it pushed before it, and those that came and bounced.
void addWhatGaveWay(const WorldState& world, Avatar& avatar, std::vector<Contact>& now,
                    QueryCount& count) {
  if (world.bodyOfId.contains(avatar.stoppedBy))
    addTouched(
        avatar.stoppedBy, [&] { return std::optional(avatar.atStop); }, now);
  const auto& met = world.rigids.metByAvatars;
  for (auto at = std::ranges::lower_bound(met, EntityPair(avatar.id, 0));
       at != met.end() && at->first == avatar.id; ++at)
    addTouched(
        at->second, [&] { return touchWith(world, avatar, at->second, count); }, now);
}

void updateContacts(WorldState& world, Avatar& avatar, TickReport& report, QueryCount& count) {
  followOthers(world, avatar);
  std::vector<Contact> now = nearOnes(avatar, nearnessOf(world.lengths), count);
  // A pair of avatars is told by the one with the lesser id.
  std::erase_if(now, [&](const Contact& c) {
    return c.other >= world.firstAvatarId() && c.other < avatar.id;
  });
  addWhatGaveWay(world, avatar, now, count);
  tellBegins(world, avatar, now, report.contacts);
  tellEnds(world, avatar, now, report.contacts, count);
  avatar.contacts = std::move(now);
}

ContactEvent nearEvent(const WorldState& world, EntityId a, const Contact& contact,
                       ContactEvent::Phase phase) {
  ContactEvent event = eventOf(world, ContactEvent::Kind::near, a, contact);
  event.phase = phase;
  if (phase == ContactEvent::Phase::min) {
    event.tick = contact.closestTick;
    event.time = static_cast<double>(contact.closestTick) * world.lengths.tick;
    event.decision = contact.closest;
  }
  return event;
}

}  // namespace

bool nearer(const Decision& a, const Decision& b) {
  return a.verdict != b.verdict ? a.verdict > b.verdict : a.distance < b.distance;
}

Nearness nearnessOf(const Lengths& lengths) {
  const double contact = contactLimit(lengths);
  return {contact, std::max(contact, lengths.nearMiss)};
}

ContactEvent eventOf(const WorldState& world, ContactEvent::Kind kind, EntityId a,
                     const Contact& contact) {
  ContactEvent event;
  event.tick = world.tick;
  event.time = static_cast<double>(world.tick) * world.lengths.tick;
  event.kind = kind;
  event.a = a;
  event.b = contact.other;
  event.decision = contact.decision;
  return event;
}

void tellBegin(const WorldState& world, EntityId a, const Contact* before, Contact& now,
               std::vector<ContactEvent>& events) {
  if (now.touching) {
    if (!before || !before->touching)
      events.push_back(eventOf(world, ContactEvent::Kind::begin, a, now));
    return;
  }
  if (before && !before->nearTold) return;  // they parted from a contact
  now.nearTold = true;
  if (before) now.closest = before->closest, now.closestTick = before->closestTick;
  if (!before || now.decision.distance < now.closest.distance)
    now.closest = now.decision, now.closestTick = world.tick;
  if (!before) events.push_back(nearEvent(world, a, now, ContactEvent::Phase::begin));
}

void tellEnd(const WorldState& world, EntityId a, const Contact& before, const Contact* now,
             const std::function<collision::Decision()>& parted,
             std::vector<ContactEvent>& events) {
  const bool contactEnds = before.touching && !(now && now->touching);
  const bool nearEnds = before.nearTold && !(now && now->nearTold);
  if (!contactEnds && !nearEnds) return;
  Contact last = before;
  last.decision = now ? now->decision : parted();
  if (contactEnds) events.push_back(eventOf(world, ContactEvent::Kind::end, a, last));
  if (!nearEnds) return;
  if (!now) events.push_back(nearEvent(world, a, last, ContactEvent::Phase::min));
  events.push_back(nearEvent(world, a, last, ContactEvent::Phase::end));
}

void findContacts(WorldState& world, TickReport& report, QueryCount& count) {
  for (auto& [name, avatar] : world.avatars) {
    // A free body may have been woken beside it after it was found to rest.
    if (!avatar.resting || !nobodyMovesNear(world, avatar))
      updateContacts(world, avatar, report, count);
    for (const Contact& contact : avatar.contacts) {
      if (contact.touching) ++report.liveContacts;
      report.worstPenetration = std::max(report.worstPenetration, contact.penetration);
    }
  }
}

void tellBlocked(const WorldState& world, Avatar& avatar, TickReport& report, QueryCount& count) {
  if (avatar.stoppedBy == 0) return;
  if (const auto decision = decisionWith(avatar, avatar.stoppedBy, count))
    report.contacts.push_back(eventOf(world, ContactEvent::Kind::blocked, avatar.id,
                                      stopped(avatar.stoppedBy, *decision)));
}

void endContactsOf(WorldState& world, Avatar& avatar, ContactEvent::Reason reason,
                   std::vector<ContactEvent>& events) {
  const auto tell = [&](const Avatar& a, const Contact& contact) {
    if (contact.touching) {
      events.push_back(eventOf(world, ContactEvent::Kind::end, a.id, contact));
      events.back().reason = reason;
    } else if (contact.nearTold) {
      events.push_back(nearEvent(world, a.id, contact, ContactEvent::Phase::min));
      events.push_back(nearEvent(world, a.id, contact, ContactEvent::Phase::end));
      events.back().reason = reason;
    }
  };
  for (const Contact& contact : avatar.contacts) tell(avatar, contact);
  avatar.contacts.clear();
  leaveTriggers(world, avatar.id, reason, events);
  for (auto& [name, other] : world.avatars) {
    if (const Contact* contact = find(other.contacts, avatar.id)) tell(other, *contact);
    std::erase_if(other.contacts, [&](const Contact& c) { return c.other == avatar.id; });
  }
}

}  // namespace enfilade::scene
