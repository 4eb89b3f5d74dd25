// Contacts of dynamic bodies with static objects, with kinematic bodies and with one another. Also
// contacts of kinematic bodies with one another and with static objects (kinematic_contacts.cpp).
// avatar_contacts.cpp reports the contacts of avatars.
// For dynamic bodies only solver pairs of moved bodies are queried that are not certified as
// farther apart than the limit. A contact of two stationary bodies persists. A pair that touched in
// the solver and is separated after the tick, as after a bounce, begins and ends in this tick.
#include "scene/world/contacts/body_contacts.hpp"

#include <algorithm>

#include "collision/motion/shape_cast.hpp"
#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "scene/world/contacts/contact_events.hpp"
#include "scene/world/contacts/kinematic_contacts.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

using collision::SeparationResult;
using collision::Verdict;

constexpr std::size_t kScanBlock = 512, kQueryBlock = 32;  // pairs per work item of a thread

bool hasMoved(const WorldData& world, EntityId id) {
  const auto found = world.bodyIndexById.find(id);
  return found != world.bodyIndexById.end() && world.bodies[found->second].moved;
}

/// Compact copy of the fields that most pairs need.
struct BodySummary {
  double teleportedDistance = 0;  ///< copy of the physics body's field
  EntityId entity = 0;
  bool isDynamic = false, isAvatar = false, hasMoved = false;

  /// Order of reporting: dynamic, kinematic, static; dynamic ones by ascending id.
  bool reportsBefore(const BodySummary& other) const {
    return std::pair(!isDynamic, entity) < std::pair(!other.isDynamic, other.entity);
  }
};

std::vector<BodySummary> summarizeBodies(const WorldData& world) {
  const DynamicBodies& dynamicBodies = world.dynamicBodies;
  std::vector<BodySummary> summaries;
  summaries.reserve(dynamicBodies.entities.size());
  for (std::size_t i = 0; i < dynamicBodies.entities.size(); ++i) {
    const Body* body = dynamicBodies.sceneBodyOf[i] == kNoBody
                           ? nullptr
                           : &world.bodies[dynamicBodies.sceneBodyOf[i]];
    summaries.push_back({dynamicBodies.physicsWorld.bodies[i].teleportedDistance,
                         dynamicBodies.entities[i], body && isDynamic(body->spec->kind),
                         dynamicBodies.entities[i] >= world.firstAvatarId(), body && body->moved});
  }
  return summaries;
}

double computePairDepth(const PhysicsBody& a, const PhysicsBody& b, const BodyPair& pair,
                        const SeparationResult& separation,
                        const collision::FeatureCache& features) {
  if (separation.verdict != Verdict::penetrating) return 0;
  collision::DepthCache emptyCache;
  return collision::computePenetrationDepth(placePart(a, pair.key.partA),
                                            placePart(b, pair.key.partB), features, emptyCache)
      .depth;
}

/// Separation of two parts of two bodies.
struct PartContact {
  EntityPair key;
  std::optional<SeparationResult> separation;      ///< nullopt: they are far apart, as before
  std::optional<SeparationResult> transientTouch;  ///< set for parts that touched within this tick
                                                   ///< and are separated again
  bool touching = false;
  double depth = 0;
};

/// Contact of two separated parts when they are moved together along the shortest path, at their
/// current orientation.
std::optional<SeparationResult> computeTransientTouch(const collision::PlacedConvex& a,
                                                      const collision::PlacedConvex& b,
                                                      const SeparationResult& separation,
                                                      const WorldSettings& settings) {
  collision::FeatureCache cache;
  const collision::MotionResult cast = collision::castShape(
      a, separation.distance * separation.normal, b, makeContactOffset(settings), cache);
  return cast.isClear() ? std::nullopt : std::optional(cast.separation);
}

void swapSides(std::optional<SeparationResult>& separation) {
  if (!separation) return;
  std::swap(separation->pointA, separation->pointB);
  std::swap(separation->featureA, separation->featureB);
  separation->normal = -separation->normal;
}

/// Indices of pairs with a moved body that may be closer than the limit, or were in the last tick.
std::vector<std::uint32_t> selectPairsToQuery(const WorldData& world,
                                              const ContactDistances& distances,
                                              std::span<const BodySummary> summaries,
                                              ThreadPool* pool) {
  const std::vector<BodyPair>& pairs = world.dynamicBodies.physicsWorld.pairs;
  std::vector<std::uint8_t> isSelected(pairs.size(), 0);
  parallelForOrSerial(pool, pairs.size(), kScanBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const BodySummary &a = summaries[pairs[i].key.a], &b = summaries[pairs[i].key.b];
      if (a.isAvatar || b.isAvatar || !(a.hasMoved || b.hasMoved)) continue;
      isSelected[i] = pairs[i].reported || pairs[i].gaveImpulse ||
                      computeLowerBound(pairs[i], a.teleportedDistance + b.teleportedDistance) <=
                          distances.reportLimit;
    }
  });
  std::vector<std::uint32_t> selected;
  for (std::uint32_t i = 0; i < pairs.size(); ++i)
    if (isSelected[i] != 0) selected.push_back(i);
  return selected;
}

