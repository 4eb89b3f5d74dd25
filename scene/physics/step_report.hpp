// StepReport: counters and measurements of one step of rigid-body dynamics.
#pragma once

#include <cstdint>

namespace enfilade::scene {

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

}  // namespace enfilade::scene
