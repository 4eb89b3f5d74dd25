// Contacts of avatars after the motion: for each avatar and each entity within reach the nearest
// convex part decides. A contact has d < 2 contactOffset (Lin 1993, section 5.1). Begins and ends
// are differences to the last tick.
#include "scene/world/contacts/avatar_contacts.hpp"

#include <algorithm>
#include <iterator>
#include <limits>

#include "collision/assert.hpp"
#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "scene/world/contacts/contact_events.hpp"
#include "scene/world/contacts/dense_obstacles.hpp"
#include "scene/world/contacts/obstacles.hpp"
#include "scene/world/contacts/triggers.hpp"

namespace enfilade::scene {
namespace {

using collision::SeparationResult;
using collision::Verdict;

constexpr std::size_t kAvatarsPerTask = 8;

/// The search for what is close to one part of an avatar.
struct CloseSearch {
  const collision::PlacedConvex part;
  const ContactDistances& distances;
  const Aabb box;  ///< what does not overlap it is beyond the report limit
  std::vector<Contact>& found;
  QueryCount& count;

  CloseSearch(const AvatarPart& avatarPart, const Vec3& footPosition,
              const ContactDistances& contactDistances, std::vector<Contact>& contacts,
              QueryCount& queryCount)
      : part(placeAvatarPart(avatarPart, footPosition)),
        distances(contactDistances),
        box(inflate(placeBox(avatarPart.box, footPosition), contactDistances.reportLimit)),
        found(contacts),
        count(queryCount) {}

