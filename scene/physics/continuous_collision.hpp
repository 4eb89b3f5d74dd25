// Continuous collision: limits each body's motion to the part that is proved clear. Step 3 at the
// head of physics_step.cpp.
#pragma once

#include "scene/physics/physics_world.hpp"
#include "scene/physics/step_scratch.hpp"

namespace enfilade::scene {

/// Moves the bodies towards the solver's result as far as that is proved clear. Sets the swept
/// poses and the fractions of the motions that are kept.
void clampToProvenMotion(const PhysicsWorld& world, double seconds, double contactOffset,
                         StepScratch& scratch);

}  // namespace enfilade::scene
