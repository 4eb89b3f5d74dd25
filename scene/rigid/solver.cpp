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

namespace enfilade::scene {
namespace {

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

/// How a body moves, and what an impulse does to it.
struct Mover {
  Vec3 velocity, spin;
  Vec3 partingVelocity, partingSpin;  ///< of step 4
  double inverseMass;
  Mat3 inverseInertia;  ///< world axes
};

/// A direction in which two bodies meet: B is pushed along it at armB, A against it at armA.
struct Direction {
  Vec3 along, angularA, angularB;  ///< arm x along
  Vec3 turnA, turnB;               ///< what an impulse of 1 turns them by, rad/s

  Direction() = default;
  Direction(const Vec3& direction, const Vec3& crossA, const Vec3& crossB, const Mover& a,
            const Mover& b)
      : along(direction),
        angularA(crossA),
        angularB(crossB),
        turnA(a.inverseInertia * crossA),
        turnB(b.inverseInertia * crossB) {}
  double speed(const Mover& a, const Mover& b) const {
    return along.dot(b.velocity - a.velocity) + angularB.dot(b.spin) - angularA.dot(a.spin);
  }
  void push(Mover& a, Mover& b, double impulse) const {
    a.velocity -= (impulse * a.inverseMass) * along;
    a.spin -= impulse * turnA;
    b.velocity += (impulse * b.inverseMass) * along;
    b.spin += impulse * turnB;
  }
  /// The same of step 4's velocities.
  double partingSpeed(const Mover& a, const Mover& b) const {
    return along.dot(b.partingVelocity - a.partingVelocity) + angularB.dot(b.partingSpin) -
           angularA.dot(a.partingSpin);
  }
  void part(Mover& a, Mover& b, double impulse) const {
    a.partingVelocity -= (impulse * a.inverseMass) * along;
    a.partingSpin -= impulse * turnA;
    b.partingVelocity += (impulse * b.inverseMass) * along;
    b.partingSpin += impulse * turnB;
  }
};

/// What an impulse along `given` changes of the speed along `felt`.
double response(const Direction& felt, const Direction& given, double inverseMasses) {
  return inverseMasses * felt.along.dot(given.along) + felt.angularA.dot(given.turnA) +
         felt.angularB.dot(given.turnB);
}

double inverted(double value) {
  return value > 0 ? 1 / value : 0;
}

struct PointRow {
  Direction normal;
  double mass;        ///< of the two bodies here, kg
  double separation;  ///< metres, now
  double arrival;     ///< speed along the normal at the start of the step; < 0 closing
  double impulse, push;
  double parting;  ///< impulse of step 4
  double sum;      ///< of the impulses of all substeps of this step
};

/// Friction at the middle of a patch.
struct RubRow {
  Direction first, second;
  double m11, m12, m22;  ///< inverse of the response of the two
  double rub1, rub2;
  Vec3 turnA, turnB;  ///< of a moment of 1 about the normal
  double twistMass, arm, twist;
};

struct PatchRow {
  std::uint32_t a, b;
  std::uint32_t firstPoint, size;
  double friction, restitution, pushSpeed, mostPush;  ///< the push of one point and substep, N s
  Vec3 normal;
  RubRow rub;
};

struct AngularRow {
  JointRow row;
  Direction direction;
  double mass, impulse, parting;
};

/// All that is solved, in the order of the arrays.
struct System {
  std::vector<Mover> movers;
  std::vector<PatchRow> patches;
  std::vector<PointRow> points;
  std::vector<AngularRow> joints;
  double seconds = 0;  ///< of a substep
  double epsilon = 0;
};

Mover moverOf(const RigidBody& body) {
  return {body.velocity,    body.spin,
          Vec3::Zero(),     Vec3::Zero(),
          body.inverseMass, body.inverseMass == 0 ? Mat3(Mat3::Zero()) : worldInverseInertia(body)};
}

// ---- setting up --------------------------------------------------------------------------------

PointRow pointRow(const ContactPatch& patch, const PatchPoint& point, const Mover& a,
                  const Mover& b) {
  PointRow row;
  row.normal =
      Direction(patch.normal, point.armA.cross(patch.normal), point.armB.cross(patch.normal), a, b);
  row.mass = inverted(response(row.normal, row.normal, a.inverseMass + b.inverseMass));
  row.separation = point.separation;
  row.arrival = row.normal.speed(a, b);
  row.impulse = point.impulse;
  row.sum = row.parting = 0;
  row.push = point.push;
  return row;
}

/// Two tangents that depend on the normal alone.
std::array<Vec3, 2> tangents(const Vec3& normal) {
  int least = 0;
  normal.cwiseAbs().minCoeff(&least);
  const Vec3 first = normal.cross(Vec3::Unit(least)).normalized();
  return {first, normal.cross(first)};
}

RubRow rubRow(const ContactPatch& patch, const Mover& a, const Mover& b) {
  RubRow row;
  Vec3 armA = Vec3::Zero(), armB = Vec3::Zero();
  for (const PatchPoint& point : patch.list()) armA += point.armA, armB += point.armB;
  armA /= static_cast<double>(patch.size), armB /= static_cast<double>(patch.size);
  const auto [first, second] = tangents(patch.normal);
  row.first = Direction(first, armA.cross(first), armB.cross(first), a, b);
  row.second = Direction(second, armA.cross(second), armB.cross(second), a, b);
  const double masses = a.inverseMass + b.inverseMass;
  const double k11 = response(row.first, row.first, masses);
  const double k12 = response(row.first, row.second, masses);
  const double k22 = response(row.second, row.second, masses);
  const double over = inverted(k11 * k22 - k12 * k12);
  row.m11 = k22 * over, row.m12 = -k12 * over, row.m22 = k11 * over;
  row.rub1 = patch.rub.dot(first), row.rub2 = patch.rub.dot(second);
  row.arm = 0;
  for (const PatchPoint& point : patch.list()) row.arm += (point.armB - armB).norm();
  row.arm /= static_cast<double>(patch.size);
  row.turnA = a.inverseInertia * patch.normal, row.turnB = b.inverseInertia * patch.normal;
  row.twistMass = inverted(patch.normal.dot(row.turnA) + patch.normal.dot(row.turnB));
  row.twist = patch.twist;
  return row;
}

void addPatch(const ContactPatch& patch, System& system) {
  const Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
  PatchRow row;
  row.a = patch.a, row.b = patch.b;
  row.firstPoint = static_cast<std::uint32_t>(system.points.size());
  row.size = static_cast<std::uint32_t>(patch.size);
  row.friction = patch.friction, row.restitution = patch.restitution;
  row.pushSpeed = patch.pushSpeed;
  row.mostPush = patch.mostPush * system.seconds / static_cast<double>(patch.size);
  row.normal = patch.normal;
  row.rub = rubRow(patch, a, b);
  for (const PatchPoint& point : patch.list())
    system.points.push_back(pointRow(patch, point, a, b));
  system.patches.push_back(row);
}

/// The joints' rows for the poses of now; their impulses are the joints'.
void placeJoints(std::span<const RigidBody> bodies, std::span<const Joint> joints, System& system) {
  std::vector<JointRow> rows;
  for (std::uint32_t i = 0; i < joints.size(); ++i)
    appendRows(joints[i], i, bodies, system.seconds, rows);
  system.joints.clear();
  for (const JointRow& row : rows) {
    const Joint& joint = joints[row.joint];
    const Mover &a = system.movers[joint.a], &b = system.movers[joint.b];
    const Direction direction(row.linear, row.angularA, row.angularB, a, b);
    const double mass = inverted(response(direction, direction, a.inverseMass + b.inverseMass));
    system.joints.push_back({row, direction, mass, joint.impulses[row.slot], 0});
  }
}

// ---- one substep -------------------------------------------------------------------------------

void warmStart(System& system, std::span<const Joint> joints) {
  for (const AngularRow& row : system.joints) {
    const Joint& joint = joints[row.row.joint];
    row.direction.push(system.movers[joint.a], system.movers[joint.b], row.impulse);
  }
  for (const PatchRow& patch : system.patches) {
    Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
    patch.rub.first.push(a, b, patch.rub.rub1);
    patch.rub.second.push(a, b, patch.rub.rub2);
    a.spin -= patch.rub.twist * patch.rub.turnA;
    b.spin += patch.rub.twist * patch.rub.turnB;
    for (std::uint32_t i = 0; i < patch.size; ++i) {
      const PointRow& point = system.points[patch.firstPoint + i];
      point.normal.push(a, b, point.impulse + point.push);
    }
  }
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
  a.spin -= (twist - row.twist) * row.turnA;
  b.spin += (twist - row.twist) * row.turnB;
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
void part(System& system, std::span<const Joint> joints) {
  for (Mover& mover : system.movers) mover.partingVelocity = mover.partingSpin = Vec3::Zero();
  for (PointRow& point : system.points) point.parting = 0;
  for (AngularRow& row : system.joints) row.parting = 0;
  for (int i = 0; i < kPartings; ++i) {
    partJoints(system, joints);
    for (PatchRow& patch : system.patches) partPatch(patch, system);
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

void goOn(System& system, std::span<RigidBody> bodies) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Mover& mover = system.movers[i];
    bodies[i].velocity = mover.velocity + mover.partingVelocity;
    bodies[i].spin = mover.spin + mover.partingSpin;
    advance(bodies[i], system.seconds);
  }
  for (const PatchRow& patch : system.patches) {
    const Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
    for (std::uint32_t i = 0; i < patch.size; ++i) {
      PointRow& point = system.points[patch.firstPoint + i];
      const double speed = point.normal.speed(a, b) + point.normal.partingSpeed(a, b);
      point.separation += system.seconds * speed;
      point.sum += point.impulse;
    }
  }
}

void applyForces(System& system, std::span<RigidBody> bodies, const Vec3& gravity) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Mover& mover = system.movers[i];
    if (mover.inverseMass == 0) continue;
    bodies[i].spin = mover.spin;
    bendSpin(bodies[i], system.seconds);
    mover.spin = bodies[i].spin;
    mover.velocity += system.seconds * gravity;
  }
}

void keepImpulses(const System& system, std::span<Joint> joints) {
  for (const AngularRow& row : system.joints)
    joints[row.row.joint].impulses[row.row.slot] = row.impulse;
}

void substep(System& system, std::span<RigidBody> bodies, std::span<Joint> joints,
             const SolverStep& step) {
  applyForces(system, bodies, step.gravity);
  placeJoints(bodies, joints, system);
  warmStart(system, joints);
  for (int i = 0; i < step.iterations; ++i) {
    solveJoints(system, joints);
    for (PatchRow& patch : system.patches) solvePatch(patch, system);
  }
  part(system, joints);
  goOn(system, bodies);
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
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const PatchRow& row = system.patches[k];
    ContactPatch& patch = patches[k];
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
           const SolverStep& step) {
  System system;
  system.seconds = step.seconds / step.substeps;
  system.epsilon = step.epsilon;
  system.movers.reserve(bodies.size());
  for (const RigidBody& body : bodies) system.movers.push_back(moverOf(body));
  system.patches.reserve(patches.size());
  for (const ContactPatch& patch : patches) addPatch(patch, system);
  for (int i = 0; i < step.substeps; ++i) substep(system, bodies, joints, step);
  bounce(system, step);
  keep(system, bodies, patches);
}

}  // namespace enfilade::scene
