// A plane with normal n parts both bodies at the start by g0 and at the end by g1. Were the ways of
// all vertices straight and even, the gap along n would be concave in time (least of linear ones),
// so at least (1 - t) g0 + t g1 for t in 0..1. A vertex that turns by theta about the centre at
// radius rho departs from its chord by at most rho theta^2 t (1 - t) / 2, since |p''| = rho
// theta^2. With B = (rho_A theta_A^2 + rho_B theta_B^2) / 2 the gap is positive all the way if
//   g0 / t + g1 / (1 - t) > B, that is, by its least value, (sqrt g0 + sqrt g1)^2 > B.
// Where neither the plane of the start nor that of the end proves so much, the way is halved: the
// middle of an even turn from q0 to q1 is q0 + q1, normalised, up to rounding.
//
// Where they move by less than their distance, no plane is needed.
//
// theta from the quaternions: |q0 - q1| = 2 sin(theta / 4) for the nearer of +-q1, and sin x >= x -
// x^3 / 6 gives theta / 4 <= s (1 + s^2) for s = sin(theta / 4) <= sin(pi / 4).
#include "scene/physics/swept_pose.hpp"

#include <algorithm>
#include <cmath>

#include "collision/narrow_phase/axis_separation.hpp"

namespace enfilade::scene {
namespace {

using collision::ConvexBody;
using collision::FeatureCache;
using collision::Quat;
using collision::Verdict;

constexpr double kUp = 1 + 0x1p-40;  // above what a few roundings lose
constexpr double kParts = 1 << kMostHalvings;
constexpr int kTries = 3;  // to cut a way where its plane is used up
constexpr double kShorter =
    0.25;  // of a way, at each try: lest the gap be used up, from step to step

/// q1 or -q1, whichever is nearer to q0.
Quat nearer(const Quat& q0, const Quat& q1) {
  if (q0.dot(q1) >= 0) return q1;
  return Quat(-q1.w(), -q1.x(), -q1.y(), -q1.z());
}

/// Radians, at least.
double turnOf(const Passage& p) {
  const Quat to = nearer(p.fromRotation, p.toRotation);
  const double s = 0.5 * (to.coeffs() - p.fromRotation.coeffs()).norm();
  return 4 * s * (1 + s * s) * kUp;
}

PassagePose middleOf(const PassagePose& from, const PassagePose& to) {
  PassagePose middle;
  middle.centre = 0.5 * (from.centre + to.centre);
  middle.rotation.coeffs() = from.rotation.coeffs() + nearer(from.rotation, to.rotation).coeffs();
  const double length = std::sqrt(middle.rotation.squaredNorm());
  middle.rotation.coeffs() /= length;
  return middle;
}

double bulgeOf(const Passage& p) {
  return p.radius * p.turn * p.turn / 2 * kUp;
}

/// A part at an end of its way.
ConvexBody placed(const PartShape& part, const Passage& p, bool atEnd) {
  return {part.vertices, atEnd ? p.toPosition : p.fromPosition, atEnd ? &p.toTurned : &p.fromTurned,
          part.hull};
}

/// The pair at one time: what is known there.
struct Known {
  FeatureCache cache;
  double apart = 0;  ///< metres, proved; 0: not separated
  double along = 0;  ///< the same, along the axis of `cache`
};

struct Search {
  const PartShape& partA;
  const PartShape& partB;
  std::uint32_t queries = 0;

