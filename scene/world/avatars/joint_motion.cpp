// One tick of a driven chain. The joints move one after the other, from the base on. Each takes
// with it all links that hang on it, as one: a revolute joint turns them about its axis, swept by
// collision/motion/rotational_shape_cast.hpp, a prismatic one shifts them. Each ends about epsilon
// away from what stopped it; the joints beyond go on.
#include <algorithm>
#include <cmath>

#include "collision/motion/rotational_shape_cast.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

constexpr double kWorthTelling = 1e-6;  // of a joint's step: less is no progress

/// How one joint wants to move, in the world.
struct JointStep {
  std::size_t joint = 0;
  double by = 0;  ///< radians or metres
  bool turns = false;
  Vec3 pivot = Vec3::Zero();
  Vec3 axis = Vec3::UnitY();
  double reach = 0;  ///< metres that no point moves farther than, for the whole step
};

/// What stopped a step so far.
struct StepStop {
  double fraction = 1;
  EntityId entity = 0;
  collision::Decision decision;
};

collision::SweepResult sweepPart(const AvatarPart& part, const Vec3& feet, const JointStep& step,
                                 double by, const collision::ConvexBody& other,
                                 const collision::StoppingBand& band,
                                 collision::FeatureCache& cache) {
  const collision::ConvexBody body = bodyAt(part, feet);
  if (step.turns)
    return collision::sweepTurning(body, {step.pivot, step.axis, by}, other, band, cache);
  return collision::sweep(body, by * step.axis, other, band, cache);
}

struct JointMover {
  Avatar& avatar;
  QueryCount& count;
  collision::StoppingBand band;

  std::size_t baseParts() const { return avatar.base.size(); }

  void meet(std::size_t part, const JointStep& step, const Box& otherBox, EntityId entity,
            const collision::ConvexBody& other, collision::FeatureCache& cache, StepStop& stop) {
    const AvatarPart& moved = avatar.shape->parts[part];
    const double far = step.reach * stop.fraction + band.high;
    if (!overlaps(grown(boxAt(moved.box, avatar.feet), far), otherBox)) return;
    const auto swept =
        sweepPart(moved, avatar.feet, step, stop.fraction * step.by, other, band, cache);
    count.narrow += swept.queries;
    count.rational += swept.rationals;
    count.bounded += swept.boundReached ? 1 : 0;
    const double fraction = stop.fraction * swept.fraction;
    if (!swept.stopped || (stop.entity != 0 && fraction >= stop.fraction)) return;
    stop = {fraction, entity, swept.atStop};
  }

  /// Links that hang on one another touch where they are joined; the base's parts are its first
  /// links' neighbours.
  bool mayTouchItself(std::size_t link, std::size_t otherPart) const {
    const Chain& chain = avatar.chain;
    if (otherPart < baseParts()) return chain.links[link].parent < 0;
    const auto other = static_cast<std::int32_t>(otherPart - baseParts());
    return chain.links[link].parent == other ||
           chain.links[static_cast<std::size_t>(other)].parent == static_cast<std::int32_t>(link);
  }

  void meetItself(std::size_t link, const JointStep& step, StepStop& stop) {
    const auto& parts = avatar.shape->parts;
    for (std::size_t other = 0; other < parts.size(); ++other) {
      const bool goesAlong =
          other >= baseParts() && moves(avatar.chain, step.joint, other - baseParts());
      if (goesAlong || mayTouchItself(link, other)) continue;
      collision::FeatureCache none;
      meet(baseParts() + link, step, boxAt(parts[other].box, avatar.feet), avatar.id,
           bodyAt(parts[other], avatar.feet), none, stop);
    }
  }

  StepStop sweep(const JointStep& step) {
    StepStop stop;
    for (std::size_t link = step.joint; link < avatar.chain.links.size(); ++link) {
      if (!moves(avatar.chain, step.joint, link)) continue;
      const std::size_t part = baseParts() + link;
      for (Obstacle& obstacle : avatar.obstacles) {
        meet(part, step, obstacle.box, obstacle.entity, obstacle.body, obstacle.cacheOf(part),
             stop);
        if (stop.fraction == 0) return stop;
      }
      if (avatar.chain.selfContact) meetItself(link, step, stop);
    }
    return stop;
  }
};

JointStep stepOf(const Avatar& avatar, const LinkPose& pose, std::size_t joint, double by) {
  const ChainLink& link = avatar.chain.links[joint];
  JointStep step;
  step.joint = joint;
  step.by = by;
  step.turns = link.joint.kind == LinkJoint::Kind::revolute;
  step.pivot = avatar.feet + pose.origin;
  step.axis = pose.axis;
  step.reach = std::abs(by) * (step.turns ? link.reach : 1);
  return step;
}

/// Moves one joint by `by` as far as it goes; whether it went anywhere.
bool moveJoint(JointMover& mover, std::size_t joint, double by) {
  Avatar& avatar = mover.avatar;
  ChainLink& link = avatar.chain.links[joint];
  const StepStop stop = mover.sweep(stepOf(avatar, posesOf(avatar.chain)[joint], joint, by));
  link.stoppedBy = stop.entity;
  if (stop.entity != 0 && avatar.stoppedBy == 0) {
    avatar.stoppedBy = stop.entity;
    avatar.atStop = stop.decision;
  }
  const double before = link.value;
  const bool whole = stop.fraction == 1 && before + by == link.target;
  link.value = whole ? link.target : before + stop.fraction * by;
  if (link.value == before) return false;
  avatar.shape = shapeWith(avatar.base, avatar.chain);
  return stop.fraction > kWorthTelling;
}

}  // namespace

void moveJoints(WorldState& world, Avatar& avatar, QueryCount& count) {
  JointMover mover{avatar, count, bandOf(world.lengths)};
  Chain& chain = avatar.chain;
  const double most = chain.speed * world.lengths.tick;
  bool went = false;
  for (std::size_t i = 0; i < chain.links.size(); ++i) {
    chain.links[i].stoppedBy = 0;
    const double left = chain.links[i].target - chain.links[i].value;
    if (left == 0) continue;
    const double by = std::max(-most, std::min(most, left));
    if (moveJoint(mover, i, by)) went = true;
  }
  chain.patienceLeft = went ? world.lengths.patience : chain.patienceLeft - world.lengths.tick;
}

}  // namespace enfilade::scene
