// Steps
//  1. Transform both bodies into one frame with world axes and origin t_A. Translations are
//     subtracted before any rounding, so a scene far from the origin loses no precision.
//  2. GJK (Gilbert, Johnson, Keerthi 1988) with the coherence of Lin and Canny (1991), as in
//     Cameron, "Enhancing GJK" (1997). The closest features are a simplex of the Minkowski
//     difference B - A. One point is vertex-vertex, two are vertex-edge (or a diagonal), three are
//     vertex-face or edge-edge. GJK starts from the previous tick's features. A support along the
//     nearest point, found by hill climbing from the simplex' vertices, either certifies the
//     features or gives the next one. In a warm start, climbs stop once they pass the origin
//     (findSupport), so that the simplex stays close to the old features. This step uses doubles
//     (gjk.cpp).
//  3. Floating-point filter. A plane with all of B - A on its far side is certified
//     (computeCertifiedExtraDistance). The certificate takes the vector between the closest points
//     in extended precision, and its deviation from GJK's last direction. If the plane clears the
//     origin, the bodies are `separated` by at least that distance. A tetrahedron that contains the
//     origin by more than the rounding bound certifies `penetrating`.
//  4. If the origin lies on the simplex: exact sums of doubles may certify `touching`
//     (touching_certificate.hpp), or a polytope grown from the simplex `penetrating`
//     (polytope.hpp).
//  5. If that fails, as for slivers: steps 2 to 4 in extended precision.
//  6. If that fails too, or the distance is not accurate enough: exact integers (exact_answer.hpp).
// Departures from V-Clip (Mirtich 1998): no Voronoi regions. Points, segments, flat and coplanar
// faces need no special cases, and one support certifies what V-Clip tests region by region.
#include "collision/narrow_phase/narrow_phase.hpp"

#include <cmath>
#include <limits>

#include "collision/assert.hpp"
#include "collision/exact/exact_answer.hpp"
#include "collision/minkowski/polytope.hpp"
#include "collision/narrow_phase/feature_classification.hpp"
#include "collision/narrow_phase/gjk.hpp"
#include "collision/narrow_phase/touching_certificate.hpp"

namespace enfilade::collision {
namespace {

constexpr double kMaxErrorUnits =
    15;  // roundoffs of the largest coordinate; one below the promised 16
constexpr double kSmallErrorRatio = 0x1p-32;  // relative to the distance: see describeSeparation
constexpr int kLocalSteps = 12;               // of a warm start: see iterateGjk

/// Square root; uses LongReal where a double would over- or underflow.
double computeSquareRoot(LongReal squared) {
  const auto rounded = static_cast<double>(squared);
  const bool fits = rounded > 0x1p-900 && rounded < 0x1p1000;
  return fits ? std::sqrt(rounded) : static_cast<double>(std::sqrt(squared));
}

/// A length as an unevaluated sum of two doubles, metres.
struct SplitLength {
  double head = 0, tail = 0;
};

/// The witness points of A and B: the combinations of vertices with the simplex' weights.
/// Rounding: weights at most 8.1 eta S per body, rotation 3 eta S. Shift and sums eta (S_A + 2 S_B
/// + 3 sqrt(3) D), length 2.5 sqrt(3) eta reach. In total below 17.5 eta reach; `error` is 24 eta
/// reach.
struct WitnessPoints {
  BodyPoint onBodyA, onBodyB;
  Vec3 pointA, pointB, aToB;  ///< world axes, relative to t_A; rounded
  LongReal squaredLength;     ///< squared length of aToB before rounding
  double error;               ///< error bound of the length, metres
  double maxCoordinate;       ///< lower bound of the maximum |coordinate| of both bodies from t_A

