// Steps, for each substep (E. Catto, "Iterative Dynamics with Temporal Coherence", 2005; M. Macklin
// and others, "Small Steps in Physics Simulation", 2019)
//  1. Gravity and the gyroscopic term change the velocities.
//  2. The last substep's impulses are given again (warm start).
//  3. Iterations over all patches and joints: friction first, then the normals, so that not
//     penetrating has the last word. Impulses are accumulated and the sums clamped.
//  4. What is too near is parted by velocities of their own, which end with the substep, so that
//     correcting positions adds no speed (split impulses). One set of velocities for both pumps
//     energy into a stack until it rocks for ever.
//  5. Poses go on with the sum of both.
// After the last substep what bounced gets its speed back.
//
// Contacts are speculative (seed 5.1.1): a point at separation s may close in at (s - epsilon) / h,
// so that bodies come to rest at epsilon, before they touch. Jacobians stand for the whole step;
// separations go on with the velocity along the normal.
//
// Friction is Coulomb's cone, one for each patch at the middle of its points, its two tangents
// solved together, and one turning moment about the normal, at most friction * normal force * the
// mean distance of the points from their middle.
//
// Energy. Without friction each iteration lowers the convex function l A l / 2 + l (v + b) of the
// impulses l >= 0, with b >= 0: starting from 0 the kinetic energy cannot grow, however early the
// iterations end. Friction only brakes. What warm starting gives too much is taken off by the
// iterations, as they may lower what is accumulated.
#include "scene/physics/solver.hpp"

#include <algorithm>
#include <cmath>

#include "scene/physics/solver_rows.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kPatchBlock = 8;  // blocks, and bodies, that a thread takes at a time
constexpr std::size_t kBodyBlock = 32;
constexpr double kPushBack = 0.25;  // of what is too near, a substep
/// Of epsilon: what is nearer is too near. Between it and epsilon bodies rest: were each of a
/// stack's points lifted to epsilon itself, the stack would rock on the lifts for ever.
constexpr double kEnough = 0.5;
/// m/s: bodies that are too near part no faster. (Of 0.5 mm in 1/240 s that is no limit.)
constexpr double kMostPushBack = 1;
/// In falls of one step: what arrives more slowly does not bounce, lest resting bodies hop.
constexpr double kLeastBounce = 4;
constexpr double kJointPushBack = 0.2;  // of a joint's error, a substep

constexpr int kPartings = 2;  // iterations of step 4

// ---- one substep -------------------------------------------------------------------------------

/// Calls each(block) for all patches: a colour at a time, the last one by one thread.
template <class Each>
void forBlocks(System& system, Workers& workers, const Each& each) {
  std::uint32_t from = 0;
  for (std::size_t colour = 0; colour < system.colours.size(); ++colour) {
    const std::span blocks(system.blocks.data() + from, system.colours[colour] - from);
    const std::size_t share = colour + 1 == system.colours.size() ? blocks.size() : kPatchBlock;
    workers.share(blocks.size(), share, [&](std::size_t first, std::size_t last) {
      forEach(blocks.subspan(first, last - first), system.byAvx, each);
    });
    from = system.colours[colour];
  }
}

[[gnu::always_inline]] inline std::span<PointBlock> pointsOf(const PatchBlock& block,
                                                             System& system) {
  return {system.points.data() + block.firstPoint, block.size};
}

/// The velocities, or those of step 4.
template <Vec3 Mover::*velocity = &Mover::velocity, Vec3 Mover::*spin = &Mover::spin>
[[gnu::always_inline]] inline Motions gathered(const PatchBlock& block, const System& system) {
  const Mover* movers = system.movers.data();
  const auto &a = block.a.movers, &b = block.b.movers;
  const Mover &a0 = movers[a[0]], &a1 = movers[a[1]], &a2 = movers[a[2]], &a3 = movers[a[3]];
  const Mover &b0 = movers[b[0]], &b1 = movers[b[1]], &b2 = movers[b[2]], &b3 = movers[b[3]];
  return {sideBySide(a0.*velocity, a1.*velocity, a2.*velocity, a3.*velocity),
          sideBySide(a0.*spin, a1.*spin, a2.*spin, a3.*spin),
          sideBySide(b0.*velocity, b1.*velocity, b2.*velocity, b3.*velocity),
          sideBySide(b0.*spin, b1.*spin, b2.*spin, b3.*spin)};
}
[[gnu::always_inline]] inline Motions gatheredPartings(const PatchBlock& block,
                                                       const System& system) {
  return gathered<&Mover::partingVelocity, &Mover::partingSpin>(block, system);
}

