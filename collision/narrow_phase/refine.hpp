// Refined narrow phase: the results of computeSeparation() with every number exact before
// its last rounding, and the penetration depth. On request only; the tick does not use it.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// The result of refineSeparation().
struct RefinedSeparation {
  Verdict verdict = Verdict::separated;
  Certificate certificate = Certificate::filter;               ///< of the verdict
  Feature featureA = Feature::none, featureB = Feature::none;  ///< of these points
  double distance = 0;     ///< metres, within 1e-15 relative; 0 unless separated
  double penetration = 0;  ///< metres, the global depth within 1e-12 relative; 0 unless penetrating
  Vec3 closest = Vec3::Zero();      ///< separated: from A to B; penetrating: shortest translation
  Vec3 closestTail = Vec3::Zero();  ///< of B that separates. The vector is closest + closestTail.
  Vec3 pointA = Vec3::Zero();       ///< world: closest points (separated), a common point
  Vec3 pointB = Vec3::Zero();       ///< (touching, penetrating); exact points, rounded
};

/// Computes verdict, distance, depth and points. `cache` as for computeSeparation().
RefinedSeparation refineSeparation(const PlacedConvex& a, const PlacedConvex& b,
                                   FeatureCache& cache);

/// Whether the distance is less than `limit` (metres, taken exactly). The comparison is exact.
bool isCloserThan(const PlacedConvex& a, const PlacedConvex& b, double limit, FeatureCache& cache);
/// The same, given the result of computeSeparation() for the same bodies.
bool isCloserThan(const SeparationResult& separation, const PlacedConvex& a, const PlacedConvex& b,
                  double limit, FeatureCache& cache);

}  // namespace enfilade::collision
