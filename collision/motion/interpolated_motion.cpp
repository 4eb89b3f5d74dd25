// Proof for one plane. A plane with normal n separates the bodies by g0 at the start and by g1 at
// the end. Suppose that all vertices move straight and uniformly. The gap along n is then concave
// in time (a minimum of linear functions), so at least (1 - t) g0 + t g1. Let a vertex at radius
// rho rotate by theta about the centre. Since abs(p'') = rho theta^2, it departs from its chord by
// at most rho theta^2 t (1 - t) / 2. With B = (rho_A theta_A^2 + rho_B theta_B^2) / 2 the gap stays
// positive if
//   g0 / t + g1 / (1 - t) > B; by its minimum: (sqrt g0 + sqrt g1)^2 > B.
// Where neither the plane of the start nor that of the end suffices, the motion is halved. The
// middle of a uniform rotation from q0 to q1 is q0 + q1, normalised, up to rounding.
//
// Where the bodies move by less than their distance, no plane is needed.
//
// Bound of theta from the quaternions: abs(q0 - q1) = 2 sin(theta / 4) for the closer of +-q1.
// Since sin x >= x - x^3 / 6, theta / 4 <= s (1 + s^2) for s = sin(theta / 4) <= sin(pi / 4).
#include "collision/motion/interpolated_motion.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"
#include "collision/narrow_phase/axis_separation.hpp"

namespace enfilade::collision {
namespace {

constexpr double kFractionSteps = 1 << kMaxHalvings;
constexpr int kMaxAttempts = 3;  // to shorten a motion whose plane has no margin left
constexpr double kSafetyFraction =
    0.25;  // of a motion, at each attempt: keeps part of the gap for the next step

/// Returns q1 or -q1, whichever is closer to q0.
Quat nearestRotation(const Quat& q0, const Quat& q1) {
  if (q0.dot(q1) >= 0) return q1;
  return Quat(-q1.w(), -q1.x(), -q1.y(), -q1.z());
}

/// Upper bound in radians.
double computeRotationAngle(const Quat& from, const Quat& to) {
  const double s = 0.5 * (nearestRotation(from, to).coeffs() - from.coeffs()).norm();
  return 4 * s * (1 + s * s) * kRoundUpFactor;
}

void placeFrame(const CentrePose& pose, const Vec3& centreInFrame, RigidTransform& worldFromFrame) {
  worldFromFrame.rotation = pose.rotation.toRotationMatrix();
  worldFromFrame.translation = pose.centre - worldFromFrame.rotation * centreInFrame;
}

PlacedConvex placeAt(const InterpolatedShape& body, bool atEnd) {
  return place(body.shape, atEnd ? body.motion.toFrame : body.motion.fromFrame);
}

double computeChordDeviation(const InterpolatedMotion& motion) {
  return motion.radius * motion.rotationAngle * motion.rotationAngle / 2 * kRoundUpFactor;
}

/// The whole motion of two shapes, or a part of it.
struct MovingPair {
  InterpolatedShape a, b;

