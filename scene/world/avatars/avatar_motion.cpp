// Motion of an avatar in one tick: a character controller with collide and slide.
//  - On the ground it slides along up to kMaxSlidePlanes planes, steps up or down by at most
//    WorldSettings::stepHeight, and otherwise falls.
//  - Each segment of the motion is a shape cast, so that no obstacle is crossed at any speed. It
//    ends one contact offset before the obstacle.
//  - The motion stays inside the motion bounds in the broad phase. A slide that would leave them,
//    as after a fast fall onto a steep roof, continues in the next tick.
//  - WorldSettings::sliding decides whether the displacement after a hit slides or is discarded.
//  - A flying avatar moves in all directions, without ground or gravity.
#include "scene/world/avatars/avatar_motion.hpp"

#include <algorithm>
#include <cmath>

#include "scene/world/avatars/joint_motion.hpp"
#include "scene/world/avatars/turning.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMaxSlidePlanes = 5;  // planes hit in one move: a corner of three, and two more
constexpr double kMinMoveFraction = 1e-9;  // of the contact offset: shorter remainders are dropped
constexpr double kMinStepDepth =
    0.05;                              // metres: a shallower ledge, as a skirting board, is no step
constexpr double kMinStepGain = 1e-3;  // of the desired length: minimum gain of a step

/// The motion of one avatar in one tick.
struct AvatarMover {
  const WorldSettings& settings;
  Avatar& avatar;
  QueryCount& count;
  Vec3 footPosition;
  Aabb allowedFootBounds;  ///< keeps the avatar inside Avatar::motionBounds

  collision::ContactOffset contactOffset() const { return makeContactOffset(settings); }
  bool isWalkable(const Vec3& normal) const { return normal.y() >= settings.walkableNormalY; }
};

struct SlideResult {
  ShapeCastHit blockingHit;  ///< first hit on a non-walkable surface, if any
  EntityId ground = 0;       ///< last entity hit with a walkable surface
};

ShapeCastHit castFrom(AvatarMover& m, const Vec3& displacement) {
  const double allowedFraction =
      computeClipFraction(m.allowedFootBounds, m.footPosition, displacement);
  const Vec3 allowed = allowedFraction * displacement;
  ShapeCastHit hit = castAvatarShape(*m.avatar.shape, m.footPosition, allowed, m.avatar.obstacles,
                                     m.contactOffset(), m.count);
  m.footPosition += hit.fraction * allowed;
  hit.fraction *= allowedFraction;
  return hit;
}

/// Projects `desired` so that it enters no plane. The result is on one plane if it suits all
/// others, else on the crease of two planes, else zero.
Vec3 projectOntoPlanes(const Vec3& desired, const std::vector<Vec3>& normals) {
  const auto isAllowed = [&](const Vec3& move) {
    for (const Vec3& n : normals)
      if (move.dot(n) < -1e-12 * desired.norm()) return false;
    return true;
  };
  for (std::size_t i = normals.size(); i-- > 0;) {
    const Vec3 move = desired - std::min(0.0, desired.dot(normals[i])) * normals[i];
    if (isAllowed(move)) return move;
  }
  for (std::size_t i = normals.size(); i-- > 0;) {
    for (std::size_t j = i; j-- > 0;) {
      const Vec3 crease = normals[i].cross(normals[j]);
      const double squared = crease.squaredNorm();
      if (!(squared > 1e-12)) continue;
      const Vec3 move = (desired.dot(crease) / squared) * crease;
      if (isAllowed(move)) return move;
    }
  }
  return Vec3::Zero();
}

/// Plane that a walking avatar collides with. Non-walkable and overhanging surfaces act as vertical
/// walls, so that it does not climb or duck.
Vec3 makeWalkingPlane(const AvatarMover& m, const Vec3& normal) {
  if (m.isWalkable(normal)) return normal;
  const Vec3 upright{normal.x(), 0, normal.z()};
  const double length = upright.norm();
  return length > 1e-6 ? Vec3(upright / length) : normal;
}

/// Response of a move to a hit.
enum class MoveMode : std::uint8_t {
  walk,  ///< up walkable slopes; non-walkable surfaces act as vertical walls
  drop,  ///< straight down to a walkable surface, sliding off others
  fall,  ///< as drop, but the horizontal remainder continues
  fly    ///< no surface counts as ground
};

/// Remaining displacement after a hit on a walkable plane.
Vec3 clipOnGround(const Vec3& remainder, MoveMode mode) {
  switch (mode) {
    case MoveMode::walk:
      return remainder;
    case MoveMode::drop:
      return Vec3::Zero();
    default:
      return {remainder.x(), 0, remainder.z()};
  }
}

