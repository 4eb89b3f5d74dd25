// Scalar reference implementation of the solver: one contact constraint after another, in plain
// doubles, by the steps at the head of solver.cpp. The SIMD solver must give the same bits for any
// constraints, number of threads and register width. Masses, constraint colouring and pose
// integration are shared with the solver, as they do not depend on SIMD width.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "collision/processor.hpp"
#include "scene/physics/graph_coloring.hpp"
#include "scene/physics/solver.hpp"
#include "scene/physics/solver_rows.hpp"

namespace enfilade::scene {
namespace {

// ---- reference solver --------------------------------------------------------------------------

/// Sums in the same order as the solver.
double computeProduct(const Vec3& a, const Vec3& b) {
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}

struct Velocities {
  Vec3 velocityA, spinA, velocityB, spinB;
};

struct ReferencePoint {
  Jacobian normal;
  double mass, separation, arrival, impulse, motorImpulse;
  double correction = 0, sum = 0;
};

struct ReferenceConstraint {
  const ContactConstraint* patch;
  std::vector<ReferencePoint> points;
  Jacobian first, second;
  double m11, m12, m22, tangent1, tangent2, arm, twistMass, twist, maxMotorImpulse;
  Vec3 turnA, turnB;
};

/// Counts how often each case occurred, so that a test without sliding cannot claim to test
/// sliding.
struct CaseCounts {
  int slid = 0, held = 0, pushed = 0, bounced = 0, parted = 0, free = 0;
};

class ReferenceSolver {
 public:
  ReferenceSolver(std::span<BodyMotion> bodies, std::span<ContactConstraint> patches,
                  const SolverSettings& step, std::span<const std::uint32_t> order)
      : bodies_(bodies), all_(patches), step_(step), seconds_(step.seconds / step.substeps) {
    for (const BodyMotion& body : bodies) {
      const bool held = body.inverseMass == 0;
      solverBodies_.push_back({body.velocity, body.angularVelocity, Vec3::Zero(), Vec3::Zero(),
                               body.inverseMass,
                               held ? Mat3(Mat3::Zero()) : computeWorldInverseInertia(body)});
    }
    for (const std::uint32_t k : order) add(patches[k]);
  }

  CaseCounts solve(std::span<const KinematicBody> driven) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(step_.substeps); ++i) {
      for (const KinematicBody& body : driven)
        solverBodies_[body.body].velocity = body.substepVelocities[i].velocity,
        solverBodies_[body.body].angularVelocity = body.substepVelocities[i].angularVelocity;
      substep();
    }
    for (ReferenceConstraint& row : rows_) applyRestitution(row);
    store();
    return happened_;
  }

 private:
  void add(const ContactConstraint& patch) {
    const SolverBody &a = solverBodies_[patch.a], &b = solverBodies_[patch.b];
    const double masses = a.inverseMass + b.inverseMass,
                 size = static_cast<double>(patch.pointCount);
    ReferenceConstraint row;
    row.patch = &patch;
    Vec3 armA = Vec3::Zero(), armB = Vec3::Zero();
    for (const ContactConstraintPoint& point : patch.activePoints()) {
      const Jacobian normal(patch.normal, point.armA.cross(patch.normal),
                            point.armB.cross(patch.normal), a, b);
      row.points.push_back({normal, invertOrZero(computeResponse(normal, normal, masses)),
                            point.separation, normal.relativeVelocity(a, b), point.impulse,
                            point.motorImpulse});
      armA += point.armA, armB += point.armB;
    }
    armA /= size, armB /= size;
    int minAxis = 0;
    patch.normal.cwiseAbs().minCoeff(&minAxis);
    const Vec3 first = patch.normal.cross(Vec3::Unit(minAxis)).normalized();
    const Vec3 second = patch.normal.cross(first);
    row.first = Jacobian(first, armA.cross(first), armB.cross(first), a, b);
    row.second = Jacobian(second, armA.cross(second), armB.cross(second), a, b);
    const double k11 = computeResponse(row.first, row.first, masses);
    const double k12 = computeResponse(row.first, row.second, masses);
    const double k22 = computeResponse(row.second, row.second, masses);
    const double over = invertOrZero(k11 * k22 - k12 * k12);
    row.m11 = k22 * over, row.m12 = -k12 * over, row.m22 = k11 * over;
    row.tangent1 = patch.tangentImpulse.dot(first), row.tangent2 = patch.tangentImpulse.dot(second),
    row.twist = patch.torsionImpulse;
    double arm = 0;
    for (const ContactConstraintPoint& point : patch.activePoints())
      arm += (point.armB - armB).norm();
    row.arm = arm / size;
    row.turnA = a.inverseInertia * patch.normal, row.turnB = b.inverseInertia * patch.normal;
    row.twistMass = invertOrZero(patch.normal.dot(row.turnA) + patch.normal.dot(row.turnB));
    row.maxMotorImpulse = patch.maxPushForce * seconds_ / size;
    rows_.push_back(std::move(row));
  }