  template <class Real>
  WitnessPoints(const MinkowskiDifference& difference, const Simplex<Real>& simplex)
      : onBodyA(computeBodyPoint(simplex, difference.a, &VertexPair::a)),
        onBodyB(computeBodyPoint(simplex, difference.b, &VertexPair::b)),
        error(static_cast<double>(4 * difference.pointError())) {
    squaredLength =
        setCoordinate<0>(difference) + setCoordinate<1>(difference) + setCoordinate<2>(difference);
    maxCoordinate = std::max(computeMaxAbsCoordinate(pointA), computeMaxAbsCoordinate(pointB)) *
                    (1 - 8 * kRoundoff);
  }
  /// Whether `metres` is at most `units` roundoffs of the largest coordinate. Searches for a larger
  /// coordinate if those of the witness points are too small.
  template <class Real>
  bool isWithin(double metres, double units, const Simplex<Real>& simplex) {
    if (metres <= units * kRoundoff * maxCoordinate) return true;
    raiseMaxCoordinate(simplex);
    return metres <= units * kRoundoff * maxCoordinate;
  }
  /// The length as an unevaluated sum, by one Newton step from `estimate`. The step's error is less
  /// than its square divided by the length.
  SplitLength length(double estimate) const {
    const auto step = [&](double head) {
      const LongReal rest = squaredLength - LongReal{head} * head;
      // If a double cannot represent the remainder, divide before rounding.
      const bool tiny = head < 0x1p-450;
      return SplitLength{head, tiny ? static_cast<double>(rest / (2 * LongReal{head}))
                                    : static_cast<double>(rest) * (0.5 / head)};
    };
    const SplitLength length = step(estimate);
    if (std::abs(length.tail) <= 0x1p-36 * estimate) return length;
    const double root = computeSquareRoot(squaredLength);
    return root > 0 ? step(root) : SplitLength{};
  }
  /// Whether both witness points are one common point, to the precision of doubles, both relative
  /// to t_A and in the world.
  template <class Real>
  bool isCommonPoint(const Vec3& tA, const Simplex<Real>& simplex) {
    const double length = computeSquareRoot(squaredLength);
    if (!isWithin(length, 2, simplex)) return false;
    const double inWorld = std::max(computeMaxAbsCoordinate(addVectors(pointA, tA)),
                                    maxCoordinate - computeMaxAbsCoordinate(tA));
    return length <= 8 * kRoundoff * inWorld;
  }

