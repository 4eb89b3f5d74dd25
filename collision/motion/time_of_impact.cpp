// Time of impact by conservative advancement (Mirtich 1996, section 2.3; Lin 1993, section 5.1),
// for bodies with constant acceleration and constant angular velocity.
//
// Steps
//  1. A plane with normal n separates A and B by `gap` at time s.
//  2. Let the plane rotate, too, at omega. With w = q - p for a vertex p of A and q of B, the
//     separation along the rotated normal n(tau) is the minimum n . w, and
//       (n . w)' = n . (T' - omega x T) + n . ((wB - omega) x rB) - n . ((wA - omega) x rA),
//     where T is the vector from A's reference point to B's, and r from a body's reference point to
//     its vertex. The second derivative is at most K (below). Up to tau the separation is at least
//       f(tau) = gap - tau v - max over A (tau c - g) - max over B (tau c - g) - K tau^2 / 2
//     with the closing speeds v and c. g >= 0 is the distance of a vertex behind the foremost one.
//     f is concave and f(0) > 0: if f(tau) is positive, the bodies are separated up to tau.
//  3. Advance to the root of f. Four rotations of the plane are tried, and the longest step wins:
//     none; with B (a face of B is nearest); with A; and the rotation that keeps both nearest edges
//     in their planes. The right one accounts for all first-order terms, so the steps converge
//     quadratically, like Newton's; without it a swinging door needs hundreds of steps. A further
//     bound treats the bodies as solids of revolution, which only translate.
//  4. When the steps become small, times slightly ahead are probed. A crossing of features proves a
//     contact (crossing.hpp), even if no double is the time of the contact. So does a depth above
//     the pose error and, if the pose is exact, touching.
//
// Departure: Mirtich bounds the speed of all points by one number and never rotates the plane.
//
// K. For a vertex r of a body that rotates at w, with delta = w - omega, in the frame of the plane:
//   omega x (omega x r) - 2 omega x (w x r) + w x (w x r)
//     = delta x (delta x r) + (delta x omega) x r
// (Jacobi), so at most |delta| (|delta| + |omega|) rho, rho the radius. For T: |T''| + 2 |omega|
// |T'| + |omega|^2 |T|, bounded over the step. If omega = 0, only the component of T'' along n
// counts.
//
// Rounding. The gap is either the exact distance (refineSeparation) minus its relative error, or
// the projection on n with the bound 16 u (S_A + S_B + |T|): four sums of three products. All other
// errors are relative to their own terms; kSlack times the sum of these terms is deducted from f.
#include "collision/motion/time_of_impact.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"
#include "collision/motion/conservative_advancement.hpp"
#include "collision/motion/crossing.hpp"
#include "collision/narrow_phase/refine.hpp"

namespace enfilade::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMaxSteps = 400;             // steps; 5 to 10 are usual
constexpr int kMaxRootIterations = 32;     // iterations over the lines of f to find its root
constexpr int kMaxProbes = 8;              // failed probes during the advance
constexpr double kSmallStep = 0x1p-43;     // of (1 s + time): step below which contacts are probed
constexpr double kMinWindow = 0x1p-46;     // of (1 s + time): first probe window
constexpr double kNarrowWindow = 0x1p-40;  // of (1 s + time): normal probe window, below 1e-12
constexpr double kMaxWindow = 0x1p-24;     // of (1 s + time): last window before `unproved`
constexpr double kSharpGapRatio = 0x1p12;  // gap in errors above which no exact distance is needed
constexpr double kSlack = 64 * kRoundoff;  // see the head of this file
constexpr double kMaxGrowth = 16;    // maximum ratio of successive steps with a rotating plane
constexpr int kMaxGrowthSteps = 16;  // attempts at longer steps; a shorter step is also valid

/// A plane that separates the bodies at some time.
struct SeparatingPlane {
  Vec3 normal = Vec3::UnitY();  ///< from A to B
  double gap = -kInfinity;      ///< metres, proved; <= 0 proves nothing
};

/// Contribution of a vertex to the closing of the gap: tau * speed - behind. The maximum counts.
struct Line {
  double speed, behind;
};

