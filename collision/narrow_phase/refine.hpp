// Narrow phase, level `Refine`: all that decide() says, and every number exact before its last
// rounding. Asked for; the tick does without.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

struct Refinement {
  Verdict verdict = Verdict::separated;
  DecidedBy decidedBy = DecidedBy::filter;                     ///< the verdict
  Feature featureA = Feature::none, featureB = Feature::none;  ///< as Decision's, of these points
  double distance = 0;     ///< metres, within 1e-15 relative; 0 unless separated
  double penetration = 0;  ///< metres, the global depth within 1e-12 relative; 0 unless penetrating
  Vec3 closest = Vec3::Zero();      ///< separated: from A to B; penetrating: moving B by this parts
  Vec3 closestTail = Vec3::Zero();  ///< them. closest + closestTail, unevaluated, is the vector.
  Vec3 pointA = Vec3::Zero();       ///< world: closest points (separated), a common point
  Vec3 pointB = Vec3::Zero();       ///< (touching, penetrating); exact points, rounded
};

/// `cache` as for decide().
Refinement refine(const ConvexBody& a, const ConvexBody& b, FeatureCache& cache);

/// Whether the distance is less than `limit` (metres, exactly this double): exact.
bool isNearerThan(const ConvexBody& a, const ConvexBody& b, double limit, FeatureCache& cache);
/// The same for bodies just decided.
bool isNearerThan(const Decision& decision, const ConvexBody& a, const ConvexBody& b, double limit,
                  FeatureCache& cache);

}  // namespace enfilade::collision
