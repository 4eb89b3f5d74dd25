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
#include "scene/physics/swept_pose.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/narrow_phase/axis_separation.hpp"

namespace enfilade::scene {
namespace {

using collision::FeatureCache;
using collision::PlacedConvex;
using collision::Quat;
using collision::Verdict;

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
double computeRotationAngle(const SweptPose& sweep) {
  const Quat to = nearestRotation(sweep.fromRotation, sweep.toRotation);
  const double s = 0.5 * (to.coeffs() - sweep.fromRotation.coeffs()).norm();
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

double computeChordDeviation(const SweptPose& sweep) {
  return sweep.radius * sweep.rotationAngle * sweep.rotationAngle / 2 * kRoundUpFactor;
}

/// A part at the start or the end of its motion.
PlacedConvex placePartAt(const PartShape& part, const SweptPose& sweep, bool atEnd) {
  return {part.vertices, atEnd ? sweep.toPosition : sweep.fromPosition,
          atEnd ? &sweep.toMatrix : &sweep.fromMatrix, part.hull};
}

/// Certified bounds of the pair at one instant.
struct SweepSample {
  FeatureCache cache;
  double lowerBound = 0;      ///< metres, certified distance; 0: not separated
  double axisLowerBound = 0;  ///< the same along the axis of `cache`
};

struct ClearanceSearch {
  const PartShape& partA;
  const PartShape& partB;
  std::uint32_t queries = 0;

  /// Queries the certified distance at the start or the end.
  SweepSample query(const SweptPose& a, const SweptPose& b, bool atEnd, const FeatureCache& hint) {
    SweepSample sample{hint, 0, 0};
    const collision::SeparationResult result = collision::computeSeparation(
        placePartAt(partA, a, atEnd), placePartAt(partB, b, atEnd), sample.cache);
    ++queries;
    if (result.verdict == Verdict::separated)
      sample.lowerBound = sample.axisLowerBound = result.distance - result.errorBound;
    return sample;
  }
  /// Returns the certified separation along the axis of `cache`, at the start or the end.
  double separationAlong(const SweptPose& a, const SweptPose& b, bool atEnd,
                         const FeatureCache& cache) const {
    if (cache.axis.isZero(0)) return 0;
    return collision::computeAxisSeparation(placePartAt(partA, a, atEnd),
                                            placePartAt(partB, b, atEnd),
                                            cache.axis.stableNormalized())
        .lowerBound;
  }
};

/// Returns whether a plane with these gaps at the ends separates the bodies throughout.
bool isSeparatedByPlane(double atStart, double atEnd, double chordDeviation) {
  if (!(atStart > 0) || !(atEnd > 0)) return false;
  const double roots = std::sqrt(atStart) + std::sqrt(atEnd);
  return roots * roots > chordDeviation * kRoundUpFactor;
}

/// Returns whether the two ends alone prove the motion clear.
bool isProvenClear(const ClearanceSearch& search, const SweptPose& a, const SweptPose& b,
                   const SweepSample& start, const SweepSample& end) {
  const double closing = computeClosingBound(a, b);
  if (closing < start.lowerBound || closing < end.lowerBound) return true;
  const double chordDeviation = computeChordDeviation(a) + computeChordDeviation(b);
  return isSeparatedByPlane(start.axisLowerBound, search.separationAlong(a, b, true, start.cache),
                            chordDeviation) ||
         isSeparatedByPlane(search.separationAlong(a, b, false, end.cache), end.axisLowerBound,
                            chordDeviation);
}

/// Returns the fraction of the motion that is proved clear. The end may be unseparated.
double searchClearFraction(ClearanceSearch& search, const SweptPose& a, const SweptPose& b,
                           const SweepSample& start, const SweepSample& end, int halvings) {
  if (end.lowerBound > 0 && isProvenClear(search, a, b, start, end)) return 1;
  if (halvings == 0) return 0;
  const CentrePose middleA = computeMiddlePose(a), middleB = computeMiddlePose(b);
  const SweptPose firstA = makeFirstHalf(a, middleA), firstB = makeFirstHalf(b, middleB);
  const SweepSample middle = search.query(firstA, firstB, true, start.cache);
  const double first = searchClearFraction(search, firstA, firstB, start, middle, halvings - 1);
  if (first < 1) return 0.5 * first;
  return 0.5 + 0.5 * searchClearFraction(search, makeSecondHalf(a, middleA),
                                         makeSecondHalf(b, middleB), middle, end, halvings - 1);
}

}  // namespace

SweptPose makeStationaryPose(const PhysicsBody& body) {
  SweptPose sweep;
  sweep.fromCentre = sweep.toCentre = body.motion.centre;
  sweep.fromRotation = sweep.toRotation = body.motion.rotation;
  sweep.radius = body.radius;
  sweep.centreInFrame = body.centreInFrame;
  sweep.stationaryBody = &body;
  sweep.fromMatrix = sweep.toMatrix = body.rotation;
  sweep.fromPosition = sweep.toPosition = body.position;
  return sweep;
}

void updateDerived(SweptPose& sweep) {
  ENFILADE_ASSERT(!(std::abs(sweep.fromRotation.squaredNorm() - 1) > 1e-6) &&
                  !(std::abs(sweep.toRotation.squaredNorm() - 1) > 1e-6));
  sweep.rotationAngle = computeRotationAngle(sweep);
  // The same expressions as in updateTransform(), equal to the last bit.
  sweep.fromMatrix = sweep.fromRotation.toRotationMatrix();
  sweep.toMatrix = sweep.toRotation.toRotationMatrix();
  sweep.fromPosition = sweep.fromCentre - sweep.fromMatrix * sweep.centreInFrame;
  sweep.toPosition = sweep.toCentre - sweep.toMatrix * sweep.centreInFrame;
}

double computeMaxDisplacement(const SweptPose& sweep) {
  const Vec3 displacement = sweep.toCentre - sweep.fromCentre;
  return (displacement.norm() + sweep.rotationAngle * sweep.radius) * kRoundUpFactor;
}

MotionBound computeMotionBound(const SweptPose& sweep) {
  return {sweep.toCentre - sweep.fromCentre, sweep.rotationAngle * sweep.radius};
}

double computeClosingBound(const MotionBound& a, const MotionBound& b) {
  return ((a.displacement - b.displacement).norm() + a.rotationalBound + b.rotationalBound) *
         kRoundUpFactor;
}

CentrePose computeMiddlePose(const SweptPose& sweep) {
  return computeMiddlePose({sweep.fromCentre, sweep.fromRotation},
                           {sweep.toCentre, sweep.toRotation});
}

SweptPose makeFirstHalf(const SweptPose& sweep, const CentrePose& middle) {
  SweptPose half = sweep;
  half.toCentre = middle.centre, half.toRotation = middle.rotation;
  updateDerived(half);
  return half;
}

SweptPose makeSecondHalf(const SweptPose& sweep, const CentrePose& middle) {
  SweptPose half = sweep;
  half.fromCentre = middle.centre, half.fromRotation = middle.rotation;
  updateDerived(half);
  return half;
}

SweptPose truncateSweep(const SweptPose& sweep, double fraction) {
  if (fraction == 1 || sweep.stationaryBody) return sweep;
  ENFILADE_ASSERT(fraction >= 0 && fraction < 1);
  ENFILADE_ASSERT(fraction * kFractionSteps == std::floor(fraction * kFractionSteps));
  // The interval that remains; only the result gets its derived fields.
  CentrePose from{sweep.fromCentre, sweep.fromRotation};
  CentrePose to{sweep.toCentre, sweep.toRotation};
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
  SweptPose done = sweep;
  done.toCentre = from.centre, done.toRotation = from.rotation;
  updateDerived(done);
  return done;
}

namespace {

/// Returns whether the plane normal to `axis` separates the parts throughout.
bool isSeparatedThroughout(const PartShape& partA, const SweptPose& a, const PartShape& partB,
                           const SweptPose& b, const Vec3& axis) {
  const auto separation = [&](bool atEnd) {
    return collision::computeAxisSeparation(placePartAt(partA, a, atEnd),
                                            placePartAt(partB, b, atEnd), axis)
        .lowerBound;
  };
  const double atEnd = separation(true);
  return atEnd > 0 && isSeparatedByPlane(separation(false), atEnd,
                                         computeChordDeviation(a) + computeChordDeviation(b));
}

}  // namespace

double clearFractionAlong(const PartShape& partA, const SweptPose& a, const PartShape& partB,
                          const SweptPose& b, const Vec3& axis) {
  const auto separation = [&](bool atEnd) {
    return collision::computeAxisSeparation(placePartAt(partA, a, atEnd),
                                            placePartAt(partB, b, atEnd), axis)
        .lowerBound;
  };
  const double atStart = separation(false), atEnd = separation(true);
  const double chordDeviation = computeChordDeviation(a) + computeChordDeviation(b);
  if (isSeparatedByPlane(atStart, atEnd, chordDeviation)) return 1;
  if (!(atStart > 0 && atStart < std::numeric_limits<double>::infinity())) return -1;
  // If the gap changed linearly, it would vanish at this fraction.
  double fraction = std::min(1.0, atStart / (atStart - std::min(0.0, atEnd) + chordDeviation));
  for (int i = 0; i < kMaxAttempts; ++i) {
    fraction = std::floor((1 - kSafetyFraction) * fraction * kFractionSteps) / kFractionSteps;
    if (!(fraction > 0)) return 0;
    if (isSeparatedThroughout(partA, truncateSweep(a, fraction), partB, truncateSweep(b, fraction),
                              axis))
      return fraction;
  }
  return -1;
}

bool isSeparatedAtEnd(const PartShape& partA, const SweptPose& a, const PartShape& partB,
                      const SweptPose& b, FeatureCache cache) {
  // The distance is not needed: the query ends when separation is certain.
  const auto result = collision::computeSeparationWithin(placePartAt(partA, a, true),
                                                         placePartAt(partB, b, true), 0, cache);
  return !result || result->verdict == Verdict::separated;
}

ClearanceResult computeClearance(const PartShape& partA, const SweptPose& a, const PartShape& partB,
                                 const SweptPose& b, const FeatureCache& cache, double lowerBound) {
  ClearanceSearch search{partA, partB};
  SweepSample start{cache, lowerBound, search.separationAlong(a, b, false, cache)};
  if (!(lowerBound > 0)) start = search.query(a, b, false, cache);
  if (!(start.lowerBound > 0)) return {0, search.queries};
  const SweepSample end = search.query(a, b, true, start.cache);
  const double fraction = searchClearFraction(search, a, b, start, end, kMaxHalvings);
  ENFILADE_ASSERT(fraction >= 0 && fraction <= 1);
  return {fraction, search.queries};
}

}  // namespace enfilade::scene