struct RotatedBody {
  std::vector<Vec3> vertices;  ///< about the reference point, world axes
  Vec3 angularVelocity;
  double radius;
  double magnitude;  ///< scale of the rounding errors; equals the radius for an exact rotation

  RotatedBody(const PlacedConvex& body, const Motion& motion)
      : angularVelocity(motion.angularVelocity),
        radius(computeRadius(body, true)),
        magnitude(body.rotation ? body.rotation->norm() * computeRadius(body, false) : radius) {
    vertices.reserve(body.vertices.size());
    for (const Vec3& v : body.vertices)
      vertices.push_back(body.rotation ? Vec3(*body.rotation * v) : v);
  }
};

/// State of the pair at one time, as required by f.
struct PairState {
  RotatedBody a, b;
  Vec3 offset, velocity, acceleration;  ///< T, T', T'': of B's reference point from A's

  PairState(const PairAtTime& pair, const Motion& motionA, const Motion& motionB, double time)
      : a(pair.a(), motionA),
        b(pair.b(), motionB),
        offset(pair.b().translation - pair.a().translation),
        velocity((motionB.velocity - motionA.velocity) +
                 time * (motionB.acceleration - motionA.acceleration)),
        acceleration(motionB.acceleration - motionA.acceleration) {}
};

/// f (see the head of this file) for one rotation of the plane.
struct GapBound {
  double gap = 0, speed = 0, curvature = 0;
  std::vector<Line> a, b;  ///< empty: no rotation relative to the plane
};

const Line& findForemostLine(const std::vector<Line>& lines, double tau) {
  ENFILADE_ASSERT(!lines.empty());
  return *std::max_element(lines.begin(), lines.end(), [tau](const Line& p, const Line& q) {
    return tau * p.speed - p.behind < tau * q.speed - q.behind;
  });
}

/// Lower bound of f(tau).
double computeGapBound(const GapBound& f, double tau) {
  double value = f.gap - tau * f.speed - 0.5 * f.curvature * tau * tau;
  double size = f.gap + tau * std::abs(f.speed) + f.curvature * tau * tau;
  for (const auto* lines : {&f.a, &f.b}) {
    if (lines->empty()) continue;
    const Line& line = findForemostLine(*lines, tau);
    value -= tau * line.speed - line.behind;
    size += tau * std::abs(line.speed) + line.behind;
  }
  return value - kSlack * size;
}

/// Time up to which f is proved positive: close to its root, at most `cap`.
double computeCertifiedStep(const GapBound& f, double cap) {
  if (!(f.gap > 0)) return 0;
  double tau = cap;
  for (int i = 0; i < kMaxRootIterations && !(computeGapBound(f, tau) > 0); ++i) {
    double gap = f.gap, speed = f.speed;
    for (const auto* lines : {&f.a, &f.b}) {
      if (lines->empty()) continue;
      const Line& line = findForemostLine(*lines, tau);
      gap += line.behind;
      speed += line.speed;
    }
    // If the root does not decrease, its line was used before: only rounding remains.
    const double root = findFirstRoot(gap, speed, f.curvature);
    if (!(root < tau)) break;
    tau = root;
  }
  for (double reduction = 0x1p-44; reduction < 1; reduction *= 8) {
    if (computeGapBound(f, tau) > 0) return tau;
    tau *= 1 - reduction;
  }
  return 0;
}

std::vector<Line> makeLines(const RotatedBody& body, const Vec3& angularVelocity,
                            const Vec3& towards) {
  std::vector<Line> lines;
  if (angularVelocity.isZero(0)) return lines;
  lines.reserve(body.vertices.size());
  double maxSupport = -kInfinity;
  for (const Vec3& r : body.vertices) maxSupport = std::max(maxSupport, towards.dot(r));
  const double slack = kSlack * body.magnitude;
  const double speedError = kSlack * body.magnitude * angularVelocity.norm();
  for (const Vec3& r : body.vertices)
    lines.push_back({towards.dot(angularVelocity.cross(r)) + speedError,
                     std::max(0.0, maxSupport - towards.dot(r) - slack)});
  return lines;
}

