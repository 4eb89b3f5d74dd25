// What the solver iterates over: rows of numbers worked out once a step. Private to solver.cpp and
// solver_rows.cpp.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "scene/physics/contact_constraint.hpp"
#include "scene/physics/joint.hpp"
#include "scene/physics/simd.hpp"
#include "scene/physics/thread_pool.hpp"

namespace enfilade::scene {

/// How a body moves, and what an impulse does to it. What impulses do not move is never written to:
/// patches that share it are solved at the same time.
struct alignas(64) Mover {
  Vec3 velocity, spin;
  Vec3 partingVelocity, partingSpin;  ///< of the solver's step 4
  double inverseMass;
  Mat3 inverseInertia;  ///< world axes

  bool yields() const { return inverseMass > 0; }
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
    if (a.yields()) {
      a.velocity -= (impulse * a.inverseMass) * along;
      a.spin -= impulse * turnA;
    }
    if (!b.yields()) return;
    b.velocity += (impulse * b.inverseMass) * along;
    b.spin += impulse * turnB;
  }
  /// The same of step 4's velocities.
  double partingSpeed(const Mover& a, const Mover& b) const {
    return along.dot(b.partingVelocity - a.partingVelocity) + angularB.dot(b.partingSpin) -
           angularA.dot(a.partingSpin);
  }
  void part(Mover& a, Mover& b, double impulse) const {
    if (a.yields()) {
      a.partingVelocity -= (impulse * a.inverseMass) * along;
      a.partingSpin -= impulse * turnA;
    }
    if (!b.yields()) return;
    b.partingVelocity += (impulse * b.inverseMass) * along;
    b.partingSpin += impulse * turnB;
  }
};

/// What an impulse along `given` changes of the speed along `felt`.
inline double response(const Direction& felt, const Direction& given, double inverseMasses) {
  return inverseMasses * felt.along.dot(given.along) + felt.angularA.dot(given.turnA) +
         felt.angularB.dot(given.turnB);
}

inline double inverted(double value) {
  return value > 0 ? 1 / value : 0;
}

/// The patches that are solved side by side share no body that moves; a lane that no patch has is
/// all zeroes, between two bodies that are none.
inline constexpr std::uint32_t kNoPatch = ~0u;

/// How the bodies of a block move: gathered, worked on, put back.
struct Motions {
  Lanes3 velocityA, spinA, velocityB, spinB;
};

/// Directions, without what is along them; see Direction.
struct Turns {
  Lanes3 angularA, angularB, turnA, turnB;

  void put(std::size_t lane, const Direction& direction) {
    angularA.put(lane, direction.angularA), angularB.put(lane, direction.angularB);
    turnA.put(lane, direction.turnA), turnB.put(lane, direction.turnB);
  }
  [[gnu::always_inline]] Lanes speed(const Lanes3& along, const Motions& m) const {
    return dot(along, m.velocityB - m.velocityA) + dot(angularB, m.spinB) - dot(angularA, m.spinA);
  }
};

struct PointBlock {
  Turns normal;
  Lanes mass;        ///< of the two bodies here, kg
  Lanes separation;  ///< metres, now
  Lanes arrival;     ///< speed along the normal at the start of the step; < 0 closing
  Lanes impulse, push;
  Lanes parting;  ///< impulse of step 4
  Lanes sum;      ///< of the impulses of all substeps of this step
  Lanes most;     ///< of impulse and push in a substep of this step
};

/// Friction at the middle of a patch.
struct RubBlock {
  Lanes3 alongFirst, alongSecond;
  Turns first, second;
  Lanes m11, m12, m22;  ///< inverse of the response of the two
  Lanes rub1, rub2;
  Lanes3 turnA, turnB;  ///< of a moment of 1 about the normal
  Lanes twistMass, arm, twist;
};

/// One of the two bodies of each patch.
struct BlockSide {
  std::array<std::uint32_t, kLanes> movers{};
  std::array<bool, kLanes> yields{};
  Lanes inverseMass;
};

struct PatchBlock {
  BlockSide a, b;
  std::array<std::uint32_t, kLanes> patches{};         ///< indices; kNoPatch: none
  std::uint32_t firstPoint = 0, size = 0;              ///< of the patch that has most
  bool rubs = false, pushes = false, bounces = false;  ///< any of them
  bool idle = false;  ///< nothing has pushed yet: all impulses are 0
  Lanes friction, restitution;
  Lanes pushSpeed, mostPush;  ///< the push of one point and substep, N s
  Lanes3 normal;
  RubBlock rub;

  /// An impulse along `along`, `turns`, on B, and against it on A.
  [[gnu::always_inline]] void push(const Lanes3& along, const Turns& turns, const Lanes& impulse,
                                   Motions& m) const {
    m.velocityA = m.velocityA - (impulse * a.inverseMass) * along;
    m.spinA = m.spinA - impulse * turns.turnA;
    m.velocityB = m.velocityB + (impulse * b.inverseMass) * along;
    m.spinB = m.spinB + impulse * turns.turnB;
  }
  /// A moment about the normal.
  [[gnu::always_inline]] void turn(const Lanes& moment, Motions& m) const {
    m.spinA = m.spinA - moment * rub.turnA;
    m.spinB = m.spinB + moment * rub.turnB;
  }
};

struct AngularRow {
  JointRow row;
  Direction direction;
  double mass, impulse, parting;
};

/// Room for so many that are written before they are read. It only grows.
template <class T>
class Room {
 public:
  std::span<T> take(std::size_t count) {
    if (count > size_) store_ = std::make_unique_for_overwrite<T[]>(size_ = 2 * count);
    return {store_.get(), count};
  }

 private:
  std::unique_ptr<T[]> store_;
  std::size_t size_ = 0;
};

/// All that is solved: joints in the order of the array, then patches colour by colour. Kept by
/// each thread from step to step, for its room alone.
struct System {
  std::vector<Mover> movers;           ///< of the bodies, and one of nobody
  std::span<PatchBlock> blocks;        ///< by colour
  std::vector<std::uint32_t> colours;  ///< where each colour ends in `blocks`; see colours.hpp
  std::span<PointBlock> points;        ///< in the order of their blocks
  std::vector<AngularRow> joints;
  double seconds = 0;  ///< of a substep
  double epsilon = 0;
  bool byAvx = false;

  Room<PatchBlock> blockRoom;  ///< of `blocks`
  Room<PointBlock> pointRoom;  ///< of `points`
};

/// Movers and patches; seconds and epsilon are set.
void setUp(std::span<const RigidBody> bodies, std::span<const ContactPatch> patches, System& system,
           Workers& workers);

/// The joints' rows for the poses of now; their impulses are the joints'.
void placeJoints(std::span<const RigidBody> bodies, std::span<const Joint> joints, System& system);

}  // namespace enfilade::scene