/// Remaining displacement after a hit on a non-walkable plane. A fall continues under any policy.
Vec3 clipOnNonWalkable(const Vec3& remainder, MoveMode mode, Sliding sliding) {
  if (sliding == Sliding::slide || mode == MoveMode::drop) return remainder;
  return mode == MoveMode::fall ? Vec3(0, std::min(0.0, remainder.y()), 0) : Vec3(Vec3::Zero());
}

/// True if a move up a non-walkable surface is a climb: the avatar falls, but has ceased to sink.
bool isClimbInFall(const AvatarMover& m, const Vec3& remainder, const Vec3& move, MoveMode mode) {
  return mode == MoveMode::fall && remainder.y() <= 0 && m.avatar.lastDisplacement.y() >= 0 &&
         move.y() > kMinMoveFraction * m.settings.contactOffset;
}

/// Collide and slide by `desired`. Projects the remaining *desired* displacement onto the planes,
/// not the clipped one; otherwise an avatar in a notch oscillates.
SlideResult collideAndSlide(AvatarMover& m, const Vec3& desired, MoveMode mode) {
  SlideResult result;
  std::vector<Vec3> planes;
  const double minMove = kMinMoveFraction * m.settings.contactOffset;
  Vec3 remainder = desired, move = desired;
  for (int i = 0; i < kMaxSlidePlanes && move.norm() > minMove; ++i) {
    const ShapeCastHit hit = castFrom(m, move);
    if (hit.entity == 0) break;
    remainder *= 1 - hit.fraction;
    if (mode != MoveMode::fly && m.isWalkable(hit.normal)) {
      result.ground = hit.entity;
      remainder = clipOnGround(remainder, mode);
    } else {
      if (result.blockingHit.entity == 0) result.blockingHit = hit;
      remainder = clipOnNonWalkable(remainder, mode, m.settings.sliding);
    }
    planes.push_back(mode == MoveMode::walk ? makeWalkingPlane(m, hit.normal) : hit.normal);
    move = projectOntoPlanes(remainder, planes);
    if (isClimbInFall(m, remainder, move, mode)) {
      planes.back() = makeWalkingPlane(m, hit.normal);
      move = projectOntoPlanes(remainder, planes);
    }
    // Restore the contact offset where grazing moves came closer.
    move += std::max(0.0, m.settings.contactOffset - hit.distance) * planes.back();
  }
  return result;
}

/// Moves down by at most `depth` onto a walkable surface and returns its entity. Returns 0 and does
/// not move without one.
EntityId snapToGround(AvatarMover& m, double depth) {
  const Vec3 before = m.footPosition;
  const EntityId ground = collideAndSlide(m, {0, -depth, 0}, MoveMode::drop).ground;
  if (ground == 0) m.footPosition = before;
  return ground;
}

double computeProgress(const Vec3& from, const Vec3& to, const Vec3& direction) {
  return (to - from).dot(direction);
}

/// True if a walk can continue by half of kMinStepDepth beyond `gained`. Restores the feet.
bool hasStepDepth(AvatarMover& m, const Vec3& direction, double gained) {
  const Vec3 before = m.footPosition;
  collideAndSlide(m, (gained + kMinStepDepth) * direction, MoveMode::walk);
  const double progress = computeProgress(before, m.footPosition, direction);
  m.footPosition = before;
  return progress > gained + 0.5 * kMinStepDepth;
}

/// Height to lift the feet for a step, metres. A prism slides up the rest of the step on its bevel.
double computeStepLift(const AvatarMover& m) {
  const Avatar& avatar = m.avatar;
  const bool isPrism = avatar.spawnHeight > 0;
  return m.settings.stepHeight -
         (isPrism ? computeBevelHeight(avatar.radius, avatar.spawnHeight, m.settings) : 0);
}

/// Tries the move one step higher. Returns true if it gains distance and ends on a walkable
/// surface; otherwise restores the feet.
bool tryStepUp(AvatarMover& m, const Vec3& start, const Vec3& desired, double minProgress) {
  const Vec3 low = m.footPosition;
  m.footPosition = start;
  castFrom(m, {0, computeStepLift(m), 0});
  const double raised = m.footPosition.y() - start.y();
  const double length = desired.norm();
  if (hasStepDepth(m, desired / length, minProgress)) {
    collideAndSlide(m, desired, MoveMode::walk);
    if (snapToGround(m, raised + m.settings.contactOffset) != 0 &&
        computeProgress(start, m.footPosition, desired / length) >
            minProgress + kMinStepGain * length)
      return true;
  }
  m.footPosition = low;
  return false;
}