double computeCurvature(const RotatedBody& body, const Vec3& angularVelocity,
                        const Vec3& planeAngularVelocity) {
  const double relative = angularVelocity.norm();
  return relative * (relative + planeAngularVelocity.norm()) * body.radius;
}

/// Bound for a plane that rotates at `planeAngularVelocity`, valid for steps up to `cap`.
GapBound makeGapBound(const PairState& at, const SeparatingPlane& plane,
                      const Vec3& planeAngularVelocity, double cap) {
  const Vec3& n = plane.normal;
  const Vec3 relativeA = at.a.angularVelocity - planeAngularVelocity;
  const Vec3 relativeB = at.b.angularVelocity - planeAngularVelocity;
  GapBound f;
  f.gap = plane.gap;
  const double planeSpeed = planeAngularVelocity.norm();
  f.speed = -n.dot(at.velocity - planeAngularVelocity.cross(at.offset)) +
            kSlack * (at.velocity.norm() + planeSpeed * at.offset.norm());
  f.a = makeLines(at.a, relativeA, n);
  f.b = makeLines(at.b, relativeB, -n);
  const double accelerationNorm = at.acceleration.norm();
  f.curvature = computeCurvature(at.a, relativeA, planeAngularVelocity) +
                computeCurvature(at.b, relativeB, planeAngularVelocity);
  if (planeSpeed > 0) {
    const double maxSpeed = at.velocity.norm() + accelerationNorm * cap;
    const double maxOffsetSpeed =
        planeAngularVelocity.cross(at.offset).norm() + planeSpeed * maxSpeed * cap;
    f.curvature += accelerationNorm + 2 * planeSpeed * maxSpeed + planeSpeed * maxOffsetSpeed +
                   kSlack * planeSpeed * planeSpeed * at.offset.norm();
  } else {
    f.curvature += std::max(0.0, -n.dot(at.acceleration)) + kSlack * accelerationNorm;
  }
  f.curvature *= 1 + kSlack;
  return f;
}

/// Angular velocity of the plane that keeps the two nearest edges parallel to it. nullopt if the
/// nearest features are not two edges.
std::optional<Vec3> findEdgeRotation(const PairState& at, const Vec3& n,
                                     const FeatureCache& features) {
  if (features.size < 2 || features.size > 3) return std::nullopt;
  const VertexPair first = features.pairs[0];
  std::uint32_t otherA = first.a, otherB = first.b;
  for (int i = 1; i < features.size; ++i) {
    if (features.pairs[i].a != first.a) otherA = features.pairs[i].a;
    if (features.pairs[i].b != first.b) otherB = features.pairs[i].b;
  }
  if (otherA == first.a || otherB == first.b) return std::nullopt;
  const std::size_t maxIndex = std::max(first.a, otherA);
  if (maxIndex >= at.a.vertices.size() || std::max(first.b, otherB) >= at.b.vertices.size())
    return std::nullopt;
  const Vec3 edgeA = at.a.vertices[otherA] - at.a.vertices[first.a];
  const Vec3 edgeB = at.b.vertices[otherB] - at.b.vertices[first.b];
  const Vec3 acrossA = edgeA.cross(n), acrossB = edgeB.cross(n);
  // n' . edge = -n . (w x edge) for both, n' . n = 0.
  const Vec3 change = -n.dot(at.a.angularVelocity.cross(edgeA)) / edgeA.dot(acrossB) * acrossB -
                      n.dot(at.b.angularVelocity.cross(edgeB)) / edgeB.dot(acrossA) * acrossA;
  const Vec3 angularVelocity = n.cross(change);
  return angularVelocity.allFinite() ? std::optional(angularVelocity) : std::nullopt;
}

