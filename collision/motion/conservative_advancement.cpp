// Time of impact by conservative advancement (Mirtich 1996, section 2.3; seed 5.1), for bodies that
// move with constant acceleration and turn at a constant rate.
//
// Steps
//  1. A plane with normal n parts A and B by `gap` at time s.
//  2. Let the plane turn too, by omega. With w = q - p for a vertex p of A and q of B, the
//  separation
//     along the turned normal n(tau) is the least n . w, and
//       (n . w)' = n . (T' - omega x T) + n . ((wB - omega) x rB) - n . ((wA - omega) x rA),
//     where T leads from A's reference point to B's and r from a body's to its vertex. Its second
//     derivative is at most K (below). So up to tau the separation is at least
//       f(tau) = gap - tau v - max over A (tau c - g) - max over B (tau c - g) - K tau^2 / 2
//     with v and c the closing speeds and g >= 0 how far a vertex lies behind the foremost one. f
//     is concave and f(0) > 0: wherever it is positive, the bodies were apart all the way there.
//  3. Advance to the root of f. Four turns of the plane are tried and the longest step is taken:
//  none;
//     with B (a face of B is nearest); with A; so that both nearest edges stay in their planes. The
//     right one leaves nothing of first order unaccounted for, so that the steps shrink
//     quadratically, as Newton's; without it a swung door needs hundreds of them. Besides, the
//     bodies are taken as solids of revolution, which nothing but their translation moves.
//  4. When the steps have become small, times a little ahead are tried: a depth above the error of
//     the pose proves that the bodies met, and so does a touch where the pose is exact.
//
// Departure: Mirtich bounds the speed of all points by one number and never turns the plane.
//
// K. For a vertex r of a body that turns at w, with delta = w - omega, in the frame of the plane:
//   omega x (omega x r) - 2 omega x (w x r) + w x (w x r) = delta x (delta x r) + (delta x omega) x
//   r
// (Jacobi), so at most |delta| (|delta| + |omega|) rho, rho the radius. For T: |T''| + 2 |omega|
// |T'|
// + |omega|^2 |T|, bounded over the step; with omega = 0 only the part of T'' along n counts.
//
// Rounding. The gap is either the exact distance (refine) less its relative error, or found along n
// with the bound 16 u (S_A + S_B + |T|): four sums of three products. Everything else has errors
// relative to its own terms: the slack of kSlack units of all of them is taken off f.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "collision/motion/shape_cast.hpp"
#include "collision/narrow_phase/refine.hpp"

namespace enfilade::collision {
namespace {

constexpr double kUnit = 0x1p-53;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kAdvanceBound = 400;      // steps; 5 to 10 are usual
constexpr int kActiveBound = 32;        // lines of f that take turns until its root is found
constexpr int kProbeBound = 8;          // times that probing may fail on the way
constexpr double kSmallStep = 0x1p-43;  // of (1 s + time): small enough to look for the contact
constexpr double kNarrow = 0x1p-40;     // the same: below 1e-12
constexpr double kWidest = 0x1p-24;     // the same: after it the contact is called unproved
constexpr double kSharp = 0x1p12;      // gap above this many errors: no need for the exact distance
constexpr double kSlack = 64 * kUnit;  // see the file's head
constexpr double kCapGrowth =
    16;  // a step with the plane turning: at most so much longer than the last
constexpr int kGrowthBound = 16;  // tries of longer steps; a shorter one is right as well

/// A plane that parts the bodies at some time.
struct PartingPlane {
  Vec3 normal = Vec3::UnitY();  ///< from A to B
  double gap = -kInfinity;      ///< metres, proved; <= 0 proves nothing
};

/// What a vertex adds to the closing of the gap: tau * speed - behind, where that is most.
struct Line {
  double speed, behind;
};

struct TurnedBody {
  std::vector<Vec3> vertices;  ///< about the reference point, world axes
  Vec3 spin;
  double radius;
  double reach;  ///< what roundings are relative to: the radius, if the rotation is one