PartContact queryPair(BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b,
                      const ContactDistances& distances, const WorldSettings& settings) {
  PartContact found;
  const bool always = pair.reported || pair.gaveImpulse;
  const double within = always ? std::numeric_limits<double>::infinity() : distances.reportLimit;
  const collision::PlacedConvex partA = placePart(a, pair.key.partA),
                                partB = placePart(b, pair.key.partB);
  pair.reported = false;
  collision::FeatureCache features = pair.features();
  found.separation = collision::computeSeparationWithin(partA, partB, within, features);
  if (pair.cache) pair.cache->features = features;  // the next step warm-starts from this tick
  if (!found.separation) return found;
  found.depth = computePairDepth(a, b, pair, *found.separation, features);
  found.touching =
      collision::isCloserThan(*found.separation, partA, partB, distances.contact, features);
  pair.reported = found.touching || found.separation->distance < distances.reportLimit;
  if (pair.gaveImpulse && !found.touching)
    found.transientTouch = computeTransientTouch(partA, partB, *found.separation, settings);
  return found;
}

/// Queries all selected pairs of parts (see selectPairsToQuery) in parallel.
std::vector<PartContact> queryCloseParts(WorldData& world, const ContactDistances& distances,
                                         QueryCount& count) {
  DynamicBodies& dynamicBodies = world.dynamicBodies;
  ThreadPool* pool =
      acquireThreadPool(world.threads, dynamicBodies.activeBodies.size(), kMinParallelBodies);
  const std::vector<BodySummary> summaries = summarizeBodies(world);
  const std::vector<std::uint32_t> selected = selectPairsToQuery(world, distances, summaries, pool);
  std::vector<PartContact> found(selected.size());
  parallelForOrSerial(pool, selected.size(), kQueryBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      BodyPair& pair = dynamicBodies.physicsWorld.pairs[selected[i]];
      const BodySummary &a = summaries[pair.key.a], &b = summaries[pair.key.b];
      found[i] =
          queryPair(pair, dynamicBodies.physicsWorld.bodies[pair.key.a],
                    dynamicBodies.physicsWorld.bodies[pair.key.b], distances, world.settings);
      found[i].key = {a.entity, b.entity};
      if (a.reportsBefore(b)) continue;
      std::swap(found[i].key.first, found[i].key.second);
      swapSides(found[i].separation);
      swapSides(found[i].transientTouch);
    }
  });
  count.narrow += static_cast<std::uint32_t>(selected.size());
  return found;
}

/// Merges the separations of parts into one contact per pair of bodies.
BodyContacts mergePartContacts(const std::vector<PartContact>& parts, QueryCount& count) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < parts.size(); ++i)
    if (parts[i].separation) order.push_back(i);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return parts[i].key; });
  BodyContacts contacts;
  contacts.reserve(order.size());
  for (const std::uint32_t i : order) {
    const PartContact& found = parts[i];
    if (found.separation->certificate == collision::Certificate::rational) ++count.rational;
    const bool isNew = contacts.empty() || contacts.back().first != found.key;
    if (isNew) contacts.emplace_back(found.key, Contact{});
    Contact& contact = contacts.back().second;
    contact.other = found.key.second;
    if (isNew || isCloser(*found.separation, contact.separation))
      contact.separation = *found.separation;
    contact.touching = contact.touching || found.touching;
    contact.penetration = std::max(contact.penetration, found.depth);
  }
  return contacts;
}

/// Pairs that touched within the tick and are separated after it: the first touching pair of parts.
BodyContacts findTransientContacts(const std::vector<PartContact>& parts, const BodyContacts& now) {
  BodyContacts transient;
  for (const PartContact& found : parts) {
    if (!found.transientTouch) continue;
    const auto at = std::ranges::lower_bound(now, found.key, {}, &BodyContacts::value_type::first);
    if (at != now.end() && at->first == found.key && at->second.touching) continue;
    Contact contact;
    contact.other = found.key.second;
    contact.separation = *found.transientTouch;
    contact.touching = true;
    transient.emplace_back(found.key, contact);
  }
  std::ranges::stable_sort(transient, {}, &BodyContacts::value_type::first);
  const auto samePair = [](const auto& a, const auto& b) { return a.first == b.first; };
  transient.erase(std::unique(transient.begin(), transient.end(), samePair), transient.end());
  return transient;
}

