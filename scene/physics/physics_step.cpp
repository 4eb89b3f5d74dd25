// Steps
//  1. Update the pairs of awake bodies (body_pair.hpp). A body that hits or pushes a sleeping one,
//     or parts from it, wakes it, and its pairs are then updated too.
//  2. Solve the awake bodies and all that they may touch (solver.hpp).
//  3. Prove every pair that could touch on its way clear
//     (collision/motion/interpolated_motion.hpp). Where that fails, the dynamic bodies move only as
//     far as proved, at reduced velocity. Their other pairs are then checked again, until no body
//     needs to be reduced. This ends: a body moves less far each time, and after a few passes not
//     at all. If no part of a body's motion was certified, depenetrate it once. An island that
//     touches one kinematic body and no other obstacle, such as parts in a tray, moves at least
//     with it.
//  4. Bodies that were at rest for a while fall asleep. A body that leaves its place wakes those
//     that touched it.
#include "scene/physics/physics_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "collision/assert.hpp"
#include "scene/base/disjoint_sets.hpp"
#include "scene/physics/continuous_collision.hpp"
#include "scene/physics/step_scratch.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kPrefetchDistance = 4;  // pairs

PairStepSettings makePairStepSettings(const StepSettings& settings) {
  return {settings.solver.seconds, settings.solver.gravity, settings.solver.contactOffset};
}

bool isRelevantPair(const SpeedBound& a, const SpeedBound& b) {
  return a.isAwake || b.isAwake || (a.isActuated && b.isDynamic) || (b.isActuated && a.isDynamic);
}

bool isAsleep(const PhysicsBody& body) {
  return body.isDynamic() && body.asleep;
}

/// Seconds at rest until a body loses its velocity at each step, which ends the jostling of a heap.
double computeSettledTime(const StepSettings& settings) {
  return settings.sleep.timeToSleep / 2;
}

void wakeBody(PhysicsBody& body, double sleepTimer) {
  body.asleep = false;
  body.sleepTimer = sleepTimer;
}

// ---- step 1 ------------------------------------------------------------------------------------

/// Bound of the displacement in metres that a point can reach along `direction` (unit) in the step
/// at the present velocities.
double computeMaxAdvance(const PhysicsBody& body, const Vec3& arm, const Vec3& direction,
                         double seconds) {
  if (body.asleep) return 0;
  const auto& mean = body.motion;
  const Vec3 velocity = mean.velocity + mean.angularVelocity.cross(arm) + body.targetVelocity;
  double maxAdvance = std::max(body.pushSpeedBound, direction.dot(velocity)) * seconds,
         displacement = 0;
  for (const SubstepVelocity& substepVelocity : body.substepVelocities) {
    displacement +=
        direction.dot(substepVelocity.velocity + substepVelocity.angularVelocity.cross(arm)) *
        seconds / static_cast<double>(body.substepVelocities.size());
    maxAdvance = std::max(maxAdvance, displacement);
  }
  return maxAdvance;
}

/// Whether it moves or is moved without regard to what it touches.
bool isPushing(const PhysicsBody& body) {
  return body.isActuated() || body.pushSpeedBound > 0;
}

/// Whether the body that sleeps must wake: the other one pushes it, or can hit it within the step.
bool wakesSleeper(const BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b,
                  const PairStepSettings& step) {
  constexpr double kMinHitSpeed = 0.05;  // m/s; a sleeping body stops what is slower
  const double minAdvance = isPushing(a) || isPushing(b) ? 0 : kMinHitSpeed * step.seconds;
  const ContactConstraint& constraint = *pair.constraint();
  for (const ContactConstraintPoint& point : constraint.activePoints()) {
    const double advance = computeMaxAdvance(a, point.armA, constraint.normal, step.seconds) +
                           computeMaxAdvance(b, point.armB, -constraint.normal, step.seconds);
    if (advance >= minAdvance && point.separation < 2 * step.contactOffset + advance) return true;
  }
  return false;
}

