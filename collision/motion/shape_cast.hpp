// When convex bodies meet: how far one may move (sweep: translation, what the tick uses), and the
// time of impact of two that move and turn.
#pragma once

#include "collision/motion/moving_pose.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"

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

enum class Impact : std::uint8_t {
  none,     ///< proved: they do not meet before the horizon; lo = hi = horizon
  contact,  ///< proved: they meet, for the first time within [lo, hi]
  unproved  ///< apart on all of [0, lo); what comes after, up to hi = horizon, is not known
};

struct TimeOfImpact {
  Impact impact = Impact::none;
  double lo = 0;  ///< seconds: apart at all times before lo
  double hi = 0;  ///< seconds: touching or penetrating at hi (contact only). hi - lo is at most
                  ///< 1e-12 (1 s + hi), and more only where the bodies close in so slowly that the
                  ///< rounding of a turned pose (PairAtTime::error()) hides the time
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B; of the last plane found to part them
  std::uint32_t queries = 0;    ///< narrow-phase queries made
};

/// The first time in [0, horizon] at which A and B touch; horizon >= 0, finite (seconds). `cache`
/// as for decide(), of the bodies at time 0.
TimeOfImpact timeOfImpact(const MovingBody& a, const MovingBody& b, double horizon,
                          FeatureCache& cache);

}  // namespace enfilade::collision
