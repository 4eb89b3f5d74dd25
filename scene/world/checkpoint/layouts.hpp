// Checkpoint layouts of the world's types. A member that is in a binding but not in `a(...)` is
// recomputed when a world is read, or before its next use; a comment says which.
#pragma once

#include "scene/world/checkpoint/order_layouts.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

template <>
inline constexpr auto kMaxEnumerator<collision::Verdict> = collision::Verdict::penetrating;
template <>
inline constexpr auto kMaxEnumerator<collision::Certificate> = collision::Certificate::rational;
template <>
inline constexpr auto kMaxEnumerator<collision::Feature> = collision::Feature::face;
template <>
inline constexpr auto kMaxEnumerator<PairCache::NormalSource> = PairCache::NormalSource::faceB;
template <>
inline constexpr auto kMaxEnumerator<Sliding> = Sliding::stop;

// ---- collision ---------------------------------------------------------------------------------

template <class A>
void archiveMembers(A& a, MaybeConst<A, collision::VertexPair>& pair) {
  auto& [vertexA, vertexB] = pair;
  a(vertexA, vertexB);
}

/// Most caches belong to obstacles that were never close; these hold no features.
template <class A>
void archiveMembers(A& a, MaybeConst<A, collision::FeatureCache>& cache) {
  auto& [pairs, size, axis] = cache;
  bool known = false;
  if constexpr (A::kWrites)
    known = size != 0 || !axis.isZero(0) || pairs != collision::FeatureCache{}.pairs;
  a(known);
  if (!known) return;
  a(pairs, size, axis);
  if constexpr (!A::kWrites)
    if (size < 0 || size > 4) a.refuse("a feature cache has " + std::to_string(size) + " pairs");
}

template <class A>
void archiveMembers(A& a, MaybeConst<A, collision::SeparationResult>& separation) {
  auto& [verdict, certificate, featureA, featureB, distance, errorBound, pointA, pointB, normal] =
      separation;
  a(verdict, certificate, featureA, featureB, distance, errorBound, pointA, pointB, normal);
}

template <class A>
void archiveMembers(A& a, MaybeConst<A, collision::DepthCache>& cache) {
  auto& [vertices, facets] = cache;
  a(vertices, facets);
  if constexpr (!A::kWrites)
    for (const auto& facet : facets)
      for (const std::uint16_t corner : facet)
        if (corner >= vertices.size()) a.refuse("a facet has an unknown corner");
}

// ---- settings ----------------------------------------------------------------------------------

template <class A>
void archiveMembers(A& a, MaybeConst<A, WorldSettings>& settings) {
  auto& [contactOffset, stepHeight, nearMissDistance, walkableNormalY, gravity, maxSpeed,
         maxPushForce, tickDuration, stuckTimeout, maxJumpHeight, maxJointSpeed, sliding] =
      settings;
  a(contactOffset, stepHeight, nearMissDistance, walkableNormalY, gravity, maxSpeed, maxPushForce,
    tickDuration, stuckTimeout, maxJumpHeight, maxJointSpeed, sliding);
}

// ---- avatars -----------------------------------------------------------------------------------

template <class A>
void archiveMembers(A& a, MaybeConst<A, Contact>& contact) {
  auto& [other, touching, separation, penetration, nearMissReported, closest, closestTick] =
      contact;
  a(other, touching, separation, penetration, nearMissReported);
  if (nearMissReported) a(closest, closestTick);  // only for a near miss
}

template <class A>
void archiveMembers(A& a, MaybeConst<A, WalkProgress>& walk) {
  auto& [waypointIndex, minDistance, timeoutLeft, calls, waitsFor, yields, flowTick] = walk;
  a(waypointIndex, minDistance, timeoutLeft, calls, waitsFor, yields, flowTick);
}

/// `box` and `convex` follow from the current poses, `bodyIndex` from `entity`.
template <class A>
void archiveMembers(A& a, MaybeConst<A, Obstacle>& obstacle) {
  auto& [entity, part, bodyIndex, box, convex, cache, moreCaches] = obstacle;
  a(entity, part, cache, moreCaches);
}

/// `geometry` follows from `entity`.
template <class A>
void archiveMembers(A& a, MaybeConst<A, DenseObject>& object) {
  auto& [entity, geometry] = object;
  a(entity);
}