 private:
  /// For each coordinate of B - A, a vertex of A or of B has at least half of it.
  template <class Real>
  void raiseMaxCoordinate(const Simplex<Real>& simplex) {
    for (int i = 0; i < simplex.size; ++i)
      maxCoordinate = std::max(maxCoordinate,
                               computeMaxAbsCoordinate(simplex.points[i].template cast<double>()) *
                                   (0.5 - 4 * kRoundoff));
  }
  /// Sets coordinate k of the points; returns its contribution to the squared length.
  template <int k>
  LongReal setCoordinate(const MinkowskiDifference& difference) {
    const PlacedConvex &a = *difference.a.shape, &b = *difference.b.shape;
    const LongReal onA = rotatedCoordinate<k>(a, onBodyA);
    const LongReal onB =
        rotatedCoordinate<k>(b, onBodyB) + (LongReal{b.translation[k]} - a.translation[k]);
    const LongReal separation = onB - onA;
    pointA[k] = static_cast<double>(onA);
    pointB[k] = static_cast<double>(onB);
    aToB[k] = static_cast<double>(separation);
    return separation * separation;
  }
  template <int k>
  static LongReal rotatedCoordinate(const PlacedConvex& convex, const BodyPoint& p) {
    if (p.vertex != BodyPoint::kNone) return rotateRow<k>(convex, convex.vertices[p.vertex]);
    return rotateRow<k>(convex, p.position);
  }
  template <int k, class Point>
  static LongReal rotateRow(const PlacedConvex& convex, const Point& p) {
    if (!convex.rotation) return p[k];
    const Mat3& r = *convex.rotation;
    return LongReal{r(k, 0)} * p[0] + LongReal{r(k, 1)} * p[1] + LongReal{r(k, 2)} * p[2];
  }
};

/// One Newton step on the weights of a tetrahedron that contains the origin. The residual is
/// `witnesses.aToB`, which would be zero for exact weights.
void refineWeights(const MinkowskiDifference& difference, const Simplex<double>& simplex,
                   WitnessPoints& witnesses) {
  Simplex<LongReal> refined;
  refined.pairs = simplex.pairs;
  refined.size = simplex.size;
  const auto& p = simplex.points;
  const Vec3 x = p[1] - p[0], y = p[2] - p[0], z = p[3] - p[0];
  const Vec3 step = witnesses.aToB / x.dot(y.cross(z));
  const Vec3 less(step.dot(y.cross(z)), step.dot(z.cross(x)), step.dot(x.cross(y)));
  const std::array<double, 4> change{less.sum(), -less.x(), -less.y(), -less.z()};
  for (std::size_t i = 0; i < 4; ++i) {
    refined.points[i] = p[i].cast<LongReal>();
    refined.weight[i] = LongReal{simplex.weight[i]} + change[i];
    if (!(refined.weight[i] >= 0)) return;
  }
  witnesses = WitnessPoints(difference, refined);
}
void refineWeights(const MinkowskiDifference&, const Simplex<LongReal>&, WitnessPoints&) {}

/// How far a body extends beyond one of its points along a direction, times `length`. `support` is
/// the result of a hill climb along the direction.
double computeSupportExcess(const BodyPoint& point, const BoundedConvex& convex,
                            const Vec3& direction, const SupportVertex& support) {
  const LongVec3 rotated = convex.bodyFromWorld<LongReal>(direction.cast<LongReal>());
  const auto project = [&](const auto& p) {
    return rotated.x() * p.x() + rotated.y() * p.y() + rotated.z() * p.z();
  };
  const LongReal pointProjection = project(point.inBodyFrame(*convex.shape));
  LongReal maxProjection = pointProjection;
  forEachSupportValue(convex, support, [&](std::uint32_t i) {
    maxProjection = std::max(maxProjection, project(convex.shape->vertices[i]));
  });
  return static_cast<double>(maxProjection - pointProjection);
}

/// The certified lower bound of the distance, minus length.head; minus infinity if nothing is
/// certified. Let w be the vector between the witness points and d GJK's last direction. Along d,
/// no point of B - A is less than w by more than the bodies' support excess. And w . d / |d| = |w|
/// cos(w, d) >= |w| - |w - d|^2 / |w| where that is positive, because cos >= cos^2.
/// Rounding: w is off by 24 eta reach (WitnessPoints), and by 2u |w| as rounded. The rotated
/// direction is off by 3 eta |d| S for a vertex. For the vector from a body's point to its vertex
/// it is off by twice that. Both products round by 3 eta |d| S, their difference by one, and the
/// point by 8.1 eta S: together below 24 eta |d| S.
double computeCertifiedExtraDistance(const MinkowskiDifference& difference,
                                     const WitnessPoints& witnesses, const SplitLength& length,
                                     const GjkState<double>& state) {
  const double error = 2 * witnesses.error;
  const auto [head, tail] = length;
  if (!state.hasDirection() || !(head > 0x1p10 * error))
    return -std::numeric_limits<double>::infinity();
  const Vec3& d = state.direction;
  double excess = 0;
  const auto& [supportA, supportB] = state.supports;
  if (!supportA.unique || supportA.vertex != witnesses.onBodyA.vertex)
    excess += computeSupportExcess(witnesses.onBodyA, difference.a, d, supportA);
  if (!supportB.unique || supportB.vertex != witnesses.onBodyB.vertex)
    excess += computeSupportExcess(witnesses.onBodyB, difference.b, -d, supportB);
  const double rounding = error + 2 * kRoundoff * head;
  const Vec3 deviation = subtractVectors(witnesses.aToB, d);
  const double directionError = 2 * (dot(deviation, deviation) + rounding * rounding) / head;
  const double lost = (directionError + excess / state.length + error) * (1 + 0x1p-8);
  return tail - lost;
}
/// In extended precision, the supports have certified the bound already.
double computeCertifiedExtraDistance(const MinkowskiDifference&, const WitnessPoints&,
                                     const SplitLength& length, const GjkState<LongReal>& state) {
  const auto extra = static_cast<double>(state.lowerBound - length.head);
  return extra - 2 * kRoundoff * std::abs(extra);
}

/// The outcome that GJK certified.
enum class GjkOutcome : std::uint8_t {
  undecided,    ///< not certified, or not to the bound that SeparationResult promises
  beyondLimit,  ///< certified: the distance exceeds the limit
  decided
};

/// Fills in the result for bodies that are certified to be separated by length.head + lowerExtra
/// along `axis`.
template <class Real>
GjkOutcome describeSeparation(const Simplex<Real>& simplex, const SplitLength& length,
                              double lowerExtra, const Vec3& axis, WitnessPoints& witnesses,
                              SeparationResult& result) {
  const auto [head, tail] = length;
  const double extra = std::max(tail, lowerExtra);
  const double distance = head + extra;
  const double rest = (head - distance) + extra;  // exact (Dekker's fast two-sum)
  const double bound = std::max(tail - extra + rest + witnesses.error, extra - lowerExtra - rest);
  ENFILADE_ASSERT(distance > 0);
  result.verdict = Verdict::separated;
  result.distance = distance;
  result.errorBound = bound * (1 + 8 * kRoundoff);
  // If the bound is large relative to the distance, the vector between the points has no reliable
  // direction. The axis replaces it, and the bound must be within one roundoff.
  const bool isAccurate = bound <= kSmallErrorRatio * distance;
  const Vec3& w = witnesses.aToB;
  result.normal = isAccurate ? Vec3(w.x() / distance, w.y() / distance, w.z() / distance) : axis;
  return witnesses.isWithin(bound, isAccurate ? kMaxErrorUnits : 1, simplex)
             ? GjkOutcome::decided
             : GjkOutcome::undecided;
}

/// Finds an axis along which the bodies are certified to touch, and sets `axis` to it. Candidates
/// are `axis` itself, the simplex' normal and the world's axes, the usual contact directions of
/// resting bodies. `axesTried`: skip all but the normal.
template <class Real>
bool findTouchingAxis(const MinkowskiDifference& difference, const GjkState<Real>& state,
                      bool axesTried, Vec3& axis) {
  std::array<Vec3, 9> directions;
  std::size_t count = 0;
  const Simplex<Real>& simplex = state.simplex;
  if (!axesTried) directions[count++] = axis;
  if (simplex.size == 3) {
    const auto& p = simplex.points;
    const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]).template cast<double>();
    directions[count++] = normal;
    directions[count++] = -normal;
  }
  for (int k = 0; k < 3 && !axesTried; ++k) {
    directions[count++] = Vec3::Unit(k);
    directions[count++] = -Vec3::Unit(k);
  }
  for (const Vec3& direction : std::span(directions).first(count)) {
    if (!(direction.squaredNorm() > 0)) continue;
    if (!certifyTouching(difference, direction, simplex.newest())) continue;
    axis = direction;  // not normalised: rounding would make the sums inexact
    return true;
  }
  return false;
}

