// Who touches what among bodies: free ones with still objects, with driven ones and with one
// another, and driven ones among themselves and with still objects (driven_contacts.cpp). (What
// avatars touch, avatars tell.) Of free ones the solver's pairs are asked, and of those only the
// ones that are not proved to be farther apart, of bodies that moved: a contact of two that stand
// lasts. What met in the solver and is apart after the tick, as what bounced, begins and ends in
// it.
#include <algorithm>

#include "collision/motion/shape_cast.hpp"
#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

using collision::Decision;
using collision::Verdict;
using Key = EntityPair;

constexpr std::size_t kScanBlock = 512, kAskBlock = 32;  // pairs that a thread takes at a time

bool hasMoved(const WorldState& world, EntityId id) {
  const auto found = world.bodyOfId.find(id);
  return found != world.bodyOfId.end() && world.bodies[found->second].moved;
}

/// What most pairs need to know of a solid, side by side.
struct Standing {
  double jumped = 0;  ///< Solid's
  EntityId entity = 0;
  bool isFree = false, isAvatar = false, hasMoved = false;

  /// Free before driven before still, and among free ones in the order of their ids.
  bool tellsBefore(const Standing& other) const {
    return std::pair(!isFree, entity) < std::pair(!other.isFree, other.entity);
  }
};

std::vector<Standing> standingsOf(const WorldState& world) {
  const RigidStage& stage = world.rigids;
  std::vector<Standing> standings;
  standings.reserve(stage.entities.size());
  for (std::size_t i = 0; i < stage.entities.size(); ++i) {
    const Body* body = stage.bodyOf[i] == kNoRigid ? nullptr : &world.bodies[stage.bodyOf[i]];
    standings.push_back({stage.dynamics.solids[i].jumped, stage.entities[i],
                         body && body->spec->kind == BodyKind::rigid,
                         stage.entities[i] >= world.firstAvatarId(), body && body->moved});
  }
  return standings;
}

double depthOf(const Solid& a, const Solid& b, const NearPair& pair, const Decision& decision,
               const collision::FeatureCache& features) {
  if (decision.verdict != Verdict::penetrating) return 0;
  collision::DepthCache none;
  return collision::penetrationDepth(partOf(a, pair.key.partA), partOf(b, pair.key.partB), features,
                                     none)
      .depth;
}

/// What two parts of two bodies are to one another.
struct PartContact {
  Key key;
  std::optional<Decision> decision;  ///< nullopt: they are far apart, and were
  std::optional<Decision> touch;     ///< of parts that met in this tick and do not touch any more
  bool touching = false;
  double depth = 0;
};

/// How two parts touch that are brought together the shortest way, as they are turned now.
std::optional<Decision> touchOf(const collision::ConvexBody& a, const collision::ConvexBody& b,
                                const Decision& apart, const Lengths& lengths) {
  collision::FeatureCache cache;
  const collision::SweepResult met =
      collision::sweep(a, apart.distance * apart.normal, b, bandOf(lengths), cache);
  return met.stopped ? std::optional(met.atStop) : std::nullopt;
}

void swapSides(std::optional<Decision>& decision) {
  if (!decision) return;
  std::swap(decision->pointA, decision->pointB);
  std::swap(decision->featureA, decision->featureB);
  decision->normal = -decision->normal;
}

/// Indices of the pairs of which one moved and that may be nearer than the limit, or were in the
/// last tick.
std::vector<std::uint32_t> pairsToAsk(const WorldState& world, const Nearness& nearness,
                                      std::span<const Standing> standings, Workers* workers) {
  const std::vector<NearPair>& pairs = world.rigids.dynamics.pairs;
  std::vector<std::uint8_t> isAsked(pairs.size(), 0);
  shareAmong(workers, pairs.size(), kScanBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const Standing &a = standings[pairs[i].key.a], &b = standings[pairs[i].key.b];
      if (a.isAvatar || b.isAvatar || !(a.hasMoved || b.hasMoved)) continue;
      isAsked[i] = pairs[i].told || pairs[i].met ||
                   apartNow(pairs[i], a.jumped + b.jumped) <= nearness.limit;
    }
  });
  std::vector<std::uint32_t> asked;
  for (std::uint32_t i = 0; i < pairs.size(); ++i)
    if (isAsked[i] != 0) asked.push_back(i);
  return asked;
}

