// Steps of each substep (E. Catto, "Iterative Dynamics with Temporal Coherence", 2005; M. Macklin
// et al., "Small Steps in Physics Simulation", 2019)
//  1. Apply gravity and the gyroscopic term.
//  2. Warm start with the impulses of the last substep.
//  3. Iterate over all contacts. Friction comes before the normals, so that non-penetration takes
//     precedence. Impulses are accumulated, and the sums are clamped.
//  4. Correct positions by separate velocities that end with the substep (split impulses). They
//     add no momentum. One set of velocities for both would pump energy into a stack, which then
//     never rests.
//  5. Integrate poses with the sum of both velocities.
// After the last substep, apply restitution.
//
// Contacts are speculative: a point at separation s may approach at (s - contactOffset) / h. Bodies
// then rest at contactOffset, before they touch. Jacobians are constant during the step;
// separations are integrated along the normal.
//
// Friction is Coulomb's cone, one per constraint at the mean of its points. The two tangents are
// solved together. Torsional friction about the normal is limited to friction * normal force * the
// mean distance of the points from their mean.
//
// Energy. Without friction each iteration lowers the convex function l A l / 2 + l (v + b) of the
// impulses l >= 0, with b >= 0. From 0 the kinetic energy cannot grow, however few iterations run.
// Friction only dissipates. Iterations remove the excess of a warm start, because they may lower
// accumulated impulses.
#include "scene/physics/solver.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/processor.hpp"
#include "scene/physics/solver_rows.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kConstraintsPerTask = 8;  // constraint blocks in one task
constexpr std::size_t kBodiesPerTask = 32;
constexpr double kBaumgarte = 0.25;  // fraction of a penetration corrected per substep
/// Of contactOffset: only closer points are corrected. Bodies rest between it and contactOffset.
/// Correcting each point up to contactOffset itself would keep a stack rocking.
constexpr double kPenetrationSlop = 0.5;
/// m/s: bound of the correction velocity. (It does not limit 0.5 mm in 1/240 s.)
constexpr double kMaxCorrectionSpeed = 1;
/// Multiple of the velocity that gravity adds in one step: slower impacts do not bounce; otherwise
/// resting bodies would hop.
constexpr double kRestitutionThreshold = 4;

constexpr int kPositionIterations = 2;  // position iterations of step 4

// ---- one substep -------------------------------------------------------------------------------

/// Calls each(block) for all constraint blocks, color by color. The last color runs on one thread.
template <class Each>
void forEachConstraint(SolverContext& context, ThreadPool& pool, const Each& each) {
  std::uint32_t from = 0;
  for (std::size_t color = 0; color < context.colorEnds.size(); ++color) {
    ENFILADE_ASSERT(from <= context.colorEnds[color] &&
                    context.colorEnds[color] <= context.constraints.size());
    const std::span blocks(context.constraints.data() + from, context.colorEnds[color] - from);
    const std::size_t blocksPerTask =
        color + 1 == context.colorEnds.size() ? blocks.size() : kConstraintsPerTask;
    pool.parallelFor(blocks.size(), blocksPerTask, [&](std::size_t first, std::size_t last) {
      runSimdLoop(blocks.subspan(first, last - first), context.useAvx, each);
    });
    from = context.colorEnds[color];
  }
}

[[gnu::always_inline]] inline std::span<ContactConstraintPointW> getConstraintPoints(
    const ContactConstraintW& block, SolverContext& context) {
  return {context.points.data() + block.firstPoint, block.pointCount};
}

/// Gathers the velocities, or the correction velocities of step 4, of a block.
template <Vec3 SolverBody::*velocity = &SolverBody::velocity,
          Vec3 SolverBody::*angularVelocity = &SolverBody::angularVelocity>