/// Computes speed bounds of all bodies, relative to the mean velocity of the awake ones.
void computeSpeedBounds(const PhysicsWorld& world, StepScratch& scratch) {
  Vec3 sum = Vec3::Zero();
  double awake = 0;
  for (const PhysicsBody& body : world.bodies)
    if (body.isAwake()) sum += body.motion.velocity, ++awake;
  const Vec3 mean = awake > 0 ? Vec3(sum / awake) : sum;
  scratch.speedBounds.clear();
  for (const PhysicsBody& body : world.bodies)
    scratch.speedBounds.push_back(computeSpeedBound(body, mean));
}

/// Updates a pair and changes nothing else. Returns its flags.
std::uint8_t evaluatePair(const PhysicsWorld& world, const StepScratch& scratch, BodyPair& pair,
                          const PairStepSettings& step) {
  const SpeedBound &speedA = scratch.speedBounds[pair.key.a],
                   &speedB = scratch.speedBounds[pair.key.b];
  if (!isRelevantPair(speedA, speedB)) return 0;
  std::uint8_t flags = StepScratch::kActive;
  const PhysicsBody &a = world.bodies[pair.key.a], &b = world.bodies[pair.key.b];
  if (isCertifiedFar(pair, speedA, speedB, step)) {
    pair.hasConstraint = false;
  } else if (updatePair(pair, a, b, step)) {
    flags |= StepScratch::kQueried;
  }
  if (pair.penetration() > 0) flags |= StepScratch::kPenetrates;
  const bool touched = pair.touched, sleeper = isAsleep(a) || isAsleep(b);
  pair.touched = isTouching(pair, step.contactOffset);
  if (sleeper && touched && !pair.touched) flags |= StepScratch::kParted;
  if (!pair.hasConstraint) return flags;
  flags |= StepScratch::kConstrained;
  if (pair.touched) flags |= StepScratch::kTouching;
  if (sleeper && wakesSleeper(pair, a, b, step)) flags |= StepScratch::kWakes;
  return flags;
}

/// Accumulates the flags of an update pass. Returns whether a body woke.
bool applyPairFlags(PhysicsWorld& world, const BodyPair& pair, std::uint8_t& flags,
                    double settledTime, StepScratch& scratch) {
  if ((flags & StepScratch::kQueried) != 0) ++scratch.report.narrowPhaseQueries;
  if ((flags & StepScratch::kPenetrates) != 0)
    scratch.report.maxPenetration = std::max(scratch.report.maxPenetration, pair.penetration());
  const bool wakes = (flags & StepScratch::kWakes) != 0,
             parted = (flags & StepScratch::kParted) != 0;
  flags &= StepScratch::kActive | StepScratch::kTouching | StepScratch::kConstrained;
  PhysicsBody &a = world.bodies[pair.key.a], &b = world.bodies[pair.key.b];
  PhysicsBody& sleeper = isAsleep(a) ? a : b;
  if ((!wakes && !parted) || !isAsleep(sleeper)) return false;
  wakeBody(sleeper, wakes ? 0 : settledTime);
  return true;
}

/// Prefetches the cache of a pair with a constraint. The caches are scattered in memory.
void prefetchPair(const BodyPair& pair) {
  if (!pair.hasConstraint) return;
  const auto* bytes = reinterpret_cast<const char*>(pair.cache.get());
  for (std::size_t i = 0; i < sizeof(PairCache); i += 64) __builtin_prefetch(bytes + i);
}