PartContact ask(NearPair& pair, const Solid& a, const Solid& b, const Nearness& nearness,
                const Lengths& lengths) {
  PartContact found;
  const bool inAnyCase = pair.told || pair.met;
  const double within = inAnyCase ? std::numeric_limits<double>::infinity() : nearness.limit;
  const collision::ConvexBody partA = partOf(a, pair.key.partA), partB = partOf(b, pair.key.partB);
  pair.told = false;
  collision::FeatureCache features = pair.features();
  found.decision = collision::decideWithin(partA, partB, within, features);
  if (pair.close) pair.close->features = features;  // the next step starts where this tick ends
  if (!found.decision) return found;
  found.depth = depthOf(a, b, pair, *found.decision, features);
  found.touching =
      collision::isNearerThan(*found.decision, partA, partB, nearness.contact, features);
  pair.told = found.touching || found.decision->distance < nearness.limit;
  if (pair.met && !found.touching) found.touch = touchOf(partA, partB, *found.decision, lengths);
  return found;
}

/// Of all pairs of parts of which one moved and that may be nearer than the limit, or were in the
/// last tick.
std::vector<PartContact> nearParts(WorldState& world, const Nearness& nearness, QueryCount& count) {
  RigidStage& stage = world.rigids;
  Workers* workers = workersFor(stage);
  const std::vector<Standing> standings = standingsOf(world);
  const std::vector<std::uint32_t> asked = pairsToAsk(world, nearness, standings, workers);
  std::vector<PartContact> found(asked.size());
  shareAmong(workers, asked.size(), kAskBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      NearPair& pair = stage.dynamics.pairs[asked[i]];
      const Standing &a = standings[pair.key.a], &b = standings[pair.key.b];
      found[i] = ask(pair, stage.dynamics.solids[pair.key.a], stage.dynamics.solids[pair.key.b],
                     nearness, world.lengths);
      found[i].key = {a.entity, b.entity};
      if (a.tellsBefore(b)) continue;
      std::swap(found[i].key.first, found[i].key.second);
      swapSides(found[i].decision);
      swapSides(found[i].touch);
    }
  });
  count.narrow += static_cast<std::uint32_t>(asked.size());
  return found;
}

/// What bodies are to one another by all of their parts.
BodyContacts together(const std::vector<PartContact>& parts, QueryCount& count) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < parts.size(); ++i)
    if (parts[i].decision) order.push_back(i);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return parts[i].key; });
  BodyContacts contacts;
  contacts.reserve(order.size());
  for (const std::uint32_t i : order) {
    const PartContact& found = parts[i];
    if (found.decision->decidedBy == collision::DecidedBy::rational) ++count.rational;
    const bool isNew = contacts.empty() || contacts.back().first != found.key;
    if (isNew) contacts.emplace_back(found.key, Contact{});
    Contact& contact = contacts.back().second;
    contact.other = found.key.second;
    if (isNew || nearer(*found.decision, contact.decision)) contact.decision = *found.decision;
    contact.touching = contact.touching || found.touching;
    contact.penetration = std::max(contact.penetration, found.depth);
  }
  return contacts;
}

/// Who met on their way and does not touch after it: the first of their parts that did.
BodyContacts metOnTheWay(const std::vector<PartContact>& parts, const BodyContacts& now) {
  BodyContacts met;
  for (const PartContact& found : parts) {
    if (!found.touch) continue;
    const auto at = std::ranges::lower_bound(now, found.key, {}, &BodyContacts::value_type::first);
    if (at != now.end() && at->first == found.key && at->second.touching) continue;
    Contact contact;
    contact.other = found.key.second;
    contact.decision = *found.touch;
    contact.touching = true;
    met.emplace_back(found.key, contact);
  }
  std::ranges::stable_sort(met, {}, &BodyContacts::value_type::first);
  const auto samePair = [](const auto& a, const auto& b) { return a.first == b.first; };
  met.erase(std::unique(met.begin(), met.end(), samePair), met.end());
  return met;
}