  Velocities getVelocities(const ReferenceConstraint& row) const {
    const SolverBody &a = solverBodies_[row.patch->a], &b = solverBodies_[row.patch->b];
    return {a.velocity, a.angularVelocity, b.velocity, b.angularVelocity};
  }
  Velocities getCorrections(const ReferenceConstraint& row) const {
    const SolverBody &a = solverBodies_[row.patch->a], &b = solverBodies_[row.patch->b];
    return {a.correctionVelocity, a.correctionAngularVelocity, b.correctionVelocity,
            b.correctionAngularVelocity};
  }
  void apply(const ReferenceConstraint& row, const Velocities& velocities) {
    SolverBody &a = solverBodies_[row.patch->a], &b = solverBodies_[row.patch->b];
    if (a.isDynamic()) a.velocity = velocities.velocityA, a.angularVelocity = velocities.spinA;
    if (b.isDynamic()) b.velocity = velocities.velocityB, b.angularVelocity = velocities.spinB;
  }
  static double computeSpeed(const Jacobian& d, const Velocities& velocities) {
    return computeProduct(d.linear, velocities.velocityB - velocities.velocityA) +
           computeProduct(d.angularB, velocities.spinB) -
           computeProduct(d.angularA, velocities.spinA);
  }
  void applyImpulse(const ReferenceConstraint& row, const Jacobian& d, double impulse,
                    Velocities& velocities) const {
    velocities.velocityA -= (impulse * solverBodies_[row.patch->a].inverseMass) * d.linear;
    velocities.spinA -= impulse * d.responseA;
    velocities.velocityB += (impulse * solverBodies_[row.patch->b].inverseMass) * d.linear;
    velocities.spinB += impulse * d.responseB;
  }
  static void applyMoment(const ReferenceConstraint& row, double moment, Velocities& velocities) {
    velocities.spinA -= moment * row.turnA;
    velocities.spinB += moment * row.turnB;
  }

  void warmStart(ReferenceConstraint& row) {
    Velocities velocities = getVelocities(row);
    applyImpulse(row, row.first, row.tangent1, velocities);
    applyImpulse(row, row.second, row.tangent2, velocities);
    applyMoment(row, row.twist, velocities);
    for (const ReferencePoint& point : row.points)
      applyImpulse(row, point.normal, point.impulse + point.motorImpulse, velocities);
    apply(row, velocities);
  }