template <Vec3 Mover::*velocity = &Mover::velocity, Vec3 Mover::*spin = &Mover::spin>
[[gnu::always_inline]] inline void putBack(const Motions& m, const PatchBlock& block,
                                           System& system) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    Mover &a = system.movers[block.a.movers[lane]], &b = system.movers[block.b.movers[lane]];
    if (block.a.yields[lane]) a.*velocity = m.velocityA.at(lane), a.*spin = m.spinA.at(lane);
    if (block.b.yields[lane]) b.*velocity = m.velocityB.at(lane), b.*spin = m.spinB.at(lane);
  }
}

void warmStart(System& system, std::span<const Joint> joints, Workers& workers) {
  for (const AngularRow& row : system.joints) {
    const Joint& joint = joints[row.row.joint];
    row.direction.push(system.movers[joint.a], system.movers[joint.b], row.impulse);
  }
  forBlocks(
      system, workers, [&](const PatchBlock& block) __attribute__((always_inline)) {
        if (block.idle) return;
        Motions m = gathered(block, system);
        const RubBlock& rub = block.rub;
        block.push(rub.alongFirst, rub.first, rub.rub1, m);
        block.push(rub.alongSecond, rub.second, rub.rub2, m);
        block.turn(rub.twist, m);
        for (const PointBlock& point : pointsOf(block, system))
          block.push(block.normal, point.normal, point.impulse + point.push, m);
        putBack(m, block, system);
      });
}

/// The rub within Coulomb's cone.
[[gnu::always_inline]] inline void solveRub(PatchBlock& block, const Lanes& normalImpulse,
                                            Motions& m) {
  RubBlock& row = block.rub;
  const Lanes most = block.friction * normalImpulse;
  const Lanes speed1 = row.first.speed(row.alongFirst, m);
  const Lanes speed2 = row.second.speed(row.alongSecond, m);
  Lanes rub1 = row.rub1 - (row.m11 * speed1 + row.m12 * speed2);
  Lanes rub2 = row.rub2 - (row.m12 * speed1 + row.m22 * speed2);
  const Lanes squared = rub1 * rub1 + rub2 * rub2;
  const LaneMask slides = most * most < squared;
  if (any(slides)) {
    const Lanes part = choose(slides, most / squareRoot(squared), everywhere(1));
    rub1 = rub1 * part, rub2 = rub2 * part;
  }
  block.push(row.alongFirst, row.first, rub1 - row.rub1, m);
  block.push(row.alongSecond, row.second, rub2 - row.rub2, m);
  row.rub1 = rub1, row.rub2 = rub2;
  const Lanes turning = dot(block.normal, m.spinB - m.spinA);
  const Lanes widest = most * row.arm;
  const Lanes twist = clamped(row.twist - row.twistMass * turning, -widest, widest);
  block.turn(twist - row.twist, m);
  row.twist = twist;
}

/// What a point lacks of the speed at which it has to part at least, so as to keep epsilon: that is
/// not positive, it may close in. A point that leans and has less than epsilon to close in is held
/// as it is: let down to epsilon, each of a stack's points would answer the last correction of the
/// others, with the delay that warm starting has, and the stack would never come to rest.
[[gnu::always_inline]] inline Lanes lackingSpeed(const PointBlock& point, const System& system,
                                                 const Lanes& speed) {
  const Lanes none = everywhere(0), epsilon = everywhere(system.epsilon);
  const Lanes room = point.separation - epsilon;
  const Lanes least = lesser(none, -room / everywhere(system.seconds));
  const Lanes most = choose(room < epsilon, none, least);
  return choose(speed < least, least - speed, lesser(none, most - speed));
}

/// Whether a point closes in too fast. Where none does and nothing has pushed yet, nothing will.
[[gnu::always_inline]] inline bool anyLacks(const PatchBlock& block, const Motions& m,
                                            System& system) {
  for (const PointBlock& point : pointsOf(block, system)) {
    const Lanes lacking = lackingSpeed(point, system, point.normal.speed(block.normal, m));
    if (any(everywhere(0) < lacking)) return true;
  }
  return false;
}

[[gnu::always_inline]] inline void solveBlock(PatchBlock& block, System& system) {
  Motions m = gathered(block, system);
  if (block.idle && !anyLacks(block, m, system)) return;
  block.idle = false;
  const std::span points = pointsOf(block, system);
  if (block.rubs) {
    Lanes normalImpulse = everywhere(0);
    for (const PointBlock& point : points)
      normalImpulse = normalImpulse + (point.impulse + point.push);
    solveRub(block, normalImpulse, m);
  }
  for (PointBlock& point : points) {
    const Lanes lacking = lackingSpeed(point, system, point.normal.speed(block.normal, m));
    const Lanes impulse = greater(everywhere(0), point.impulse + point.mass * lacking);
    block.push(block.normal, point.normal, impulse - point.impulse, m);
    point.impulse = impulse;
    if (!block.pushes) continue;
    const Lanes slow = block.pushSpeed - point.normal.speed(block.normal, m);
    const Lanes more = clamped(point.push + point.mass * slow, everywhere(0), block.mostPush);
    const Lanes push = choose(everywhere(0) < block.mostPush, more, point.push);
    block.push(block.normal, point.normal, push - point.push, m);
    point.push = push;
  }
  putBack(m, block, system);
}

