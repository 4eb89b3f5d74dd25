// Contacts of avatars after the motion: for each avatar and each entity within reach the nearest
// convex part decides. A contact has d < 2 contactOffset (Lin 1993, section 5.1). Begins and ends
// are differences to the last tick.
#include "scene/world/contacts/contacts.hpp"

#include <algorithm>
#include <iterator>
#include <limits>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "scene/world/contacts/obstacles.hpp"
#include "scene/world/contacts/triggers.hpp"

namespace enfilade::scene {
namespace {

using collision::SeparationResult;
using collision::Verdict;

double computeObstacleDepth(const collision::PlacedConvex& part, const Obstacle& obstacle,
                            const collision::FeatureCache& cache,
                            const SeparationResult& separation) {
  if (separation.verdict != Verdict::penetrating) return 0;
  collision::DepthCache emptyCache;  // avatars do not penetrate, so a warm start has no use
  return collision::computePenetrationDepth(part, obstacle.convex, cache, emptyCache).depth;
}

std::optional<SeparationResult> computeSeparationCounted(const collision::PlacedConvex& part,
                                                         const Obstacle& obstacle, double limit,
                                                         collision::FeatureCache& cache,
                                                         QueryCount& count) {
  ++count.narrow;
  const auto separation = collision::computeSeparationWithin(part, obstacle.convex, limit, cache);
  if (separation && separation->certificate == collision::Certificate::rational) ++count.rational;
  return separation;
}

/// Merges the separation of the avatar's part `i` and the obstacle into the contacts found so far.
void addCloseObstacle(const Avatar& avatar, std::size_t i, Obstacle& obstacle,
                      const ContactDistances& distances, std::vector<Contact>& found,
                      QueryCount& count) {
  const double limit = distances.reportLimit;
  const AvatarPart& part = avatar.shape->parts[i];
  if (!overlaps(inflated(placeBox(part.box, avatar.footPosition), limit), obstacle.box)) return;
  const bool known = !found.empty() && found.back().other == obstacle.entity;
  const double within =
      known ? std::max(found.back().separation.distance, distances.contact) : limit;
  const collision::PlacedConvex placed = placeAvatarPart(part, avatar.footPosition);
  collision::FeatureCache& cache = obstacle.cacheFor(i);
  const auto separation = computeSeparationCounted(placed, obstacle, within, cache, count);
  if (!separation || !collision::isCloserThan(*separation, placed, obstacle.convex, limit, cache))
    return;
  if (!known) {
    found.emplace_back();
    found.back().other = obstacle.entity;
    found.back().separation = *separation;
  } else if (isCloser(*separation, found.back().separation)) {
    found.back().separation = *separation;
  }
  Contact& contact = found.back();
  contact.touching =
      contact.touching || distances.contact == limit ||
      collision::isCloserThan(*separation, placed, obstacle.convex, distances.contact, cache);
  double& penetration = contact.penetration;
  penetration = std::max(penetration, computeObstacleDepth(placed, obstacle, cache, *separation));
}

/// All entities closer than the limit, each with its nearest part, ascending.
std::vector<Contact> findNearby(Avatar& avatar, const ContactDistances& distances,
                                QueryCount& count) {
  std::vector<Contact> found;
  const std::size_t partCount = avatar.shape->parts.size();
  const Aabb box =
      inflated(placeBox(avatar.shape->box, avatar.footPosition), distances.reportLimit);
  for (Obstacle& obstacle : avatar.obstacles) {
    if (!overlaps(box, obstacle.box)) continue;
    for (std::size_t i = 0; i < partCount; ++i)
      addCloseObstacle(avatar, i, obstacle, distances, found, count);
  }
  return found;
}

/// Current separation of the avatar and `other`; nullopt if `other` is out of reach.
std::optional<SeparationResult> computeSeparationFrom(Avatar& avatar, EntityId other,
                                                      QueryCount& count) {
  std::optional<SeparationResult> best;
  for (Obstacle& obstacle : avatar.obstacles) {
    if (obstacle.entity != other) continue;
    for (std::size_t i = 0; i < avatar.shape->parts.size(); ++i) {
      const auto separation = computeSeparationCounted(
          placeAvatarPart(avatar.shape->parts[i], avatar.footPosition), obstacle,
          std::numeric_limits<double>::infinity(), obstacle.cacheFor(i), count);
      if (!best || isCloser(*separation, *best)) best = separation;
    }
  }
  return best;
}

const Contact* findContact(const std::vector<Contact>& contacts, EntityId other) {
  const auto at = std::lower_bound(contacts.begin(), contacts.end(), other,
                                   [](const Contact& c, EntityId id) { return c.other < id; });
  return at != contacts.end() && at->other == other ? &*at : nullptr;
}

void emitContactBegins(const WorldData& world, const Avatar& avatar, std::vector<Contact>& now,
                       std::vector<ContactEvent>& events) {
  for (Contact& contact : now)
    emitContactBegin(world, avatar.id, findContact(avatar.contacts, contact.other), contact,
                     events);
}

void emitContactEnds(const WorldData& world, Avatar& avatar, const std::vector<Contact>& now,
                     std::vector<ContactEvent>& events, QueryCount& count) {
  for (const Contact& before : avatar.contacts)
    emitContactEnd(
        world, avatar.id, before, findContact(now, before.other),
        [&] {
          return computeSeparationFrom(avatar, before.other, count).value_or(before.separation);
        },
        events);
}

Contact makeContact(EntityId blocker, const SeparationResult& separation) {
  Contact contact;
  contact.other = blocker;
  contact.separation = separation;
  return contact;
}

/// Adds a contact with a body that the avatar touched within this tick and no longer touches. Does
/// nothing if they still touch.
template <class Touch>
void addTransientContact(EntityId body, const Touch& touch, std::vector<Contact>& now) {
  const auto at = std::ranges::lower_bound(now, body, {}, &Contact::other);
  const bool listed = at != now.end() && at->other == body;
  if (listed && at->touching) return;
  const std::optional<SeparationResult> separation = touch();
  if (!separation) return;
  Contact contact = makeContact(body, *separation);
  contact.touching = true;
  if (listed) {
    *at = contact;
  } else {
    now.insert(at, contact);
  }
}

/// Contact of the avatar and a separated body when they are moved together along the shortest path.
std::optional<SeparationResult> computeTouchWith(const WorldData& world, Avatar& avatar,
                                                 EntityId body, QueryCount& count) {
  const std::optional<SeparationResult> separation = computeSeparationFrom(avatar, body, count);
  if (!separation) return std::nullopt;
  std::vector<Obstacle> parts;
  std::ranges::copy_if(avatar.obstacles, std::back_inserter(parts),
                       [&](const Obstacle& obstacle) { return obstacle.entity == body; });
  const ShapeCastHit hit =
      castAvatarShape(*avatar.shape, avatar.footPosition, separation->distance * separation->normal,
                      parts, makeContactOffset(world.settings), count);
  return hit.entity == body ? std::optional(hit.separation) : std::nullopt;
}

/// Adds bodies that touched the avatar within this tick and moved away since: the one that blocked
/// it, dynamic bodies that it pushed, and those that bounced off it.
void addYieldedBodies(const WorldData& world, Avatar& avatar, std::vector<Contact>& now,
                      QueryCount& count) {
  if (world.bodyIndexById.contains(avatar.blockedBy))
    addTransientContact(
        avatar.blockedBy, [&] { return std::optional(avatar.blockingHit); }, now);
  const auto& transient = world.dynamicBodies.avatarBodyPairs;
  for (auto at = std::ranges::lower_bound(transient, EntityPair(avatar.id, 0));
       at != transient.end() && at->first == avatar.id; ++at)
    addTransientContact(
        at->second, [&] { return computeTouchWith(world, avatar, at->second, count); }, now);
}

void updateAvatarContacts(WorldData& world, Avatar& avatar, TickReport& report, QueryCount& count) {
  refreshDynamicObstacles(world, avatar);
  std::vector<Contact> now = findNearby(avatar, computeContactDistances(world.settings), count);
  // The avatar with the smaller id reports a pair of avatars.
  std::erase_if(now, [&](const Contact& c) {
    return c.other >= world.firstAvatarId() && c.other < avatar.id;
  });
  addYieldedBodies(world, avatar, now, count);
  emitContactBegins(world, avatar, now, report.contacts);
  emitContactEnds(world, avatar, now, report.contacts, count);
  avatar.contacts = std::move(now);
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

}  // namespace

bool isCloser(const SeparationResult& a, const SeparationResult& b) {
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

void detectAvatarContacts(WorldData& world, TickReport& report, QueryCount& count) {
  for (Avatar& avatar : world.avatars) {
    // A dynamic body next to the avatar may have been woken after the avatar was found idle.
    if (!avatar.idle || !areNeighboursStationary(world, avatar))
      updateAvatarContacts(world, avatar, report, count);
    for (const Contact& contact : avatar.contacts) {
      if (contact.touching) ++report.activeContacts;
      report.maxPenetration = std::max(report.maxPenetration, contact.penetration);
    }
  }
}

void emitBlocked(const WorldData& world, Avatar& avatar, TickReport& report, QueryCount& count) {
  if (avatar.blockedBy == 0) return;
  if (const auto separation = computeSeparationFrom(avatar, avatar.blockedBy, count))
    report.contacts.push_back(makeContactEvent(world, ContactEvent::Kind::blocked, avatar.id,
                                               makeContact(avatar.blockedBy, *separation)));
}

void endAvatarContacts(WorldData& world, Avatar& avatar, ContactEvent::Reason reason,
                       std::vector<ContactEvent>& events) {
  const auto emitEnd = [&](const Avatar& a, const Contact& contact) {
    if (contact.touching) {
      events.push_back(makeContactEvent(world, ContactEvent::Kind::end, a.id, contact));
      events.back().reason = reason;
    } else if (contact.nearMissReported) {
      events.push_back(makeNearMissEvent(world, a.id, contact, ContactEvent::Phase::min));
      events.push_back(makeNearMissEvent(world, a.id, contact, ContactEvent::Phase::end));
      events.back().reason = reason;
    }
  };
  for (const Contact& contact : avatar.contacts) emitEnd(avatar, contact);
  avatar.contacts.clear();
  removeFromTriggers(world, avatar.id, reason, events);
  for (Avatar& other : world.avatars) {
    if (const Contact* contact = findContact(other.contacts, avatar.id)) emitEnd(other, *contact);
    std::erase_if(other.contacts, [&](const Contact& c) { return c.other == avatar.id; });
  }
}

}  // namespace enfilade::scene
