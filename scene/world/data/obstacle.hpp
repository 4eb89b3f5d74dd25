// A convex part that is in the way of an avatar, and the memory of the last query against it.
#pragma once

#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/world/data/body.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// A convex part of an entity, and the last tick's separating axis towards it.
struct Obstacle {
  EntityId entity = 0;
  std::uint32_t part = 0;  ///< of a static object (see CollisionGeometry), a body or an avatar
  std::uint32_t bodyIndex = kNoBody;  ///< index into WorldData::bodies
  Aabb box;                           ///< scene frame, metres
  collision::PlacedConvex convex;
  collision::FeatureCache cache;                    ///< for the avatar's first part
  std::vector<collision::FeatureCache> moreCaches;  ///< for its other parts, from their first query
                                                    ///< on

  collision::FeatureCache& cacheFor(std::size_t avatarPart) {
    if (avatarPart == 0) return cache;
    if (moreCaches.size() < avatarPart) moreCaches.resize(avatarPart);
    return moreCaches[avatarPart - 1];
  }
};

}  // namespace enfilade::scene
