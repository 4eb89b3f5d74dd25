// Who touches what among bodies: free ones with still objects, with driven ones and with one
// another, and driven ones among themselves and with still objects (driven_contacts.cpp). (What
// avatars touch, avatars tell.) Of free ones the solver's pairs are asked, and of those only the
// ones that are not proved to be farther apart, of bodies that moved: a contact of two that stand
// lasts.
#include <algorithm>

#include "collision/penetration_depth.hpp"
#include "collision/refine.hpp"
#include "scene/world_state.hpp"

namespace enfilade::scene {
namespace {

using collision::Decision;
using collision::Verdict;
using Key = std::pair<EntityId, EntityId>;

bool hasMoved(const WorldState& world, EntityId id) {
  const auto found = world.bodyOfId.find(id);
  return found != world.bodyOfId.end() && world.bodies[found->second].moved;
}
bool solidHasMoved(const WorldState& world, std::uint32_t solid) {
  const std::uint32_t body = world.rigids.bodyOf[solid];
  return body != kNoRigid && world.bodies[body].moved;
}

/// Free before driven before still, and among free ones in the order of their ids.
bool tellsFirst(const WorldState& world, std::uint32_t solidA, std::uint32_t solidB) {
  const auto rank = [&](std::uint32_t solid) {
    const std::uint32_t body = world.rigids.bodyOf[solid];
    const bool isFree = body != kNoRigid && world.bodies[body].spec->kind == BodyKind::rigid;
    return std::pair(isFree ? 0 : 1, world.rigids.entities[solid]);
  };
  return rank(solidA) < rank(solidB);
}

double depthOf(const Solid& a, const Solid& b, const NearPair& pair, const Decision& decision,
               const collision::FeatureCache& features) {
  if (decision.verdict != Verdict::penetrating) return 0;
  collision::DepthCache none;
  return collision::penetrationDepth(partOf(a, pair.key.partA), partOf(b, pair.key.partB), features,
                                     none)
      .depth;
}

/// What two parts are to one another.
struct PartContact {
  Decision decision;
  bool touching = false;
  double depth = 0;
};

/// Takes it into what their bodies are.
void take(std::map<Key, Contact>& now, const Key& key, const PartContact& parts) {
  const auto [at, isNew] = now.try_emplace(key);
  Contact& contact = at->second;
  contact.other = key.second;
  if (isNew || nearer(parts.decision, contact.decision)) contact.decision = parts.decision;
  contact.touching = contact.touching || parts.touching;
  contact.penetration = std::max(contact.penetration, parts.depth);
}

/// All pairs of which one moved and that are nearer than the limit, or were in the last tick.
std::map<Key, Contact> nearBodies(WorldState& world, const Nearness& nearness, QueryCount& count) {
  RigidStage& stage = world.rigids;
  std::map<Key, Contact> now;
  for (NearPair& pair : stage.dynamics.pairs) {
    const Solid& solidA = stage.dynamics.solids[pair.key.a];
    const Solid& solidB = stage.dynamics.solids[pair.key.b];
    const bool lasted = pair.told;
    if (!lasted && apartNow(pair, solidA, solidB) > nearness.limit) continue;
    EntityId a = stage.entities[pair.key.a], b = stage.entities[pair.key.b];
    if (std::max(a, b) >= world.firstAvatarId()) continue;
    if (!solidHasMoved(world, pair.key.a) && !solidHasMoved(world, pair.key.b)) continue;
    pair.told = false;
    const bool swapped = !tellsFirst(world, pair.key.a, pair.key.b);
    if (swapped) std::swap(a, b);
    const double within = lasted ? std::numeric_limits<double>::infinity() : nearness.limit;
    collision::FeatureCache features = pair.features();
    ++count.narrow;
    const collision::ConvexBody partA = partOf(solidA, pair.key.partA);
    const collision::ConvexBody partB = partOf(solidB, pair.key.partB);
    auto decision = collision::decideWithin(partA, partB, within, features);
    if (!decision) continue;
    if (decision->decidedBy == collision::DecidedBy::rational) ++count.rational;
    const double depth = depthOf(solidA, solidB, pair, *decision, features);
    const bool touching =
        collision::isNearerThan(*decision, partA, partB, nearness.contact, features);
    pair.told = touching || decision->distance < nearness.limit;
    if (swapped) {
      std::swap(decision->pointA, decision->pointB);
      decision->normal = -decision->normal;
    }
    take(now, {a, b}, {*decision, touching, depth});
  }
  return now;
}

/// They begin here, and end as all that is not so any more.
void tellOnTheWay(WorldState& world, std::map<Key, Contact>& touched,
                  std::vector<ContactEvent>& events) {
  for (auto& [key, contact] : touched) {
    const auto near = world.bodyContacts.find(key);
    const Contact* before = near == world.bodyContacts.end() ? nullptr : &near->second;
    tellBegin(world, key.first, before, contact, events);
    if (before) tellEnd(world, key.first, *before, &contact, {}, events);
    world.bodyContacts[key] = contact;
  }
}

}  // namespace

void findBodyContacts(WorldState& world, TickReport& report, QueryCount& count) {
  const Nearness nearness = nearnessOf(world.lengths);
  std::map<Key, Contact> now, parted;
  if (!world.rigids.seeds.empty()) now = nearBodies(world, nearness, count);
  DrivenContacts driven = drivenContacts(world, nearness, count);
  now.merge(driven.now);
  tellOnTheWay(world, driven.onTheWay, report.contacts);
  for (auto at = now.begin(); at != now.end();) {
    const auto next = std::next(at);
    const bool near = at->second.touching || at->second.decision.distance < nearness.limit;
    if (!near) parted.insert(now.extract(at));
    at = next;
  }
  for (const auto& [key, before] : world.bodyContacts)  // a contact of two that stand lasts
    if (!hasMoved(world, key.first) && !hasMoved(world, key.second)) now.try_emplace(key, before);
  for (auto& [key, contact] : now) {
    const auto before = world.bodyContacts.find(key);
    tellBegin(world, key.first, before == world.bodyContacts.end() ? nullptr : &before->second,
              contact, report.contacts);
  }
  for (const auto& [key, before] : world.bodyContacts) {
    const auto after = now.find(key);
    const auto gone = parted.find(key);
    const Contact& last = gone == parted.end() ? before : gone->second;
    tellEnd(
        world, key.first, before, after == now.end() ? nullptr : &after->second,
        [&last] { return last.decision; }, report.contacts);
  }
  world.bodyContacts = std::move(now);
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
