// Contacts of avatars and static objects by brute force: every part of every object, cold, by the
// exact comparison.
#pragma once

#include <algorithm>
#include <vector>

#include "collision/narrow_phase/refine.hpp"
#include "scene/world/active_contacts.hpp"
#include "scene/world/contacts/contact_events.hpp"

namespace enfilade::scene::testing {

/// True if any part of the static object is closer to the avatar than `limit` (metres).
inline bool isObjectCloser(const Scene& scene, std::uint32_t object, const AvatarSnapshot& avatar,
                           double limit) {
  const CollisionGeometry& geometry = scene.collisionGeometry(object);
  for (const AvatarPart& part : avatar.shape->parts) {
    const collision::PlacedConvex body = placeAvatarPart(part, avatar.footPosition);
    const Aabb box = inflate(placeBox(part.box, avatar.footPosition), 2 * limit);
    for (std::uint32_t i = 0; i < geometry.size(); ++i) {
      collision::FeatureCache cold;
      if (overlaps(box, geometry.box(i)) &&
          collision::isCloserThan(body, geometry.convex(i), limit, cold))
        return true;
    }
  }
  return false;
}

struct ContactComparison {
  std::size_t expected = 0;   ///< contacts by brute force
  std::size_t different = 0;  ///< reported and not expected, or the reverse
};

/// Compares the world's contacts of avatars and static objects with brute force.
inline ContactComparison compareStaticContacts(const World& world) {
  std::vector<EntityPair> reported, expected, different;
  for (const ContactEvent& event : collectActiveContacts(world))
    if (event.kind == ContactEvent::Kind::begin && event.b <= world.scene().model().objects.size())
      reported.emplace_back(event.a, event.b);
  const double limit = computeContactDistances(world.settings()).contact;
  for (const AvatarSnapshot& avatar : world.snapshot()->avatars)
    for (const std::uint32_t object : world.scene().solidObjects())
      if (isObjectCloser(world.scene(), object, avatar, limit))
        expected.emplace_back(avatar.id, object + 1);
  std::sort(reported.begin(), reported.end());
  std::sort(expected.begin(), expected.end());
  std::set_symmetric_difference(reported.begin(), reported.end(), expected.begin(), expected.end(),
                                std::back_inserter(different));
  return {expected.size(), different.size()};
}

}  // namespace enfilade::scene::testing