  void solveFriction(ReferenceConstraint& row, Velocities& velocities) {
    double normalImpulse = 0;
    for (const ReferencePoint& point : row.points)
      normalImpulse += point.impulse + point.motorImpulse;
    const double maxFriction = row.patch->friction * normalImpulse;
    const double speed1 = computeSpeed(row.first, velocities),
                 speed2 = computeSpeed(row.second, velocities);
    double tangent1 = row.tangent1 - (row.m11 * speed1 + row.m12 * speed2);
    double tangent2 = row.tangent2 - (row.m12 * speed1 + row.m22 * speed2);
    const double squared = tangent1 * tangent1 + tangent2 * tangent2;
    ++(maxFriction * maxFriction < squared ? happened_.slid : happened_.held);
    if (maxFriction * maxFriction < squared) {
      const double part = maxFriction / std::sqrt(squared);
      tangent1 *= part, tangent2 *= part;
    }
    applyImpulse(row, row.first, tangent1 - row.tangent1, velocities);
    applyImpulse(row, row.second, tangent2 - row.tangent2, velocities);
    row.tangent1 = tangent1, row.tangent2 = tangent2;
    const double turning = computeProduct(row.patch->normal, velocities.spinB - velocities.spinA);
    const double widest = maxFriction * row.arm;
    const double twist = std::clamp(row.twist - row.twistMass * turning, -widest, widest);
    applyMoment(row, twist - row.twist, velocities);
    row.twist = twist;
  }

  double computeVelocityError(const ReferencePoint& point, double now) const {
    const double room = point.separation - step_.contactOffset;
    const double minSpeed = std::min(0.0, -room / seconds_),
                 maxSpeed = room < step_.contactOffset ? 0 : minSpeed;
    return now < minSpeed ? minSpeed - now : std::min(0.0, maxSpeed - now);
  }

  void iterate(ReferenceConstraint& row) {
    Velocities velocities = getVelocities(row);
    if (row.patch->friction > 0) solveFriction(row, velocities);
    for (ReferencePoint& point : row.points) {
      const double more =
          point.mass * computeVelocityError(point, computeSpeed(point.normal, velocities));
      const double impulse = std::max(0.0, point.impulse + more);
      applyImpulse(row, point.normal, impulse - point.impulse, velocities);
      point.impulse = impulse;
      if (impulse == 0) ++happened_.free;
      if (row.maxMotorImpulse == 0) continue;
      const double slow = row.patch->targetSpeed - computeSpeed(point.normal, velocities);
      const double given =
          std::clamp(point.motorImpulse + point.mass * slow, 0.0, row.maxMotorImpulse);
      applyImpulse(row, point.normal, given - point.motorImpulse, velocities);
      point.motorImpulse = given;
      if (given > 0) ++happened_.pushed;
    }
    apply(row, velocities);
  }

  double computeCorrectionSpeed(const ReferencePoint& point) const {
    const double room = point.separation - step_.contactOffset;
    const double lacks = 0.5 * step_.contactOffset - point.separation;
    if (room > 0) return -room / seconds_;
    return lacks > 0 ? std::min(0.25 * lacks / seconds_, 1.0) : 0;
  }

  void correct(ReferenceConstraint& row) {
    const Velocities velocities = getVelocities(row);
    Velocities apart = getCorrections(row);
    for (ReferencePoint& point : row.points) {
      const double also =
          point.separation > step_.contactOffset ? computeSpeed(point.normal, velocities) : 0;
      const double lacks =
          computeCorrectionSpeed(point) - (computeSpeed(point.normal, apart) + also);
      const double impulse = std::max(0.0, point.correction + point.mass * lacks);
      applyImpulse(row, point.normal, impulse - point.correction, apart);
      point.correction = impulse;
      if (impulse > 0) ++happened_.parted;
    }
    SolverBody &a = solverBodies_[row.patch->a], &b = solverBodies_[row.patch->b];
    if (a.isDynamic())
      a.correctionVelocity = apart.velocityA, a.correctionAngularVelocity = apart.spinA;
    if (b.isDynamic())
      b.correctionVelocity = apart.velocityB, b.correctionAngularVelocity = apart.spinB;
  }