void findConstraints(PhysicsWorld& world, const PairStepSettings& step, double settledTime,
                     StepScratch& scratch) {
  std::vector<BodyPair>& pairs = world.pairs;
  scratch.pairFlags.assign(pairs.size(), 0);
  std::vector<std::uint8_t> isNew(pairs.size(), 1);
  // Each pass but the last wakes a body.
  for (std::size_t pass = 0; pass <= world.bodies.size(); ++pass) {
    computeSpeedBounds(world, scratch);
    scratch.pool->parallelFor(pairs.size(), kPairsPerTask, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        if (i + kPrefetchDistance < to) prefetchPair(pairs[i + kPrefetchDistance]);
        if (isNew[i]) scratch.pairFlags[i] = evaluatePair(world, scratch, pairs[i], step);
      }
    });
    bool woken = false;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (!isNew[i] || scratch.pairFlags[i] == 0) continue;
      isNew[i] = 0;
      woken = applyPairFlags(world, pairs[i], scratch.pairFlags[i], settledTime, scratch) || woken;
    }
    if (!woken) break;
  }
  for (std::uint32_t i = 0; i < pairs.size(); ++i) {
    if (scratch.pairFlags[i] == 0) continue;
    scratch.activePairs.push_back(i);
    if ((scratch.pairFlags[i] & StepScratch::kConstrained) != 0)
      scratch.constrainedPairs.push_back(i);
  }
}

// ---- step 2 ------------------------------------------------------------------------------------

void addBody(const PhysicsWorld& world, std::uint32_t body, StepScratch& scratch) {
  ENFILADE_ASSERT(body < world.bodies.size());
  if (scratch.localIndices[body] != kNoIndex) return;
  scratch.localIndices[body] = static_cast<std::uint32_t>(scratch.motions.size());
  scratch.bodyIndices.push_back(body);
  scratch.motions.push_back(world.bodies[body].motion);
  const PhysicsBody& source = world.bodies[body];
  if (!source.isDynamic() && !source.substepVelocities.empty())
    scratch.kinematicBodies.push_back({scratch.localIndices[body], source.substepVelocities});
  BodyMotion& motion = scratch.motions.back();
  if (!world.bodies[body].asleep) return;
  motion.inverseMass = 0;  // asleep: static for the solver
  motion.velocity = motion.angularVelocity = Vec3::Zero();
}

void gatherBodies(const PhysicsWorld& world, StepScratch& scratch) {
  scratch.localIndices.assign(world.bodies.size(), kNoIndex);
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i)
    if (world.bodies[i].isAwake()) addBody(world, i, scratch);
  scratch.report.awake = static_cast<std::uint32_t>(scratch.motions.size());
  scratch.pairBodies.reserve(scratch.activePairs.size());
  for (const std::uint32_t i : scratch.activePairs) {
    const PartPairKey& key = world.pairs[i].key;
    addBody(world, key.a, scratch);
    addBody(world, key.b, scratch);
    scratch.pairBodies.push_back({scratch.localIndices[key.a], scratch.localIndices[key.b]});
  }
}

void gatherConstraints(const PhysicsWorld& world, StepScratch& scratch) {
  scratch.constraints.resize(scratch.constrainedPairs.size());
  scratch.pool->parallelFor(
      scratch.constrainedPairs.size(), kPairsPerTask, [&](std::size_t from, std::size_t to) {
        for (std::size_t k = from; k < to; ++k) {
          const BodyPair& pair = world.pairs[scratch.constrainedPairs[k]];
          ENFILADE_ASSERT(pair.constraint() && pair.constraint()->pointCount > 0);
          scratch.constraints[k] = *pair.constraint();
          scratch.constraints[k].a = scratch.localIndices[pair.key.a];
          scratch.constraints[k].b = scratch.localIndices[pair.key.b];
        }
      });
  for (const std::uint32_t i : scratch.constrainedPairs)
    if (scratch.isTouchingPair(i)) ++scratch.report.touching;
  scratch.report.constraints = static_cast<std::uint32_t>(scratch.constraints.size());
}

void findKinematicPenetrations(const PhysicsWorld& world, StepScratch& scratch) {
  scratch.released.assign(scratch.motions.size(), 0);
  for (std::uint32_t k = 0; k < scratch.constrainedPairs.size(); ++k) {
    const BodyPair& pair = world.pairs[scratch.constrainedPairs[k]];
    const PhysicsBody &a = world.bodies[pair.key.a], &b = world.bodies[pair.key.b];
    if (!penetratesKinematic(pair, a, b)) continue;
    scratch.kinematicPenetrations.push_back(k);
    const ContactConstraint& constraint = scratch.constraints[k];
    if (isReleased(pair, a, b)) scratch.released[a.isDynamic() ? constraint.a : constraint.b] = 1;
  }
}

