// Verdict, distance and closest points from exact integers. Internal to the narrow phase.
#pragma once

#include "collision/exact/exact_minkowski.hpp"
#include "collision/minkowski/verdict.hpp"

namespace enfilade::collision {

/// The exact separation of two convex bodies; every number is rounded once.
struct ExactSeparation {
  Verdict verdict = Verdict::separated;
  double distance = 0;                                      ///< metres; 0 unless separated
  Vec3 closest = Vec3::Zero(), closestTail = Vec3::Zero();  ///< from A to B; separated only
  Vec3 normal = Vec3::UnitY();  ///< separated, touching: unit, of a separating plane, from A to B
  Vec3 pointA = Vec3::Zero();   ///< world: closest points; a common point unless separated
  Vec3 pointB = Vec3::Zero();
};

/// Computes the separation in integers. `cache` is the warm start (computeSeparation() leaves a
/// good one) and receives the exact features. Costs tens of microseconds from a good start.
ExactSeparation computeExactSeparation(ExactMinkowskiDifference& difference, FeatureCache& cache);

}  // namespace enfilade::collision
