// Proof for one plane. A plane with normal n separates the bodies by g0 at the start and by g1 at
// the end. If all vertices moved straight and uniformly, the gap along n would be concave in time
// (a minimum of linear functions), so at least (1 - t) g0 + t g1. A vertex at radius rho that
// rotates by theta about the centre departs from its chord by at most rho theta^2 t (1 - t) / 2,
// since abs(p'') = rho theta^2. With B = (rho_A theta_A^2 + rho_B theta_B^2) / 2 the gap stays
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
double computeRotationAngle(const InterpolatedMotion& motion) {
  const Quat to = nearestRotation(motion.fromRotation, motion.toRotation);
  const double s = 0.5 * (to.coeffs() - motion.fromRotation.coeffs()).norm();
  return 4 * s * (1 + s * s) * kRoundUpFactor;
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

/// The whole motion of two shapes, or a part of it.
struct MovingPair {
  const ConvexShape& shapeA;
  const ConvexShape& shapeB;
  const InterpolatedMotion& a;
  const InterpolatedMotion& b;

  PlacedConvex placedA(bool atEnd) const { return place(shapeA, a, atEnd); }
  PlacedConvex placedB(bool atEnd) const { return place(shapeB, b, atEnd); }

  /// Certified separation along a unit axis, at the start or the end.
  double separationAlong(const Vec3& axis, bool atEnd) const {
    return computeAxisSeparation(placedA(atEnd), placedB(atEnd), axis).lowerBound;
  }
  double chordDeviation() const { return computeChordDeviation(a) + computeChordDeviation(b); }

 private:
  static PlacedConvex place(const ConvexShape& shape, const InterpolatedMotion& motion,
                            bool atEnd) {
    return {shape.vertices, atEnd ? motion.toPosition : motion.fromPosition,
            atEnd ? &motion.toMatrix : &motion.fromMatrix, shape.hull};
  }
  static double computeChordDeviation(const InterpolatedMotion& motion) {
    return motion.radius * motion.rotationAngle * motion.rotationAngle / 2 * kRoundUpFactor;
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
                   std::uint32_t& queries) {
  Sample sample{hint, 0, 0};
  const SeparationResult result =
      computeSeparation(pair.placedA(atEnd), pair.placedB(atEnd), sample.cache);
  ++queries;
  if (result.verdict == Verdict::separated)
    sample.lowerBound = sample.axisLowerBound = result.distance - result.errorBound;
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
  const double approach =
      computeApproachBound(computeDisplacementBound(pair.a), computeDisplacementBound(pair.b));
  if (approach < start.lowerBound || approach < end.lowerBound) return true;
  const double deviation = pair.chordDeviation();
  return isSeparatedByPlane(start.axisLowerBound, separationAlong(pair, start.cache, true),
                            deviation) ||
         isSeparatedByPlane(separationAlong(pair, end.cache, false), end.axisLowerBound, deviation);
}

/// Returns the fraction of the motion that is proved clear. The end may be unseparated.
double searchClearFraction(const MovingPair& pair, const Sample& start, const Sample& end,
                           int halvings, std::uint32_t& queries) {
  if (end.lowerBound > 0 && isProvenClear(pair, start, end)) return 1;
  if (halvings == 0) return 0;
  const CentrePose middleA = computeMiddlePose(pair.a), middleB = computeMiddlePose(pair.b);
  const InterpolatedMotion firstA = makeFirstHalf(pair.a, middleA),
                           firstB = makeFirstHalf(pair.b, middleB);
  const MovingPair firstHalf{pair.shapeA, pair.shapeB, firstA, firstB};
  const Sample middle = querySample(firstHalf, true, start.cache, queries);
  const double first = searchClearFraction(firstHalf, start, middle, halvings - 1, queries);
  if (first < 1) return 0.5 * first;
  const InterpolatedMotion secondA = makeSecondHalf(pair.a, middleA),
                           secondB = makeSecondHalf(pair.b, middleB);
  return 0.5 + 0.5 * searchClearFraction({pair.shapeA, pair.shapeB, secondA, secondB}, middle, end,
                                         halvings - 1, queries);
}

}  // namespace

void updateDerived(InterpolatedMotion& motion) {
  ENFILADE_ASSERT(!(std::abs(motion.fromRotation.squaredNorm() - 1) > 1e-6) &&
                  !(std::abs(motion.toRotation.squaredNorm() - 1) > 1e-6));
  motion.rotationAngle = computeRotationAngle(motion);
  motion.fromMatrix = motion.fromRotation.toRotationMatrix();
  motion.toMatrix = motion.toRotation.toRotationMatrix();
  motion.fromPosition = motion.fromCentre - motion.fromMatrix * motion.centreInFrame;
  motion.toPosition = motion.toCentre - motion.toMatrix * motion.centreInFrame;
}

double computeMaxDisplacement(const InterpolatedMotion& motion) {
  const Vec3 displacement = motion.toCentre - motion.fromCentre;
  return (displacement.norm() + motion.rotationAngle * motion.radius) * kRoundUpFactor;
}

DisplacementBound computeDisplacementBound(const InterpolatedMotion& motion) {
  return {motion.toCentre - motion.fromCentre, motion.rotationAngle * motion.radius};
}

double computeApproachBound(const DisplacementBound& a, const DisplacementBound& b) {
  return ((a.displacement - b.displacement).norm() + a.rotationalBound + b.rotationalBound) *
         kRoundUpFactor;
}

CentrePose computeMiddlePose(const InterpolatedMotion& motion) {
  return computeMiddlePose({motion.fromCentre, motion.fromRotation},
                           {motion.toCentre, motion.toRotation});
}

InterpolatedMotion makeFirstHalf(const InterpolatedMotion& motion, const CentrePose& middle) {
  InterpolatedMotion half = motion;
  half.toCentre = middle.centre, half.toRotation = middle.rotation;
  updateDerived(half);
  return half;
}

InterpolatedMotion makeSecondHalf(const InterpolatedMotion& motion, const CentrePose& middle) {
  InterpolatedMotion half = motion;
  half.fromCentre = middle.centre, half.fromRotation = middle.rotation;
  updateDerived(half);
  return half;
}

InterpolatedMotion truncateMotion(const InterpolatedMotion& motion, double fraction) {
  if (fraction == 1 || motion.isStationary) return motion;
  ENFILADE_ASSERT(fraction >= 0 && fraction < 1);
  ENFILADE_ASSERT(fraction * kFractionSteps == std::floor(fraction * kFractionSteps));
  // The interval that remains; only the result gets its derived fields.
  CentrePose from{motion.fromCentre, motion.fromRotation};
  CentrePose to{motion.toCentre, motion.toRotation};
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
  return makeFirstHalf(motion, from);
}

double computeClearFractionAlong(const InterpolatedShape& a, const InterpolatedShape& b,
                                 const Vec3& axis) {
  const MovingPair pair{a.shape, b.shape, a.motion, b.motion};
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
    const MovingPair done{a.shape, b.shape, doneA, doneB};
    const double atFraction = done.separationAlong(axis, true);
    if (atFraction > 0 &&
        isSeparatedByPlane(done.separationAlong(axis, false), atFraction, done.chordDeviation()))
      return fraction;
  }
  return -1;
}

bool isSeparatedAtEnd(const InterpolatedShape& a, const InterpolatedShape& b, FeatureCache cache) {
  const MovingPair pair{a.shape, b.shape, a.motion, b.motion};
  // The distance is not needed: the query ends when separation is certain.
  const auto result = computeSeparationWithin(pair.placedA(true), pair.placedB(true), 0, cache);
  return !result || result->verdict == Verdict::separated;
}

ClearanceResult computeClearance(const InterpolatedShape& a, const InterpolatedShape& b,
                                 const FeatureCache& cache, double lowerBound) {
  const MovingPair pair{a.shape, b.shape, a.motion, b.motion};
  ClearanceResult result{0, 0};
  const Sample start = lowerBound > 0
                           ? Sample{cache, lowerBound, separationAlong(pair, cache, false)}
                           : querySample(pair, false, cache, result.queries);
  if (!(start.lowerBound > 0)) return result;
  const Sample end = querySample(pair, true, start.cache, result.queries);
  result.fraction = searchClearFraction(pair, start, end, kMaxHalvings, result.queries);
  ENFILADE_ASSERT(result.fraction >= 0 && result.fraction <= 1);
  return result;
}

}  // namespace enfilade::collision