/// Metres by which the points of a constraint approach on the swept poses; < 0: they separate.
double computeApproach(const ContactConstraint& constraint, const StepScratch& scratch) {
  const auto computeDisplacement = [&](std::uint32_t body, const Vec3& arm) -> Vec3 {
    const collision::InterpolatedMotion& sweep = scratch.sweptMotions[body];
    const Vec3 inFrame = sweep.fromFrame.rotation.transpose() * arm;
    return sweep.to.centre - sweep.from.centre +
           (sweep.toFrame.rotation - sweep.fromFrame.rotation) * inFrame;
  };
  double maxApproach = -std::numeric_limits<double>::infinity();
  for (const ContactConstraintPoint& point : constraint.activePoints()) {
    const Vec3 approach = computeDisplacement(constraint.a, point.armA) -
                          computeDisplacement(constraint.b, point.armB);
    maxApproach = std::max(maxApproach, constraint.normal.dot(approach));
  }
  return maxApproach;
}

/// Flags bodies whose impulses must not warm-start the next step: a kinematic body moves deeper
/// into them or their contacts. Between two unyielding bodies impulses grow without bound. Stored,
/// they would eject a body that comes free.
std::vector<std::uint8_t> findColdStarts(const PhysicsWorld& world, const StepScratch& scratch) {
  const auto isAwake = [&](std::uint32_t i) {
    return world.bodies[scratch.bodyIndices[i]].isAwake();
  };
  std::vector<std::uint8_t> cold(scratch.motions.size(), 0);
  for (const std::uint32_t k : scratch.kinematicPenetrations) {
    const ContactConstraint& constraint = scratch.constraints[k];
    if (computeApproach(constraint, scratch) > 0)
      cold[isAwake(constraint.a) ? constraint.a : constraint.b] = 1;
  }
  if (std::ranges::find(cold, 1) == cold.end()) return cold;
  DisjointSets islands(scratch.motions.size());
  const auto uniteAwake = [&](const auto& link) {
    if (isAwake(link.a) && isAwake(link.b)) islands.unite(link.a, link.b);
  };
  for (const ContactConstraint& constraint : scratch.constraints) uniteAwake(constraint);
  for (std::uint32_t i = 0; i < cold.size(); ++i)
    if (cold[i] != 0) cold[islands.find(i)] = 1;
  for (std::uint32_t i = 0; i < cold.size(); ++i) cold[i] = cold[islands.find(i)];
  return cold;
}

void storePairImpulses(PhysicsWorld& world, const StepScratch& scratch) {
  const std::vector<std::uint8_t> cold = findColdStarts(world, scratch);
  const auto isWarm = [&](const auto& link) { return cold[link.a] == 0 && cold[link.b] == 0; };
  const ContactConstraint nothing;
  scratch.pool->parallelFor(
      scratch.constraints.size(), kPairsPerTask, [&](std::size_t from, std::size_t to) {
        for (std::size_t k = from; k < to; ++k) {
          BodyPair& pair = world.pairs[scratch.constrainedPairs[k]];
          pair.gaveImpulse = scratch.constraints[k].gaveImpulse;
          ContactConstraint& constraint = *pair.constraint();
          const ContactConstraint& solved =
              isWarm(scratch.constraints[k]) ? scratch.constraints[k] : nothing;
          for (std::size_t i = 0; i < constraint.pointCount; ++i) {
            constraint.points[i].impulse = solved.points[i].impulse;
            constraint.points[i].motorImpulse = solved.points[i].motorImpulse;
          }
          constraint.tangentImpulse = solved.tangentImpulse;
          constraint.torsionImpulse = solved.torsionImpulse;
        }
      });
}