/// Maximum projection on `n` of any vertex for any rotation about the body's axis.
double computeRevolvedSupport(const RotatedBody& body, const Vec3& n) {
  const bool rotates = !body.angularVelocity.isZero(0);
  const Vec3 axis = rotates ? Vec3(body.angularVelocity.normalized()) : Vec3(Vec3::Zero());
  const double axial = n.dot(axis);
  const double radial = (n - axial * axis).norm();
  double maxSupport = -kInfinity;
  for (const Vec3& r : body.vertices) {
    const double height = r.dot(axis);
    maxSupport = std::max(
        maxSupport, rotates ? axial * height + radial * (r - height * axis).norm() : n.dot(r));
  }
  return maxSupport + kSlack * body.magnitude;
}

/// Step for the solids of revolution of the bodies, which only translate. Long for distant bodies
/// and for a body that rotates in free space.
double computeRevolvedStep(const PairState& at, const Vec3& n, double cap) {
  const double accelerationNorm = at.acceleration.norm();
  GapBound f;
  f.gap = n.dot(at.offset) - computeRevolvedSupport(at.a, n) - computeRevolvedSupport(at.b, -n) -
          kSlack * at.offset.norm();
  f.speed = -n.dot(at.velocity) + kSlack * at.velocity.norm();
  f.curvature = std::max(0.0, -n.dot(at.acceleration)) + kSlack * accelerationNorm;
  return computeCertifiedStep(f, cap);
}

/// Time for which the bodies are proved to stay separated, at most `cap`.
double computeLongestStep(const PairState& at, const SeparatingPlane& plane,
                          const FeatureCache& features, double cap) {
  double best = computeCertifiedStep(makeGapBound(at, plane, Vec3::Zero(), cap), cap);
  if (at.a.angularVelocity.isZero(0) && at.b.angularVelocity.isZero(0)) return best;
  best = std::max(best, computeRevolvedStep(at, plane.normal, cap));
  const double length = at.offset.norm();
  if (length > 0) best = std::max(best, computeRevolvedStep(at, at.offset / length, cap));
  const auto tryRotatingPlane = [&](const Vec3& planeAngularVelocity) {
    // The curvature bound grows with the step length, so the step is extended gradually.
    bool reached = !planeAngularVelocity.isZero(0) && best > 0;
    for (int i = 0; i < kMaxGrowthSteps && reached && best < cap; ++i) {
      const double maxStep = std::min(cap, kMaxGrowth * best);
      const double step =
          computeCertifiedStep(makeGapBound(at, plane, planeAngularVelocity, maxStep), maxStep);
      reached = step >= maxStep;
      best = std::max(best, step);
    }
  };
  tryRotatingPlane(at.b.angularVelocity);
  tryRotatingPlane(at.a.angularVelocity);
  if (const auto edgeAngularVelocity = findEdgeRotation(at, plane.normal, features))
    tryRotatingPlane(*edgeAngularVelocity);
  return best;
}

/// Gap along the normal of computeSeparation(), recomputed with a rounding bound.
SeparatingPlane makeSeparatingPlane(const Vec3& normal, const PairState& at, double poseError) {
  double maxA = -kInfinity, minB = kInfinity;
  for (const Vec3& r : at.a.vertices) maxA = std::max(maxA, normal.dot(r));
  for (const Vec3& r : at.b.vertices) minB = std::min(minB, normal.dot(r));
  const double size = at.a.magnitude + at.b.magnitude + at.offset.norm();
  const double error = 16 * kRoundoff * size + poseError;
  const double gap = (normal.dot(at.offset) + minB) - maxA;
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
      : a_(a), b_(b), horizon_(horizon), cache_(cache) {}

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

  /// Moves time_ to the latest time that a plane certifies, and returns it: the horizon if the rest
  /// is clear, kArrived if the search has ended or there is no further step.
  double certify() {
    const PairAtTime pair(a_, b_, time_);
    const PairState at(pair, a_.motion, b_.motion, time_);
    const SeparatingPlane plane = findSeparatingPlane(pair, at);
    if (ended_ || !(plane.gap > 0)) return kArrived;
    const double before = time_;
    time_ = addStep(computeLongestStep(at, plane, cache_, horizon_ - time_));
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

  SeparatingPlane findSeparatingPlane(const PairAtTime& pair, const PairState& at) {
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