[[gnu::always_inline]] inline VelocitiesW gatherVelocities(const ContactConstraintW& block,
                                                           const SolverContext& context) {
  const SolverBody* bodies = context.bodies.data();
  const auto &a = block.a.bodies, &b = block.b.bodies;
  const SolverBody &a0 = bodies[a[0]], &a1 = bodies[a[1]], &a2 = bodies[a[2]], &a3 = bodies[a[3]];
  const SolverBody &b0 = bodies[b[0]], &b1 = bodies[b[1]], &b2 = bodies[b[2]], &b3 = bodies[b[3]];
  return {
      gather(a0.*velocity, a1.*velocity, a2.*velocity, a3.*velocity),
      gather(a0.*angularVelocity, a1.*angularVelocity, a2.*angularVelocity, a3.*angularVelocity),
      gather(b0.*velocity, b1.*velocity, b2.*velocity, b3.*velocity),
      gather(b0.*angularVelocity, b1.*angularVelocity, b2.*angularVelocity, b3.*angularVelocity)};
}
[[gnu::always_inline]] inline VelocitiesW gatherCorrectionVelocities(
    const ContactConstraintW& block, const SolverContext& context) {
  return gatherVelocities<&SolverBody::correctionVelocity, &SolverBody::correctionAngularVelocity>(
      block, context);
}

template <Vec3 SolverBody::*velocity = &SolverBody::velocity,
          Vec3 SolverBody::*angularVelocity = &SolverBody::angularVelocity>
[[gnu::always_inline]] inline void scatterVelocities(const VelocitiesW& m,
                                                     const ContactConstraintW& block,
                                                     SolverContext& context) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    SolverBody &a = context.bodies[block.a.bodies[lane]], &b = context.bodies[block.b.bodies[lane]];
    if (block.a.isDynamic[lane])
      a.*velocity = m.velocityA.at(lane), a.*angularVelocity = m.angularVelocityA.at(lane);
    if (block.b.isDynamic[lane])
      b.*velocity = m.velocityB.at(lane), b.*angularVelocity = m.angularVelocityB.at(lane);
  }
}

void warmStart(SolverContext& context, ThreadPool& pool) {
  forEachConstraint(
      context, pool, [&](const ContactConstraintW& block) __attribute__((always_inline)) {
        if (block.idle) return;
        VelocitiesW m = gatherVelocities(block, context);
        const FrictionW& friction = block.frictionRows;
        block.applyImpulse(friction.tangent1, friction.angular1, friction.tangentImpulse1, m);
        block.applyImpulse(friction.tangent2, friction.angular2, friction.tangentImpulse2, m);
        block.applyTorsion(friction.torsionImpulse, m);
        for (const ContactConstraintPointW& point : getConstraintPoints(block, context))
          block.applyImpulse(block.normal, point.normal, point.impulse + point.motorImpulse, m);
        scatterVelocities(m, block, context);
      });
}

/// Solves friction within Coulomb's cone.
[[gnu::always_inline]] inline void solveFriction(ContactConstraintW& block,
                                                 const DoubleW& normalImpulse, VelocitiesW& m) {
  FrictionW& row = block.frictionRows;
  const DoubleW maxImpulse = block.frictionCoefficient * normalImpulse;
  const DoubleW speed1 = row.angular1.relativeVelocity(row.tangent1, m);
  const DoubleW speed2 = row.angular2.relativeVelocity(row.tangent2, m);
  DoubleW impulse1 =
      row.tangentImpulse1 - (row.effectiveMass11 * speed1 + row.effectiveMass12 * speed2);
  DoubleW impulse2 =
      row.tangentImpulse2 - (row.effectiveMass12 * speed1 + row.effectiveMass22 * speed2);
  const DoubleW squared = impulse1 * impulse1 + impulse2 * impulse2;
  const MaskW isSliding = maxImpulse * maxImpulse < squared;
  if (any(isSliding)) {
    const DoubleW scale = selectW(isSliding, maxImpulse / sqrtW(squared), splat(1));
    impulse1 = impulse1 * scale, impulse2 = impulse2 * scale;
  }
  block.applyImpulse(row.tangent1, row.angular1, impulse1 - row.tangentImpulse1, m);
  block.applyImpulse(row.tangent2, row.angular2, impulse2 - row.tangentImpulse2, m);
  row.tangentImpulse1 = impulse1, row.tangentImpulse2 = impulse2;
  const DoubleW relativeAngularSpeed = dot(block.normal, m.angularVelocityB - m.angularVelocityA);
  const DoubleW maxTorsion = maxImpulse * row.torsionArm;
  const DoubleW torsion =
      clampW(row.torsionImpulse - row.torsionMass * relativeAngularSpeed, -maxTorsion, maxTorsion);
  block.applyTorsion(torsion - row.torsionImpulse, m);
  row.torsionImpulse = torsion;
}

