// Constraint rows of the solver, computed once per step. Private to solver.cpp and solver_rows.cpp.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "scene/base/thread_pool.hpp"
#include "scene/physics/contact_constraint.hpp"
#include "scene/physics/simd.hpp"

namespace enfilade::scene {

/// Velocity and inverse mass of a body in the solver. Bodies that impulses do not move are never
/// written to, because constraints that share one are solved in parallel.
struct alignas(64) SolverBody {
  Vec3 velocity, angularVelocity;
  Vec3 correctionVelocity, correctionAngularVelocity;  ///< of the solver's step 4
  double inverseMass;
  Mat3 inverseInertia;  ///< world axes

  bool isDynamic() const { return inverseMass > 0; }
};

/// Jacobian of one direction between two bodies: an impulse acts on B along it at armB, and on A
/// against it at armA.
struct Jacobian {
  Vec3 linear, angularA, angularB;  ///< angular: arm x linear
  Vec3 responseA, responseB;        ///< rad/s of an impulse of 1

  Jacobian() = default;
  Jacobian(const Vec3& direction, const Vec3& crossA, const Vec3& crossB, const SolverBody& a,
           const SolverBody& b)
      : linear(direction),
        angularA(crossA),
        angularB(crossB),
        responseA(a.inverseInertia * crossA),
        responseB(b.inverseInertia * crossB) {}
  double relativeVelocity(const SolverBody& a, const SolverBody& b) const {
    return linear.dot(b.velocity - a.velocity) + angularB.dot(b.angularVelocity) -
           angularA.dot(a.angularVelocity);
  }
};

/// Change of the velocity along `felt` per impulse along `given`.
inline double computeResponse(const Jacobian& felt, const Jacobian& given, double inverseMasses) {
  return inverseMasses * felt.linear.dot(given.linear) + felt.angularA.dot(given.responseA) +
         felt.angularB.dot(given.responseB);
}

inline double invertOrZero(double value) {
  return value > 0 ? 1 / value : 0;
}

/// Index of an empty lane. An empty lane is all zeroes, between two dummy bodies. Constraints in
/// one block share no dynamic body.
inline constexpr std::uint32_t kNoConstraint = ~0u;

/// Velocities of the bodies of a block: gathered, solved, then scattered.
struct VelocitiesW {
  Vec3W velocityA, angularVelocityA, velocityB, angularVelocityB;
};

/// Angular part of a Jacobian, four wide; see Jacobian.
struct AngularJacobianW {
  Vec3W angularA, angularB, responseA, responseB;

  void set(std::size_t lane, const Jacobian& direction) {
    angularA.set(lane, direction.angularA), angularB.set(lane, direction.angularB);
    responseA.set(lane, direction.responseA), responseB.set(lane, direction.responseB);
  }
  [[gnu::always_inline]] DoubleW relativeVelocity(const Vec3W& direction,
                                                  const VelocitiesW& m) const {
    return dot(direction, m.velocityB - m.velocityA) + dot(angularB, m.angularVelocityB) -
           dot(angularA, m.angularVelocityA);
  }
};

struct ContactConstraintPointW {
  AngularJacobianW normal;
  DoubleW effectiveMass;  ///< of the two bodies at this point, kg
  DoubleW separation;     ///< present separation, metres
  DoubleW approachSpeed;  ///< normal velocity at the start of the step; < 0: approaching
  DoubleW impulse, motorImpulse;
  DoubleW correctionImpulse;  ///< impulse of step 4
  DoubleW totalImpulse;       ///< of the impulses of all substeps in this step
  DoubleW maxImpulse;         ///< maximum over the substeps of impulse plus motor impulse
};

/// Friction at the mean of a constraint's points, four wide.
struct FrictionW {
  Vec3W tangent1, tangent2;
  AngularJacobianW angular1, angular2;
  DoubleW effectiveMass11, effectiveMass12,
      effectiveMass22;  ///< inverse of the response matrix of the tangents
  DoubleW tangentImpulse1, tangentImpulse2;
  Vec3W torsionResponseA, torsionResponseB;  ///< response to a unit torque about the normal
  DoubleW torsionMass, torsionArm, torsionImpulse;
};

/// One of the two bodies of each constraint in a block.
struct ConstraintBodyW {
  std::array<std::uint32_t, kLanes> bodies{};
  std::array<bool, kLanes> isDynamic{};
  DoubleW inverseMass;
};

/// Four contact constraints that are solved together.
struct ContactConstraintW {
  ConstraintBodyW a, b;
  std::array<std::uint32_t, kLanes> constraints{};  ///< indices; kNoConstraint: empty lane
  std::uint32_t firstPoint = 0, pointCount = 0;     ///< of the constraint with most points
  bool hasFriction = false, hasMotor = false, hasRestitution = false;  ///< of any lane
  bool idle = false;  ///< no impulse yet: all impulses are 0
  DoubleW frictionCoefficient, restitution;
  DoubleW targetSpeed, maxMotorImpulse;  ///< motor impulse per point and substep, N s
  Vec3W normal;
  FrictionW frictionRows;

  /// Applies an impulse along `direction` (with its `angular` part) to B, and the opposite to A.
  [[gnu::always_inline]] void applyImpulse(const Vec3W& direction, const AngularJacobianW& angular,
                                           const DoubleW& impulse, VelocitiesW& m) const {
    m.velocityA = m.velocityA - (impulse * a.inverseMass) * direction;
    m.angularVelocityA = m.angularVelocityA - impulse * angular.responseA;
    m.velocityB = m.velocityB + (impulse * b.inverseMass) * direction;
    m.angularVelocityB = m.angularVelocityB + impulse * angular.responseB;
  }
  /// Applies a torque about the normal.
  [[gnu::always_inline]] void applyTorsion(const DoubleW& moment, VelocitiesW& m) const {
    m.angularVelocityA = m.angularVelocityA - moment * frictionRows.torsionResponseA;
    m.angularVelocityB = m.angularVelocityB + moment * frictionRows.torsionResponseB;
  }
};

/// Uninitialised memory that is written before it is read. It only grows.
template <class T>
class ScratchBuffer {
 public:
  std::span<T> allocate(std::size_t count) {
    if (count > size_) store_ = std::make_unique_for_overwrite<T[]>(size_ = 2 * count);
    return {store_.get(), count};
  }

 private:
  std::unique_ptr<T[]> store_;
  std::size_t size_ = 0;
};

/// State of one solve: contacts by color. Each thread keeps it between steps to reuse its memory.
struct SolverContext {
  std::vector<SolverBody> bodies;             ///< one per body, and a dummy
  std::span<ContactConstraintW> constraints;  ///< by color
  /// end of each color in `constraints`; see graph_coloring.hpp
  std::vector<std::uint32_t> colorEnds;
  std::span<ContactConstraintPointW> points;  ///< in the order of their blocks
  double seconds = 0;                         ///< of a substep
  double contactOffset = 0;
  bool useAvx = false;

  ScratchBuffer<ContactConstraintW> constraintBuffer;  ///< memory of `constraints`
  ScratchBuffer<ContactConstraintPointW> pointBuffer;  ///< memory of `points`
};

/// Fills bodies and constraints. `seconds` and `contactOffset` must be set.
void prepareConstraints(std::span<const BodyMotion> motions,
                        std::span<const ContactConstraint> constraints, SolverContext& context,
                        ThreadPool& pool);

}  // namespace enfilade::scene
