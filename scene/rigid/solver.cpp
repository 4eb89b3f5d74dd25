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
#include "scene/rigid/solver.hpp"

#include <algorithm>
#include <cmath>

#include "scene/rigid/solver_rows.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kPatchBlock = 16;  // patches, and bodies, that a thread takes at a time
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

/// Calls each(patch) for all patches: a colour at a time, the last one by one thread.
template <class Each>
void forPatches(System& system, Workers& workers, const Each& each) {
  std::uint32_t from = 0;
  for (std::size_t colour = 0; colour < system.colours.size(); ++colour) {
    const std::uint32_t end = system.colours[colour];
    const std::size_t size = end - from;
    const std::size_t block = colour + 1 == system.colours.size() ? size : kPatchBlock;
    workers.share(size, block, [&](std::size_t first, std::size_t last) {
      for (std::size_t k = first; k < last; ++k) each(system.patches[from + k]);
    });
    from = end;
  }
}

void warmStart(System& system, std::span<const Joint> joints, Workers& workers) {
  for (const AngularRow& row : system.joints) {
    const Joint& joint = joints[row.row.joint];
    row.direction.push(system.movers[joint.a], system.movers[joint.b], row.impulse);
  }
  forPatches(system, workers, [&](const PatchRow& patch) {
    Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
    patch.rub.first.push(a, b, patch.rub.rub1);
    patch.rub.second.push(a, b, patch.rub.rub2);
    patch.rub.turn(a, b, patch.rub.twist);
    for (std::uint32_t i = 0; i < patch.size; ++i) {
      const PointRow& point = system.points[patch.firstPoint + i];
      point.normal.push(a, b, point.impulse + point.push);
    }
  });
}

/// The rub within Coulomb's cone.
void solveRub(PatchRow& patch, double normalImpulse, Mover& a, Mover& b) {
  RubRow& row = patch.rub;
  const double most = patch.friction * normalImpulse;
  const double speed1 = row.first.speed(a, b), speed2 = row.second.speed(a, b);
  double rub1 = row.rub1 - (row.m11 * speed1 + row.m12 * speed2);
  double rub2 = row.rub2 - (row.m12 * speed1 + row.m22 * speed2);
  const double squared = rub1 * rub1 + rub2 * rub2;
  if (squared > most * most) {
    const double part = most / std::sqrt(squared);
    rub1 *= part, rub2 *= part;
  }
  row.first.push(a, b, rub1 - row.rub1);
  row.second.push(a, b, rub2 - row.rub2);
  row.rub1 = rub1, row.rub2 = rub2;
  if (row.arm == 0) return;
  const double turning = patch.normal.dot(b.spin - a.spin);
  const double twist =
      std::clamp(row.twist - row.twistMass * turning, -most * row.arm, most * row.arm);
  row.turn(a, b, twist - row.twist);
  row.twist = twist;
}

/// What a point lacks of the speed at which it has to part at least, so as to keep epsilon: that is
/// not positive, it may close in. A point that leans and has less than epsilon to close in is held
/// as it is: let down to epsilon, each of a stack's points would answer the last correction of the
/// others, with the delay that warm starting has, and the stack would never come to rest.
double lackingSpeed(const PointRow& point, const System& system, double speed) {
  const double room = point.separation - system.epsilon;
  const double least = std::min(0.0, -room / system.seconds);
  const double most = room < system.epsilon ? 0 : least;
  return speed < least ? least - speed : std::min(0.0, most - speed);
}

void solvePatch(PatchRow& patch, System& system) {
  Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
  const std::span points(system.points.data() + patch.firstPoint, patch.size);
  if (patch.friction > 0) {
    double normalImpulse = 0;
    for (const PointRow& point : points) normalImpulse += point.impulse + point.push;
    solveRub(patch, normalImpulse, a, b);
  }
  for (PointRow& point : points) {
    const double lacking = lackingSpeed(point, system, point.normal.speed(a, b));
    const double impulse = std::max(0.0, point.impulse + point.mass * lacking);
    point.normal.push(a, b, impulse - point.impulse);
    point.impulse = impulse;
    if (patch.mostPush == 0) continue;
    const double slow = patch.pushSpeed - point.normal.speed(a, b);
    const double push = std::clamp(point.push + point.mass * slow, 0.0, patch.mostPush);
    point.normal.push(a, b, push - point.push);
    point.push = push;
  }
}

