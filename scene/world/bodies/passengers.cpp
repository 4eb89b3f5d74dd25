#include "scene/world/bodies/passengers.hpp"

#include <algorithm>
#include <set>

#include "collision/assert.hpp"
#include "collision/narrow_phase/contact_manifold.hpp"

namespace enfilade::scene {
namespace {

/// Y component of the steepest contact normal from `a` to `b` over all touching parts. The part
/// nearest to a crate in a corner may belong to the wall.
double findSteepestNormalY(const WorldData& world, const Body& a, const Body& b) {
  double steepest = 0;
  const double limit = computeContactThreshold(world.settings);
  for (std::uint32_t i = 0; i < getPartCount(a); ++i) {
    const Aabb box = inflate(getPartBox(a, i), limit);
    for (std::uint32_t k = 0; k < getPartCount(b); ++k) {
      if (!overlaps(box, getPartBox(b, k))) continue;
      collision::FeatureCache cache;
      const auto at = collision::computeSeparationWithin(makePlacedPart(a, i), makePlacedPart(b, k),
                                                         limit, cache);
      const bool touches = at && at->verdict != collision::Verdict::penetrating;
      if (touches && std::abs(at->normal.y()) > std::abs(steepest)) steepest = at->normal.y();
    }
  }
  return steepest;
}

/// > 0: the second body stands on the first; < 0: the first stands on the second; 0: neither. Uses
/// the contact of the last tick.
double computeSupportNormalY(const WorldData& world, const Contact& contact, const Body& first,
                             const Body& second) {
  const double minNormalY = world.settings.walkableNormalY;
  if (contact.separation.verdict == collision::Verdict::penetrating)  // there is no normal
    return second.position.y() - first.position.y();
  double up = contact.separation.normal.y();
  const bool haveOnePart = getPartCount(first) == 1 && getPartCount(second) == 1;
  if (std::abs(up) < minNormalY && !haveOnePart) up = findSteepestNormalY(world, first, second);
  return std::abs(up) < minNormalY ? 0 : up;
}

std::vector<CarriedBody> findCarriedBodies(const WorldData& world, const Body& body,
                                           const SupportGraph& supportGraph) {
  ENFILADE_ASSERT(std::ranges::is_sorted(supportGraph));
  std::vector<CarriedBody> carriedBodies;
  std::vector<EntityId> pending{body.id};
  std::set<EntityId> visited{body.id};
  while (!pending.empty()) {
    const EntityId below = pending.back();
    pending.pop_back();
    for (auto at = std::ranges::lower_bound(supportGraph, std::pair(below, EntityId{0}));
         at != supportGraph.end() && at->first == below; ++at) {
      if (!visited.insert(at->second).second) continue;
      pending.push_back(at->second);
      const std::uint32_t index = world.bodyIndexById.at(at->second);
      const Body& above = world.bodies[index];
      carriedBodies.push_back(
          {index, toBodyFrame(body, above.position), above.position.y(), above.pendingLift});
    }
  }
  return carriedBodies;
}

/// Avatars that overlap the body in the broad phase, sorted by name.
std::vector<Avatar*> findNearbyAvatars(WorldData& world, const Body& body) {
  std::vector<Avatar*> avatars;
  for (const auto& overlap : world.broadPhase.getOverlaps(body.proxy))
    if (Avatar* avatar = overlap.isDynamic ? world.findAvatarByProxy(overlap.id) : nullptr)
      avatars.push_back(avatar);
  std::ranges::sort(avatars);  // by name, as WorldData::avatars
  ENFILADE_ASSERT(std::ranges::is_sorted(avatars, {}, &Avatar::name));
  return avatars;
}

/// Support point of the avatar on the body, as close to its feet as the contact area allows. The
/// avatar moves with this point: feet on a turntable follow the place below them, and a touching
/// finger follows the fingertip.
Vec3 findSupportPoint(const WorldData& world, const Body& body, const Avatar& avatar,
                      const Contact& contact) {
  const double limit = computeContactThreshold(world.settings);
  Aabb contactArea{contact.separation.pointB, contact.separation.pointB};
  for (const AvatarPart& avatarPart : avatar.shape->parts) {
    const Aabb box = inflate(placeBox(avatarPart.box, avatar.footPosition), limit);
    for (std::uint32_t i = 0; i < getPartCount(body); ++i) {
      if (!overlaps(box, getPartBox(body, i))) continue;
      const collision::PlacedConvex placedPart = placeAvatarPart(avatarPart, avatar.footPosition),
                                    under = makePlacedPart(body, i);
      collision::FeatureCache cache;
      const collision::SeparationResult at = collision::computeSeparation(placedPart, under, cache);
      if (at.verdict != collision::Verdict::separated || at.distance >= limit) continue;
      if (-at.normal.y() < world.settings.walkableNormalY) continue;
      const collision::ContactManifold manifold = collision::computeContactManifold(
          placedPart, under,
          {at.normal, at.pointA, at.pointB, limit, collision::ContactManifold::kMaxPoints});
      for (const collision::ContactPoint& point : manifold.activePoints())
        contactArea.include(point.pointB);
    }
  }
  return avatar.footPosition.cwiseMax(contactArea.min).cwiseMin(contactArea.max);
}

bool findStandingPoint(const WorldData& world, const Body& body, const Avatar& avatar, Vec3& at) {
  for (const Contact& contact : avatar.contacts) {
    const bool below = -contact.separation.normal.y() >= world.settings.walkableNormalY;
    if (contact.other != body.id || !contact.touching || !below) continue;
    at = findSupportPoint(world, body, avatar, contact);
    return true;
  }
  return false;
}

}  // namespace

SupportGraph buildSupportGraph(const WorldData& world) {
  SupportGraph supportGraph;
  if (world.avatars.empty() || world.movingBodies.empty()) return supportGraph;
  for (const auto& [pair, contact] : world.bodyContacts) {
    if (!contact.touching || pair.second >= world.firstAvatarId()) continue;
    const auto first = world.bodyIndexById.find(pair.first),
               second = world.bodyIndexById.find(pair.second);
    if (first == world.bodyIndexById.end() || second == world.bodyIndexById.end()) continue;
    const Body &a = world.bodies[first->second], &b = world.bodies[second->second];
    const double up = computeSupportNormalY(world, contact, a, b);
    const Body &below = up > 0 ? a : b, &above = up > 0 ? b : a;
    const bool carries = up != 0 && isDynamic(above.spec->kind) && !above.outOfWorld;
    if (carries) supportGraph.emplace_back(below.id, above.id);
  }
  std::ranges::sort(supportGraph);
  return supportGraph;
}

Passengers findPassengers(WorldData& world, const Body& body, const SupportGraph& supportGraph) {
  Passengers passengers{
      findCarriedBodies(world, body, supportGraph), findNearbyAvatars(world, body), {}};
  Vec3 at;
  for (Avatar* avatar : passengers.nearbyAvatars)
    if (avatar->grounded && findStandingPoint(world, body, *avatar, at))
      passengers.avatars.push_back({avatar, toBodyFrame(body, at), false});
  const std::size_t directCount = passengers.avatars.size();
  for (CarriedBody& carried : passengers.bodies) {
    const Body& carriedBody = world.bodies[carried.index];
    carried.nearbyAvatars = findNearbyAvatars(world, carriedBody);
    for (Avatar* avatar : carried.nearbyAvatars) {
      if (!avatar->grounded || avatar->groundEntity != carriedBody.id) continue;
      const auto end = passengers.avatars.begin() + static_cast<std::ptrdiff_t>(directCount);
      if (std::find_if(passengers.avatars.begin(), end, [&](const CarriedAvatar& carriedAvatar) {
            return carriedAvatar.avatar == avatar;
          }) == end)
        passengers.avatars.push_back({avatar, toBodyFrame(body, avatar->footPosition), true});
    }
  }
  std::erase_if(passengers.bodies,
                [](const CarriedBody& carried) { return carried.nearbyAvatars.empty(); });
  return passengers;
}

}  // namespace enfilade::scene
