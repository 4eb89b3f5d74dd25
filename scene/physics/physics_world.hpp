// Free bodies among all that they can meet: one step of their motion, from contacts to rest. What
// pairs may meet is told from outside (a broad phase); nothing here knows a world.
#pragma once

#include <vector>

#include "scene/physics/body_pair.hpp"
#include "scene/physics/joint.hpp"
#include "scene/physics/solver.hpp"

namespace enfilade::scene {

struct Dynamics {
  std::vector<Solid> solids;
  std::vector<Joint> joints;    ///< of solids
  std::vector<NearPair> pairs;  ///< ascending by key: set by setPairs()
};

/// When a body sleeps, and when not.
struct RestLimits {
  double calmSpeed = 0.01;  ///< m/s: no point is faster
  double calmFor = 0.5;     ///< seconds
};

struct DynamicsStep {
  SolverStep solver;
  RestLimits rest;
  Workers* workers = nullptr;  ///< who do it; the result is the same. null: the caller alone
};

struct DynamicsReport {
  std::uint32_t awake = 0;      ///< free solids
  std::uint32_t looks = 0;      ///< pairs whose shapes were looked at
  std::uint32_t patches = 0;    ///< given to the solver
  std::uint32_t leaning = 0;    ///< of those, nearer than 2 epsilon
  std::uint32_t islands = 0;    ///< awake ones
  std::uint32_t proofs = 0;     ///< pairs whose way had to be proved clear
  std::uint32_t shortened = 0;  ///< free solids that went less far than the solver had it
  std::uint32_t squeezed = 0;   ///< pairs of which a driven solid runs into a free one that has no
                                ///< way out: they may penetrate
  double deepest = 0;           ///< metres: penetration at the start of the step
};

/// A sphere that no point of a free solid leaves in a step; metres.
struct ReachSphere {
  Vec3 centre = Vec3::Zero();
  double radius = 0;
};
ReachSphere reachSphere(const Solid& solid);

/// Whether what stays in these spheres can come within `lookout` metres of one another.
inline bool mayMeet(const ReachSphere& a, const ReachSphere& b, double lookout) {
  const double reach = (a.radius + b.radius + lookout) * (1 + 0x1p-40);
  return !((a.centre - b.centre).squaredNorm() > reach * reach);
}

/// The pairs that may meet in the next steps; ascending, a < b, at least one of them free. What is
/// known of a pair that was there before is kept. `workers`: who do it; null: the caller alone.
void setPairs(Dynamics& dynamics, std::span<const PartPairKey> candidates,
              Workers* workers = nullptr);

/// Goes on by one step. Free bodies that were separated from all that stands or is free stay so, by
/// the exact verdict and all the way: a body that the solver would bring through another is stopped
/// on its way.
DynamicsReport step(Dynamics& dynamics, const DynamicsStep& settings);

/// Nothing that was found out about pairs of this solid holds any more: its shape is another one.
void forgetPairsOf(Dynamics& dynamics, std::uint32_t solid);

}  // namespace enfilade::scene