/// Adds contacts of other pairs.
void merge(const BodyContacts& more, BodyContacts& contacts) {
  const auto middle = static_cast<std::ptrdiff_t>(contacts.size());
  contacts.insert(contacts.end(), more.begin(), more.end());
  std::ranges::inplace_merge(contacts, contacts.begin() + middle, {},
                             &BodyContacts::value_type::first);
}

/// They begin here, and end as all that is not so any more.
void tellOnTheWay(WorldState& world, BodyContacts& touched, std::vector<ContactEvent>& events) {
  BodyContacts begun;
  for (auto& [key, contact] : touched) {
    const Contact* before = contactOf(world, key);
    tellBegin(world, key.first, before, contact, events);
    if (before) {
      tellEnd(world, key.first, *before, &contact, {}, events);
      placeOf(world.bodyContacts, key)->second = contact;
    } else {
      begun.emplace_back(key, contact);
    }
  }
  if (!begun.empty()) merge(begun, world.bodyContacts);
}

/// Tells what began and ended, and leaves in the world what lasts. `now`: also those that were near
/// and are so no more.
void takeOver(WorldState& world, BodyContacts& now, const Nearness& nearness,
              std::vector<ContactEvent>& events) {
  BodyContacts lasting;
  lasting.reserve(world.bodyContacts.size() + now.size());
  auto told = world.bodyContacts.begin();
  const auto end = world.bodyContacts.end();
  const auto passOver = [&] {
    const auto& [key, contact] = *told++;
    if (!hasMoved(world, key.first) && !hasMoved(world, key.second)) {
      lasting.emplace_back(key, contact);  // a contact of two that stand lasts
    } else {
      tellEnd(
          world, key.first, contact, nullptr, [&last = contact] { return last.decision; }, events);
    }
  };
  for (auto& [key, contact] : now) {
    while (told != end && told->first < key) passOver();
    const Contact* before = told != end && told->first == key ? &(told++)->second : nullptr;
    const bool near = contact.touching || contact.decision.distance < nearness.limit;
    if (near) tellBegin(world, key.first, before, contact, events);
    if (before)
      tellEnd(
          world, key.first, *before, near ? &contact : nullptr,
          [&last = contact] { return last.decision; }, events);
    if (near) lasting.emplace_back(key, contact);
  }
  while (told != end) passOver();
  world.bodyContacts = std::move(lasting);
}

}  // namespace

BodyContacts::iterator placeOf(BodyContacts& contacts, const EntityPair& pair) {
  return std::ranges::lower_bound(contacts, pair, {}, &BodyContacts::value_type::first);
}

const Contact* contactOf(const WorldState& world, const EntityPair& pair) {
  const BodyContacts& all = world.bodyContacts;
  const auto at = std::ranges::lower_bound(all, pair, {}, &BodyContacts::value_type::first);
  return at != all.end() && at->first == pair ? &at->second : nullptr;
}

void findBodyContacts(WorldState& world, TickReport& report, QueryCount& count) {
  const Nearness nearness = nearnessOf(world.lengths);
  BodyContacts now, met;
  if (!world.rigids.seeds.empty()) {
    const std::vector<PartContact> parts = nearParts(world, nearness, count);
    now = together(parts, count);
    met = metOnTheWay(parts, now);
  }
  DrivenContacts driven = drivenContacts(world, nearness, count);
  if (!driven.now.empty()) merge(driven.now, now);
  tellOnTheWay(world, met, report.contacts);
  tellOnTheWay(world, driven.onTheWay, report.contacts);
  takeOver(world, now, nearness, report.contacts);
  for (const auto& [key, contact] : world.bodyContacts) {
    if (contact.touching) ++report.liveContacts;
    report.worstPenetration = std::max(report.worstPenetration, contact.penetration);
  }
}

void endBodyContacts(WorldState& world, ContactEvent::Reason reason,
                     std::vector<ContactEvent>& events) {
  for (const auto& [key, contact] : world.bodyContacts) {
    const std::size_t told = events.size();
    tellEnd(
        world, key.first, contact, nullptr, [&last = contact] { return last.decision; }, events);
    if (events.size() > told) events.back().reason = reason;
  }
  world.bodyContacts.clear();
}

}  // namespace enfilade::scene
