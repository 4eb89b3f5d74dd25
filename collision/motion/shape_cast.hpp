// Shape cast of a translating convex body against a static one.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

/// The two distances of a shape cast, in metres, 0 < min < rest. A cast stops at about `rest` from
/// an obstacle, but only if the motion would come closer than `min`. The gap between the two lets a
/// body at `rest` slide over the seams of its support.
struct ContactOffset {
  double min;
  double rest;
};

struct ShapeCastResult {
  /// Fraction of the displacement that is free, 0..1; 1 if nothing blocks it.
  double fraction = 1;
  bool stopped = false;
  bool iterationLimitReached = false;  ///< stopped by the iteration limit; contact is not proved
  std::uint32_t queries = 0;           ///< number of narrow-phase queries
  std::uint32_t exactQueries = 0;      ///< number of queries decided by exact arithmetic
  SeparationResult separationAtStop;   ///< at `fraction`; normal from A to B; valid only if stopped
};

/// Moves A by `displacement` (metres, world) against the static B. Up to the resulting fraction, A
/// and B stay at least min(offset.min, initial distance) apart, up to a billionth of the
/// displacement and SeparationResult::errorBound. If they start closer than `min` or overlap, only
/// motions that do not approach are allowed.
ShapeCastResult castShape(const PlacedConvex& a, const Vec3& displacement, const PlacedConvex& b,
                          const ContactOffset& offset, FeatureCache& cache);

}  // namespace enfilade::collision
