// Rigid bodies in the tick. Before the broad phase, each awake body gets its motion bounds. After
// the avatars, the solver moves the bodies among everything inside these bounds:
//  - static objects, as triangles.
//  - other rigid bodies, with sleeping ones that may be woken and the bodies in contact with them.
//  - kinematic bodies, which have moved already, as driven from their previous pose.
//  - avatars, which have moved already: they are fixed, and push with their desired velocity.
// A body does not leave its motion bounds in a tick, because no obstacles are known beyond them.
#include "scene/world/bodies/step_dynamic_bodies.hpp"

#include <algorithm>

#include "collision/floating_point.hpp"
#include "scene/physics/physics_step.hpp"
#include "scene/world/bodies/body_state.hpp"
#include "scene/world/bodies/candidate_pairs.hpp"
#include "scene/world/bodies/physics_bodies.hpp"
#include "scene/world/contacts/contact_events.hpp"

namespace enfilade::scene {
namespace {

/// Displacement that a body may gain in a tick by impulses, beyond its own velocity: metres, and
/// fraction of its radius; the smaller applies.
constexpr double kExtraMotion = 0.1, kExtraMotionPerRadius = 0.3;
/// Margin of the box in the broad phase, so that it moves less often: metres, and fraction of the
/// radius; the smaller applies.
constexpr double kAabbMargin = 0.02, kAabbMarginPerRadius = 0.4;
constexpr double kMaxDepthBelowScene = 50;    // metres: lower bodies are out of the world
constexpr double kMaxDistanceOutside = 1000;  // metres beyond the other sides

StepSettings makeStepSettings(const WorldSettings& settings) {
  StepSettings stepSettings;
  stepSettings.solver.seconds = settings.tickDuration;
  stepSettings.solver.substeps = kSolverSubsteps;
  stepSettings.solver.gravity = {0, -settings.gravity, 0};
  stepSettings.solver.contactOffset = settings.contactOffset;
  return stepSettings;
}

/// Sets the pose of a kinematic body's physics body. The solver reaches it only up to rounding.
void setKinematicPose(PhysicsBody& physicsBody, const Vec3& position,
                      const collision::Quat& orientation) {
  if (physicsBody.motion.centre == position &&
      physicsBody.motion.rotation.coeffs() == orientation.coeffs())
    return;
  const Vec3 positionBefore = physicsBody.position;
  const Mat3 rotationBefore = physicsBody.rotation;
  physicsBody.motion.centre = position;
  physicsBody.motion.rotation = orientation;
  updateTransform(physicsBody);
  physicsBody.teleportedDistance +=
      collision::kRoundUpFactor *
      ((physicsBody.position - positionBefore).norm() +
       (physicsBody.rotation - rotationBefore).norm() * physicsBody.radius);
}

/// Velocity in each substep of a body on a path; empty: constant velocity.
std::vector<SubstepVelocity> computeSubstepVelocities(const Body& body, double tick) {
  std::vector<SubstepVelocity> velocities;
  const KinematicTarget& target = body.kinematicTarget;
  if (target.segments != kSolverSubsteps || !body.moved) return velocities;
  const double seconds = tick / kSolverSubsteps;
  for (std::size_t i = 0; i < kSolverSubsteps; ++i) {
    const JointPose &from = target.keyPoses[i], &to = target.keyPoses[i + 1];
    velocities.push_back(
        {(to.offset - from.offset) / seconds, (to.angle - from.angle) / seconds * body.spec->axis});
  }
  return velocities;
}

/// Kinematic bodies have moved already: sets their physics bodies to the previous pose, with the
/// velocity to the current one.
void startKinematicMotion(WorldData& world) {
  for (const std::uint32_t i : world.kinematicBodies) {
    const Body& body = world.bodies[i];
    if (world.dynamicBodies.physicsBodyOf[i] == kNoBody) continue;
    PhysicsBody& physicsBody = findPhysicsBody(world.dynamicBodies, i);
    setKinematicPose(physicsBody, body.previousPosition, body.previousOrientation);
    physicsBody.motion.velocity = body.velocity;
    physicsBody.motion.angularVelocity = body.angularVelocity;
    physicsBody.substepVelocities = computeSubstepVelocities(body, world.settings.tickDuration);
  }
}

/// Sets the physics bodies of kinematic bodies to the current poses, bit for bit.
void finishKinematicMotion(WorldData& world) {
  for (const std::uint32_t i : world.kinematicBodies) {
    const Body& body = world.bodies[i];
    if (world.dynamicBodies.physicsBodyOf[i] == kNoBody) continue;
    setKinematicPose(findPhysicsBody(world.dynamicBodies, i), body.position, body.orientation);
  }
}

void readBackPose(Body& body, const PhysicsBody& physicsBody) {
  body.moved = physicsBody.position != body.position ||
               physicsBody.motion.rotation.coeffs() != body.orientation.coeffs();
  if (body.moved) setBodyPose(body, physicsBody.motion.centre, physicsBody.motion.rotation);
  body.velocity = physicsBody.motion.velocity;
  body.angularVelocity = physicsBody.motion.angularVelocity;
  body.asleep = physicsBody.asleep;
}

std::vector<std::pair<EntityId, EntityId>> collectAvatarBodyPairs(const WorldData& world) {
  std::vector<std::pair<EntityId, EntityId>> pairs;
  if (world.avatars.empty()) return pairs;
  const DynamicBodies& dynamicBodies = world.dynamicBodies;
  for (const BodyPair& pair :
       dynamicBodies.physicsWorld.pairs)  // the rigid body is key.a, the avatar key.b
    if (pair.gaveImpulse && dynamicBodies.entities[pair.key.b] >= world.firstAvatarId())
      pairs.emplace_back(dynamicBodies.entities[pair.key.b], dynamicBodies.entities[pair.key.a]);
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

bool isOutOfWorld(const WorldData& world, const Body& body) {
  const Aabb& bounds = world.scene->bounds();
  const Aabb within{
      bounds.min - Vec3(kMaxDistanceOutside, kMaxDepthBelowScene, kMaxDistanceOutside),
      bounds.max + Vec3::Constant(kMaxDistanceOutside)};
  return !contains(within, Aabb{body.position, body.position});
}

/// Freezes a body that is out of the world, and reports it.
void removeFromSimulation(WorldData& world, Body& body, PhysicsBody& physicsBody,
                          TickReport& report) {
  body.outOfWorld = true;
  body.asleep = physicsBody.asleep = true;
  body.velocity = body.angularVelocity = physicsBody.motion.velocity =
      physicsBody.motion.angularVelocity = Vec3::Zero();
  physicsBody.motion.inverseMass = 0;
  Contact contact;
  contact.separation.pointA = contact.separation.pointB = body.position;
  report.contacts.push_back(
      makeContactEvent(world, ContactEvent::Kind::leftWorld, body.id, contact));
}

/// Bound on the distance that kinematic bodies push or carry each rigid body in this tick, metres,
/// directly or through other rigid bodies.
std::vector<double> computeKinematicPushBounds(const WorldData& world) {
  const std::vector<std::uint32_t>& bodyIndices = world.dynamicBodies.bodyIndices;
  std::vector<double> pushBounds(bodyIndices.size(), 0);
  if (world.movingBodies.empty()) return pushBounds;
  std::vector<Aabb> boxes;
  std::vector<std::size_t> unpushed, pending;
  for (std::size_t k = 0; k < bodyIndices.size(); ++k) {
    boxes.push_back(world.bodies[bodyIndices[k]].boxes.whole);
    for (const std::uint32_t i : world.movingBodies)
      if (overlaps(world.bodies[i].motionBounds, boxes[k]))
        pushBounds[k] = std::max(pushBounds[k], world.bodies[i].kinematicTarget.maxDisplacement);
    (pushBounds[k] > 0 ? pending : unpushed).push_back(k);
  }
  while (!pending.empty() && !unpushed.empty()) {
    const std::size_t pusher = pending.back();
    pending.pop_back();
    const Aabb within =
        inflate(boxes[pusher], pushBounds[pusher] + computeContactQueryMargin(world.settings));
    std::erase_if(unpushed, [&](std::size_t k) {
      if (!overlaps(within, boxes[k])) return false;
      pushBounds[k] = pushBounds[pusher];
      pending.push_back(k);
      return true;
    });
  }
  return pushBounds;
}

}  // namespace

void initDynamicBodies(WorldData& world) {
  DynamicBodies& dynamicBodies = world.dynamicBodies;
  dynamicBodies.physicsBodyOf.assign(world.bodies.size(), kNoBody);
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i) {
    Body& body = world.bodies[i];
    if (!isDynamic(body.spec->kind)) continue;
    body.asleep = false;
    body.velocity = body.spec->velocity, body.angularVelocity = body.spec->angularVelocity;
    dynamicBodies.bodyIndices.push_back(i);
    ensureSceneBody(world, i);
  }
}

void planDynamicMotion(WorldData& world) {
  const double margin = computeContactQueryMargin(world.settings),
               tick = world.settings.tickDuration;
  const std::vector<double> pushBounds = computeKinematicPushBounds(world);
  for (std::size_t k = 0; k < pushBounds.size(); ++k) {
    const std::uint32_t i = world.dynamicBodies.bodyIndices[k];
    Body& body = world.bodies[i];
    PhysicsBody& physicsBody = findPhysicsBody(world.dynamicBodies, i);
    const double pushBound = pushBounds[k];
    body.kinematicPushBound = pushBound;
    // Pairs closer than twice the contact offset are checked in any case.
    physicsBody.pushSpeedBound = std::max(
        0.0, (pushBound - 2 * world.settings.contactOffset) / tick - physicsBody.maxPointSpeed());
    const bool isStationary = body.asleep && pushBound == 0;
    if (isStationary && !body.moved && physicsBody.maxStepDisplacement == margin)
      continue;  // unchanged
    body.moved = false;
    const double fallDistance = world.settings.gravity * tick * tick;
    const double extraMotion = std::min(kExtraMotion, kExtraMotionPerRadius * physicsBody.radius);
    physicsBody.maxStepDisplacement =
        isStationary
            ? margin
            : physicsBody.maxPointSpeed() * tick + fallDistance + std::max(pushBound, extraMotion);
    const Aabb required = inflate(body.boxes.whole, physicsBody.maxStepDisplacement + margin);
    if (!isStationary && contains(body.motionBounds, required)) continue;
    body.motionBounds =
        inflate(required, std::min(kAabbMargin, kAabbMarginPerRadius * physicsBody.radius));
    world.broadPhase.move(body.proxy, body.motionBounds);
  }
}

void stepDynamicBodies(WorldData& world, TickReport& report, QueryCount& count) {
  DynamicBodies& dynamicBodies = world.dynamicBodies;
  dynamicBodies.avatarBodyPairs.clear();
  for (const std::uint32_t i : dynamicBodies.bodyIndices) world.bodies[i].pendingLift = 0;
  if (dynamicBodies.bodyIndices.empty()) return;
  for (const Avatar& avatar : world.avatars)
    if (!avatar.lastDisplacement.isZero(0) || changesShape(avatar))
      wakeTouchingBodies(world, avatar);
  dynamicBodies.activeBodies = collectActiveBodies(world);
  if (dynamicBodies.activeBodies.empty()) return;
  ThreadPool* threadPool =
      acquireThreadPool(world.threads, dynamicBodies.activeBodies.size(), kMinParallelBodies);
  collectPairs(world, threadPool);
  startKinematicMotion(world);
  StepSettings stepSettings = makeStepSettings(world.settings);
  stepSettings.pool = threadPool;
  dynamicBodies.lastReport = stepPhysics(dynamicBodies.physicsWorld, stepSettings);
  finishKinematicMotion(world);
  dynamicBodies.avatarBodyPairs = collectAvatarBodyPairs(world);
  count.narrow +=
      dynamicBodies.lastReport.narrowPhaseQueries + dynamicBodies.lastReport.continuousChecks;
  report.crushedBodies = dynamicBodies.lastReport.crushed;
  parallelForOrSerial(threadPool, dynamicBodies.activeBodies.size(), kBodiesPerTask,
                      [&](std::size_t from, std::size_t to) {
                        for (std::size_t k = from; k < to; ++k) {
                          const std::uint32_t i = dynamicBodies.activeBodies[k];
                          Body& body = world.bodies[i];
                          if (body.outOfWorld) continue;
                          readBackPose(body, findPhysicsBody(dynamicBodies, i));
                          updatePartBoxes(world, body);
                        }
                      });
  for (const std::uint32_t i : dynamicBodies.activeBodies) {
    Body& body = world.bodies[i];
    if (!body.outOfWorld && isOutOfWorld(world, body))
      removeFromSimulation(world, body, findPhysicsBody(dynamicBodies, i), report);
  }
}

}  // namespace enfilade::scene
