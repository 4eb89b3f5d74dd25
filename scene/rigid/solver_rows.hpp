// What the solver iterates over: rows of numbers worked out once a step. Private to solver.cpp and
// solver_rows.cpp.
#pragma once

#include <span>
#include <vector>

#include "scene/rigid/contact_patch.hpp"
#include "scene/rigid/joint.hpp"
#include "scene/rigid/workers.hpp"

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

  /// A moment about the normal.
  void turn(Mover& a, Mover& b, double moment) const {
    if (a.yields()) a.spin -= moment * turnA;
    if (b.yields()) b.spin += moment * turnB;
  }
};

struct PatchRow {
  std::uint32_t a, b;
  std::uint32_t patch;  ///< index of the patch that it is of
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

/// All that is solved: joints in the order of the array, then patches colour by colour.
struct System {
  std::vector<Mover> movers;
  std::vector<PatchRow> patches;       ///< by colour
  std::vector<std::uint32_t> colours;  ///< where each colour ends in `patches`; see colours.hpp
  std::vector<PointRow> points;        ///< in the order of their patches
  std::vector<AngularRow> joints;
  double seconds = 0;  ///< of a substep
  double epsilon = 0;
};

/// Movers and patches; seconds and epsilon are set.
void setUp(std::span<const RigidBody> bodies, std::span<const ContactPatch> patches, System& system,
           Workers& workers);

/// The joints' rows for the poses of now; their impulses are the joints'.
void placeJoints(std::span<const RigidBody> bodies, std::span<const Joint> joints, System& system);

}  // namespace enfilade::scene