  void substep() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (!solverBodies_[i].isDynamic()) continue;
      bodies_[i].angularVelocity = solverBodies_[i].angularVelocity;
      applyGyroscopicTorque(bodies_[i], seconds_);
      solverBodies_[i].angularVelocity = bodies_[i].angularVelocity;
      solverBodies_[i].velocity += seconds_ * step_.gravity;
    }
    for (ReferenceConstraint& row : rows_) warmStart(row);
    for (int i = 0; i < step_.iterations; ++i)
      for (ReferenceConstraint& row : rows_) iterate(row);
    for (SolverBody& body : solverBodies_)
      body.correctionVelocity = body.correctionAngularVelocity = Vec3::Zero();
    for (ReferenceConstraint& row : rows_)
      for (ReferencePoint& point : row.points) point.correction = 0;
    for (int i = 0; i < 2; ++i)
      for (ReferenceConstraint& row : rows_) correct(row);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      bodies_[i].velocity = solverBodies_[i].velocity + solverBodies_[i].correctionVelocity;
      bodies_[i].angularVelocity =
          solverBodies_[i].angularVelocity + solverBodies_[i].correctionAngularVelocity;
      integratePose(bodies_[i], seconds_);
    }
    for (ReferenceConstraint& row : rows_) {
      for (ReferencePoint& point : row.points) {
        const double both = computeSpeed(point.normal, getVelocities(row)) +
                            computeSpeed(point.normal, getCorrections(row));
        point.separation += seconds_ * both;
        point.sum += point.impulse;
      }
    }
  }

  void applyRestitution(ReferenceConstraint& row) {
    const double e = row.patch->restitution;
    if (e == 0) return;
    const double minArrivalSpeed = 4 * step_.gravity.norm() * step_.seconds;
    Velocities velocities = getVelocities(row);
    for (const ReferencePoint& point : row.points) {
      if (point.sum <= 0 || point.arrival > -minArrivalSpeed) continue;
      const double lacks = -e * point.arrival - computeSpeed(point.normal, velocities);
      const double back = std::clamp(point.mass * lacks, 0.0, e * point.sum);
      applyImpulse(row, point.normal, back, velocities);
      if (back > 0) ++happened_.bounced;
    }
    apply(row, velocities);
  }

  void store() {
    for (std::size_t i = 0; i < bodies_.size(); ++i)
      bodies_[i].velocity = solverBodies_[i].velocity,
      bodies_[i].angularVelocity = solverBodies_[i].angularVelocity;
    for (const ReferenceConstraint& row : rows_) {
      ContactConstraint& patch = all_[static_cast<std::size_t>(row.patch - all_.data())];
      for (std::size_t i = 0; i < patch.pointCount; ++i) {
        patch.points[i].separation = row.points[i].separation;
        patch.points[i].impulse = row.points[i].impulse;
        patch.points[i].motorImpulse = row.points[i].motorImpulse;
      }
      patch.tangentImpulse = row.tangent1 * row.first.linear + row.tangent2 * row.second.linear;
      patch.torsionImpulse = row.twist;
    }
  }

  std::span<BodyMotion> bodies_;
  std::span<ContactConstraint> all_;
  const SolverSettings& step_;
  double seconds_;
  std::vector<SolverBody> solverBodies_;
  std::vector<ReferenceConstraint> rows_;
  CaseCounts happened_;
};

// ---- heaps -------------------------------------------------------------------------------------

struct Heap {
  std::vector<BodyMotion> bodies;
  std::vector<ContactConstraint> patches;
  std::vector<SubstepVelocity> substepVelocities;
  std::uint32_t drivenBody = 0;

  std::vector<KinematicBody> listDriven() const { return {{drivenBody, substepVelocities}}; }
};

class HeapMaker {
 public:
  explicit HeapMaker(unsigned seed) : random_(seed) {}

