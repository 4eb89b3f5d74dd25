// One tick of a driven chain. The joints move one after the other, starting at the base. Each joint
// moves its link and all descendants as one rigid body: a revolute joint by a rotational shape cast
// (collision/motion/shape_cast.hpp), a prismatic joint by a linear one. Each stops about
// one contact offset before an obstacle; the following joints still move.
#include "scene/world/avatars/joint_motion.hpp"

#include <algorithm>
#include <cmath>

#include "collision/motion/shape_cast.hpp"
#include "scene/world/contacts/dense_obstacles.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinProgressFraction = 1e-6;  // of a joint's step: minimum that counts as progress

/// The requested motion of one joint in this tick, scene frame.
struct JointStep {
  std::size_t joint = 0;
  double delta = 0;  ///< radians or metres
  bool isRevolute = false;
  Vec3 pivot = Vec3::Zero();
  Vec3 axis = Vec3::UnitY();
  double maxDisplacement = 0;  ///< metres: bound on the displacement of any point in the step
};

/// The earliest hit of a step so far.
struct StepHit {
  double fraction = 1;
  EntityId entity = 0;
  collision::SeparationResult separation;
};

collision::ShapeCastResult castPart(const AvatarPart& part, const Vec3& footPosition,
                                    const JointStep& step, double delta,
                                    const collision::PlacedConvex& other,
                                    const collision::ContactOffset& contactOffset,
                                    collision::FeatureCache& cache) {
  const collision::PlacedConvex placed = placeAvatarPart(part, footPosition);
  if (step.isRevolute)
    return collision::castShape(placed, collision::AxisRotation{step.pivot, step.axis, delta},
                                other, contactOffset, cache);
  return collision::castShape(placed, delta * step.axis, other, contactOffset, cache);
}

struct JointMover {
  Avatar& avatar;
  QueryCount& count;
  collision::ContactOffset contactOffset;

  std::size_t basePartCount() const { return avatar.baseParts.size(); }

  bool reaches(const AvatarPart& part, const JointStep& step, const StepHit& hit,
               const Aabb& box) const {
    const double margin = step.maxDisplacement * hit.fraction + contactOffset.rest;
    return overlaps(inflated(placeBox(part.box, avatar.footPosition), margin), box);
  }

  void castAgainst(std::size_t part, const JointStep& step, const Aabb& otherBox, EntityId entity,
                   const collision::PlacedConvex& other, collision::FeatureCache& cache,
                   StepHit& hit) {
    const AvatarPart& movedPart = avatar.shape->parts[part];
    if (!reaches(movedPart, step, hit, otherBox)) return;
    const auto result = castPart(movedPart, avatar.footPosition, step, hit.fraction * step.delta,
                                 other, contactOffset, cache);
    count.add(result);
    const double fraction = hit.fraction * result.fraction;
    if (!result.stopped || (hit.entity != 0 && fraction >= hit.fraction)) return;
    hit = {fraction, entity, result.separationAtStop};
  }

  /// The link may turn, so no planes are kept.
  void castAgainst(std::size_t part, const JointStep& step, const DenseObject& object,
                   StepHit& hit) {
    const auto inReach = [&](const Aabb& box) {
      return hit.fraction > 0 && reaches(avatar.shape->parts[part], step, hit, box);
    };
    const Aabb partBox = placeBox(avatar.shape->parts[part].box, avatar.footPosition);
    descendParts(*object.geometry, computeCore(partBox), inReach, [&](std::uint32_t i) {
      ++count.partsLookedAt;
      const DensePair pair{object.entity, i, static_cast<std::uint32_t>(part)};
      const Aabb box = object.geometry->box(i);
      if (inReach(box))
        castAgainst(part, step, box, object.entity, object.geometry->convex(i),
                    avatar.obstacles.denseCaches[pair], hit);
    });
  }

