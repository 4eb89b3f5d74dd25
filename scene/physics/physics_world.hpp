// One step of rigid-body dynamics: contacts, solver, continuous collision and sleeping. The caller
// supplies candidate pairs (broad phase). Nothing here depends on the scene's world.
#pragma once

#include <vector>

#include "scene/physics/body_pair.hpp"
#include "scene/physics/solver.hpp"

namespace enfilade::scene {

struct PhysicsWorld {
  std::vector<PhysicsBody> bodies;
  std::vector<BodyPair> pairs;  ///< ascending by key; set by setPairs()
};

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

/// Counters of one step.
struct StepReport {
  std::uint32_t awake = 0;               ///< dynamic bodies awake
  std::uint32_t narrowPhaseQueries = 0;  ///< narrow-phase queries
  std::uint32_t constraints = 0;         ///< constraints given to the solver
  std::uint32_t touching = 0;            ///< constraints with a point closer than 2 contactOffset
  std::uint32_t islands = 0;             ///< awake islands
  std::uint32_t continuousChecks = 0;    ///< pairs that needed a continuous check
  std::uint32_t reducedMotions = 0;      ///< bodies that moved less far than the solver result
  /// pairs of a kinematic body and a dynamic one without a way out: they may penetrate
  std::uint32_t crushed = 0;
  double maxPenetration = 0;  ///< metres: maximal penetration at the start of the step
};

/// Bounding sphere of a dynamic body's motion in a step, in metres.
struct MotionSphere {
  Vec3 centre = Vec3::Zero();
  double radius = 0;
};
MotionSphere computeMotionSphere(const PhysicsBody& body);

/// Returns whether the contents of two spheres can come within `margin` metres of each other.
inline bool mayMeet(const MotionSphere& a, const MotionSphere& b, double margin) {
  const double maxDistance = (a.radius + b.radius + margin) * (1 + 0x1p-40);
  return !((a.centre - b.centre).squaredNorm() > maxDistance * maxDistance);
}

/// Replaces the candidate pairs. They are ascending, with a < b, and at least one body is dynamic.
/// State of pairs that existed before is kept. `pool` null: the caller's thread alone.
void setPairs(PhysicsWorld& world, std::span<const PartPairKey> candidates,
              ThreadPool* pool = nullptr);

/// Advances the world by one step. Dynamic bodies that were separated from static and dynamic ones
/// stay separated, by the exact verdict over the whole motion. A body that the solver would move
/// through another is stopped.
StepReport stepPhysics(PhysicsWorld& world, const StepSettings& settings);

/// Discards all pair state of a body. Call it after its shape changed.
void erasePairs(PhysicsWorld& world, std::uint32_t body);

}  // namespace enfilade::scene