void recordBlockingHit(Avatar& avatar, const ShapeCastHit& hit) {
  avatar.blockedBy = hit.entity;
  avatar.blockingHit = hit.separation;
}

void setGround(Avatar& avatar, EntityId ground) {
  avatar.groundEntity = ground;
  avatar.grounded = ground != 0;
}

void moveOnGround(AvatarMover& m, const Vec3& desired) {
  const Vec3 start = m.footPosition;
  const double length = desired.norm();
  ShapeCastHit blockingHit;
  if (length > 0) {
    blockingHit = collideAndSlide(m, desired, MoveMode::walk).blockingHit;
    const double progress = computeProgress(start, m.footPosition, desired / length);
    if (blockingHit.entity != 0 && tryStepUp(m, start, desired, progress)) blockingHit = {};
  }
  setGround(m.avatar, snapToGround(m, m.settings.stepHeight));
  m.avatar.fallSpeed = 0;
  recordBlockingHit(m.avatar, blockingHit);
}

/// Fall speed after a tick with `requested` and `actual` downward displacement, metres. An obstacle
/// below a falling avatar, or above a rising one, reduces it.
double computeFallSpeed(double speed, double requested, double actual, double tick) {
  constexpr double kMinFallFraction = 0.99;  // of the displacement: less is more than rounding
  const bool isBlocked =
      requested > 0 ? actual < kMinFallFraction * requested : actual > kMinFallFraction * requested;
  if (!isBlocked) return speed;
  return speed > 0 ? std::min(speed, std::max(0.0, actual / tick)) : 0;
}

/// Falls, or rises after a jump: each tick ends exactly on the parabola.
void moveFalling(AvatarMover& m, const Vec3& desired) {
  const WorldSettings& settings = m.settings;
  const double before = m.avatar.fallSpeed;
  const double after =
      std::min(before + settings.gravity * settings.tickDuration, settings.maxSpeed);
  const double down = 0.5 * (before + after) * settings.tickDuration;
  const double height = m.footPosition.y();
  const SlideResult result = collideAndSlide(m, desired - Vec3(0, down, 0), MoveMode::fall);
  recordBlockingHit(m.avatar, result.blockingHit);
  setGround(m.avatar, result.ground);
  const double actual = height - m.footPosition.y();
  m.avatar.fallSpeed =
      m.avatar.grounded ? 0 : computeFallSpeed(after, down, actual, settings.tickDuration);
}

void moveFlying(AvatarMover& m, const Vec3& desired) {
  m.avatar.fallSpeed = 0;
  setGround(m.avatar, 0);
  recordBlockingHit(m.avatar, collideAndSlide(m, desired, MoveMode::fly).blockingHit);
}

}  // namespace

Aabb computeMotionBounds(const WorldSettings& settings, const Avatar& avatar) {
  const double across = avatar.desiredVelocity.norm() * settings.tickDuration + kMinStepDepth +
                        computeMaxChainDisplacement(avatar.chain, settings.tickDuration) +
                        computeMaxTurnDisplacement(settings, avatar);
  const double down = (std::abs(avatar.fallSpeed) + settings.gravity * settings.tickDuration) *
                      settings.tickDuration;
  // Room for restoring the contact offset, and for the search of contacts and near misses.
  const double margin = 8 * settings.contactOffset + settings.nearMissDistance;
  Aabb box = placeBox(avatar.shape->box, avatar.footPosition);
  box.min -= Vec3(across, across + std::max(settings.stepHeight, down), across);
  box.max += Vec3(across, across + std::max(settings.stepHeight, down), across);
  return inflate(box, margin);
}

void moveAvatar(const WorldData& world, Avatar& avatar, QueryCount& count) {
  AvatarMover m{world.settings, avatar, count, avatar.footPosition,
                computeAvatarFootBounds(world.settings, avatar)};
  const Vec3 desired = avatar.desiredVelocity * world.settings.tickDuration;
  if (avatar.flying) {
    moveFlying(m, desired);
  } else if (avatar.grounded) {
    moveOnGround(m, desired);
  } else {
    moveFalling(m, desired);
  }
  avatar.requestedDisplacement = desired;
  avatar.lastDisplacement = m.footPosition - avatar.footPosition;
  avatar.footPosition = m.footPosition;
  avatar.dirty = false;
  if (avatar.turn.left != 0) turnAvatar(world.settings, avatar, count);
  if (avatar.chain.speed > 0) moveJoints(world, avatar, count);
  if (avatar.blockedBy != 0) avatar.lastStoppedTick = world.tick;
}

}  // namespace enfilade::scene