/// Whether the origin, which lies on the simplex, is certified to be strictly inside B - A.
template <class Real>
bool certifyPenetration(const MinkowskiDifference& difference, const Simplex<Real>& simplex) {
  Polytope<Real> polytope(difference);
  const std::span pairs(simplex.pairs.data(), static_cast<std::size_t>(simplex.size));
  if (encloseOrigin<Real>(pairs, polytope)) return true;
  polytope.clear();
  return encloseOriginBySearch<Real>(polytope);
}

/// Derives the verdict from GJK's final features and fills in the result. `axis` is the last
/// certified separating axis; it is set only from certified directions, as other nearest points may
/// point anywhere.
template <class Real>
GjkOutcome classify(const MinkowskiDifference& difference, GjkState<Real>& state, double limit,
                    Vec3& axis, SeparationResult& result) {
  if (state.beyondLimit) {
    axis = state.axis();
    return GjkOutcome::beyondLimit;
  }
  const Simplex<Real>& simplex = state.simplex;
  const Vec3& tA = difference.a.shape->translation;
  const bool inside = simplex.containsOrigin;
  WitnessPoints witnesses(difference, simplex);
  bool common = inside && witnesses.isCommonPoint(tA, simplex);
  if (inside && !common) {
    refineWeights(difference, simplex, witnesses);
    common = witnesses.isCommonPoint(tA, simplex);
  }
  result.pointA = addVectors(witnesses.pointA, tA);
  result.pointB = addVectors(witnesses.pointB, tA);
  if (!inside) {
    const SplitLength length = witnesses.length(static_cast<double>(state.distance));
    const double lowerExtra = computeCertifiedExtraDistance(difference, witnesses, length, state);
    const bool isSeparated = lowerExtra > -length.head;
    if (isSeparated) axis = state.axis();
    if ((length.head - limit) + lowerExtra > 0) return GjkOutcome::beyondLimit;
    if (isSeparated)
      return describeSeparation(simplex, length, lowerExtra, axis, witnesses, result);
    common = witnesses.isCommonPoint(tA, simplex);
  }
  if (!common) return GjkOutcome::undecided;
  const bool axesTried = std::is_same_v<Real, LongReal> && fitsDoubleRange(difference);
  if (!inside && findTouchingAxis(difference, state, axesTried, axis)) {
    result.verdict = Verdict::touching;
    result.certificate = Certificate::expansion;
    result.normal = axis.stableNormalized();
    return GjkOutcome::decided;
  }
  if (!inside && !certifyPenetration(difference, simplex)) return GjkOutcome::undecided;
  result.verdict = Verdict::penetrating;
  return GjkOutcome::decided;
}

