// The parts of a dense object that a query of an avatar's part needs. The cost follows what is near
// the avatar's surface. A plane that separates the avatar from a branch of the tree discards all
// parts in it.
#pragma once

#include "collision/motion/separating_planes.hpp"
#include "scene/world/data/obstacle.hpp"
#include "scene/world/data/tick_report.hpp"

namespace enfilade::scene {

using DenseCaches = std::map<DensePair, collision::FeatureCache>;

/// The middle of a part, a segment along its longest axis. Its nearest branches are visited first.
inline Aabb computeCore(const Aabb& partBox) {
  const Vec3 half = 0.5 * partBox.size();
  const Vec3 core = (half.array() - std::min({half.x(), half.y(), half.z()})).matrix();
  return {partBox.centre() - core, partBox.centre() + core};
}

/// Calls query(PlacedConvex, FeatureCache&) for each part of `object` whose box is `inReach`, near
/// ones first. Parts that `planes` prove to be missed by the avatar's part, whose box is `partBox`,
/// are left out. `query` may shorten the reach. The axes that it leaves in the caches become
/// planes.
template <class InReach, class Query>
void forEachNearPart(const DenseObject& object, std::uint32_t avatarPart, const Aabb& partBox,
                     collision::SeparatingPlanes& planes, const InReach& inReach,
                     DenseCaches& caches, QueryCount& count, const Query& query) {
  descendParts(
      *object.geometry, computeCore(partBox),
      [&](const Aabb& branch) { return inReach(branch) && !planes.haveMissed(branch); },
      [&](std::uint32_t part) {
        ++count.partsLookedAt;
        const Aabb box = object.geometry->box(part);
        if (!inReach(box)) return;
        const collision::PlacedConvex convex = object.geometry->convex(part);
        if (planes.haveMissed(convex, box)) return;
        collision::FeatureCache& cache = caches[{object.entity, part, avatarPart}];
        if (planes.tryAxis(convex, box, cache.axis)) return;
        query(convex, cache);
        planes.tryAxis(convex, box, cache.axis);
      });
}

}  // namespace enfilade::scene
