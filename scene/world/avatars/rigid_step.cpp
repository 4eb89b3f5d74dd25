#include "scene/world/avatars/rigid_step.hpp"

#include "collision/motion/shape_cast.hpp"
#include "scene/world/contacts/dense_obstacles.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

collision::MotionResult castPart(const AvatarPart& part, const Vec3& footPosition,
                                 const RigidStep& step, double delta,
                                 const collision::PlacedConvex& other,
                                 const collision::ContactOffset& contactOffset,
                                 collision::FeatureCache& cache) {
  const collision::PlacedConvex placed = placeAvatarPart(part, footPosition);
  if (step.isRotation)
    return collision::castShape(placed, collision::AxisRotation{step.pivot, step.axis, delta},
                                other, contactOffset, cache);
  return collision::castShape(placed, delta * step.axis, other, contactOffset, cache);
}

/// One cast of a step, and its earliest hit so far.
struct StepCaster {
  Avatar& avatar;
  const RigidStep& step;
  QueryCount& count;
  collision::ContactOffset contactOffset;
  RigidStepHit hit = {};

  bool moves(std::size_t part) const { return (step.movedParts >> part & 1) != 0; }

  bool reaches(const AvatarPart& part, const Aabb& box) const {
    const double margin = step.maxDisplacement * hit.fraction + contactOffset.rest;
    return overlaps(inflate(placeBox(part.box, avatar.footPosition), margin), box);
  }

  void castAgainst(std::size_t part, const Aabb& otherBox, EntityId entity,
                   const collision::PlacedConvex& other, collision::FeatureCache& cache) {
    const AvatarPart& movedPart = avatar.shape->parts[part];
    if (!reaches(movedPart, otherBox)) return;
    const auto result = castPart(movedPart, avatar.footPosition, step, hit.fraction * step.delta,
                                 other, contactOffset, cache);
    count.add(result);
    const double fraction = hit.fraction * result.lo;
    if (result.isClear() || (hit.entity != 0 && fraction >= hit.fraction)) return;
    hit = {fraction, entity, result.separation};
  }

  /// The part may turn, so no planes are kept.
  void castAgainst(std::size_t part, const DenseObject& object) {
    const auto inReach = [&](const Aabb& box) {
      return hit.fraction > 0 && reaches(avatar.shape->parts[part], box);
    };
    const Aabb partBox = placeBox(avatar.shape->parts[part].box, avatar.footPosition);
    descendParts(*object.geometry, computeCore(partBox), inReach, [&](std::uint32_t i) {
      ++count.partsLookedAt;
      const DensePair pair{object.entity, i, static_cast<std::uint32_t>(part)};
      const Aabb box = object.geometry->box(i);
      if (inReach(box))
        castAgainst(part, box, object.entity, object.geometry->convex(i),
                    avatar.obstacles.denseCaches[pair]);
    });
  }

  /// True if the link and the part are joined, and therefore touch. The base's parts are adjacent
  /// to the links without a parent.
  bool isAdjacent(std::size_t link, std::size_t otherPart) const {
    const Chain& chain = avatar.chain;
    if (otherPart < avatar.baseParts.size()) return chain.links[link].parent < 0;
    const auto other = static_cast<std::int32_t>(otherPart - avatar.baseParts.size());
    return chain.links[link].parent == other ||
           chain.links[static_cast<std::size_t>(other)].parent == static_cast<std::int32_t>(link);
  }

  void castAgainstSelf(std::size_t part) {
    if (part < avatar.baseParts.size()) return;  // then all parts move
    const auto& parts = avatar.shape->parts;
    for (std::size_t other = 0; other < parts.size(); ++other) {
      if (moves(other) || isAdjacent(part - avatar.baseParts.size(), other)) continue;
      collision::FeatureCache emptyCache;
      castAgainst(part, placeBox(parts[other].box, avatar.footPosition), avatar.id,
                  placeAvatarPart(parts[other], avatar.footPosition), emptyCache);
    }
  }

  void castPartAgainstAll(std::size_t part) {
    for (Obstacle& obstacle : avatar.obstacles.list) {
      castAgainst(part, obstacle.box, obstacle.entity, obstacle.convex, obstacle.cacheFor(part));
      if (hit.fraction == 0) return;
    }
    for (const DenseObject& object : avatar.obstacles.dense) {
      castAgainst(part, object);
      if (hit.fraction == 0) return;
    }
    if (avatar.chain.selfContact) castAgainstSelf(part);
  }
};

}  // namespace

bool mayHit(const Avatar& avatar, const Aabb& reach) {
  if (avatar.chain.selfContact) return true;
  for (const Obstacle& obstacle : avatar.obstacles.list)
    if (overlaps(reach, obstacle.box)) return true;
  bool found = false;
  for (const DenseObject& object : avatar.obstacles.dense)
    descendParts(
        *object.geometry, reach, [&](const Aabb& box) { return !found && overlaps(reach, box); },
        [&](std::uint32_t) { found = true; });
  return found;
}

RigidStepHit castRigidStep(const WorldSettings& settings, Avatar& avatar, const RigidStep& step,
                           QueryCount& count) {
  StepCaster caster{avatar, step, count, makeContactOffset(settings)};
  for (std::size_t part = 0; part < avatar.shape->parts.size(); ++part) {
    if (caster.moves(part)) caster.castPartAgainstAll(part);
    if (caster.hit.fraction == 0) break;
  }
  return caster.hit;
}

void recordStepHit(Avatar& avatar, const RigidStepHit& hit) {
  if (hit.entity == 0 || avatar.blockedBy != 0) return;
  avatar.blockedBy = hit.entity;
  avatar.blockingHit = hit.separation;
}

}  // namespace enfilade::scene
