// How bodies that touch or are jointed go on: sequential impulses in small steps. Free functions on
// plain arrays; nothing is kept but the impulses in the patches and joints. Only + - * / and sqrt,
// in an order that the patches alone decide.
#pragma once

#include <span>
#include <vector>

#include "scene/physics/contact_constraint.hpp"
#include "scene/physics/joint.hpp"
#include "scene/physics/physics_body.hpp"
#include "scene/physics/thread_pool.hpp"

namespace enfilade::scene {

struct SolverStep {
  double seconds = 1.0 / 60;     ///< of the whole step, > 0
  int substeps = 4;              ///< >= 1
  int iterations = 4;            ///< of the velocities in a substep, >= 1
  Vec3 gravity{0, -9.80665, 0};  ///< m/s^2
  double epsilon = 0.5e-3;  ///< metres: bodies come to rest between half of it and all of it apart
  bool byAvx = true;        ///< where the processor has it; the result is the same
};

/// A body of inverse mass 0 that changes its motion from substep to substep.
struct DrivenBody {
  std::uint32_t body = 0;
  std::span<const Gait> gaits;  ///< one for each substep
};

/// Moves `bodies` by a step. No patch lets its points come nearer than epsilon, to first order and
/// as far as the iterations converge; points that are nearer part without gaining speed. Bodies
/// whose inverse mass is 0 keep their velocity and go on with it. Impulses are of one substep. The
/// result is the same with any number of workers.
void solve(std::span<RigidBody> bodies, std::span<ContactPatch> patches, std::span<Joint> joints,
           std::span<const DrivenBody> driven, const SolverStep& step, Workers& workers);

}  // namespace enfilade::scene