  bool isFound(EntityId entity) const { return !found.empty() && found.back().other == entity; }
  /// Metres: parts of the entity that are farther away change nothing.
  double computeLimit(EntityId entity) const {
    if (!isFound(entity)) return distances.reportLimit;
    const Contact& contact = found.back();
    return contact.touching ? contact.separation.distance
                            : std::max(contact.separation.distance, distances.contact);
  }
  /// Merges the separation of the obstacle into the contacts found so far; those of an entity come
  /// one after the other.
  void addObstacle(EntityId entity, const collision::PlacedConvex& obstacle,
                   collision::FeatureCache& cache);
};

std::optional<SeparationResult> computeSeparationCounted(const collision::PlacedConvex& part,
                                                         const collision::PlacedConvex& obstacle,
                                                         double limit,
                                                         collision::FeatureCache& cache,
                                                         QueryCount& count) {
  ++count.narrow;
  const auto separation = collision::computeSeparationWithin(part, obstacle, limit, cache);
  if (separation && separation->certificate == collision::Certificate::rational) ++count.rational;
  return separation;
}

double computeObstacleDepth(const collision::PlacedConvex& part,
                            const collision::PlacedConvex& obstacle,
                            const collision::FeatureCache& cache,
                            const SeparationResult& separation) {
  if (separation.verdict != Verdict::penetrating) return 0;
  collision::DepthCache emptyCache;  // avatars do not penetrate, so a warm start has no use
  return collision::computePenetrationDepth(part, obstacle, cache, emptyCache).depth;
}

void CloseSearch::addObstacle(EntityId entity, const collision::PlacedConvex& obstacle,
                              collision::FeatureCache& cache) {
  const double limit = distances.reportLimit;
  const bool known = isFound(entity);
  const auto separation =
      computeSeparationCounted(part, obstacle, computeLimit(entity), cache, count);
  if (!separation || !collision::isCloserThan(*separation, part, obstacle, limit, cache)) return;
  if (!known) {
    found.emplace_back();
    found.back().other = entity;
    found.back().separation = *separation;
  } else if (isCloser(*separation, found.back().separation)) {
    found.back().separation = *separation;
  }
  Contact& contact = found.back();
  contact.touching = contact.touching || distances.contact == limit ||
                     collision::isCloserThan(*separation, part, obstacle, distances.contact, cache);
  double& penetration = contact.penetration;
  penetration = std::max(penetration, computeObstacleDepth(part, obstacle, cache, *separation));
}

/// Distances of a flat floor's triangles differ by less, so that one of them answers for all.
double computeTieDistance(const Aabb& box) {
  return 0x1p-40 * (1 + box.min.cwiseAbs().maxCoeff() + box.max.cwiseAbs().maxCoeff());
}

/// The distance found may exceed that of the nearest part by computeTieDistance(), which its error
/// bound includes.
void findCloseDense(Avatar& avatar, const DenseObject& object, const ContactDistances& distances,
                    std::vector<Contact>& found, QueryCount& count) {
  const double tie = computeTieDistance(placeBox(avatar.shape->box, avatar.footPosition));
  for (std::uint32_t i = 0; i < avatar.shape->parts.size(); ++i) {
    CloseSearch search(avatar.shape->parts[i], avatar.footPosition, distances, found, count);
    collision::SeparatingPlanes planes(search.part, Vec3::Zero(), distances.reportLimit);
    forEachNearPart(
        object, i, search.box, planes, [&](const Aabb& box) { return overlaps(search.box, box); },
        avatar.obstacles.denseCaches, count,
        [&](const collision::PlacedConvex& obstacle, collision::FeatureCache& cache) {
          search.addObstacle(object.entity, obstacle, cache);
          const double limit = search.computeLimit(object.entity);
          planes.reduceTo(Vec3::Zero(), std::max(0.0, limit - tie));
        });
  }
  if (!found.empty() && found.back().other == object.entity &&
      found.back().separation.verdict == Verdict::separated)
    found.back().separation.errorBound += tie;
}

/// All entities closer than the limit, each with its nearest part, ascending.
std::vector<Contact> findNearby(Avatar& avatar, const ContactDistances& distances,
                                QueryCount& count) {
  std::vector<Contact> found;
  std::vector<CloseSearch> searches;
  searches.reserve(avatar.shape->parts.size());
  for (const AvatarPart& part : avatar.shape->parts)
    searches.emplace_back(part, avatar.footPosition, distances, found, count);
  const Aabb box = inflate(placeBox(avatar.shape->box, avatar.footPosition), distances.reportLimit);
  for (Obstacle& obstacle : avatar.obstacles.list) {
    if (!overlaps(box, obstacle.box)) continue;
    for (std::size_t i = 0; i < searches.size(); ++i) {
      if (!overlaps(searches[i].box, obstacle.box)) continue;
      ++count.partsLookedAt;
      searches[i].addObstacle(obstacle.entity, obstacle.convex, obstacle.cacheFor(i));
    }
  }
  for (const DenseObject& object : avatar.obstacles.dense)
    findCloseDense(avatar, object, distances, found, count);
  std::ranges::sort(found, {}, &Contact::other);
  return found;
}

/// Current separation from a dense object. Only parts that may be nearer than the nearest so far
/// are asked.
SeparationResult computeDenseSeparation(const Avatar& avatar, const DenseObject& object,
                                        QueryCount& count) {
  SeparationResult best;
  best.distance = std::numeric_limits<double>::infinity();
  for (const AvatarPart& avatarPart : avatar.shape->parts) {
    const collision::PlacedConvex part = placeAvatarPart(avatarPart, avatar.footPosition);
    const Aabb box = placeBox(avatarPart.box, avatar.footPosition);
    const auto mayBeNearer = [&](const Aabb& other) {
      return overlaps(inflate(box, best.distance + best.errorBound), other);
    };
    descendParts(*object.geometry, computeCore(box), mayBeNearer, [&](std::uint32_t i) {
      if (!mayBeNearer(object.geometry->box(i))) return;
      collision::FeatureCache cold;
      const auto separation =
          computeSeparationCounted(part, object.geometry->convex(i), best.distance, cold, count);
      if (separation && isCloser(*separation, best)) best = *separation;
    });
  }
  return best;
}

/// Current separation of the avatar and `other`; nullopt if `other` is out of reach.
std::optional<SeparationResult> computeSeparationFrom(Avatar& avatar, EntityId other,
                                                      QueryCount& count) {
  if (const DenseObject* object = avatar.obstacles.findDense(other))
    return computeDenseSeparation(avatar, *object, count);
  std::optional<SeparationResult> best;
  for (Obstacle& obstacle : avatar.obstacles.list) {
    if (obstacle.entity != other) continue;
    for (std::size_t i = 0; i < avatar.shape->parts.size(); ++i) {
      const auto separation = computeSeparationCounted(
          placeAvatarPart(avatar.shape->parts[i], avatar.footPosition), obstacle.convex,
          std::numeric_limits<double>::infinity(), obstacle.cacheFor(i), count);
      if (!best || isCloser(*separation, *best)) best = separation;
    }
  }
  return best;
}

const Contact* findContact(const std::vector<Contact>& contacts, EntityId other) {
  ENFILADE_ASSERT(std::ranges::is_sorted(contacts, {}, &Contact::other));
  const auto at = std::ranges::lower_bound(contacts, other, {}, &Contact::other);
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
  ENFILADE_ASSERT(std::ranges::is_sorted(now, {}, &Contact::other));
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
  ObstacleSet parts;
  std::ranges::copy_if(avatar.obstacles.list, std::back_inserter(parts.list),
                       [&](const Obstacle& obstacle) { return obstacle.entity == body; });
  const ShapeCastHit hit =
      castAvatarShape(*avatar.shape, avatar.footPosition, separation->distance * separation->normal,
                      parts, makeContactOffset(world.settings), count);
  return hit.entity == body ? std::optional(hit.separation) : std::nullopt;
}

/// Adds bodies that touched the avatar within this tick and moved away since. These are the one
/// that blocked it, dynamic bodies that it pushed, and those that bounced off it.
void addYieldedBodies(const WorldData& world, Avatar& avatar, std::vector<Contact>& now,
                      QueryCount& count) {
  if (world.bodyIndexById.contains(avatar.blockedBy))
    addTransientContact(
        avatar.blockedBy, [&] { return std::optional(avatar.blockingHit); }, now);
  const auto& transient = world.dynamicBodies.avatarBodyPairs;
  ENFILADE_ASSERT(std::ranges::is_sorted(transient));
  for (auto at = std::ranges::lower_bound(transient, EntityPair(avatar.id, 0));
       at != transient.end() && at->first == avatar.id; ++at)
    addTransientContact(
        at->second, [&] { return computeTouchWith(world, avatar, at->second, count); }, now);
}

/// Changes the avatar alone, so that avatars are updated in parallel.
void updateAvatarContacts(const WorldData& world, Avatar& avatar,
                          std::vector<ContactEvent>& events) {
  QueryCount& count = avatar.work;
  refreshDynamicObstacles(world, avatar);
  std::vector<Contact> now = findNearby(avatar, computeContactDistances(world.settings), count);
  // The avatar with the smaller id reports a pair of avatars.
  std::erase_if(now, [&](const Contact& c) {
    return c.other >= world.firstAvatarId() && c.other < avatar.id;
  });
  addYieldedBodies(world, avatar, now, count);
  emitContactBegins(world, avatar, now, events);
  emitContactEnds(world, avatar, now, events, count);
  avatar.contacts = std::move(now);
}

}  // namespace

void detectAvatarContacts(WorldData& world, TickReport& report) {
  std::vector<std::vector<ContactEvent>> events(world.avatars.size());
  parallelForOrSerial(acquireThreadPool(world.threads, world.avatars.size(), kMinParallelAvatars),
                      world.avatars.size(), kAvatarsPerTask, [&](std::size_t from, std::size_t to) {
                        for (std::size_t i = from; i < to; ++i) {
                          Avatar& avatar = world.avatars[i];
                          // A dynamic body next to the avatar may have been woken after the avatar
                          // was found idle.
                          if (!avatar.idle || !areNeighboursStationary(world, avatar))
                            updateAvatarContacts(world, avatar, events[i]);
                        }
                      });
  for (std::size_t i = 0; i < world.avatars.size(); ++i) {
    std::ranges::move(events[i], std::back_inserter(report.contacts));
    for (const Contact& contact : world.avatars[i].contacts) {
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