SeparationResult computeSeparationExactly(const MinkowskiDifference& difference,
                                          FeatureCache& cache) {
  ExactMinkowskiDifference integers(*difference.a.shape, *difference.b.shape);
  const ExactSeparation exact = computeExactSeparation(integers, cache);
  SeparationResult result;
  result.verdict = exact.verdict;
  result.certificate = Certificate::rational;
  result.distance = exact.distance;
  if (exact.verdict == Verdict::separated)
    result.errorBound = 2 * kRoundoff * exact.distance + std::numeric_limits<double>::denorm_min();
  result.pointA = exact.pointA;
  result.pointB = exact.pointB;
  if (exact.verdict != Verdict::penetrating) result.normal = cache.axis = exact.normal;
  return result;
}

/// Vertices at which a hill climb along the cached axis starts.
VertexPair getSupportHint(const PlacedConvex& a, const PlacedConvex& b, const FeatureCache& cache) {
  return isUsable(cache, a, b) ? cache.pairs[0] : VertexPair{};
}

/// Upper bound, up to rounding, on the projection of the vertices in doubles. `support`: of a hill
/// climb.
double computeMaxProjection(const BoundedConvex& convex, const SupportVertex& support) {
  double max = support.projection;
  forEachSupportValue(convex, support, [&](std::uint32_t i) {
    max = std::max(max, dot(support.direction, convex.shape->vertices[i]));
  });
  return max;
}