/// Adds the contacts of other pairs; keeps the order.
void mergeContacts(const BodyContacts& added, BodyContacts& contacts) {
  const auto middle = static_cast<std::ptrdiff_t>(contacts.size());
  contacts.insert(contacts.end(), added.begin(), added.end());
  std::ranges::inplace_merge(contacts, contacts.begin() + middle, {},
                             &BodyContacts::value_type::first);
}

/// Iterator to the pair, or to its insertion point.
BodyContacts::iterator findContactPosition(BodyContacts& contacts, const EntityPair& pair) {
  return std::ranges::lower_bound(contacts, pair, {}, &BodyContacts::value_type::first);
}

/// Emits `begin` for transient contacts and updates those that existed before.
void emitTransientContacts(WorldData& world, BodyContacts& transient,
                           std::vector<ContactEvent>& events) {
  BodyContacts added;
  for (auto& [key, contact] : transient) {
    const Contact* before = world.findBodyContact(key);
    emitContactBegin(world, key.first, before, contact, events);
    if (before) {
      emitContactEnd(world, key.first, *before, &contact, {}, events);
      findContactPosition(world.bodyContacts, key)->second = contact;
    } else {
      added.emplace_back(key, contact);
    }
  }
  if (!added.empty()) mergeContacts(added, world.bodyContacts);
}

/// Emits begins and ends, and stores the persistent contacts in the world. `now` also holds pairs
/// that were close before and no longer are.
void updateBodyContacts(WorldData& world, BodyContacts& now, const ContactDistances& distances,
                        std::vector<ContactEvent>& events) {
  BodyContacts lasting;
  lasting.reserve(world.bodyContacts.size() + now.size());
  auto previous = world.bodyContacts.begin();
  const auto end = world.bodyContacts.end();
  const auto carryOver = [&] {
    const auto& [key, contact] = *previous++;
    if (!hasMoved(world, key.first) && !hasMoved(world, key.second)) {
      lasting.emplace_back(key, contact);  // a contact of two stationary bodies persists
    } else {
      emitContactEnd(
          world, key.first, contact, nullptr, [&last = contact] { return last.separation; },
          events);
    }
  };
  for (auto& [key, contact] : now) {
    while (previous != end && previous->first < key) carryOver();
    const Contact* before =
        previous != end && previous->first == key ? &(previous++)->second : nullptr;
    const bool isClose = contact.touching || contact.separation.distance < distances.reportLimit;
    if (isClose) emitContactBegin(world, key.first, before, contact, events);
    if (before)
      emitContactEnd(
          world, key.first, *before, isClose ? &contact : nullptr,
          [&last = contact] { return last.separation; }, events);
    if (isClose) lasting.emplace_back(key, contact);
  }
  while (previous != end) carryOver();
  world.bodyContacts = std::move(lasting);
}

}  // namespace

void detectBodyContacts(WorldData& world, TickReport& report, QueryCount& count) {
  const ContactDistances distances = computeContactDistances(world.settings);
  BodyContacts now, transient;
  if (!world.dynamicBodies.activeBodies.empty()) {
    const std::vector<PartContact> parts = queryCloseParts(world, distances, count);
    now = mergePartContacts(parts, count);
    transient = findTransientContacts(parts, now);
  }
  KinematicContacts kinematic = findKinematicContacts(world, distances, count);
  if (!kinematic.current.empty()) mergeContacts(kinematic.current, now);
  emitTransientContacts(world, transient, report.contacts);
  emitTransientContacts(world, kinematic.transient, report.contacts);
  updateBodyContacts(world, now, distances, report.contacts);
  for (const auto& [key, contact] : world.bodyContacts) {
    if (contact.touching) ++report.activeContacts;
    report.maxPenetration = std::max(report.maxPenetration, contact.penetration);
  }
}

void endBodyContacts(WorldData& world, ContactEvent::Reason reason,
                     std::vector<ContactEvent>& events) {
  for (const auto& [key, contact] : world.bodyContacts) {
    const std::size_t eventCount = events.size();
    emitContactEnd(
        world, key.first, contact, nullptr, [&last = contact] { return last.separation; }, events);
    if (events.size() > eventCount) events.back().reason = reason;
  }
  world.bodyContacts.clear();
}

}  // namespace enfilade::scene