  /// True if the link and the part are joined, and therefore touch. The base's parts are adjacent
  /// to the links without a parent.
  bool isAdjacent(std::size_t link, std::size_t otherPart) const {
    const Chain& chain = avatar.chain;
    if (otherPart < basePartCount()) return chain.links[link].parent < 0;
    const auto other = static_cast<std::int32_t>(otherPart - basePartCount());
    return chain.links[link].parent == other ||
           chain.links[static_cast<std::size_t>(other)].parent == static_cast<std::int32_t>(link);
  }

  void castAgainstSelf(std::size_t link, const JointStep& step, StepHit& hit) {
    const auto& parts = avatar.shape->parts;
    for (std::size_t other = 0; other < parts.size(); ++other) {
      const bool isCarried = other >= basePartCount() &&
                             doesJointMoveLink(avatar.chain, step.joint, other - basePartCount());
      if (isCarried || isAdjacent(link, other)) continue;
      collision::FeatureCache emptyCache;
      castAgainst(basePartCount() + link, step, placeBox(parts[other].box, avatar.footPosition),
                  avatar.id, placeAvatarPart(parts[other], avatar.footPosition), emptyCache, hit);
    }
  }

  StepHit castStep(const JointStep& step) {
    StepHit hit;
    for (std::size_t link = step.joint; link < avatar.chain.links.size(); ++link) {
      if (!doesJointMoveLink(avatar.chain, step.joint, link)) continue;
      const std::size_t part = basePartCount() + link;
      for (Obstacle& obstacle : avatar.obstacles.list) {
        castAgainst(part, step, obstacle.box, obstacle.entity, obstacle.convex,
                    obstacle.cacheFor(part), hit);
        if (hit.fraction == 0) return hit;
      }
      for (const DenseObject& object : avatar.obstacles.dense) {
        castAgainst(part, step, object, hit);
        if (hit.fraction == 0) return hit;
      }
      if (avatar.chain.selfContact) castAgainstSelf(link, step, hit);
    }
    return hit;
  }
};

JointStep makeJointStep(const Avatar& avatar, const LinkPose& pose, std::size_t joint,
                        double delta) {
  const ChainLink& link = avatar.chain.links[joint];
  JointStep step;
  step.joint = joint;
  step.delta = delta;
  step.isRevolute = link.joint.kind == LinkJoint::Kind::revolute;
  step.pivot = avatar.footPosition + pose.origin;
  step.axis = pose.axis;
  step.maxDisplacement = std::abs(delta) * (step.isRevolute ? link.maxRadius : 1);
  return step;
}

/// Moves one joint by `delta`, or up to the first hit. Returns whether it made progress.
bool moveJoint(JointMover& mover, std::size_t joint, double delta) {
  Avatar& avatar = mover.avatar;
  ChainLink& link = avatar.chain.links[joint];
  const StepHit hit =
      mover.castStep(makeJointStep(avatar, computeLinkPoses(avatar.chain)[joint], joint, delta));
  link.blockedBy = hit.entity;
  if (hit.entity != 0 && avatar.blockedBy == 0) {
    avatar.blockedBy = hit.entity;
    avatar.blockingHit = hit.separation;
  }
  const double before = link.value;
  const bool reachesTarget = hit.fraction == 1 && before + delta == link.target;
  link.value = reachesTarget ? link.target : before + hit.fraction * delta;
  if (link.value == before) return false;
  avatar.shape = makeChainShape(avatar.baseParts, avatar.chain);
  return hit.fraction > kMinProgressFraction;
}

}  // namespace

void moveJoints(const WorldData& world, Avatar& avatar, QueryCount& count) {
  JointMover mover{avatar, count, makeContactOffset(world.settings)};
  Chain& chain = avatar.chain;
  const double maxDelta = chain.speed * world.settings.tickDuration;
  bool moved = false;
  for (std::size_t i = 0; i < chain.links.size(); ++i) {
    const double remaining = chain.links[i].target - chain.links[i].value;
    if (remaining == 0) continue;
    const double delta = std::max(-maxDelta, std::min(maxDelta, remaining));
    if (moveJoint(mover, i, delta)) moved = true;
  }
  chain.timeoutLeft =
      moved ? world.settings.stuckTimeout : chain.timeoutLeft - world.settings.tickDuration;
}

}  // namespace enfilade::scene
