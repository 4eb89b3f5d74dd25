// Conservative advancement (Mirtich 1996, section 2.3; Lin 1993, section 5.1), for any motion:
//  1. Query the separation at the position reached so far: a fraction of the motion, or a time. A
//     plane separates the bodies.
//  2. A bound of the motion certifies that the plane separates them up to a later position. Advance
//     to it and repeat.
// Shape casts bound it by motion_bounds.hpp, the time of impact by time_of_impact.cpp.
#pragma once

#include "collision/assert.hpp"
#include "collision/motion/shape_cast.hpp"

namespace enfilade::collision {

/// In place of a step or a position: the target is reached.
inline constexpr double kArrived = -1;

enum class AdvancementEnd : std::uint8_t { clear, arrived, iterationLimit };

/// Advances `at` (>= 0) up to `end`. `certify(at)` returns the position up to which the motion from
/// `at` is certified, which is at least `end` if its rest is clear, or kArrived.
template <class Certify>
AdvancementEnd advance(double& at, double end, int maxSteps, const Certify& certify) {
  for (int i = 0; i < maxSteps; ++i) {
    ENFILADE_ASSERT(at >= 0 && at <= end);
    const double next = certify(at);
    if (next == kArrived) return AdvancementEnd::arrived;
    if (next >= end) return AdvancementEnd::clear;
    at = next;
  }
  return AdvancementEnd::iterationLimit;
}

struct Advancement {
  double fraction = 0;   ///< certified
  bool arrived = false;  ///< false: clear up to the end of the motion
  bool iterationLimitReached = false;
  double queriedFraction = 0;   ///< of `separation`; below `fraction` at the iteration limit only
  SeparationResult separation;  ///< of the last query
};

/// Advances a motion from fraction `from`. `query(fraction)` returns the separation; nullopt if the
/// rest of the motion is clear. `step(fraction, separation)` returns the certified advance, or
/// kArrived. Counts the queries in `result`.
template <class Query, class Step>
Advancement advanceConservatively(double from, int maxSteps, ShapeCastResult& result,
                                  const Query& query, const Step& step) {
  constexpr double kWhole = 1;
  Advancement advancement;
  advancement.fraction = from;
  const AdvancementEnd end = advance(advancement.fraction, kWhole, maxSteps, [&](double at) {
    const std::optional<SeparationResult> separation = query(at);
    ++result.queries;
    if (!separation) return kWhole;
    if (separation->certificate == Certificate::rational) ++result.exactQueries;
    advancement.separation = *separation;
    advancement.queriedFraction = at;
    const double certified = step(at, *separation);
    return certified == kArrived ? kArrived : at + certified;
  });
  advancement.arrived = end != AdvancementEnd::clear;
  advancement.iterationLimitReached = end == AdvancementEnd::iterationLimit;
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
