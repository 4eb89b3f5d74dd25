// Verdict, distance and closest points from exact integers. Internal to the narrow phase.
#pragma once

#include "collision/exact/exact_minkowski.hpp"

namespace enfilade::collision {

/// Every number is the exact one, rounded once.
struct ExactAnswer {
  Verdict verdict = Verdict::separated;
  double distance = 0;                                      ///< metres; 0 unless separated
  Vec3 closest = Vec3::Zero(), closestTail = Vec3::Zero();  ///< from A to B; separated only
  Vec3 normal = Vec3::UnitY();  ///< separated, touching: unit, of a parting plane, from A to B
  Vec3 pointA = Vec3::Zero();   ///< world: closest points; a common point unless separated
  Vec3 pointB = Vec3::Zero();
};

/// `cache` is where to start from (decide() leaves it well), and holds the exact features
/// afterwards. Costs tens of microseconds from good features.
ExactAnswer solveExactly(ExactDifference& difference, FeatureCache& cache);

}  // namespace enfilade::collision