  TurnedBody(const ConvexBody& body, const Motion& motion)
      : spin(motion.angularVelocity),
        radius(radiusOf(body, true)),
        reach(body.rotation ? body.rotation->norm() * radiusOf(body, false) : radius) {
    vertices.reserve(body.vertices.size());
    for (const Vec3& v : body.vertices)
      vertices.push_back(body.rotation ? Vec3(*body.rotation * v) : v);
  }
};

/// The pair at one time, as f needs it.
struct Instant {
  TurnedBody a, b;
  Vec3 apart, velocity, acceleration;  ///< T, T', T'': of B's reference point from A's

  Instant(const PairAtTime& pair, const Motion& motionA, const Motion& motionB, double time)
      : a(pair.a(), motionA),
        b(pair.b(), motionB),
        apart(pair.b().translation - pair.a().translation),
        velocity((motionB.velocity - motionA.velocity) +
                 time * (motionB.acceleration - motionA.acceleration)),
        acceleration(motionB.acceleration - motionA.acceleration) {}
};

/// f of the file's head, for one turn of the plane.
struct GapBound {
  double gap = 0, speed = 0, curvature = 0;
  std::vector<Line> a, b;  ///< empty: nothing turns against the plane
};

const Line& foremost(const std::vector<Line>& lines, double tau) {
  return *std::max_element(lines.begin(), lines.end(), [tau](const Line& p, const Line& q) {
    return tau * p.speed - p.behind < tau * q.speed - q.behind;
  });
}

/// A lower bound of f(tau).
double gapAfter(const GapBound& f, double tau) {
  double value = f.gap - tau * f.speed - 0.5 * f.curvature * tau * tau;
  double size = f.gap + tau * std::abs(f.speed) + f.curvature * tau * tau;
  for (const auto* lines : {&f.a, &f.b}) {
    if (lines->empty()) continue;
    const Line& line = foremost(*lines, tau);
    value -= tau * line.speed - line.behind;
    size += tau * std::abs(line.speed) + line.behind;
  }
  return value - kSlack * size;
}

/// Least tau > 0 with gap - tau speed - curvature tau^2 / 2 = 0; gap > 0, curvature >= 0.
double firstRoot(double gap, double speed, double curvature) {
  const double root = std::sqrt(speed * speed + 2 * curvature * gap);
  if (speed > 0) return 2 * gap / (speed + root);
  return curvature > 0 ? (root - speed) / curvature : kInfinity;
}

/// A time up to which f is proved positive: close to its root, at most `cap`.
double provedStep(const GapBound& f, double cap) {
  if (!(f.gap > 0)) return 0;
  double tau = cap;
  for (int i = 0; i < kActiveBound && !(gapAfter(f, tau) > 0); ++i) {
    double gap = f.gap, speed = f.speed;
    for (const auto* lines : {&f.a, &f.b}) {
      if (lines->empty()) continue;
      const Line& line = foremost(*lines, tau);
      gap += line.behind;
      speed += line.speed;
    }
    // The foremost line at the root itself has been met before: only rounding is left.
    const double root = firstRoot(gap, speed, f.curvature);
    if (!(root < tau)) break;
    tau = root;
  }
  for (double less = 0x1p-44; less < 1; less *= 8) {
    if (gapAfter(f, tau) > 0) return tau;
    tau *= 1 - less;
  }
  return 0;
}

std::vector<Line> linesOf(const TurnedBody& body, const Vec3& spin, const Vec3& towards) {
  std::vector<Line> lines;
  if (spin.isZero(0)) return lines;
  lines.reserve(body.vertices.size());
  double most = -kInfinity;
  for (const Vec3& r : body.vertices) most = std::max(most, towards.dot(r));
  const double slack = kSlack * body.reach;
  const double fast = kSlack * body.reach * spin.norm();
  for (const Vec3& r : body.vertices)
    lines.push_back(
        {towards.dot(spin.cross(r)) + fast, std::max(0.0, most - towards.dot(r) - slack)});
  return lines;
}

double curvatureOf(const TurnedBody& body, const Vec3& spin, const Vec3& planeSpin) {
  const double relative = spin.norm();
  return relative * (relative + planeSpin.norm()) * body.radius;
}

/// The bound for a plane that turns at `spin`, good for steps up to `cap`.
GapBound gapBound(const Instant& at, const PartingPlane& plane, const Vec3& spin, double cap) {
  const Vec3& n = plane.normal;
  const Vec3 spinA = at.a.spin - spin;
  const Vec3 spinB = at.b.spin - spin;
  GapBound f;
  f.gap = plane.gap;
  const double turn = spin.norm();
  f.speed = -n.dot(at.velocity - spin.cross(at.apart)) +
            kSlack * (at.velocity.norm() + turn * at.apart.norm());
  f.a = linesOf(at.a, spinA, n);
  f.b = linesOf(at.b, spinB, -n);
  const double pull = at.acceleration.norm();
  f.curvature = curvatureOf(at.a, spinA, spin) + curvatureOf(at.b, spinB, spin);
  if (turn > 0) {
    const double fastest = at.velocity.norm() + pull * cap;
    const double farthest = spin.cross(at.apart).norm() + turn * fastest * cap;
    f.curvature +=
        pull + 2 * turn * fastest + turn * farthest + kSlack * turn * turn * at.apart.norm();
  } else {
    f.curvature += std::max(0.0, -n.dot(at.acceleration)) + kSlack * pull;
  }
  f.curvature *= 1 + kSlack;
  return f;
}

/// The turn of the plane that keeps two nearest edges in planes of its normal; none when the
/// nearest features are no two edges.
std::optional<Vec3> spinOfEdges(const Instant& at, const Vec3& n, const FeatureCache& features) {
  if (features.size < 2 || features.size > 3) return std::nullopt;
  const VertexPair first = features.pairs[0];
  std::uint32_t otherA = first.a, otherB = first.b;
  for (int i = 1; i < features.size; ++i) {
    if (features.pairs[i].a != first.a) otherA = features.pairs[i].a;
    if (features.pairs[i].b != first.b) otherB = features.pairs[i].b;
  }
  if (otherA == first.a || otherB == first.b) return std::nullopt;
  const std::size_t most = std::max(first.a, otherA);
  if (most >= at.a.vertices.size() || std::max(first.b, otherB) >= at.b.vertices.size())
    return std::nullopt;
  const Vec3 edgeA = at.a.vertices[otherA] - at.a.vertices[first.a];
  const Vec3 edgeB = at.b.vertices[otherB] - at.b.vertices[first.b];
  const Vec3 acrossA = edgeA.cross(n), acrossB = edgeB.cross(n);
  // n' . edge = -n . (w x edge) for both, n' . n = 0.
  const Vec3 change = -n.dot(at.a.spin.cross(edgeA)) / edgeA.dot(acrossB) * acrossB -
                      n.dot(at.b.spin.cross(edgeB)) / edgeB.dot(acrossA) * acrossA;
  const Vec3 spin = n.cross(change);
  return spin.allFinite() ? std::optional(spin) : std::nullopt;
}

/// How far along `n` any vertex can come by turning about the body's axis, however long.
double spunReach(const TurnedBody& body, const Vec3& n) {
  const bool spins = !body.spin.isZero(0);
  const Vec3 axis = spins ? Vec3(body.spin.normalized()) : Vec3(Vec3::Zero());
  const double along = n.dot(axis);
  const double across = (n - along * axis).norm();
  double most = -kInfinity;
  for (const Vec3& r : body.vertices) {
    const double height = r.dot(axis);
    most = std::max(most, spins ? along * height + across * (r - height * axis).norm() : n.dot(r));
  }
  return most + kSlack * body.reach;
}

/// With the bodies spun into solids of revolution only their reference points move: good while they
/// are far apart, and where a body turns in a place that has room for it.
double spunStep(const Instant& at, const Vec3& n, double cap) {
  const double pull = at.acceleration.norm();
  GapBound f;
  f.gap = n.dot(at.apart) - spunReach(at.a, n) - spunReach(at.b, -n) - kSlack * at.apart.norm();
  f.speed = -n.dot(at.velocity) + kSlack * at.velocity.norm();
  f.curvature = std::max(0.0, -n.dot(at.acceleration)) + kSlack * pull;
  return provedStep(f, cap);
}

/// How long the bodies are proved to stay apart, at most `cap`.
double longestStep(const Instant& at, const PartingPlane& plane, const FeatureCache& features,
                   double cap) {
  double best = provedStep(gapBound(at, plane, Vec3::Zero(), cap), cap);
  if (at.a.spin.isZero(0) && at.b.spin.isZero(0)) return best;
  best = std::max(best, spunStep(at, plane.normal, cap));
  const double length = at.apart.norm();
  if (length > 0) best = std::max(best, spunStep(at, at.apart / length, cap));
  const auto tryTurning = [&](const Vec3& spin) {
    // The bound of the curvature grows with the step it is for: longer ones only as they prove
    // good.
    bool reached = !spin.isZero(0) && best > 0;
    for (int i = 0; i < kGrowthBound && reached && best < cap; ++i) {
      const double longest = std::min(cap, kCapGrowth * best);
      const double step = provedStep(gapBound(at, plane, spin, longest), longest);
      reached = step >= longest;
      best = std::max(best, step);
    }
  };
  tryTurning(at.b.spin);
  tryTurning(at.a.spin);
  if (const auto spin = spinOfEdges(at, plane.normal, features)) tryTurning(*spin);
  return best;
}

/// The gap along decide()'s normal, found anew with its rounding bound.
PartingPlane planeAlong(const Vec3& normal, const Instant& at, double poseError) {
  double mostA = -kInfinity, leastB = kInfinity;
  for (const Vec3& r : at.a.vertices) mostA = std::max(mostA, normal.dot(r));
  for (const Vec3& r : at.b.vertices) leastB = std::min(leastB, normal.dot(r));
  const double size = at.a.reach + at.b.reach + at.apart.norm();
  const double error = 16 * kUnit * size + poseError;
  const double gap = (normal.dot(at.apart) + leastB) - mostA;
  // The normal's length is off 1 by a few units of rounding.
  return {normal, gap > kSharp * error ? (gap - error) * (1 - kSlack) : -kInfinity};
}

/// `time` rounded to a multiple of a power of two, at most `fineness` (one too) of 1 s + time. A
/// position at a time of few bits is more often exact, so that bodies that touch and never
/// penetrate are found to touch.
double fewBits(double time, double fineness) {
  constexpr double kLargest = 0x1p900;
  double unit = fineness;
  while (2 * unit <= fineness * (1 + time) && unit < kLargest) unit *= 2;
  const double shift = 0x1.8p52 * unit;
  return (time + shift) - shift;
}

/// The time of fewest bits after `time`, at most `ahead` later; `time` >= 0, `ahead` > 0.
double simplestAfter(double time, double ahead) {
  double unit = std::exp2(std::floor(std::log2(time + ahead)));
  for (; unit > 0; unit /= 2) {
    const double simple = (std::floor(time / unit) + 1) * unit;
    if (simple > time && simple <= time + ahead) return simple;
  }
  return time + ahead;
}

/// The advance along the time axis.
class Advance {
 public:
  Advance(const MovingBody& a, const MovingBody& b, double horizon, FeatureCache& cache)
      : a_(a), b_(b), horizon_(horizon), cache_(cache) {}

