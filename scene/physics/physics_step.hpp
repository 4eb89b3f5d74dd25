// One step of rigid-body dynamics: contacts, solver, continuous collision and sleeping.
#pragma once

#include "scene/base/thread_pool.hpp"
#include "scene/physics/physics_world.hpp"
#include "scene/physics/solver.hpp"
#include "scene/physics/step_report.hpp"

namespace enfilade::scene {

/// Sleep thresholds.
struct SleepSettings {
  double sleepVelocity = 0.01;  ///< m/s: bound of the mean speed of a resting body
  double timeToSleep = 0.5;     ///< seconds at rest before a body sleeps
};

struct StepSettings {
  SolverSettings solver;
  SleepSettings sleep;
  ThreadPool* pool = nullptr;  ///< null: the caller's thread alone; the result is the same
};

/// Advances the world by one step. Dynamic bodies that were separated from static and dynamic ones
/// stay separated, by the exact verdict over the whole motion. A body that the solver would move
/// through another is stopped.
StepReport stepPhysics(PhysicsWorld& world, const StepSettings& settings);

}  // namespace enfilade::scene