/// How fast a point has to part so that a part of what it is too near is gone after the substep.
[[gnu::always_inline]] inline Lanes partingSpeed(const PointBlock& point, const System& system) {
  const Lanes none = everywhere(0), seconds = everywhere(system.seconds);
  const Lanes room = point.separation - everywhere(system.epsilon);
  const Lanes lacking = everywhere(kEnough * system.epsilon) - point.separation;
  const Lanes back = lesser(everywhere(kPushBack) * lacking / seconds, everywhere(kMostPushBack));
  return choose(none < room, -room / seconds, choose(none < lacking, back, none));
}

[[gnu::always_inline]] inline void partBlock(const PatchBlock& block, bool begins, System& system) {
  const Motions going = gathered(block, system);
  Motions m = gatheredPartings(block, system);
  for (PointBlock& point : pointsOf(block, system)) {
    const LaneMask roomy = everywhere(system.epsilon) < point.separation;
    const Lanes also = choose(roomy, point.normal.speed(block.normal, going), everywhere(0));
    const Lanes speed = point.normal.speed(block.normal, m) + also;
    const Lanes lacking = partingSpeed(point, system) - speed;
    const Lanes before = begins ? everywhere(0) : point.parting;
    const Lanes impulse = greater(everywhere(0), before + point.mass * lacking);
    block.push(block.normal, point.normal, impulse - before, m);
    point.parting = impulse;
  }
  putBack<&Mover::partingVelocity, &Mover::partingSpin>(m, block, system);
}

void partJoints(System& system, std::span<const Joint> joints) {
  for (AngularRow& row : system.joints) {
    if (row.row.kind == JointRow::Kind::motor || (row.row.error >= 0 && row.row.least == 0))
      continue;
    const Joint& joint = joints[row.row.joint];
    Mover &a = system.movers[joint.a], &b = system.movers[joint.b];
    const double target = -kJointPushBack * row.row.error / system.seconds;
    const double lacking = target - row.direction.partingSpeed(a, b);
    const double impulse = std::max(row.row.least, row.parting + row.mass * lacking);
    row.direction.part(a, b, impulse - row.parting);
    row.parting = impulse;
  }
}

/// Step 4.
void part(System& system, std::span<const Joint> joints, Workers& workers) {
  for (Mover& mover : system.movers) mover.partingVelocity = mover.partingSpin = Vec3::Zero();
  for (AngularRow& row : system.joints) row.parting = 0;
  for (int i = 0; i < kPartings; ++i) {
    partJoints(system, joints);
    forBlocks(
        system, workers, [&](PatchBlock & block) __attribute__((always_inline)) {
          partBlock(block, i == 0, system);
        });
  }
}

double targetSpeed(const JointRow& row, double seconds) {
  if (row.kind == JointRow::Kind::motor) return row.speed;
  return row.kind == JointRow::Kind::limit ? std::min(0.0, -row.error / seconds) : 0;
}

void solveJoints(System& system, std::span<const Joint> joints) {
  for (AngularRow& row : system.joints) {
    const Joint& joint = joints[row.row.joint];
    Mover &a = system.movers[joint.a], &b = system.movers[joint.b];
    const double lacking = targetSpeed(row.row, system.seconds) - row.direction.speed(a, b);
    const double impulse =
        std::clamp(row.impulse + row.mass * lacking, row.row.least, row.row.most);
    row.direction.push(a, b, impulse - row.impulse);
    row.impulse = impulse;
  }
}

void goOn(System& system, std::span<RigidBody> bodies, Workers& workers) {
  workers.share(bodies.size(), kBodyBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const Mover& mover = system.movers[i];
      bodies[i].velocity = mover.velocity + mover.partingVelocity;
      bodies[i].spin = mover.spin + mover.partingSpin;
      advance(bodies[i], system.seconds);
    }
  });
  forBlocks(
      system, workers, [&](const PatchBlock& block) __attribute__((always_inline)) {
        const Motions m = gathered(block, system), parting = gatheredPartings(block, system);
        for (PointBlock& point : pointsOf(block, system)) {
          const Lanes speed =
              point.normal.speed(block.normal, m) + point.normal.speed(block.normal, parting);
          point.separation = point.separation + everywhere(system.seconds) * speed;
          point.sum = point.sum + point.impulse;
          point.most = greater(point.most, point.impulse + point.push);
        }
      });
}