template <class A>
void archiveMembers(A& a, MaybeConst<A, DensePair>& pair) {
  auto& [entity, part, avatarPart] = pair;
  a(entity, part, avatarPart);
}

template <class A>
void archiveMembers(A& a, MaybeConst<A, ObstacleSet>& set) {
  auto& [list, dense, denseCaches] = set;
  a(list, dense, denseCaches);
}

/// `parent`, `joint`, `turning` and `maxRadius` follow from the spawn order.
template <class A>
void archiveMembers(A& a, MaybeConst<A, ChainLink>& link) {
  auto& [parent, joint, turning, maxRadius, value, target, blockedBy] = link;
  a(value, target, blockedBy);
}

/// The links, `avatarFromBase` and `selfContact` already exist: they follow from the spawn order.
template <class A>
void archiveMembers(A& a, MaybeConst<A, Chain>& chain) {
  auto& [links, avatarFromBase, selfContact, speed, timeoutLeft] = chain;
  for (auto& link : links) a(link);
  a(speed, timeoutLeft);
}

template <class A>
void archiveMembers(A& a, MaybeConst<A, TurnProgress>& turn) {
  auto& [heading, left, rate, timeoutLeft, blockedBy] = turn;
  a(heading, left, rate, timeoutLeft, blockedBy);
}

/// Computes shape, base and chain of an avatar from the members that were read. Throws
/// CheckpointError if no order can have created it (checkpoint_validation.cpp).
void restoreAvatarShape(const Reader& a, Avatar& avatar);

/// `desiredVelocity` follows from the orders at the start of the next tick.
template <class A>
void archiveMembers(A& a, MaybeConst<A, Avatar>& avatar) {
  auto& [name, id, shape, spawnOrder, footPosition, viewDirection, eyeHeight, fallSpeed, grounded,
         groundEntity, flying, jumping, spawnHeight, height, radius, turningParts, baseParts, chain,
         facing, turn, viewHeld, teleports, driveVelocity, desiredVelocity, walk, waitTimeLeft,
         stalledInAirTime, lastDisplacement, requestedDisplacement, idle, dirty, blockedBy,
         lastStoppedTick, pairsChanged, blockingHit, blockedReported, proxy, motionBounds,
         cachedBounds, obstacles, work, boxWork, hasBodyObstacles, contacts] = avatar;
  a(name, spawnOrder, spawnHeight, height, radius, facing);
  if constexpr (!A::kWrites) restoreAvatarShape(a, avatar);  // also `turningParts` and `baseParts`
  a(chain);
  if constexpr (!A::kWrites)
    if (!chain.links.empty()) shape = makeChainShape(baseParts, chain, boxWork);
  a(id, footPosition, viewDirection, eyeHeight, fallSpeed, grounded, groundEntity, flying, jumping,
    turn, viewHeld, teleports, driveVelocity, walk, waitTimeLeft, stalledInAirTime,
    lastDisplacement, requestedDisplacement, idle, dirty, blockedBy, lastStoppedTick, pairsChanged,
    blockingHit, blockedReported, proxy, motionBounds, cachedBounds, obstacles, hasBodyObstacles,
    contacts);
}

// ---- bodies ------------------------------------------------------------------------------------

template <class A>
void archiveMembers(A& a, MaybeConst<A, JointPose>& pose) {
  auto& [offset, angle] = pose;
  a(offset, angle);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, KinematicDrive>& drive) {
  auto& [pose, jointPosition, jointVelocity, target, speed, moving, autoCloseIn] = drive;
  a(pose, jointPosition, jointVelocity, target, speed, moving, autoCloseIn);
}
/// The key poses are planned before their next use; only the values in the snapshot are written.
template <class A>
void archiveMembers(A& a, MaybeConst<A, KinematicTarget>& target) {
  auto& [segments, keyPoses, jointPosition, maxDisplacement, velocityDeviation] = target;
  a(maxDisplacement, velocityDeviation);
}
/// `id`, `spec`, `shape` and `proxy` are as in any world of the scene; `rotation`, `isRotated` and
/// `boxes` follow from the pose. The previous pose is set before use.
template <class A>
void archiveMembers(A& a, MaybeConst<A, Body>& body) {
  auto& [id, spec, shape, position, orientation, rotation, isRotated, boxes, previousPosition,
         previousOrientation, velocity, angularVelocity, asleep, moved, kinematicPushBound,
         pendingLift, outOfWorld, blockedBy, drive, kinematicTarget, proxy, motionBounds,
         occupants] = body;
  a(position, orientation);
  if constexpr (!A::kWrites) setBodyPose(body, position, orientation);
  a(velocity, angularVelocity, asleep, moved, outOfWorld, blockedBy, drive, kinematicTarget,
    motionBounds, occupants);
}

