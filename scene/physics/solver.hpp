// Contact solver: sequential impulses with substeps. Free functions on plain arrays; only the
// impulses in constraints persist. It uses only + - * / and sqrt, in an order that
// the constraints alone determine.
#pragma once

#include <span>
#include <vector>

#include "scene/base/thread_pool.hpp"
#include "scene/physics/contact_constraint.hpp"
#include "scene/physics/physics_body.hpp"

namespace enfilade::scene {

struct SolverSettings {
  double seconds = 1.0 / 60;      ///< of the whole step, > 0
  int substeps = 4;               ///< >= 1
  int iterations = 4;             ///< velocity iterations per substep, >= 1
  Vec3 gravity{0, -9.80665, 0};   ///< m/s^2
  double contactOffset = 0.5e-3;  ///< metres: bodies rest at a gap between half of it and all of it
  bool useAvx = true;             ///< use AVX where the processor has it; the result is the same
};

/// A body of inverse mass 0 whose velocity changes from substep to substep.
struct KinematicBody {
  std::uint32_t body = 0;
  std::span<const SubstepVelocity> substepVelocities;  ///< one for each substep
};

/// Advances the bodies by one step. Contact points keep a separation of contactOffset, to first
/// order and as far as the iterations converge. Closer points separate without gaining velocity.
/// Bodies of inverse mass 0 keep their velocity. Impulses are those of one substep. The result does
/// not depend on the number of threads.
void solveConstraints(std::span<BodyMotion> motions, std::span<ContactConstraint> constraints,
                      std::span<const KinematicBody> kinematicBodies,
                      const SolverSettings& settings, ThreadPool& pool);

}  // namespace enfilade::scene
