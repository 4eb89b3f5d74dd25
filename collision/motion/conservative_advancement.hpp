// Conservative advancement (Mirtich 1996, section 2.3; Lin 1993, section 5.1), for any motion:
//  1. Query the separation at the position reached so far: a fraction of the motion, or a time. A
//     plane separates the bodies.
//  2. A bound of the motion certifies that the plane separates them up to a later position. Advance
//     to it and repeat.
#pragma once

#include <cmath>
#include <limits>

#include "collision/assert.hpp"
#include "collision/motion/motion_result.hpp"

namespace enfilade::collision {

/// In place of a step or a position: the target is reached.
inline constexpr double kArrived = -1;

/// Advances `at` (>= 0) up to `end`. `certify(at)` returns the position up to which the motion from
/// `at` is certified, which is at least `end` if its rest is clear, or kArrived. `unproved`: the
/// limit of steps.
template <class Certify>
MotionOutcome advance(double& at, double end, int maxSteps, const Certify& certify) {
  for (int i = 0; i < maxSteps; ++i) {
    ENFILADE_ASSERT(at >= 0 && at <= end);
    const double next = certify(at);
    if (next == kArrived) return MotionOutcome::contact;
    if (next >= end) return MotionOutcome::clear;
    at = next;
  }
  return MotionOutcome::unproved;
}

/// Advances a motion from the fraction result.lo. `query(fraction)` returns the separation; nullopt
/// if the rest of the motion is clear. `step(fraction, separation)` returns the certified advance,
/// or kArrived. At the limit of steps, result.separation is of a fraction below result.lo.
template <class Query, class Step>
void advanceFraction(int maxSteps, MotionResult& result, const Query& query, const Step& step) {
  constexpr double kWhole = 1;
  result.outcome = advance(result.lo, kWhole, maxSteps, [&](double at) {
    const std::optional<SeparationResult> separation = query(at);
    result.countQuery(separation ? separation->certificate : Certificate::filter);
    if (!separation) return kWhole;
    result.separation = *separation;
    const double certified = step(at, *separation);
    return certified == kArrived ? kArrived : at + certified;
  });
  if (result.isClear()) result.lo = kWhole;
}

/// Smallest s > 0 with gap - closing s - curvature s^2 / 2 = 0; infinity if there is no such s.
/// gap, curvature >= 0.
inline double findFirstRoot(double gap, double closing, double curvature) {
  if (curvature == 0) return closing > 0 ? gap / closing : std::numeric_limits<double>::infinity();
  const double root = std::sqrt(closing * closing + 2 * curvature * gap);
  return closing > 0 ? 2 * gap / (closing + root) : (root - closing) / curvature;
}

}  // namespace enfilade::collision
