// Proof for one plane. A plane with normal n separates the bodies by g0 at the start and by g1 at
// the end. Suppose that all vertices move straight and uniformly. The gap along n is then concave
// in time (a minimum of linear functions), so at least (1 - t) g0 + t g1. Let a vertex at radius
// rho rotate by theta about the centre. Since abs(p'') = rho theta^2, it departs from its chord by
// at most rho theta^2 t (1 - t) / 2. With B = (rho_A theta_A^2 + rho_B theta_B^2) / 2 the gap stays
// positive if
//   g0 / t + g1 / (1 - t) > B; by its minimum: (sqrt g0 + sqrt g1)^2 > B.
// Where neither the plane of the start nor that of the end suffices, the motion is halved. The
// advancement then continues from the position reached to the end of the longest part that is
// proved. The middle of a uniform rotation from q0 to q1 is q0 + q1, normalised, up to rounding.
//
// Where the bodies move by less than their distance, no plane is needed.
//
// Bound of theta from the quaternions: abs(q0 - q1) = 2 sin(theta / 4) for the closer of +-q1.
// Since sin x >= x - x^3 / 6, theta / 4 <= s (1 + s^2) for s = sin(theta / 4) <= sin(pi / 4).
#include "collision/motion/interpolated_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"
#include "collision/motion/conservative_advancement.hpp"
#include "collision/narrow_phase/axis_separation.hpp"

namespace enfilade::collision {
namespace {

constexpr double kFractionSteps = 1 << kMaxHalvings;
constexpr int kMaxAttempts = 3;  // to shorten a motion whose plane has no margin left
constexpr double kSafetyFraction =
    0.25;  // of a motion, at each attempt: keeps part of the gap for the next step

/// Returns q1 or -q1, whichever is closer to q0.
Quat alignHemisphere(const Quat& q0, const Quat& q1) {
  if (q0.dot(q1) >= 0) return q1;
  return Quat(-q1.w(), -q1.x(), -q1.y(), -q1.z());
}

/// Upper bound in radians.
double computeRotationAngle(const Quat& from, const Quat& to) {
  const double s = 0.5 * (alignHemisphere(from, to).coeffs() - from.coeffs()).norm();
  return 4 * s * (1 + s * s) * kRoundUpFactor;
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
  double computeSeparationAlong(const Vec3& axis, bool atEnd) const {
    return computeAxisSeparation(placeAt(a, atEnd), placeAt(b, atEnd), axis).lowerBound;
  }
  double computeChordDeviationSum() const {
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
double computeSeparationAlong(const MovingPair& pair, const FeatureCache& cache, bool atEnd) {
  if (cache.axis.isZero(0)) return 0;
  return pair.computeSeparationAlong(cache.axis.stableNormalized(), atEnd);
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
  const double deviation = pair.computeChordDeviationSum();
  return isSeparatedByPlane(start.axisLowerBound, computeSeparationAlong(pair, start.cache, true),
                            deviation) ||
         isSeparatedByPlane(computeSeparationAlong(pair, end.cache, false), end.axisLowerBound,
                            deviation);
}

/// A position of both motions.
struct Position {
  double fraction = 0;  ///< a multiple of 2^-kMaxHalvings
  CentrePose a, b;
  Sample sample;
};

/// The parts of two motions: the whole, its halves, and so on.
class ClearanceSearch {
 public:
  ClearanceSearch(const MovingPair& whole, const Sample& start, const Sample& end)
      : whole_(whole),
        partA_(whole.a.motion),
        partB_(whole.b.motion),
        start_{0, partA_.from, partB_.from, start} {
    ends_[0] = {1, partA_.to, partB_.to, end};
  }

  /// Advances to the end of the longest part from the position reached that is proved clear, and
  /// returns it; kArrived if none is.
  double certify(MotionResult& result) {
    while (!(getEnd().sample.lowerBound > 0 &&
             isProvenClear(getPart(), start_.sample, getEnd().sample))) {
      if ((getEnd().fraction - start_.fraction) * kFractionSteps <= 1) return kArrived;
      halvePart(result);
    }
    start_ = getEnd();
    if (--endCount_ > 0) takePart();
    return start_.fraction;
  }

 private:
  const Position& getEnd() const { return ends_[endCount_ - 1]; }
  MovingPair getPart() const { return {{whole_.a.shape, partA_}, {whole_.b.shape, partB_}}; }

  /// Makes the part from start_ to the next end.
  void takePart() {
    partA_ = replaceEnds(whole_.a.motion, start_.a, getEnd().a);
    partB_ = replaceEnds(whole_.b.motion, start_.b, getEnd().b);
  }

  void halvePart(MotionResult& result) {
    const Position& end = getEnd();
    Position& middle = ends_[endCount_];
    middle.fraction = 0.5 * (start_.fraction + end.fraction);
    middle.a = computeMiddlePose(start_.a, end.a);
    middle.b = computeMiddlePose(start_.b, end.b);
    ++endCount_;
    takePart();
    middle.sample = querySample(getPart(), true, start_.sample.cache, result);
  }

  const MovingPair& whole_;
  InterpolatedMotion partA_, partB_;  ///< from start_ to the next end
  Position start_;
  std::array<Position, kMaxHalvings + 1> ends_;  ///< of the parts that remain, the next one last
  std::size_t endCount_ = 1;
};

}  // namespace

RigidTransform placeFrame(const CentrePose& pose, const Vec3& centreInFrame) {
  RigidTransform worldFromFrame{pose.rotation.toRotationMatrix(), {}};
  worldFromFrame.translation = pose.centre - worldFromFrame.rotation * centreInFrame;
  return worldFromFrame;
}

void updateDerived(InterpolatedMotion& motion) {
  ENFILADE_ASSERT(!(std::abs(motion.from.rotation.squaredNorm() - 1) > 1e-6) &&
                  !(std::abs(motion.to.rotation.squaredNorm() - 1) > 1e-6));
  motion.rotationAngle = computeRotationAngle(motion.from.rotation, motion.to.rotation);
  motion.fromFrame = placeFrame(motion.from, motion.centreInFrame);
  motion.toFrame = placeFrame(motion.to, motion.centreInFrame);
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
      from.rotation.coeffs() + alignHemisphere(from.rotation, to.rotation).coeffs();
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
  const double atStart = pair.computeSeparationAlong(axis, false),
               atEnd = pair.computeSeparationAlong(axis, true);
  const double deviation = pair.computeChordDeviationSum();
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
    const double atFraction = done.computeSeparationAlong(axis, true);
    if (atFraction > 0 && isSeparatedByPlane(done.computeSeparationAlong(axis, false), atFraction,
                                             done.computeChordDeviationSum()))
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
                           ? Sample{cache, lowerBound, computeSeparationAlong(pair, cache, false)}
                           : querySample(pair, false, cache, result);
  if (!(start.lowerBound > 0)) return result;
  const Sample end = querySample(pair, true, start.cache, result);
  ClearanceSearch search(pair, start, end);
  constexpr double kWhole = 1;
  const MotionOutcome outcome =
      advance(result.lo, kWhole, 1 << kMaxHalvings, [&](double) { return search.certify(result); });
  if (outcome != MotionOutcome::clear) return result;
  result.outcome = outcome;
  result.lo = kWhole;
  return result;
}

}  // namespace enfilade::collision