/// Whether the bodies' distance along `axis` exceeds `distance`, as far as doubles tell. The value
/// of a support pair is off by less than 40u length reach (computeSupportValue). The 48 leave room
/// for the bound in extended precision, which is closer.
std::optional<bool> isFartherAlong(const MinkowskiDifference& difference, const Vec3& axis,
                                   double distance, VertexPair hint) {
  const double length = computeNorm(axis) * kMaxUnitLength;
  if (!fitsDoubleRange(difference) || !(length > 1e-100 && length < 1e100)) return std::nullopt;
  const SupportPair supports = hillClimbPair(difference, axis, length, hint);
  const double value = computeSupportValue(difference, axis, length, supports).value;
  const double rounding = 48 * kRoundoff * length * (difference.reach + std::abs(distance));
  if (value + rounding < distance * length) return false;
  const double lowest = value -
                        (computeMaxProjection(difference.a, supports.a) - supports.a.projection) -
                        (computeMaxProjection(difference.b, supports.b) - supports.b.projection);
  if (lowest - rounding > distance * length) return true;
  return std::nullopt;
}

/// Runs GJK in Real from the cached features and classifies its result.
template <class Real>
GjkOutcome runGjk(const MinkowskiDifference& difference, double limit, FeatureCache& cache,
                  SeparationResult& result) {
  GjkState<Real> state;
  const bool warm = warmStart(difference, cache, state);
  iterateGjk(difference, limit, warm ? kLocalSteps : 0, state);
  const GjkOutcome outcome = classify(difference, state, limit, cache.axis, result);
  storeFeatures(state, cache);
  return outcome;
}

/// False: the distance is certified to exceed `limit`.
bool computeSeparationWithin(const PlacedConvex& a, const PlacedConvex& b, double limit,
                             FeatureCache& cache, SeparationResult& result) {
  const MinkowskiDifference difference(a, b);
  GjkOutcome outcome = GjkOutcome::undecided;
  if (fitsDoubleRange(difference)) outcome = runGjk<double>(difference, limit, cache, result);
  if (outcome == GjkOutcome::undecided)
    outcome = runGjk<LongReal>(difference, limit, cache, result);
  if (outcome == GjkOutcome::undecided) result = computeSeparationExactly(difference, cache);
  if (outcome == GjkOutcome::beyondLimit) return false;
  ENFILADE_ASSERT(std::abs(result.normal.squaredNorm() - 1) < 1e-6);
  assignFeatures(a, b, cache, result);
  return true;
}

}  // namespace

std::optional<SeparationResult> computeSeparationWithin(const PlacedConvex& a,
                                                        const PlacedConvex& b, double limit,
                                                        FeatureCache& cache) {
  std::optional<SeparationResult> result(std::in_place);
  if (!computeSeparationWithin(a, b, limit, cache, *result)) result.reset();
  return result;
}

SeparationResult computeSeparation(const PlacedConvex& a, const PlacedConvex& b,
                                   FeatureCache& cache) {
  SeparationResult result;
  computeSeparationWithin(a, b, std::numeric_limits<double>::infinity(), cache, result);
  return result;
}

double computeSeparationLowerBound(const PlacedConvex& a, const PlacedConvex& b,
                                   const FeatureCache& cache) {
  if (!(cache.axis.squaredNorm() > 0)) return -std::numeric_limits<double>::infinity();
  VertexPair hint = getSupportHint(a, b, cache);
  const LongVec3 axis = cache.axis.cast<LongReal>();
  const LongReal length = axis.norm();
  const LongReal lowerBound =
      findCertifiedSupport(MinkowskiDifference(a, b), axis, length, hint).lowerBound / length;
  return static_cast<double>(lowerBound - std::abs(lowerBound) * 2 * kRoundoff);
}

bool isSeparationProved(const PlacedConvex& a, const PlacedConvex& b, double distance,
                        const FeatureCache& cache) {
  const std::optional<bool> isFarther =
      isFartherAlong(MinkowskiDifference(a, b), cache.axis, distance, getSupportHint(a, b, cache));
  return isFarther ? *isFarther : computeSeparationLowerBound(a, b, cache) > distance;
}

}  // namespace enfilade::collision