/// Difference between a point's velocity and the slowest one that keeps contactOffset; negative
/// where it may approach. A touching point closer than contactOffset is held at its separation. If
/// it were lowered to contactOffset, each point of a stack would answer the delayed correction of
/// the others, and the stack would never rest.
[[gnu::always_inline]] inline DoubleW computeVelocityError(const ContactConstraintPointW& point,
                                                           const SolverContext& context,
                                                           const DoubleW& speed) {
  const DoubleW zero = splat(0), contactOffset = splat(context.contactOffset);
  const DoubleW gap = point.separation - contactOffset;
  const DoubleW minSpeed = minW(zero, -gap / splat(context.seconds));
  const DoubleW maxSpeed = selectW(gap < contactOffset, zero, minSpeed);
  return selectW(speed < minSpeed, minSpeed - speed, minW(zero, maxSpeed - speed));
}

/// Returns whether a point approaches too fast. If none does and no impulse exists yet, the block
/// needs no solving.
[[gnu::always_inline]] inline bool hasVelocityError(const ContactConstraintW& block,
                                                    const VelocitiesW& m, SolverContext& context) {
  for (const ContactConstraintPointW& point : getConstraintPoints(block, context)) {
    const DoubleW velocityError =
        computeVelocityError(point, context, point.normal.relativeVelocity(block.normal, m));
    if (any(splat(0) < velocityError)) return true;
  }
  return false;
}

[[gnu::always_inline]] inline void solveContactVelocities(ContactConstraintW& block,
                                                          SolverContext& context) {
  VelocitiesW m = gatherVelocities(block, context);
  if (block.idle && !hasVelocityError(block, m, context)) return;
  block.idle = false;
  const std::span points = getConstraintPoints(block, context);
  if (block.hasFriction) {
    DoubleW normalImpulse = splat(0);
    for (const ContactConstraintPointW& point : points)
      normalImpulse = normalImpulse + (point.impulse + point.motorImpulse);
    solveFriction(block, normalImpulse, m);
  }
  for (ContactConstraintPointW& point : points) {
    const DoubleW velocityError =
        computeVelocityError(point, context, point.normal.relativeVelocity(block.normal, m));
    const DoubleW impulse = maxW(splat(0), point.impulse + point.effectiveMass * velocityError);
    block.applyImpulse(block.normal, point.normal, impulse - point.impulse, m);
    point.impulse = impulse;
    if (!block.hasMotor) continue;
    const DoubleW speedError = block.targetSpeed - point.normal.relativeVelocity(block.normal, m);
    const DoubleW clamped = clampW(point.motorImpulse + point.effectiveMass * speedError, splat(0),
                                   block.maxMotorImpulse);
    const DoubleW motorImpulse =
        selectW(splat(0) < block.maxMotorImpulse, clamped, point.motorImpulse);
    block.applyImpulse(block.normal, point.normal, motorImpulse - point.motorImpulse, m);
    point.motorImpulse = motorImpulse;
  }
  scatterVelocities(m, block, context);
}

/// Separation velocity that corrects a fraction of the penetration within the substep.
[[gnu::always_inline]] inline DoubleW computeCorrectionSpeed(const ContactConstraintPointW& point,
                                                             const SolverContext& context) {
  const DoubleW zero = splat(0), seconds = splat(context.seconds);
  const DoubleW gap = point.separation - splat(context.contactOffset);
  const DoubleW missingGap = splat(kPenetrationSlop * context.contactOffset) - point.separation;
  const DoubleW correction =
      minW(splat(kBaumgarte) * missingGap / seconds, splat(kMaxCorrectionSpeed));
  return selectW(zero < gap, -gap / seconds, selectW(zero < missingGap, correction, zero));
}

