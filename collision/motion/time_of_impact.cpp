// Time of impact by conservative advancement (Mirtich 1996, section 2.3; Lin 1993, section 5.1),
// for bodies with constant acceleration and constant angular velocity.
//
// Steps
//  1. A plane with normal n separates A and B by `gap` at time s.
//  2. Advance by the step that this plane certifies (plane_bound.cpp).
//  3. When the steps become small, times slightly ahead are probed. A crossing of features proves a
//     contact (crossing.hpp), even if no double is the time of the contact. So does a depth above
//     the pose error and, if the pose is exact, touching.
//
// Rounding. The gap is either the exact distance (refineSeparation) minus its relative error, or
// the projection on n with the bound 16 u (S_A + S_B + |T|). It covers four sums of three products.
// S is the magnitude of a body (computeMagnitude), T the vector between the reference points.
#include "collision/motion/time_of_impact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"
#include "collision/motion/conservative_advancement.hpp"
#include "collision/motion/crossing.hpp"
#include "collision/motion/plane_bound.hpp"
#include "collision/narrow_phase/refine.hpp"

namespace enfilade::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMaxSteps = 400;             // steps; 5 to 10 are usual
constexpr int kMaxProbes = 8;              // failed probes during the advance
constexpr double kSmallStep = 0x1p-43;     // of (1 s + time): step below which contacts are probed
constexpr double kMinWindow = 0x1p-46;     // of (1 s + time): first probe window
constexpr double kNarrowWindow = 0x1p-40;  // of (1 s + time): normal probe window, below 1e-12
constexpr double kMaxWindow = 0x1p-24;     // of (1 s + time): last window before `unproved`
constexpr double kSharpGapRatio = 0x1p12;  // gap in errors above which no exact distance is needed
constexpr double kSlack = 64 * kRoundoff;  // of the length of a normal

double findMaxProjection(const PlacedConvex& body, const Vec3& direction) {
  const Vec3 local = body.rotation ? Vec3(body.rotation->transpose() * direction) : direction;
  double best = -kInfinity;
  for (const Vec3& vertex : body.vertices) best = std::max(best, local.dot(vertex));
  return best;
}

/// Gap along the normal of computeSeparation(), recomputed with a rounding bound.
SeparatingPlane makeSeparatingPlane(const Vec3& normal, const PairMotion& at, double poseError) {
  const double size = computeMagnitude(at.a) + computeMagnitude(at.b) + at.offset.norm();
  const double error = 16 * kRoundoff * size + poseError;
  const double gap = (normal.dot(at.offset) - findMaxProjection(at.b.body, -normal)) -
                     findMaxProjection(at.a.body, normal);
  // The length of the normal is 1 up to a few units of rounding.
  return {normal, gap > kSharpGapRatio * error ? (gap - error) * (1 - kSlack) : -kInfinity};
}

/// Rounds `time` to a multiple of a power of two, at most `fineness` (also one) of 1 s + time. A
/// position at a time of few bits is more often exact. Bodies that touch without penetration are
/// then found to touch.
double roundToFewBits(double time, double fineness) {
  constexpr double kMaxUnit = 0x1p900;
  double unit = fineness;
  while (2 * unit <= fineness * (1 + time) && unit < kMaxUnit) unit *= 2;
  const double shift = 0x1.8p52 * unit;
  return (time + shift) - shift;
}

/// Time with the fewest bits in (time, time + ahead]; `time` >= 0, `ahead` > 0.
double findSimplestTime(double time, double ahead) {
  ENFILADE_ASSERT(time >= 0 && ahead > 0);
  double unit = std::exp2(std::floor(std::log2(time + ahead)));
  for (; unit > 0; unit /= 2) {
    const double simple = (std::floor(time / unit) + 1) * unit;
    if (simple > time && simple <= time + ahead) return simple;
  }
  return time + ahead;
}

/// The advancement along the time axis.
class ImpactSearch {
 public:
  ImpactSearch(const MovingBody& a, const MovingBody& b, double horizon, FeatureCache& cache)
      : a_(a),
        b_(b),
        horizon_(horizon),
        cache_(cache),
        radiusA_(computeRadius(a.body, true)),
        radiusB_(computeRadius(b.body, true)) {}

  MotionResult run() {
    double reached = 0;
    const MotionOutcome end =
        advance(reached, horizon_, kMaxSteps, [this](double) { return certify(); });
    if (end == MotionOutcome::clear) {
      finish(MotionOutcome::clear, horizon_, horizon_);
    } else if (!ended_ && !findContactWithin(kMaxWindow)) {
      finish(MotionOutcome::unproved, time_, horizon_);
    }
    return result_;
  }

 private:
  void finish(MotionOutcome outcome, double lo, double hi) {
    ENFILADE_ASSERT(lo <= hi);
    result_.outcome = outcome;
    result_.lo = lo;
    result_.hi = hi;
    ended_ = true;
  }

  PairMotion makePairMotion(const PairAtTime& pair) const {
    const Motion &a = a_.motion, &b = b_.motion;
    return {{pair.a(), Vec3::Zero(), a.angularVelocity, radiusA_},
            {pair.b(), Vec3::Zero(), b.angularVelocity, radiusB_},
            pair.b().translation - pair.a().translation,
            (b.velocity - a.velocity) + time_ * (b.acceleration - a.acceleration),
            b.acceleration - a.acceleration};
  }