  TimeOfImpact run() {
    for (int i = 0; i < kAdvanceBound; ++i) {
      const PairAtTime pair(a_, b_, time_);
      const Instant at(pair, a_.motion, b_.motion, time_);
      const PartingPlane plane = partingPlane(pair, at);
      if (ended_) return result_;
      if (!(plane.gap > 0)) break;
      result_.normal = plane.normal;
      const double before = time_;
      advance(longestStep(at, plane, cache_, horizon_ - time_));
      if (ended_) return result_;
      const bool stuck = !(time_ > before);
      const bool small = time_ - before < kSmallStep * (1 + time_);
      if (small && probes_ < kProbeBound && meetWithin(kNarrow)) return result_;
      if (stuck) break;
    }
    if (!meetWithin(kWidest)) finish(Impact::unproved, time_, horizon_);
    return result_;
  }

 private:
  void finish(Impact impact, double lo, double hi) {
    result_.impact = impact;
    result_.lo = lo;
    result_.hi = hi;
    ended_ = true;
  }

  /// Moves on by at most `step`, which ends the advance at the horizon.
  void advance(double step) {
    if (step >= horizon_ - time_) return finish(Impact::none, horizon_, horizon_);
    double next = time_ + step;
    for (int i = 0; i < 4 && (next - time_) * (1 + 4 * kUnit) > step; ++i) next *= 1 - 2 * kUnit;
    if (next > time_ && (next - time_) * (1 + 4 * kUnit) <= step) time_ = next;
  }