// ---- after step 3 ------------------------------------------------------------------------------

void applyMotions(PhysicsWorld& world, StepScratch& scratch) {
  for (std::size_t i = 0; i < scratch.motions.size(); ++i) {
    PhysicsBody& body = world.bodies[scratch.bodyIndices[i]];
    const bool isAwake = body.isAwake();
    if (!isAwake && !body.isKinematic()) continue;
    const collision::InterpolatedMotion& sweep = scratch.sweptMotions[i];
    ENFILADE_ASSERT(scratch.motionFractions[i] >= 0 && scratch.motionFractions[i] <= 1);
    body.motion.centre = sweep.to.centre, body.motion.rotation = sweep.to.rotation;
    if (isAwake) {
      const CarrierMotion& carrierMotion = scratch.carrierMotions[i];
      const Vec3 carrierVelocity = carrierMotion.velocityAt(sweep.from.centre);
      body.motion.velocity = carrierVelocity + scratch.motionFractions[i] *
                                                   (scratch.motions[i].velocity - carrierVelocity);
      body.motion.angularVelocity =
          carrierMotion.angularVelocity +
          scratch.motionFractions[i] *
              (scratch.motions[i].angularVelocity - carrierMotion.angularVelocity);
      if (scratch.motionFractions[i] < 1) ++scratch.report.reducedMotions;
    }
    body.accumulatedMotion += computeMaxDisplacement(sweep);
    updateTransform(body);
  }
  scratch.pool->parallelFor(
      scratch.activePairs.size(), kPairsPerTask, [&](std::size_t from, std::size_t to) {
        for (std::size_t k = from; k < to; ++k) {
          double& lowerBound = world.pairs[scratch.activePairs[k]].lowerBound;
          const auto [a, b] = scratch.pairBodies[k];
          const double closing =
              computeApproachBound(scratch.motionBounds[a], scratch.motionBounds[b]);
          lowerBound -= closing + 0x1p-51 * (std::abs(lowerBound) + closing);
        }
      });
}

// ---- step 4 ------------------------------------------------------------------------------------

DisjointSets findIslands(const PhysicsWorld& world, const StepScratch& scratch) {
  DisjointSets islands(world.bodies.size());
  for (const std::uint32_t i : scratch.constrainedPairs) {
    const BodyPair& pair = world.pairs[i];
    if (!world.bodies[pair.key.a].isAwake() || !world.bodies[pair.key.b].isAwake()) continue;
    if (scratch.isTouchingPair(i)) islands.unite(pair.key.a, pair.key.b);
  }
  return islands;
}

bool preventsSleep(const PhysicsBody& body) {
  const bool isMoving = body.maxPointSpeed() + body.maxVelocityDeviation() > 0;
  return body.preventsSleep || (body.isKinematic() && isMoving);
}

/// Metres: bound of the displacement of any point from the rest pose. A rotation by an angle moves
/// a point by at most 2 sin(angle / 2) radius; the sine is the length of the quaternion's vector.
double computeDisplacementFromRest(const PhysicsBody& body) {
  const Vec3 turned = (body.motion.rotation * body.restRotation.conjugate()).vec();
  return (body.motion.centre - body.restCentre).norm() + 2 * turned.norm() * body.radius;
}

/// Bodies that touch a moving kinematic body, or an avatar that pushes.
std::vector<std::uint8_t> findBodiesKeptAwake(const PhysicsWorld& world,
                                              const StepScratch& scratch) {
  std::vector<std::uint8_t> keptAwake(world.bodies.size(), 0);
  for (const std::uint32_t i : scratch.constrainedPairs) {
    const BodyPair& pair = world.pairs[i];
    const bool a = preventsSleep(world.bodies[pair.key.a]),
               b = preventsSleep(world.bodies[pair.key.b]);
    if ((!a && !b) || !scratch.isTouchingPair(i)) continue;
    keptAwake[a ? pair.key.b : pair.key.a] = 1;
  }
  return keptAwake;
}