void applyForces(System& system, std::span<RigidBody> bodies, const Vec3& gravity,
                 Workers& workers) {
  workers.share(bodies.size(), kBodyBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      Mover& mover = system.movers[i];
      if (!mover.yields()) continue;
      bodies[i].spin = mover.spin;
      bendSpin(bodies[i], system.seconds);
      mover.spin = bodies[i].spin;
      mover.velocity += system.seconds * gravity;
    }
  });
}

void keepImpulses(const System& system, std::span<Joint> joints) {
  for (const AngularRow& row : system.joints)
    joints[row.row.joint].impulses[row.row.slot] = row.impulse;
}

void substep(System& system, std::span<RigidBody> bodies, std::span<Joint> joints,
             const SolverStep& step, Workers& workers) {
  applyForces(system, bodies, step.gravity, workers);
  placeJoints(bodies, joints, system);
  warmStart(system, joints, workers);
  for (int i = 0; i < step.iterations; ++i) {
    solveJoints(system, joints);
    forBlocks(
        system, workers, [&](PatchBlock & block) __attribute__((always_inline)) {
          solveBlock(block, system);
        });
  }
  part(system, joints, workers);
  goOn(system, bodies, workers);
  keepImpulses(system, joints);
}

// ---- the end of the step -----------------------------------------------------------------------

/// Points that arrived and were pushed leave at `restitution` of the speed that they came with
/// (Newton), by at most `restitution` of the impulse that stopped them (Poisson): either alone may
/// add energy where several points arrive together.
void bounce(System& system, const SolverStep& step) {
  const double least = kLeastBounce * step.gravity.norm() * step.seconds;
  for (const PatchBlock& block : system.blocks) {
    if (!block.bounces) continue;
    Motions m = gathered(block, system);
    for (const PointBlock& point : pointsOf(block, system)) {
      const Lanes speed = point.normal.speed(block.normal, m);
      const Lanes lacking = -block.restitution * point.arrival - speed;
      const Lanes most = block.restitution * point.sum;
      const Lanes back = clamped(point.mass * lacking, everywhere(0), most);
      const LaneMask slow = everywhere(-least) < point.arrival;
      const LaneMask pushed = everywhere(0) < point.sum;
      const Lanes none = everywhere(0);
      block.push(block.normal, point.normal, choose(pushed, choose(slow, none, back), none), m);
    }
    putBack(m, block, system);
  }
}

void keepLane(const System& system, const PatchBlock& block, std::size_t lane,
              ContactPatch& patch) {
  patch.pushed = false;
  for (std::uint32_t i = 0; i < patch.size; ++i) {
    const PointBlock& point = system.points[block.firstPoint + i];
    patch.pushed = patch.pushed || point.most[lane] > 0;
    patch.points[i].separation = point.separation[lane];
    patch.points[i].impulse = point.impulse[lane];
    patch.points[i].push = point.push[lane];
  }
  const RubBlock& rub = block.rub;
  patch.rub = rub.rub1[lane] * rub.alongFirst.at(lane) + rub.rub2[lane] * rub.alongSecond.at(lane);
  patch.twist = rub.twist[lane];
}

void keep(const System& system, std::span<RigidBody> bodies, std::span<ContactPatch> patches,
          Workers& workers) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].velocity = system.movers[i].velocity;
    bodies[i].spin = system.movers[i].spin;
  }
  workers.share(system.blocks.size(), kPatchBlock, [&](std::size_t from, std::size_t to) {
    for (const PatchBlock& block : system.blocks.subspan(from, to - from))
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        if (block.patches[lane] != kNoPatch)
          keepLane(system, block, lane, patches[block.patches[lane]]);
  });
}

}  // namespace

void solve(std::span<RigidBody> bodies, std::span<ContactPatch> patches, std::span<Joint> joints,
           std::span<const DrivenBody> driven, const SolverStep& step, Workers& workers) {
  thread_local System kept;
  System& system = kept;  // which threads that help can see
  system.seconds = step.seconds / step.substeps;
  system.epsilon = step.epsilon;
  system.byAvx = step.byAvx && hasAvx();
  setUp(bodies, patches, system, workers);
  for (std::size_t i = 0; i < static_cast<std::size_t>(step.substeps); ++i) {
    for (const DrivenBody& body : driven) {
      system.movers[body.body].velocity = body.gaits[i].velocity;
      system.movers[body.body].spin = body.gaits[i].spin;
    }
    substep(system, bodies, joints, step, workers);
  }
  bounce(system, step);
  keep(system, bodies, patches, workers);
}

}  // namespace enfilade::scene