/// How fast a point has to part so that a part of what it is too near is gone after the substep.
double partingSpeed(const PointRow& point, const System& system) {
  const double room = point.separation - system.epsilon;
  if (room > 0) return -room / system.seconds;
  const double lacking = kEnough * system.epsilon - point.separation;
  if (lacking <= 0) return 0;
  return std::min(kPushBack * lacking / system.seconds, kMostPushBack);
}

void partPatch(PatchRow& patch, System& system) {
  Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
  for (std::uint32_t i = 0; i < patch.size; ++i) {
    PointRow& point = system.points[patch.firstPoint + i];
    const double speed = point.normal.partingSpeed(a, b) +
                         (point.separation > system.epsilon ? point.normal.speed(a, b) : 0);
    const double lacking = partingSpeed(point, system) - speed;
    const double impulse = std::max(0.0, point.parting + point.mass * lacking);
    point.normal.part(a, b, impulse - point.parting);
    point.parting = impulse;
  }
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
  for (PointRow& point : system.points) point.parting = 0;
  for (AngularRow& row : system.joints) row.parting = 0;
  for (int i = 0; i < kPartings; ++i) {
    partJoints(system, joints);
    forPatches(system, workers, [&](PatchRow& patch) { partPatch(patch, system); });
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
  forPatches(system, workers, [&](const PatchRow& patch) {
    const Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
    for (std::uint32_t i = 0; i < patch.size; ++i) {
      PointRow& point = system.points[patch.firstPoint + i];
      const double speed = point.normal.speed(a, b) + point.normal.partingSpeed(a, b);
      point.separation += system.seconds * speed;
      point.sum += point.impulse;
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
    forPatches(system, workers, [&](PatchRow& patch) { solvePatch(patch, system); });
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
  for (PatchRow& patch : system.patches) {
    if (patch.restitution == 0) continue;
    Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
    for (std::uint32_t i = 0; i < patch.size; ++i) {
      PointRow& point = system.points[patch.firstPoint + i];
      if (point.arrival > -least || point.sum == 0) continue;
      const double lacking = -patch.restitution * point.arrival - point.normal.speed(a, b);
      const double most = patch.restitution * point.sum;
      point.normal.push(a, b, std::clamp(point.mass * lacking, 0.0, most));
    }
  }
}

void keep(const System& system, std::span<RigidBody> bodies, std::span<ContactPatch> patches) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].velocity = system.movers[i].velocity;
    bodies[i].spin = system.movers[i].spin;
  }
  for (const PatchRow& row : system.patches) {
    ContactPatch& patch = patches[row.patch];
    for (std::uint32_t i = 0; i < row.size; ++i) {
      const PointRow& point = system.points[row.firstPoint + i];
      patch.points[i].separation = point.separation;
      patch.points[i].impulse = point.impulse;
      patch.points[i].push = point.push;
    }
    patch.rub = row.rub.rub1 * row.rub.first.along + row.rub.rub2 * row.rub.second.along;
    patch.twist = row.rub.twist;
  }
}

}  // namespace

void solve(std::span<RigidBody> bodies, std::span<ContactPatch> patches, std::span<Joint> joints,
           std::span<const DrivenBody> driven, const SolverStep& step, Workers& workers) {
  System system;
  system.seconds = step.seconds / step.substeps;
  system.epsilon = step.epsilon;
  setUp(bodies, patches, system, workers);
  for (std::size_t i = 0; i < static_cast<std::size_t>(step.substeps); ++i) {
    for (const DrivenBody& body : driven) {
      system.movers[body.body].velocity = body.gaits[i].velocity;
      system.movers[body.body].spin = body.gaits[i].spin;
    }
    substep(system, bodies, joints, step, workers);
  }
  bounce(system, step);
  keep(system, bodies, patches);
}

}  // namespace enfilade::scene