/// Displacement decides, not velocity: a body that every pass stops is at rest, and so is one that
/// its neighbours jostle in its place.
void updateSleepTimer(PhysicsBody& body, const StepSettings& settings) {
  const double maxDisplacement = settings.sleep.sleepVelocity * settings.sleep.timeToSleep;
  if (computeDisplacementFromRest(body) <= maxDisplacement) {
    body.sleepTimer += settings.solver.seconds;
    return;
  }
  body.restCentre = body.motion.centre;
  body.restRotation = body.motion.rotation;
  body.sleepTimer = 0;
}

bool isSettled(const PhysicsBody& body, const StepSettings& settings) {
  return body.sleepTimer >= computeSettledTime(settings);
}

/// Advances the timers. The bodies of an island that is kept awake are not at rest.
void updateSleepTimers(PhysicsWorld& world, const StepSettings& settings, StepScratch& scratch) {
  DisjointSets islands = findIslands(world, scratch);
  const std::vector<std::uint8_t> keptAwake = findBodiesKeptAwake(world, scratch);
  std::vector<std::uint8_t> driven(world.bodies.size(), 0);  // by the island's representative
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i) {
    if (!world.bodies[i].isAwake()) continue;
    const std::uint32_t island = islands.find(i);
    if (keptAwake[i] != 0) driven[island] = 1;
    if (island == i) ++scratch.report.islands;
  }
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i) {
    PhysicsBody& body = world.bodies[i];
    if (!body.isAwake()) continue;
    updateSleepTimer(body, settings);
    if (driven[islands.find(i)] != 0) body.sleepTimer = 0;
  }
}

/// A body at rest sleeps unless a body that is not settled touches it. Such a body wakes those that
/// it touched before the step: it may have held them. They stay settled until they leave their own
/// places, so that one moving part does not wake a heap.
void updateSleep(PhysicsWorld& world, const StepSettings& settings, StepScratch& scratch) {
  updateSleepTimers(world, settings, scratch);
  std::vector<std::uint8_t> disturbed(world.bodies.size(), 0);
  for (const std::uint32_t i : scratch.constrainedPairs) {
    if (!scratch.isTouchingPair(i)) continue;
    const auto [a, b] = std::pair(world.pairs[i].key.a, world.pairs[i].key.b);
    const auto disturbs = [&](const PhysicsBody& body) {
      return body.isAwake() && !isSettled(body, settings);
    };
    if (disturbs(world.bodies[a])) disturbed[b] = 1;
    if (disturbs(world.bodies[b])) disturbed[a] = 1;
  }
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i) {
    PhysicsBody& body = world.bodies[i];
    if (!body.isDynamic()) continue;
    if (body.asleep && disturbed[i] != 0) wakeBody(body, computeSettledTime(settings));
    if (body.asleep) continue;
    body.asleep = disturbed[i] == 0 && body.sleepTimer >= settings.sleep.timeToSleep;
    if (isSettled(body, settings))
      body.motion.velocity = body.motion.angularVelocity = Vec3::Zero();
  }
}

}  // namespace

StepReport stepPhysics(PhysicsWorld& world, const StepSettings& settings) {
  ThreadPool alone(1);
  thread_local StepScratch kept;
  StepScratch& scratch = kept;  // a reference that worker threads can see
  scratch.reset(settings.pool ? *settings.pool : alone);
  findConstraints(world, makePairStepSettings(settings), computeSettledTime(settings), scratch);
  gatherBodies(world, scratch);
  gatherConstraints(world, scratch);
  findKinematicPenetrations(world, scratch);
  solveConstraints(scratch.motions, scratch.constraints, scratch.kinematicBodies, settings.solver,
                   *scratch.pool);
  clampToProvenMotion(world, settings.solver.seconds, settings.solver.contactOffset, scratch);
  storePairImpulses(world, scratch);
  applyMotions(world, scratch);
  updateSleep(world, settings, scratch);
  return scratch.report;
}

}  // namespace enfilade::scene