  /// Body 0 is static, body 1 is kinematic. `hub`: number of constraints that touch body 2.
  Heap make(std::size_t bodies, std::size_t patches, std::size_t hub, const SolverSettings& step) {
    Heap heap;
    for (std::size_t i = 0; i < bodies; ++i) heap.bodies.push_back(makeBody(i > 1));
    heap.drivenBody = 1;
    for (int i = 0; i < step.substeps; ++i)
      heap.substepVelocities.push_back({drawVector(0.5), drawVector(1)});
    for (std::size_t i = 0; i < patches; ++i) heap.patches.push_back(makePatch(bodies, i < hub));
    return heap;
  }

 private:
  double drawNumber(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool isOneIn(int many) { return drawNumber(0, many) < 1; }
  Vec3 drawVector(double size) {
    const double x = drawNumber(-size, size), y = drawNumber(-size, size);
    return {x, y, drawNumber(-size, size)};
  }
  std::uint32_t drawIndex(std::size_t from, std::size_t to) {
    return static_cast<std::uint32_t>(
        std::uniform_int_distribution<std::size_t>(from, to)(random_));
  }

  BodyMotion makeBody(bool free) {
    BodyMotion body;
    body.centre = drawVector(1);
    body.velocity = free ? drawVector(3) : Vec3(Vec3::Zero());
    if (!free) return body;
    body.angularVelocity = drawVector(3);
    body.rotation = Quat(1, drawNumber(-1, 1), drawNumber(-1, 1), drawNumber(-1, 1)).normalized();
    body.inverseMass = 1 / drawNumber(0.5, 8);
    body.inertia =
        Vec3(drawNumber(0.1, 0.3), drawNumber(0.1, 0.3), drawNumber(0.1, 0.3)).asDiagonal();
    body.inverseInertia = body.inertia.inverse();
    return body;
  }

  ContactConstraint makePatch(std::size_t bodies, bool atHub) {
    ContactConstraint patch;
    patch.a = atHub ? 2 : drawIndex(0, bodies - 1);
    do patch.b = drawIndex(2, bodies - 1);
    while (patch.b == patch.a);
    if (isOneIn(3)) std::swap(patch.a, patch.b);
    patch.normal = (drawVector(1) + Vec3(0, 1e-3, 0)).normalized();
    patch.friction = isOneIn(3) ? 0 : drawNumber(0.05, 1.2);
    patch.restitution = isOneIn(2) ? 0 : drawNumber(0.1, 0.9);
    patch.pointCount = drawIndex(1, ContactConstraint::kMaxPoints);
    const bool warm = isOneIn(2);
    if (isOneIn(4)) patch.maxPushForce = drawNumber(1, 200), patch.targetSpeed = drawNumber(0.1, 2);
    for (std::size_t i = 0; i < patch.pointCount; ++i) {
      ContactConstraintPoint& point = patch.points[i];
      point.armA = drawVector(0.3), point.armB = drawVector(0.3);
      point.separation = 0.5e-3 * drawNumber(-2, 4);
      if (warm) point.impulse = drawNumber(0, 0.05);
    }
    if (!warm || patch.friction == 0) return patch;
    const Vec3 any = drawVector(0.02);
    patch.tangentImpulse = any - patch.normal.dot(any) * patch.normal;
    patch.torsionImpulse = drawNumber(-0.01, 0.01);
    return patch;
  }

  std::mt19937 random_;
};

std::vector<std::uint32_t> computeOrder(const Heap& heap) {
  std::vector<std::uint8_t> moves;
  for (const BodyMotion& body : heap.bodies) moves.push_back(body.inverseMass > 0);
  return colorConstraints(heap.patches, moves).order;
}

std::vector<std::uint32_t> makeOriginalOrder(const Heap& heap) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < heap.patches.size(); ++i) order.push_back(i);
  return order;
}

