// ObstacleSet: the obstacles of an avatar, with the caches of the last queries against them.
#pragma once

#include <algorithm>
#include <compare>
#include <map>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/model/shapes/collision_geometry.hpp"
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

/// A static object of more than kMaxListedParts parts. They are not listed: its trees find those
/// that a query needs.
struct DenseObject {
  EntityId entity = 0;
  const CollisionGeometry* geometry = nullptr;
};

/// A part of a dense object, and a part of the avatar.
struct DensePair {
  EntityId entity = 0;
  std::uint32_t part = 0;
  std::uint32_t avatarPart = 0;
  auto operator<=>(const DensePair&) const = default;
};

struct ObstacleSet {
  std::vector<Obstacle> list;                                ///< ascending (entity, part)
  std::vector<DenseObject> dense;                            ///< ascending entity
  std::map<DensePair, collision::FeatureCache> denseCaches;  ///< of pairs that were close

  /// Null if the entity is not a dense object of this set.
  const DenseObject* findDense(EntityId entity) const {
    const auto at = std::ranges::lower_bound(dense, entity, {}, &DenseObject::entity);
    return at != dense.end() && at->entity == entity ? &*at : nullptr;
  }
};

}  // namespace enfilade::scene