  /// Certified separation along a unit axis, at the start or the end.
  double separationAlong(const Vec3& axis, bool atEnd) const {
    return computeAxisSeparation(placeAt(a, atEnd), placeAt(b, atEnd), axis).lowerBound;
  }
  double chordDeviation() const {
    return computeChordDeviation(a.motion) + computeChordDeviation(b.motion);
  }
};

/// Certified bounds of the pair at one instant.
struct Sample {
  FeatureCache cache;
  double lowerBound = 0;      ///< metres, certified distance; 0: not separated
  double axisLowerBound = 0;  ///< the same along the axis of `cache`
};

/// Queries the certified distance at the start or the end.
Sample querySample(const MovingPair& pair, bool atEnd, const FeatureCache& hint,
                   MotionResult& result) {
  Sample sample{hint, 0, 0};
  const SeparationResult separation =
      computeSeparation(placeAt(pair.a, atEnd), placeAt(pair.b, atEnd), sample.cache);
  result.countQuery(separation.certificate);
  if (separation.verdict == Verdict::separated)
    sample.lowerBound = sample.axisLowerBound = separation.distance - separation.errorBound;
  return sample;
}

/// The certified separation along the axis of `cache`.
double separationAlong(const MovingPair& pair, const FeatureCache& cache, bool atEnd) {
  if (cache.axis.isZero(0)) return 0;
  return pair.separationAlong(cache.axis.stableNormalized(), atEnd);
}

/// Returns whether a plane with these gaps at the ends separates the bodies throughout.
bool isSeparatedByPlane(double atStart, double atEnd, double chordDeviation) {
  if (!(atStart > 0) || !(atEnd > 0)) return false;
  const double roots = std::sqrt(atStart) + std::sqrt(atEnd);
  return roots * roots > chordDeviation * kRoundUpFactor;
}

/// Returns whether the two ends alone prove the motion clear.
bool isProvenClear(const MovingPair& pair, const Sample& start, const Sample& end) {
  const double approach = computeApproachBound(computeDisplacementBound(pair.a.motion),
                                               computeDisplacementBound(pair.b.motion));
  if (approach < start.lowerBound || approach < end.lowerBound) return true;
  const double deviation = pair.chordDeviation();
  return isSeparatedByPlane(start.axisLowerBound, separationAlong(pair, start.cache, true),
                            deviation) ||
         isSeparatedByPlane(separationAlong(pair, end.cache, false), end.axisLowerBound, deviation);
}

/// Returns the fraction of the motion that is proved clear. The end may be unseparated.
double searchClearFraction(const MovingPair& pair, const Sample& start, const Sample& end,
                           int halvings, MotionResult& result) {
  if (end.lowerBound > 0 && isProvenClear(pair, start, end)) return 1;
  if (halvings == 0) return 0;
  const InterpolatedMotion &a = pair.a.motion, &b = pair.b.motion;
  const CentrePose middleA = computeMiddlePose(a.from, a.to);
  const CentrePose middleB = computeMiddlePose(b.from, b.to);
  const InterpolatedMotion firstA = replaceEnds(a, a.from, middleA),
                           firstB = replaceEnds(b, b.from, middleB);
  const MovingPair firstHalf{{pair.a.shape, firstA}, {pair.b.shape, firstB}};
  const Sample middle = querySample(firstHalf, true, start.cache, result);
  const double first = searchClearFraction(firstHalf, start, middle, halvings - 1, result);
  if (first < 1) return 0.5 * first;
  const InterpolatedMotion secondA = replaceEnds(a, middleA, a.to),
                           secondB = replaceEnds(b, middleB, b.to);
  const MovingPair secondHalf{{pair.a.shape, secondA}, {pair.b.shape, secondB}};
  return 0.5 + 0.5 * searchClearFraction(secondHalf, middle, end, halvings - 1, result);
}

}  // namespace

void updateDerived(InterpolatedMotion& motion) {
  ENFILADE_ASSERT(!(std::abs(motion.from.rotation.squaredNorm() - 1) > 1e-6) &&
                  !(std::abs(motion.to.rotation.squaredNorm() - 1) > 1e-6));
  motion.rotationAngle = computeRotationAngle(motion.from.rotation, motion.to.rotation);
  placeFrame(motion.from, motion.centreInFrame, motion.fromFrame);
  placeFrame(motion.to, motion.centreInFrame, motion.toFrame);
}

DisplacementBound computeDisplacementBound(const InterpolatedMotion& motion) {
  return {motion.to.centre - motion.from.centre, motion.rotationAngle * motion.radius};
}

double computeApproachBound(const DisplacementBound& a, const DisplacementBound& b) {
  return ((a.displacement - b.displacement).norm() + a.rotationalBound + b.rotationalBound) *
         kRoundUpFactor;
}

CentrePose computeMiddlePose(const CentrePose& from, const CentrePose& to) {
  CentrePose middle;
  middle.centre = 0.5 * (from.centre + to.centre);
  middle.rotation.coeffs() =
      from.rotation.coeffs() + nearestRotation(from.rotation, to.rotation).coeffs();
  const double length = std::sqrt(middle.rotation.squaredNorm());
  ENFILADE_ASSERT(!(length < 1));  // the nearer of two unit quaternions: the sum is longer
  middle.rotation.coeffs() /= length;
  return middle;
}

InterpolatedMotion replaceEnds(const InterpolatedMotion& motion, const CentrePose& from,
                               const CentrePose& to) {
  InterpolatedMotion replaced = motion;
  replaced.from = from, replaced.to = to;
  updateDerived(replaced);
  return replaced;
}

InterpolatedMotion truncateMotion(const InterpolatedMotion& motion, double fraction) {
  if (fraction == 1 || motion.isStationary) return motion;
  ENFILADE_ASSERT(fraction >= 0 && fraction < 1);
  ENFILADE_ASSERT(fraction * kFractionSteps == std::floor(fraction * kFractionSteps));
  CentrePose from = motion.from, to = motion.to;  // the interval that remains
  for (int i = 0; i < kMaxHalvings && fraction > 0; ++i) {
    const CentrePose middle = computeMiddlePose(from, to);
    fraction *= 2;
    if (fraction >= 1) {
      from = middle;
      fraction -= 1;
    } else {
      to = middle;
    }
  }
  return replaceEnds(motion, motion.from, from);
}

double computeClearFractionAlong(const InterpolatedShape& a, const InterpolatedShape& b,
                                 const Vec3& axis) {
  const MovingPair pair{a, b};
  const double atStart = pair.separationAlong(axis, false),
               atEnd = pair.separationAlong(axis, true);
  const double deviation = pair.chordDeviation();
  if (isSeparatedByPlane(atStart, atEnd, deviation)) return 1;
  if (!(atStart > 0 && atStart < std::numeric_limits<double>::infinity())) return -1;
  // If the gap changed linearly, it would vanish at this fraction.
  double fraction = std::min(1.0, atStart / (atStart - std::min(0.0, atEnd) + deviation));
  for (int i = 0; i < kMaxAttempts; ++i) {
    fraction = std::floor((1 - kSafetyFraction) * fraction * kFractionSteps) / kFractionSteps;
    if (!(fraction > 0)) return 0;
    const InterpolatedMotion doneA = truncateMotion(a.motion, fraction),
                             doneB = truncateMotion(b.motion, fraction);
    const MovingPair done{{a.shape, doneA}, {b.shape, doneB}};
    const double atFraction = done.separationAlong(axis, true);
    if (atFraction > 0 &&
        isSeparatedByPlane(done.separationAlong(axis, false), atFraction, done.chordDeviation()))
      return fraction;
  }
  return -1;
}

bool isSeparatedAtEnd(const InterpolatedShape& a, const InterpolatedShape& b, FeatureCache cache) {
  // The distance is not needed: the query ends when separation is certain.
  const auto result = computeSeparationWithin(placeAt(a, true), placeAt(b, true), 0, cache);
  return !result || result->verdict == Verdict::separated;
}

MotionResult computeClearance(const InterpolatedShape& a, const InterpolatedShape& b,
                              const FeatureCache& cache, double lowerBound) {
  const MovingPair pair{a, b};
  MotionResult result{.outcome = MotionOutcome::unproved, .lo = 0};
  const Sample start = lowerBound > 0
                           ? Sample{cache, lowerBound, separationAlong(pair, cache, false)}
                           : querySample(pair, false, cache, result);
  if (!(start.lowerBound > 0)) return result;
  const Sample end = querySample(pair, true, start.cache, result);
  result.lo = searchClearFraction(pair, start, end, kMaxHalvings, result);
  ENFILADE_ASSERT(result.lo >= 0 && result.lo <= 1);
  if (result.lo == 1) result.outcome = MotionOutcome::clear;
  return result;
}

}  // namespace enfilade::collision