  /// Separated at the end, and by how much?
  Known ask(const Passage& a, const Passage& b, bool atEnd, const FeatureCache& hint) {
    Known known{hint, 0, 0};
    const collision::Decision decision =
        collision::decide(placed(partA, a, atEnd), placed(partB, b, atEnd), known.cache);
    ++queries;
    if (decision.verdict == Verdict::separated)
      known.apart = known.along = decision.distance - decision.errorBound;
    return known;
  }
  /// The gap along the axis of `cache`, at the end or the start.
  double along(const Passage& a, const Passage& b, bool atEnd, const FeatureCache& cache) const {
    if (cache.axis.isZero(0)) return 0;
    return collision::gapAlong(placed(partA, a, atEnd), placed(partB, b, atEnd),
                               cache.axis.stableNormalized())
        .proved;
  }
};

/// Whether a plane with these gaps at the ends parts the bodies all the way.
bool planeParts(double atStart, double atEnd, double bulge) {
  if (!(atStart > 0) || !(atEnd > 0)) return false;
  const double roots = std::sqrt(atStart) + std::sqrt(atEnd);
  return roots * roots > bulge * kUp;
}

/// Proved from the two ends alone.
bool provedClear(const Search& search, const Passage& a, const Passage& b, const Known& start,
                 const Known& end) {
  const double moves = closingOf(a, b);
  if (moves < start.apart || moves < end.apart) return true;
  const double bulge = bulgeOf(a) + bulgeOf(b);
  return planeParts(start.along, search.along(a, b, true, start.cache), bulge) ||
         planeParts(search.along(a, b, false, end.cache), end.along, bulge);
}

/// The part of the way that is proved clear. The end's answer is not known to be separated.
double clearPart(Search& search, const Passage& a, const Passage& b, const Known& start,
                 const Known& end, int halvings) {
  if (end.apart > 0 && provedClear(search, a, b, start, end)) return 1;
  if (halvings == 0) return 0;
  const PassagePose middleA = middleOf(a), middleB = middleOf(b);
  const Passage firstA = firstHalf(a, middleA), firstB = firstHalf(b, middleB);
  const Known middle = search.ask(firstA, firstB, true, start.cache);
  const double first = clearPart(search, firstA, firstB, start, middle, halvings - 1);
  if (first < 1) return 0.5 * first;
  return 0.5 + 0.5 * clearPart(search, secondHalf(a, middleA), secondHalf(b, middleB), middle, end,
                               halvings - 1);
}

}  // namespace

Passage standing(const Solid& solid) {
  Passage passage;
  passage.fromCentre = passage.toCentre = solid.motion.centre;
  passage.fromRotation = passage.toRotation = solid.motion.rotation;
  passage.radius = solid.radius;
  passage.centreInFrame = solid.centreInFrame;
  passage.stands = &solid;
  passage.fromTurned = passage.toTurned = solid.rotation;
  passage.fromPosition = passage.toPosition = solid.position;
  return passage;
}

void measure(Passage& passage) {
  passage.turn = turnOf(passage);
  // As placeSolid() has it, to the last bit.
  passage.fromTurned = passage.fromRotation.toRotationMatrix();
  passage.toTurned = passage.toRotation.toRotationMatrix();
  passage.fromPosition = passage.fromCentre - passage.fromTurned * passage.centreInFrame;
  passage.toPosition = passage.toCentre - passage.toTurned * passage.centreInFrame;
}

double lengthOf(const Passage& p) {
  const Vec3 way = p.toCentre - p.fromCentre;
  return (way.norm() + p.turn * p.radius) * kUp;
}

Stride strideOf(const Passage& p) {
  return {p.toCentre - p.fromCentre, p.turn * p.radius};
}

double closingOf(const Stride& a, const Stride& b) {
  return ((a.way - b.way).norm() + a.tip + b.tip) * kUp;
}

PassagePose middleOf(const Passage& p) {
  return middleOf({p.fromCentre, p.fromRotation}, {p.toCentre, p.toRotation});
}

Passage firstHalf(const Passage& p, const PassagePose& middle) {
  Passage half = p;
  half.toCentre = middle.centre, half.toRotation = middle.rotation;
  measure(half);
  return half;
}

Passage secondHalf(const Passage& p, const PassagePose& middle) {
  Passage half = p;
  half.fromCentre = middle.centre, half.fromRotation = middle.rotation;
  measure(half);
  return half;
}

Passage firstPart(const Passage& passage, double fraction) {
  if (fraction == 1 || passage.stands) return passage;
  // What is left of the way, from the end of what is done; only the result is measured.
  PassagePose from{passage.fromCentre, passage.fromRotation};
  PassagePose to{passage.toCentre, passage.toRotation};
  for (int i = 0; i < kMostHalvings && fraction > 0; ++i) {
    const PassagePose middle = middleOf(from, to);
    fraction *= 2;
    if (fraction >= 1) {
      from = middle;
      fraction -= 1;
    } else {
      to = middle;
    }
  }
  Passage done = passage;
  done.toCentre = from.centre, done.toRotation = from.rotation;
  measure(done);
  return done;
}

namespace {

/// Whether the plane at right angles to `axis` parts the two all the way.
bool partsAllTheWay(const PartShape& partA, const Passage& a, const PartShape& partB,
                    const Passage& b, const Vec3& axis) {
  const auto gap = [&](bool atEnd) {
    return collision::gapAlong(placed(partA, a, atEnd), placed(partB, b, atEnd), axis).proved;
  };
  const double atEnd = gap(true);
  return atEnd > 0 && planeParts(gap(false), atEnd, bulgeOf(a) + bulgeOf(b));
}

}  // namespace

double clearAlong(const PartShape& partA, const Passage& a, const PartShape& partB,
                  const Passage& b, const Vec3& axis) {
  const auto gap = [&](bool atEnd) {
    return collision::gapAlong(placed(partA, a, atEnd), placed(partB, b, atEnd), axis).proved;
  };
  const double atStart = gap(false), atEnd = gap(true);
  const double bulge = bulgeOf(a) + bulgeOf(b);
  if (planeParts(atStart, atEnd, bulge)) return 1;
  if (!(atStart > 0 && atStart < std::numeric_limits<double>::infinity())) return -1;
  // Were it linear in time, the gap would be gone at this part.
  double part = std::min(1.0, atStart / (atStart - std::min(0.0, atEnd) + bulge));
  for (int i = 0; i < kTries; ++i) {
    part = std::floor((1 - kShorter) * part * kParts) / kParts;
    if (!(part > 0)) return 0;
    if (partsAllTheWay(partA, firstPart(a, part), partB, firstPart(b, part), axis)) return part;
  }
  return -1;
}

bool separatedAtEnd(const PartShape& partA, const Passage& a, const PartShape& partB,
                    const Passage& b, FeatureCache cache) {
  // Not how far: that they are apart at all ends it.
  const auto decision =
      collision::decideWithin(placed(partA, a, true), placed(partB, b, true), 0, cache);
  return !decision || decision->verdict == Verdict::separated;
}

Clearance clearance(const PartShape& partA, const Passage& a, const PartShape& partB,
                    const Passage& b, const FeatureCache& cache, double apart) {
  Search search{partA, partB};
  Known start{cache, apart, search.along(a, b, false, cache)};
  if (!(apart > 0)) start = search.ask(a, b, false, cache);
  if (!(start.apart > 0)) return {0, search.queries};
  const Known end = search.ask(a, b, true, start.cache);
  const double fraction = clearPart(search, a, b, start, end, kMostHalvings);
  return {fraction, search.queries};
}

}  // namespace enfilade::scene