  /// Moves time_ to the latest time that a plane certifies. Returns it, the horizon if the rest is
  /// clear, or kArrived if the search has ended or there is no further step.
  double certify() {
    const PairAtTime pair(a_, b_, time_);
    const PairMotion at = makePairMotion(pair);
    const SeparatingPlane plane = findSeparatingPlane(pair, at);
    if (ended_ || !(plane.gap > 0)) return kArrived;
    const double before = time_;
    time_ = addStep(computeCertifiedStep(at, plane, cache_, horizon_ - time_));
    if (time_ >= horizon_) return horizon_;
    const bool stuck = !(time_ > before);
    const bool small = time_ - before < kSmallStep * (1 + time_);
    if (small && probes_ < kMaxProbes && findContactWithin(kNarrowWindow)) return kArrived;
    return stuck ? kArrived : time_;
  }

  /// The latest double that is at most `step` after time_; the horizon if the step leads there.
  double addStep(double step) const {
    ENFILADE_ASSERT(step >= 0 && time_ <= horizon_);
    if (step >= horizon_ - time_) return horizon_;
    double next = time_ + step;
    for (int i = 0; i < 4 && (next - time_) * (1 + 4 * kRoundoff) > step; ++i)
      next *= 1 - 2 * kRoundoff;
    return next > time_ && (next - time_) * (1 + 4 * kRoundoff) <= step ? next : time_;
  }

  SeparatingPlane findSeparatingPlane(const PairAtTime& pair, const PairMotion& at) {
    const SeparationResult separation = computeSeparation(pair.a(), pair.b(), cache_);
    result_.countQuery(separation.certificate);
    if (separation.verdict != Verdict::separated) {
      if (time_ == 0) finish(MotionOutcome::contact, 0, 0);
      return {};
    }
    SeparatingPlane plane = makeSeparatingPlane(separation.normal, at, pair.error());
    if (!(plane.gap > 0)) {
      // To prove a crossing takes less time than an exact distance.
      if (crossingProbes_++ < kMaxProbes && findCrossingWithin(kNarrowWindow)) return {};
      plane = findExactPlane(pair);
    }
    if (plane.gap > 0) {
      result_.separation = separation;
      result_.separation.normal = plane.normal;
    }
    return plane;
  }

  SeparatingPlane findExactPlane(const PairAtTime& pair) {
    const RefinedSeparation refined = refineSeparation(pair.a(), pair.b(), cache_);
    result_.countQuery(refined.certificate);
    const double length = refined.closest.norm();
    if (!(length > 0)) return {};
    const double gap = refined.distance * (1 - 32 * kRoundoff) - pair.error();
    return {refined.closest / length, gap};
  }

  /// True if it is proved that the bodies touch or penetrate at `time` in the exact motion.
  bool isContactAt(double time) {
    const PairAtTime pair(a_, b_, time);
    if (!std::isfinite(pair.error())) return false;
    FeatureCache cache = cache_;
    const RefinedSeparation refined = refineSeparation(pair.a(), pair.b(), cache);
    result_.countQuery(refined.certificate);
    if (refined.verdict == Verdict::separated) return false;
    return pair.error() == 0 || refined.penetration * (1 - 1e-9) > pair.error();
  }

  /// Probes for a contact up to `maxWidth` (of 1 s + time) ahead: for crossings in narrow windows,
  /// then for all contacts, nearest times first. Returns whether the query is decided.
  bool findContactWithin(double maxWidth) {
    ++probes_;
    const auto find = [this](double hi) { return findCrossingBy(hi) || findContactBy(hi); };
    if (findCrossingWithin(kNarrowWindow) || findBy(maxWidth, find) || decideExactly()) return true;
    // Grazing bodies touch at one instant. It can be detected only if it is a double, and then it
    // probably has few bits.
    return findContactBy(std::min(horizon_, findSimplestTime(time_, kNarrowWindow * (1 + time_))));
  }

  /// Calls `find(hi)` for times up to `maxWidth` (of 1 s + time) ahead, nearest first, until it
  /// returns true.
  bool findBy(double maxWidth, const auto& find) const {
    for (double width = kMinWindow; width <= maxWidth; width *= 4)
      if (find(std::min(horizon_, roundToFewBits(time_ + width * (1 + time_), width / 32))))
        return true;
    return false;
  }

  bool findCrossingWithin(double maxWidth) {
    return findBy(maxWidth, [this](double hi) { return findCrossingBy(hi); });
  }

  /// The interval of the proof extends as far back from time_, so that its signs are certain there.
  /// The bodies are separated up to time_: a contact in the interval is not before it.
  bool findCrossingBy(double hi) {
    const double from = std::max(0.0, time_ - (hi - time_));
    const bool cross = from < hi && isCrossingProved(a_, b_, from, hi, cache_);
    if (cross) finish(MotionOutcome::contact, time_, hi);
    return cross;
  }

  /// Decides crossings too close to an edge for findCrossingBy(), and near misses.
  bool decideExactly() {
    if (exactlyUndecided_) return false;
    const std::optional<CrossingTime> time = findExactCrossingTime(a_, b_);
    exactlyUndecided_ = !time;
    if (!time) return false;
    if (time->hi > horizon_)
      finish(MotionOutcome::clear, horizon_, horizon_);
    else
      finish(MotionOutcome::contact, std::max(time->lo, time_), std::max(time->hi, time_));
    return true;
  }

  bool findContactBy(double hi) {
    const bool meet = isContactAt(hi);
    if (meet) finish(MotionOutcome::contact, time_, hi);
    return meet;
  }

  const MovingBody& a_;
  const MovingBody& b_;
  double horizon_;
  FeatureCache& cache_;
  const double radiusA_, radiusB_;
  double time_ = 0;
  int probes_ = 0, crossingProbes_ = 0;
  bool exactlyUndecided_ = false;
  bool ended_ = false;
  MotionResult result_;
};

}  // namespace

MotionResult computeTimeOfImpact(const MovingBody& a, const MovingBody& b, double horizon,
                                 FeatureCache& cache) {
  return ImpactSearch(a, b, horizon, cache).run();
}

}  // namespace enfilade::collision