[[gnu::always_inline]] inline void solveContactPositions(const ContactConstraintW& block,
                                                         bool isFirstIteration,
                                                         SolverContext& context) {
  const VelocitiesW velocities = gatherVelocities(block, context);
  VelocitiesW m = gatherCorrectionVelocities(block, context);
  for (ContactConstraintPointW& point : getConstraintPoints(block, context)) {
    const MaskW hasGap = splat(context.contactOffset) < point.separation;
    const DoubleW ownSpeed =
        selectW(hasGap, point.normal.relativeVelocity(block.normal, velocities), splat(0));
    const DoubleW speed = point.normal.relativeVelocity(block.normal, m) + ownSpeed;
    const DoubleW velocityError = computeCorrectionSpeed(point, context) - speed;
    const DoubleW before = isFirstIteration ? splat(0) : point.correctionImpulse;
    const DoubleW impulse = maxW(splat(0), before + point.effectiveMass * velocityError);
    block.applyImpulse(block.normal, point.normal, impulse - before, m);
    point.correctionImpulse = impulse;
  }
  scatterVelocities<&SolverBody::correctionVelocity, &SolverBody::correctionAngularVelocity>(
      m, block, context);
}

/// Solves step 4 for all contacts.
void solvePositions(SolverContext& context, ThreadPool& pool) {
  for (SolverBody& solverBody : context.bodies)
    solverBody.correctionVelocity = solverBody.correctionAngularVelocity = Vec3::Zero();
  for (int i = 0; i < kPositionIterations; ++i) {
    forEachConstraint(
        context, pool, [&](ContactConstraintW & block) __attribute__((always_inline)) {
          solveContactPositions(block, i == 0, context);
        });
  }
}

void integratePoses(SolverContext& context, std::span<BodyMotion> motions, ThreadPool& pool) {
  pool.parallelFor(motions.size(), kBodiesPerTask, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const SolverBody& solverBody = context.bodies[i];
      motions[i].velocity = solverBody.velocity + solverBody.correctionVelocity;
      motions[i].angularVelocity =
          solverBody.angularVelocity + solverBody.correctionAngularVelocity;
      integratePose(motions[i], context.seconds);
    }
  });
  forEachConstraint(
      context, pool, [&](const ContactConstraintW& block) __attribute__((always_inline)) {
        const VelocitiesW m = gatherVelocities(block, context),
                          correction = gatherCorrectionVelocities(block, context);
        for (ContactConstraintPointW& point : getConstraintPoints(block, context)) {
          const DoubleW speed = point.normal.relativeVelocity(block.normal, m) +
                                point.normal.relativeVelocity(block.normal, correction);
          point.separation = point.separation + splat(context.seconds) * speed;
          point.totalImpulse = point.totalImpulse + point.impulse;
          point.maxImpulse = maxW(point.maxImpulse, point.impulse + point.motorImpulse);
        }
      });
}

void applyForces(SolverContext& context, std::span<BodyMotion> motions, const Vec3& gravity,
                 ThreadPool& pool) {
  pool.parallelFor(motions.size(), kBodiesPerTask, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      SolverBody& solverBody = context.bodies[i];
      if (!solverBody.isDynamic()) continue;
      motions[i].angularVelocity = solverBody.angularVelocity;
      applyGyroscopicTorque(motions[i], context.seconds);
      solverBody.angularVelocity = motions[i].angularVelocity;
      solverBody.velocity += context.seconds * gravity;
    }
  });
}

void substep(SolverContext& context, std::span<BodyMotion> motions, const SolverSettings& settings,
             ThreadPool& pool) {
  applyForces(context, motions, settings.gravity, pool);
  warmStart(context, pool);
  for (int i = 0; i < settings.iterations; ++i) {
    forEachConstraint(
        context, pool, [&](ContactConstraintW & block) __attribute__((always_inline)) {
          solveContactVelocities(block, context);
        });
  }
  solvePositions(context, pool);
  integratePoses(context, motions, pool);
}

// ---- the end of the step -----------------------------------------------------------------------