/// "" or the first number that differs; the sign of a zero is ignored.
std::string findHeapDifference(const Heap& a, const Heap& b) {
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    const BodyMotion &x = a.bodies[i], &y = b.bodies[i];
    if (x.velocity != y.velocity || x.angularVelocity != y.angularVelocity)
      return "motion of body " + std::to_string(i);
    if (x.centre != y.centre || x.rotation.coeffs() != y.rotation.coeffs())
      return "pose of body " + std::to_string(i);
  }
  for (std::size_t i = 0; i < a.patches.size(); ++i) {
    const ContactConstraint &x = a.patches[i], &y = b.patches[i];
    if (x.tangentImpulse != y.tangentImpulse || x.torsionImpulse != y.torsionImpulse)
      return "friction of patch " + std::to_string(i);
    for (std::size_t k = 0; k < x.pointCount; ++k)
      if (x.points[k].impulse != y.points[k].impulse ||
          x.points[k].motorImpulse != y.points[k].motorImpulse ||
          x.points[k].separation != y.points[k].separation)
        return "point " + std::to_string(k) + " of patch " + std::to_string(i);
  }
  return "";
}

struct Size {
  std::size_t bodies, patches, hub;
};

/// A few constraints, which keep their order; many, which are coloured; and many on one body, more
/// than there are colours.
constexpr Size kSizes[] = {{4, 2, 0}, {12, 9, 0}, {40, 150, 6}, {150, 400, 0}, {90, 500, 60}};

void compareWithReference(bool byAvx) {
  CaseCounts all;
  for (const Size& size : kSizes) {
    for (unsigned seed = 1; seed <= 12; ++seed) {
      SCOPED_TRACE(std::to_string(size.patches) + " patches, seed " + std::to_string(seed));
      SolverSettings step;
      step.useAvx = byAvx;
      step.substeps = 1 + static_cast<int>(seed % 4);
      step.iterations = 1 + static_cast<int>(seed % 3);
      const Heap start = HeapMaker(seed).make(size.bodies, size.patches, size.hub, step);
      Heap slow = start;
      const bool few = size.patches < kSmallConstraintThreshold;
      const CaseCounts one = ReferenceSolver(slow.bodies, slow.patches, step,
                                             few ? makeOriginalOrder(slow) : computeOrder(slow))
                                 .solve(slow.listDriven());
      all.slid += one.slid, all.held += one.held, all.pushed += one.pushed;
      all.bounced += one.bounced, all.parted += one.parted, all.free += one.free;
      for (const int threads : {1, 2}) {
        Heap fast = start;
        ThreadPool workers(threads);
        solveConstraints(fast.bodies, fast.patches, fast.listDriven(), step, workers);
        EXPECT_EQ(findHeapDifference(slow, fast), "") << threads << " threads";
        EXPECT_NE(findHeapDifference(start, fast), "");
      }
    }
  }
  for (const int count : {all.slid, all.held, all.pushed, all.bounced, all.parted, all.free})
    EXPECT_GT(count, 1000);
}

TEST(SolverReference, FourParallelPatchesEqualSequentialOnes) {
  compareWithReference(false);
}

TEST(SolverReference, FourPatchesInWideRegistersEqualSequentialOnes) {
  if (!collision::hasAvx())
    GTEST_SKIP() << "this processor has no AVX: only the scalar path was compared";
  compareWithReference(true);
}

TEST(SolverReference, APatchWithoutPointsDoesNothing) {
  SolverSettings step;
  Heap heap = HeapMaker(1).make(40, 150, 6, step), more = heap;
  for (std::uint32_t i = 2; i < 30; ++i) {
    ContactConstraint none;
    none.a = i, none.b = i + 1, none.friction = 0.5;
    more.patches.push_back(none);
  }
  for (Heap* each : {&heap, &more}) {
    ThreadPool workers(2);
    solveConstraints(each->bodies, each->patches, each->listDriven(), step, workers);
  }
  EXPECT_EQ(findHeapDifference(heap, more), "");
}

}  // namespace
}  // namespace enfilade::scene
