// Conservative advancement (Mirtich 1996, section 2.3; Lin 1993, section 5.1), for any motion:
//  1. Query the separation at the fraction reached so far. A plane separates the bodies.
//  2. A bound of the motion (motion_bounds.hpp) certifies that the plane separates them up to a
//     larger fraction. Advance to it and repeat.
#pragma once

#include "collision/assert.hpp"
#include "collision/motion/shape_cast.hpp"

namespace enfilade::collision {

struct Advancement {
  double fraction = 0;   ///< certified
  bool arrived = false;  ///< false: clear up to the end of the motion
  bool iterationLimitReached = false;
  double queriedFraction = 0;   ///< of `separation`; below `fraction` at the iteration limit only
  SeparationResult separation;  ///< of the last query
};

/// In place of a step: the target is reached.
inline constexpr double kArrived = -1;

/// Advances from fraction `from`. `query(fraction)` returns the separation; nullopt if the rest of
/// the motion is clear. `step(fraction, separation)` returns the certified advance, or kArrived.
/// Counts the queries in `result`.
template <class Query, class Step>
Advancement advanceConservatively(double from, int maxSteps, ShapeCastResult& result,
                                  const Query& query, const Step& step) {
  Advancement advancement;
  advancement.fraction = from;
  for (int i = 0; i < maxSteps; ++i) {
    ENFILADE_ASSERT(advancement.fraction >= 0 && advancement.fraction < 1);
    const std::optional<SeparationResult> separation = query(advancement.fraction);
    ++result.queries;
    if (!separation) return advancement;
    if (separation->certificate == Certificate::rational) ++result.exactQueries;
    advancement.separation = *separation;
    advancement.queriedFraction = advancement.fraction;
    const double certified = step(advancement.fraction, *separation);
    advancement.arrived = certified == kArrived;
    if (advancement.arrived || advancement.fraction + certified >= 1) return advancement;
    advancement.fraction += certified;
  }
  advancement.arrived = advancement.iterationLimitReached = true;
  return advancement;
}

/// A distance to advance to, metres.
struct TargetDistance {
  double distance, tolerance;
};

inline constexpr double kArrivalTolerance = 1.0 / 32;  // of (rest - min): tolerance at a target

/// Advances to offset.rest, and from there to offset.min to check that the obstacle really blocks
/// the motion. `cast` advances to a target (advanceTo), and decides where the first target is
/// reached: isLeaving(), for bodies that overlap there, frees the motion; findSecondTarget()
/// returns nullopt if it ends there.
template <class Cast>
void castToOffset(Cast& cast, const ContactOffset& offset, ShapeCastResult& result) {
  ENFILADE_ASSERT(offset.min < offset.rest);
  const double tolerance = kArrivalTolerance * (offset.rest - offset.min);
  Advancement rest = cast.advanceTo({offset.rest, tolerance}, 0, result);
  if (!rest.arrived) return;
  bool blocked = true, limited = rest.iterationLimitReached;
  if (rest.separation.verdict != Verdict::separated) {
    blocked = !cast.isLeaving(rest);
  } else if (!limited) {
    if (const auto target = cast.findSecondTarget(rest, {offset.min, tolerance})) {
      const Advancement min = cast.advanceTo(*target, rest.fraction, result);
      blocked = min.arrived;
      limited = min.iterationLimitReached;
    }
  }
  if (!blocked) return;
  result.stopped = true;
  result.iterationLimitReached = limited;
  result.fraction = rest.fraction;
  result.separationAtStop = rest.separation;
}

}  // namespace enfilade::collision