// ---- dynamic bodies ----------------------------------------------------------------------------

template <class A>
void archiveMembers(A& a, MaybeConst<A, PartPairKey>& key) {
  auto& [bodyA, bodyB, partA, partB] = key;
  a(bodyA, bodyB, partA, partB);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, ContactConstraintPoint>& point) {
  auto& [armA, armB, separation, impulse, motorImpulse] = point;
  a(armA, armB, separation, impulse, motorImpulse);
}
/// The body indices are set by the solver.
template <class A>
void archiveMembers(A& a, MaybeConst<A, ContactConstraint>& constraint) {
  auto& [bodyA, bodyB, normal, friction, restitution, points, pointCount, tangentImpulse,
         torsionImpulse, targetSpeed, maxPushForce, gaveImpulse] = constraint;
  a(normal, friction, restitution, pointCount, tangentImpulse, torsionImpulse, targetSpeed,
    maxPushForce);
  if constexpr (!A::kWrites)
    if (pointCount > points.size())
      a.refuse("a contact has " + std::to_string(pointCount) + " points");
  for (std::size_t i = 0; i < pointCount; ++i) a(points[i]);
}
/// The pair writes constraint and anchors: they are valid only if it has a constraint.
template <class A>
void archiveMembers(A& a, MaybeConst<A, PairCache>& cache) {
  auto& [features, depth, penetration, constraint, anchors, normalSource] = cache;
  a(features, depth, penetration, normalSource);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, BodyPair>& pair) {
  auto& [key, lowerBound, teleportedAtBound, separatingAxis, verdict, cache, hasConstraint, touched,
         reported, gaveImpulse] = pair;
  a(key, lowerBound, teleportedAtBound, separatingAxis, verdict, cache, hasConstraint, touched,
    reported);
  if constexpr (!A::kWrites)
    if (!cache && (hasConstraint || verdict == collision::Verdict::penetrating))
      a.refuse("a pair of physics bodies lacks its contact data");
  if (!hasConstraint) return;
  a(cache->constraint);
  for (std::size_t i = 0; i < cache->constraint.pointCount; ++i) a(cache->anchors[i]);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, SubstepVelocity>& substepVelocity) {
  auto& [velocity, angularVelocity] = substepVelocity;
  a(velocity, angularVelocity);
}
/// Inertia, friction and restitution are those of the body; the physics body writes whether it is
/// dynamic.
template <class A>
void archiveMembers(A& a, MaybeConst<A, BodyMotion>& motion) {
  auto& [centre, rotation, velocity, angularVelocity, inverseMass, inertia, inverseInertia,
         friction, restitution] = motion;
  a(centre, rotation, velocity, angularVelocity);
}
/// `hull`, `centreInFrame`, `parts`, `mesh` and `radius` are the shape, which is assigned before.
template <class A>
void archiveMembers(A& a, MaybeConst<A, PhysicsBody>& body) {
  auto& [hull, motion, centreInFrame, parts, mesh, radius, asleep, sleepTimer, restCentre,
         restRotation, targetVelocity, maxPushForce, maxStepDisplacement, substepVelocities,
         pushSpeedBound, preventsSleep, rotation, position, accumulatedMotion, teleportedDistance] =
      body;
  bool isFree = body.isDynamic();  // false for a body that left the world
  a(motion, isFree, asleep, sleepTimer, restCentre, restRotation, targetVelocity, maxPushForce);
  if constexpr (!A::kWrites)
    if (!isFree) motion.inverseMass = 0;
  archiveExtended(a, maxStepDisplacement);
  a(substepVelocities, preventsSleep, rotation, position, accumulatedMotion, teleportedDistance);
}

}  // namespace enfilade::scene
