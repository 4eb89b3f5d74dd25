#include "scene/world/bodies/passengers.hpp"

#include <set>
#include <string>

#include "collision/narrow_phase/contact_manifold.hpp"

namespace enfilade::scene {
namespace {

/// The steepest normal of parts that touch, from `a` to `b`: of a crate in a corner the nearest
/// part may be the wall.
double steepestTouch(const WorldState& world, const Body& a, const Body& b) {
  double steepest = 0;
  const double near = contactLimit(world.lengths);
  for (std::uint32_t i = 0; i < a.partBoxes.size(); ++i) {
    const Box box = grown(a.partBoxes[i], near);
    for (std::uint32_t k = 0; k < b.partBoxes.size(); ++k) {
      if (!overlaps(box, b.partBoxes[k])) continue;
      collision::FeatureCache cache;
      const auto at = collision::decideWithin(partOf(a, i), partOf(b, k), near, cache);
      const bool touches = at && at->verdict != collision::Verdict::penetrating;
      if (touches && std::abs(at->normal.y()) > std::abs(steepest)) steepest = at->normal.y();
    }
  }
  return steepest;
}

/// Whether the second stands on the first, > 0, or the first on the second, < 0; by the contact of
/// the last tick.
double standing(const WorldState& world, const Contact& contact, const Body& first,
                const Body& second) {
  const double least = world.lengths.walkableNormalY;
  if (contact.decision.verdict == collision::Verdict::penetrating)  // there is no normal
    return second.position.y() - first.position.y();
  double up = contact.decision.normal.y();
  const bool isOne = first.partBoxes.size() == 1 && second.partBoxes.size() == 1;
  if (std::abs(up) < least && !isOne) up = steepestTouch(world, first, second);
  return std::abs(up) < least ? 0 : up;
}

std::vector<Load> loadsOf(const WorldState& world, const Body& body, const Supports& supports) {
  std::vector<Load> loads;
  std::vector<EntityId> open{body.id};
  std::set<EntityId> known{body.id};
  while (!open.empty()) {
    const EntityId below = open.back();
    open.pop_back();
    for (auto at = std::ranges::lower_bound(supports, std::pair(below, EntityId{0}));
         at != supports.end() && at->first == below; ++at) {
      if (!known.insert(at->second).second) continue;
      open.push_back(at->second);
      const std::uint32_t index = world.bodyOfId.at(at->second);
      const Body& above = world.bodies[index];
      loads.push_back({index, inBody(body, above.position), above.position.y(), above.risesBy});
    }
  }
  return loads;
}

/// Avatars that the broad phase has near the body, in order of name.
std::vector<Avatar*> avatarsNear(WorldState& world, const Body& body) {
  std::vector<std::string> names;
  for (const auto& partner : world.broadPhase.partners(body.mover)) {
    if (!partner.moves) continue;
    const auto found = world.avatarOfMover.find(partner.id);
    if (found != world.avatarOfMover.end()) names.push_back(found->second);
  }
  std::sort(names.begin(), names.end());
  std::vector<Avatar*> avatars;
  for (const std::string& name : names) avatars.push_back(&world.avatars.at(name));
  return avatars;
}

/// Where the avatar leans on the body, as near to its feet as that comes: carried by that point,
/// who stands on what turns goes round with its feet, and who has a finger on it with the finger.
Vec3 leaningPoint(const WorldState& world, const Body& body, const Avatar& avatar,
                  const Contact& contact) {
  const double near = contactLimit(world.lengths);
  Box patch{contact.decision.pointB, contact.decision.pointB};
  for (const AvatarPart& limb : avatar.shape->parts) {
    const Box box = grown(boxAt(limb.box, avatar.feet), near);
    for (std::uint32_t i = 0; i < body.partBoxes.size(); ++i) {
      if (!overlaps(box, body.partBoxes[i])) continue;
      const collision::ConvexBody own = bodyAt(limb, avatar.feet), under = partOf(body, i);
      collision::FeatureCache cache;
      const collision::Decision at = collision::decide(own, under, cache);
      if (at.verdict != collision::Verdict::separated || at.distance >= near) continue;
      if (-at.normal.y() < world.lengths.walkableNormalY) continue;
      const collision::ContactManifold manifold = collision::contactManifold(
          own, under,
          {at.normal, at.pointA, at.pointB, near, collision::ContactManifold::kMostPoints});
      for (const collision::ContactPoint& point : manifold.list()) patch.include(point.pointB);
    }
  }
  return avatar.feet.cwiseMax(patch.min).cwiseMin(patch.max);
}

bool standsOn(const WorldState& world, const Body& body, const Avatar& avatar, Vec3& at) {
  for (const Contact& contact : avatar.contacts) {
    const bool below = -contact.decision.normal.y() >= world.lengths.walkableNormalY;
    if (contact.other != body.id || !contact.touching || !below) continue;
    at = leaningPoint(world, body, avatar, contact);
    return true;
  }
  return false;
}

}  // namespace

Supports supportsOf(const WorldState& world) {
  Supports supports;
  if (world.avatars.empty() || world.goingBodies.empty()) return supports;
  for (const auto& [pair, contact] : world.bodyContacts) {
    if (!contact.touching || pair.second >= world.firstAvatarId()) continue;
    const auto first = world.bodyOfId.find(pair.first), second = world.bodyOfId.find(pair.second);
    if (first == world.bodyOfId.end() || second == world.bodyOfId.end()) continue;
    const Body &a = world.bodies[first->second], &b = world.bodies[second->second];
    const double up = standing(world, contact, a, b);
    const Body &below = up > 0 ? a : b, &above = up > 0 ? b : a;
    const bool carries = up != 0 && above.spec->kind == BodyKind::rigid && !above.left;
    if (carries) supports.emplace_back(below.id, above.id);
  }
  std::ranges::sort(supports);
  return supports;
}

Company companyOf(WorldState& world, const Body& body, const Supports& supports) {
  Company company{loadsOf(world, body, supports), avatarsNear(world, body), {}};
  Vec3 at;
  for (Avatar* avatar : company.near)
    if (avatar->grounded && standsOn(world, body, *avatar, at))
      company.riders.push_back({avatar, inBody(body, at), false});
  const std::size_t direct = company.riders.size();
  for (Load& load : company.loads) {
    const Body& loaded = world.bodies[load.index];
    load.near = avatarsNear(world, loaded);
    for (Avatar* avatar : load.near) {
      if (!avatar->grounded || avatar->standsOn != loaded.id) continue;
      const auto end = company.riders.begin() + static_cast<std::ptrdiff_t>(direct);
      if (std::find_if(company.riders.begin(), end,
                       [&](const Rider& rider) { return rider.avatar == avatar; }) == end)
        company.riders.push_back({avatar, inBody(body, avatar->feet), true});
    }
  }
  std::erase_if(company.loads, [](const Load& load) { return load.near.empty(); });
  return company;
}

}  // namespace enfilade::scene