  PartingPlane partingPlane(const PairAtTime& pair, const Instant& at) {
    ++result_.queries;
    const Decision decision = decide(pair.a(), pair.b(), cache_);
    if (decision.verdict != Verdict::separated) {
      if (time_ == 0) finish(Impact::contact, 0, 0);
      return {};
    }
    const PartingPlane plane = planeAlong(decision.normal, at, pair.error());
    if (plane.gap > 0) return plane;
    ++result_.queries;
    const Refinement refined = refine(pair.a(), pair.b(), cache_);
    const double length = refined.closest.norm();
    if (!(length > 0)) return {};
    const double gap = refined.distance * (1 - 32 * kUnit) - pair.error();
    return {refined.closest / length, gap};
  }

  /// Whether the exact motion has the bodies touch or penetrate at `time`: proved.
  bool meetAt(double time) {
    const PairAtTime pair(a_, b_, time);
    if (!std::isfinite(pair.error())) return false;
    ++result_.queries;
    FeatureCache cache = cache_;
    const Refinement refined = refine(pair.a(), pair.b(), cache);
    if (refined.verdict == Verdict::separated) return false;
    return pair.error() == 0 || refined.penetration * (1 - 1e-9) > pair.error();
  }

  /// Looks for a contact up to `widest` (of 1 s + time) ahead, the nearest times first.
  bool meetWithin(double widest) {
    ++probes_;
    for (double width = 0x1p-46; width <= widest; width *= 4) {
      const double hi = std::min(horizon_, fewBits(time_ + width * (1 + time_), width / 32));
      if (meetsBy(hi)) return true;
    }
    // Bodies that graze meet at one instant, which is seen where it is a double; then it is likely
    // to be one of few bits.
    return meetsBy(std::min(horizon_, simplestAfter(time_, kNarrow * (1 + time_))));
  }

  bool meetsBy(double hi) {
    const bool meet = meetAt(hi);
    if (meet) finish(Impact::contact, time_, hi);
    return meet;
  }

  const MovingBody& a_;
  const MovingBody& b_;
  double horizon_;
  FeatureCache& cache_;
  double time_ = 0;
  int probes_ = 0;
  bool ended_ = false;
  TimeOfImpact result_;
};

}  // namespace

TimeOfImpact timeOfImpact(const MovingBody& a, const MovingBody& b, double horizon,
                          FeatureCache& cache) {
  return Advance(a, b, horizon, cache).run();
}

}  // namespace enfilade::collision
