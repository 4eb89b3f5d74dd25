// How far a convex body can move before it comes too near another: translation only.
#pragma once

#include "collision/narrow_phase.hpp"

namespace enfilade::collision {

/// The two distances of a swept move, in metres, 0 < low < high: a move stops at about `high` from
/// an obstacle, but an obstacle stops it only when the move would come nearer than `low`. The band
/// between them lets a body that rests at `high` glide past the seams of what it rests on.
struct StoppingBand {
  double low;
  double high;
};

struct SweepResult {
  /// Part of the displacement that may be made, 0..1; 1 when nothing stops it.
  double fraction = 1;
  bool stopped = false;
  bool boundReached = false;  ///< stopped because the iteration bound was reached, not proved near
  std::uint32_t queries = 0;  ///< narrow-phase queries made
  std::uint32_t rationals = 0;  ///< of those, decided by exact arithmetic
  Decision atStop;              ///< at `fraction`; its normal points from A to B; only when stopped
};

/// Moves A by `displacement` (metres, world) against B, which stands. Along the whole part that is
/// granted, A and B stay at least min(band.low, their distance at the start) apart, up to a
/// billionth of the displacement and what Decision::errorBound states. When they start nearer than
/// `low` (or overlap), only moves that do not close in are granted.
SweepResult sweep(const ConvexBody& a, const Vec3& displacement, const ConvexBody& b,
                  const StoppingBand& band, FeatureCache& cache);

}  // namespace enfilade::collision