/// Applies restitution. Points that hit leave at `restitution` times their approach velocity
/// (Newton), by at most `restitution` times the impulse that stopped them (Poisson). Either rule
/// alone may add energy where several points hit together.
void applyRestitution(SolverContext& context, const SolverSettings& settings) {
  const double minSpeed = kRestitutionThreshold * settings.gravity.norm() * settings.seconds;
  for (const ContactConstraintW& block : context.constraints) {
    if (!block.hasRestitution) continue;
    VelocitiesW m = gatherVelocities(block, context);
    for (const ContactConstraintPointW& point : getConstraintPoints(block, context)) {
      const DoubleW speed = point.normal.relativeVelocity(block.normal, m);
      const DoubleW velocityError = -block.restitution * point.approachSpeed - speed;
      const DoubleW maxImpulse = block.restitution * point.totalImpulse;
      const DoubleW impulse = clampW(point.effectiveMass * velocityError, splat(0), maxImpulse);
      const MaskW isSlow = splat(-minSpeed) < point.approachSpeed;
      const MaskW hadImpulse = splat(0) < point.totalImpulse;
      const DoubleW zero = splat(0);
      block.applyImpulse(block.normal, point.normal,
                         selectW(hadImpulse, selectW(isSlow, zero, impulse), zero), m);
    }
    scatterVelocities(m, block, context);
  }
}

void storeLane(const SolverContext& context, const ContactConstraintW& block, std::size_t lane,
               ContactConstraint& constraint) {
  ENFILADE_ASSERT(constraint.pointCount <= block.pointCount);
  constraint.gaveImpulse = false;
  for (std::uint32_t i = 0; i < constraint.pointCount; ++i) {
    const ContactConstraintPointW& point = context.points[block.firstPoint + i];
    constraint.gaveImpulse = constraint.gaveImpulse || point.maxImpulse[lane] > 0;
    constraint.points[i].separation = point.separation[lane];
    constraint.points[i].impulse = point.impulse[lane];
    constraint.points[i].motorImpulse = point.motorImpulse[lane];
  }
  const FrictionW& friction = block.frictionRows;
  constraint.tangentImpulse = friction.tangentImpulse1[lane] * friction.tangent1.at(lane) +
                              friction.tangentImpulse2[lane] * friction.tangent2.at(lane);
  constraint.torsionImpulse = friction.torsionImpulse[lane];
}

void storeImpulses(const SolverContext& context, std::span<BodyMotion> motions,
                   std::span<ContactConstraint> constraints, ThreadPool& pool) {
  for (std::size_t i = 0; i < motions.size(); ++i) {
    motions[i].velocity = context.bodies[i].velocity;
    motions[i].angularVelocity = context.bodies[i].angularVelocity;
  }
  pool.parallelFor(
      context.constraints.size(), kConstraintsPerTask, [&](std::size_t from, std::size_t to) {
        for (const ContactConstraintW& block : context.constraints.subspan(from, to - from))
          for (std::size_t lane = 0; lane < kLanes; ++lane)
            if (block.constraints[lane] != kNoConstraint)
              storeLane(context, block, lane, constraints[block.constraints[lane]]);
      });
}

}  // namespace

void solveConstraints(std::span<BodyMotion> motions, std::span<ContactConstraint> constraints,
                      std::span<const KinematicBody> kinematicBodies,
                      const SolverSettings& settings, ThreadPool& pool) {
  ENFILADE_ASSERT(settings.seconds > 0 && settings.substeps >= 1);
  thread_local SolverContext threadContext;
  SolverContext& context = threadContext;  // a reference that worker threads can see
  context.seconds = settings.seconds / settings.substeps;
  context.contactOffset = settings.contactOffset;
  context.useAvx = settings.useAvx && collision::hasAvx();
  prepareConstraints(motions, constraints, context, pool);
  for (std::size_t i = 0; i < static_cast<std::size_t>(settings.substeps); ++i) {
    for (const KinematicBody& body : kinematicBodies) {
      ENFILADE_ASSERT(body.body < motions.size() && i < body.substepVelocities.size());
      context.bodies[body.body].velocity = body.substepVelocities[i].velocity;
      context.bodies[body.body].angularVelocity = body.substepVelocities[i].angularVelocity;
    }
    substep(context, motions, settings, pool);
  }
  applyRestitution(context, settings);
  storeImpulses(context, motions, constraints, pool);
}

}  // namespace enfilade::scene
