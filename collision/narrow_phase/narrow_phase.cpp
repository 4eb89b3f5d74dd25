// Steps
//  1. Both bodies go into one frame, axes as the world's, origin at t_A: translations are
//     subtracted before anything is rounded, so a scene far from the origin loses nothing.
//  2. The walk over closest features. The pair of features is kept as a simplex of the Minkowski
//     difference B - A: one point is vertex-vertex, two span vertex-edge (or a diagonal), three
//     vertex-face or edge-edge. It starts at last tick's features; a support along the nearest
//     point, climbed to over the hulls' edges from the simplex' vertices, proves them closest or
//     names the feature to go on with. That is GJK (Gilbert, Johnson, Keerthi 1988) with the
//     coherence of Lin and Canny (1991) as in Cameron, "Enhancing GJK" (1997). From last tick's
//     features, climbs end where the origin is passed (findSupport), so that the walk stays near
//     them. It is in doubles; it ends, since |nearest| falls at every step but a bounded number of
//     equal ones.
//  3. The filter. The vector between the closest points, in extended precision, and how far it
//     slips from the walk's last direction prove a plane (provedMore) that all of B - A lies
//     beyond; where it stands clear of the origin, the bodies are `separated`, at least by that. A
//     tetrahedron that holds the origin by more than the rounding bound proves `penetrating`.
//  4. An origin that lies on the simplex: exact sums of doubles may prove `touching`
//     (touching_proof.hpp), a polytope grown from the simplex `penetrating` (polytope.hpp).
//  5. Where that is not enough, as among slivers, steps 2 to 4 in extended precision.
//  6. Where that cannot decide either, or the distance is not good enough: exact_answer.hpp.
// Departures from V-Clip (Mirtich 1998): no Voronoi regions. Points, segments, flat and coplanar
// faces need no cases of their own, and one support proves what V-Clip proves region by region.
#include "collision/narrow_phase/narrow_phase.hpp"

#include <cmath>
#include <limits>

#include "collision/exact/exact_answer.hpp"
#include "collision/minkowski/polytope.hpp"
#include "collision/minkowski/simplex.hpp"
#include "collision/narrow_phase/feature_classification.hpp"
#include "collision/narrow_phase/touching_certificate.hpp"

namespace enfilade::collision {
namespace {

constexpr double kMostError = 15;  // units of rounding of the largest coordinate; one to spare
constexpr double kFine = 0x1p-32;  // of the distance: see describeSeparation
constexpr double kLeastInDoubles = 1e-140;  // metres: below, a squared length loses bits
constexpr int kMostEqualSteps = 4;          // of a walk, that come no nearer
constexpr int kLocalSteps = 12;             // of a warm walk: see findSupport
constexpr int kIterationBound = 96;  // about 10 are usual, from nothing; reaching it: the next step

bool valid(const FeatureCache& cache, const ConvexBody& a, const ConvexBody& b) {
  if (cache.size < 1 || cache.size > 4) return false;
  for (int i = 0; i < cache.size; ++i)
    if (cache.pairs[i].a >= a.vertices.size() || cache.pairs[i].b >= b.vertices.size())
      return false;
  return true;
}

/// At least one and a few roundings: makes a rounded length one that is not less.
template <class Real>
constexpr Real kLonger = 1 + 16 * unitOf<Real>();

/// What the walk over features found.
template <class Real>
struct Search {
  using Vec = Eigen::Matrix<Real, 3, 1>;

  Simplex<Real> simplex;
  Real distance = 0;            ///< of simplex.nearest
  Vec direction = Vec::Zero();  ///< of the last support: the simplex.nearest of then
  Real length = 0;              ///< of `direction`, at least
  Summits summits;              ///< of the last support, when the walk is in doubles
  Wide lower = 0;               ///< of the true distance, proved by supports in extended precision
  bool beyondLimit = false;     ///< proved: the distance is greater than the limit

  /// `direction`, unit up to rounding.
  Vec3 axis() const { return times(direction, kLonger<Real> / length).template cast<double>(); }
  /// False: the simplex holds the origin, or all but touches it.
  bool hasDirection() const {
    constexpr bool isDouble = std::is_same_v<Real, double>;
    return !simplex.holdsOrigin &&
           distance > (isDouble ? kLeastInDoubles : std::numeric_limits<double>::min());
  }
};

/// The features of last time, or any point. True: those of last time.
template <class Real>
bool start(const MinkowskiDifference& difference, const FeatureCache& cache, Search<Real>& search) {
  const bool warm = valid(cache, *difference.a.body, *difference.b.body);
  if (warm) {
    const std::span pairs(cache.pairs);
    search.simplex.set(difference, pairs.first(static_cast<std::size_t>(cache.size)));
  } else {
    search.simplex.set(difference, std::array{VertexPair{}});
  }
  search.distance = lengthOf(search.simplex.nearest);
  return warm;
}

/// A point of B - A: the least along search.direction, up to rounding, or one that is beyond the
/// origin.
template <class Real>
struct Support {
  VertexPair pair;
  Real along;  ///< times search.length
};

/// `local`: a body whose vertex alone takes the support to the origin and beyond is climbed no
/// farther. That there is no plane between is known then, and what is near is rather of use to the
/// simplex than what is far behind.
Support<double> findSupport(const MinkowskiDifference& difference, bool local, double limit,
                            Search<double>& search) {
  const double enough =
      local ? search.length * search.length : std::numeric_limits<double>::infinity();
  climb(difference, search.direction, search.length, search.simplex.newest(), enough,
        search.summits);
  const Along along = alongOf(difference, search.direction, search.length, search.summits);
  search.beyondLimit = along.bound > limit * search.length * kUnitLength;
  return {search.summits.pair(), along.value};
}
Support<Wide> findSupport(const MinkowskiDifference& difference, bool, double limit,
                          Search<Wide>& search) {
  VertexPair hint = search.simplex.newest();
  const Least least = leastAlong(difference, search.direction, search.length, hint);
  search.lower = std::max(search.lower, least.bound / search.length * (1 - 4 * kWideUnit));
  search.beyondLimit = search.lower > limit;
  return {least.pair, least.along};
}

/// Ends at the closest features, at a tetrahedron that holds the origin, where the distance is
/// proved above `limit`, or where Real makes no more progress.
template <class Real>
void walk(const MinkowskiDifference& difference, double limit, int localSteps,
          Search<Real>& search) {
  const Real enough = 24 * unitOf<Real>() * static_cast<Real>(difference.reach);
  Simplex<Real>& simplex = search.simplex;
  int equalSteps = 0;
  for (int i = 0; i < kIterationBound && search.hasDirection(); ++i) {
    search.direction = simplex.nearest;
    search.length = search.distance * kLonger<Real>;
    const Support<Real> support = findSupport(difference, i < localSteps, limit, search);
    if (search.beyondLimit ||
        search.distance * search.distance - support.along <= enough * search.length ||
        simplex.holds(support.pair))
      return;
    const std::array<VertexPair, 4> lastPairs = simplex.pairs;
    const int lastSize = simplex.size;
    simplex.add(difference, support.pair);
    simplex.reduce(difference);
    const Real distance = lengthOf(simplex.nearest);
    if (!simplex.holdsOrigin && !(distance < search.distance)) {
      // As near may be good, too: the feature whose direction proves it.
      const bool asNear = distance <= search.distance && simplex.holds(support.pair);
      if (!asNear || ++equalSteps > kMostEqualSteps) {
        // The last simplex to the last bit: a face that is reduced stays as it is.
        simplex.set(difference, std::span(lastPairs).first(static_cast<std::size_t>(lastSize)));
        return;
      }
    }
    search.distance = distance;
  }
}

template <class Real>
void remember(const Search<Real>& search, FeatureCache& cache) {
  cache.size = search.simplex.size;
  for (int i = 0; i < search.simplex.size; ++i) cache.pairs[i] = search.simplex.pairs[i];
}

/// Where doubles would over- or underflow, by way of Wide.
double rootOf(Wide squared) {
  const auto rounded = static_cast<double>(squared);
  const bool fits = rounded > 0x1p-900 && rounded < 0x1p1000;
  return fits ? std::sqrt(rounded) : static_cast<double>(std::sqrt(squared));
}

struct Length {
  double head = 0, tail = 0;
};

/// The points of A and B that the simplex' weights name.
/// Weights round by at most 8.1 eta S a body, turning by 3 eta S, shift and sums by eta (S_A +
/// 2 S_B + 3 sqrt(3) D), the length by 2.5 sqrt(3) eta reach: below 17.5 eta reach; `error` is 24.
struct Combination {
  PointOn onBodyA, onBodyB;
  Vec3 pointA, pointB, aToB;  ///< world axes, from t_A; rounded
  Wide squared;               ///< length of aToB before that
  double error;               ///< of that length, metres
  double largest;             ///< of the |coordinates| of both bodies from t_A, from below

  template <class Real>
  Combination(const MinkowskiDifference& difference, const Simplex<Real>& simplex)
      : onBodyA(pointOn(simplex, difference.a, &VertexPair::a)),
        onBodyB(pointOn(simplex, difference.b, &VertexPair::b)),
        error(static_cast<double>(4 * difference.pointError())) {
    squared = set<0>(difference) + set<1>(difference) + set<2>(difference);
    largest = std::max(largestOf(pointA), largestOf(pointB)) * (1 - 8 * kUnit);
  }
  /// Whether `metres` are at most so many units of rounding of the largest coordinate; looks for a
  /// larger one where the points' own do not do.
  template <class Real>
  bool isWithin(double metres, double units, const Simplex<Real>& simplex) {
    if (metres <= units * kUnit * largest) return true;
    raiseLargest(simplex);
    return metres <= units * kUnit * largest;
  }
  /// As an unevaluated sum; `about`: what it may be. A step of Newton's is off by less than the
  /// square of itself / length.
  Length length(double about) const {
    const auto step = [&](double head) {
      const Wide rest = squared - Wide{head} * head;
      // Where a double could not hold it, it is divided before it is rounded.
      const bool tiny = head < 0x1p-450;
      return Length{head, tiny ? static_cast<double>(rest / (2 * Wide{head}))
                               : static_cast<double>(rest) * (0.5 / head)};
    };
    const Length length = step(about);
    if (std::abs(length.tail) <= 0x1p-36 * about) return length;
    const double root = rootOf(squared);
    return root > 0 ? step(root) : Length{};
  }
  /// For both bodies, as closely as doubles tell, from t_A and in the world.
  template <class Real>
  bool isCommonPoint(const Vec3& tA, const Simplex<Real>& simplex) {
    const double length = rootOf(squared);
    if (!isWithin(length, 2, simplex)) return false;
    const double inWorld = std::max(largestOf(plus(pointA, tA)), largest - largestOf(tA));
    return length <= 8 * kUnit * inWorld;
  }

 private:
  /// Of a coordinate of B - A, a vertex of A or one of B has half.
  template <class Real>
  void raiseLargest(const Simplex<Real>& simplex) {
    for (int i = 0; i < simplex.size; ++i)
      largest = std::max(largest,
                         largestOf(simplex.points[i].template cast<double>()) * (0.5 - 4 * kUnit));
  }
  /// A coordinate of the points; returns what it adds to the squared length.
  template <int k>
  Wide set(const MinkowskiDifference& difference) {
    const ConvexBody &a = *difference.a.body, &b = *difference.b.body;
    const Wide onA = turned<k>(a, onBodyA);
    const Wide onB = turned<k>(b, onBodyB) + (Wide{b.translation[k]} - a.translation[k]);
    const Wide apart = onB - onA;
    pointA[k] = static_cast<double>(onA);
    pointB[k] = static_cast<double>(onB);
    aToB[k] = static_cast<double>(apart);
    return apart * apart;
  }
  template <int k>
  static Wide turned(const ConvexBody& body, const PointOn& p) {
    if (p.vertex != PointOn::kNone) return turnedRow<k>(body, body.vertices[p.vertex]);
    return turnedRow<k>(body, p.combined);
  }
  template <int k, class Point>
  static Wide turnedRow(const ConvexBody& body, const Point& p) {
    if (!body.rotation) return p[k];
    const Mat3& r = *body.rotation;
    return Wide{r(k, 0)} * p[0] + Wide{r(k, 1)} * p[1] + Wide{r(k, 2)} * p[2];
  }
};

/// Newton's step for a tetrahedron that holds the origin: its weights as rounded led to `at.aToB`
/// instead.
void sharpen(const MinkowskiDifference& difference, const Simplex<double>& simplex,
             Combination& at) {
  Simplex<Wide> sharp;
  sharp.pairs = simplex.pairs;
  sharp.size = simplex.size;
  const auto& p = simplex.points;
  const Vec3 x = p[1] - p[0], y = p[2] - p[0], z = p[3] - p[0];
  const Vec3 step = at.aToB / x.dot(y.cross(z));
  const Vec3 less(step.dot(y.cross(z)), step.dot(z.cross(x)), step.dot(x.cross(y)));
  const std::array<double, 4> change{less.sum(), -less.x(), -less.y(), -less.z()};
  for (std::size_t i = 0; i < 4; ++i) {
    sharp.points[i] = p[i].cast<Wide>();
    sharp.weight[i] = Wide{simplex.weight[i]} + change[i];
    if (!(sharp.weight[i] >= 0)) return;
  }
  at = Combination(difference, sharp);
}
void sharpen(const MinkowskiDifference&, const Simplex<Wide>&, Combination&) {}

/// How much farther along a direction, times `length`, a body reaches than one of its points.
/// `summit` is that of a climb along it.
double reachPast(const PointOn& point, const PlacedBody& placed, const Vec3& direction,
                 double length, const Summit& summit) {
  const WideVec turned = placed.bodyFromWorld<Wide>(direction.cast<Wide>());
  const auto along = [&](const auto& p) {
    return turned.x() * p.x() + turned.y() * p.y() + turned.z() * p.z();
  };
  const Wide least = along(point.in(*placed.body));
  Wide most = least;
  forEachFarthest(placed, placed.bodyFromWorld<double>(direction), supportSlack(placed, length),
                  summit,
                  [&](std::uint32_t i) { most = std::max(most, along(placed.body->vertices[i])); });
  return static_cast<double>(most - least);
}

/// What the walk's last direction d proves of the length of w, the vector from point to point, as
/// far as it is more than length.head; minus infinity: nothing. Along d no point of B - A is less
/// than w by more than the bodies reach beyond their points, and w . d / |d| = |w| cos(w, d)
/// >= |w| - |w - d|^2 / |w| where that is positive, as cos >= cos^2.
/// Rounding: w is off by 24 eta reach (Combination), and by 2u |w| as rounded. The turned direction
/// is off by 3 eta |d| S beside a vertex, so by twice that beside the way from a body's point to
/// its vertex; both products round by 3 eta |d| S, their difference by one, and the point by
/// 8.1 eta S: together below 24 eta |d| S.
double provedMore(const MinkowskiDifference& difference, const Combination& at,
                  const Length& length, const Search<double>& search) {
  const double error = 2 * at.error;
  const auto [head, tail] = length;
  if (!search.hasDirection() || !(head > 0x1p10 * error))
    return -std::numeric_limits<double>::infinity();
  const Vec3& d = search.direction;
  double far = 0;
  const auto& [summitA, summitB] = search.summits;
  if (!summitA.alone || summitA.vertex != at.onBodyA.vertex)
    far += reachPast(at.onBodyA, difference.a, d, search.length, summitA);
  if (!summitB.alone || summitB.vertex != at.onBodyB.vertex)
    far += reachPast(at.onBodyB, difference.b, -d, search.length, summitB);
  const double blur = error + 2 * kUnit * head;
  const Vec3 off = minus(at.aToB, d);
  const double slip = 2 * (dot(off, off) + blur * blur) / head;
  const double lost = (slip + far / search.length + error) * (1 + 0x1p-8);
  return tail - lost;
}
/// Its supports have proved it.
double provedMore(const MinkowskiDifference&, const Combination&, const Length& length,
                  const Search<Wide>& search) {
  const auto more = static_cast<double>(search.lower - length.head);
  return more - 2 * kUnit * std::abs(more);
}

enum class Outcome : std::uint8_t {
  open,         ///< not proved, or not to the bound that Decision promises
  beyondLimit,  ///< proved: farther apart than the limit
  decided
};

/// Fills in what holds of separated bodies that are proved to be length.head + low apart, along
/// `axis`.
template <class Real>
Outcome describeSeparation(const Simplex<Real>& simplex, const Length& length, double low,
                           const Vec3& axis, Combination& at, Decision& decision) {
  const auto [head, tail] = length;
  const double more = std::max(tail, low);
  const double distance = head + more;
  const double rest = (head - distance) + more;  // exact (Dekker's fast two-sum)
  const double bound = std::max(tail - more + rest + at.error, more - low - rest);
  decision.verdict = Verdict::separated;
  decision.distance = distance;
  decision.errorBound = bound * (1 + 8 * kUnit);
  // Where the bound is no small part of the distance, the vector from point to point may lead
  // anywhere, and only the last unit will do.
  const bool fine = bound <= kFine * distance;
  const Vec3& w = at.aToB;
  decision.normal = fine ? Vec3(w.x() / distance, w.y() / distance, w.z() / distance) : axis;
  return at.isWithin(bound, fine ? kMostError : 1, simplex) ? Outcome::decided : Outcome::open;
}

/// Whether the bodies are proved to touch along `axis`, the last one known, or along another that
/// things often stand or lean along: the simplex' normal, the world's axes. Sets `axis`. `again`:
/// all but the normal have been tried.
template <class Real>
bool findTouching(const MinkowskiDifference& difference, const Search<Real>& search, bool again,
                  Vec3& axis) {
  std::array<Vec3, 9> directions;
  std::size_t count = 0;
  const Simplex<Real>& simplex = search.simplex;
  if (!again) directions[count++] = axis;
  if (simplex.size == 3) {
    const auto& p = simplex.points;
    const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]).template cast<double>();
    directions[count++] = normal;
    directions[count++] = -normal;
  }
  for (int k = 0; k < 3 && !again; ++k) {
    directions[count++] = Vec3::Unit(k);
    directions[count++] = -Vec3::Unit(k);
  }
  for (const Vec3& direction : std::span(directions).first(count)) {
    if (!(direction.squaredNorm() > 0)) continue;
    if (!provedTouching(difference, direction, simplex.newest())) continue;
    axis = direction;  // as it is: made unit, its sums would not come out exact
    return true;
  }
  return false;
}

/// Whether the origin is proved to be strictly inside B - A though it lies on the simplex.
template <class Real>
bool findInside(const MinkowskiDifference& difference, const Simplex<Real>& simplex) {
  Polytope<Real> polytope(difference);
  const std::span pairs(simplex.pairs.data(), static_cast<std::size_t>(simplex.size));
  if (surround<Real>(pairs, polytope)) return true;
  polytope.clear();
  return surroundBySearch<Real>(polytope);
}

/// Fills in what the features that the walk ended at prove. `axis` is the last one known to part
/// the bodies; a nearest point that proves nothing may point anywhere.
template <class Real>
Outcome conclude(const MinkowskiDifference& difference, Search<Real>& search, double limit,
                 Vec3& axis, Decision& decision) {
  if (search.beyondLimit) {
    axis = search.axis();
    return Outcome::beyondLimit;
  }
  const Simplex<Real>& simplex = search.simplex;
  const Vec3& tA = difference.a.body->translation;
  const bool inside = simplex.holdsOrigin;
  Combination at(difference, simplex);
  bool common = inside && at.isCommonPoint(tA, simplex);
  if (inside && !common) {
    sharpen(difference, simplex, at);
    common = at.isCommonPoint(tA, simplex);
  }
  decision.pointA = plus(at.pointA, tA);
  decision.pointB = plus(at.pointB, tA);
  if (!inside) {
    const Length length = at.length(static_cast<double>(search.distance));
    const double low = provedMore(difference, at, length, search);
    const bool apart = low > -length.head;
    if (apart) axis = search.axis();
    if ((length.head - limit) + low > 0) return Outcome::beyondLimit;
    if (apart) return describeSeparation(simplex, length, low, axis, at, decision);
    common = at.isCommonPoint(tA, simplex);
  }
  if (!common) return Outcome::open;
  const bool again = std::is_same_v<Real, Wide> && fitsDoubles(difference);
  if (!inside && findTouching(difference, search, again, axis)) {
    decision.verdict = Verdict::touching;
    decision.decidedBy = DecidedBy::expansion;
    decision.normal = axis.stableNormalized();
    return Outcome::decided;
  }
  if (!inside && !findInside(difference, simplex)) return Outcome::open;
  decision.verdict = Verdict::penetrating;
  return Outcome::decided;
}

Decision decideExactly(const MinkowskiDifference& difference, FeatureCache& cache) {
  ExactDifference integers(*difference.a.body, *difference.b.body);
  const ExactAnswer exact = solveExactly(integers, cache);
  Decision decision;
  decision.verdict = exact.verdict;
  decision.decidedBy = DecidedBy::rational;
  decision.distance = exact.distance;
  if (exact.verdict == Verdict::separated)
    decision.errorBound = 2 * kUnit * exact.distance + std::numeric_limits<double>::denorm_min();
  decision.pointA = exact.pointA;
  decision.pointB = exact.pointB;
  if (exact.verdict != Verdict::penetrating) decision.normal = cache.axis = exact.normal;
  return decision;
}

/// The walk in Real from the cached features, and what it proves.
template <class Real>
Outcome search(const MinkowskiDifference& difference, double limit, FeatureCache& cache,
               Decision& decision) {
  Search<Real> search;
  const bool warm = start(difference, cache, search);
  walk(difference, limit, warm ? kLocalSteps : 0, search);
  const Outcome outcome = conclude(difference, search, limit, cache.axis, decision);
  remember(search, cache);
  return outcome;
}

/// False: proved farther apart than `limit`.
bool decideWithin(const ConvexBody& a, const ConvexBody& b, double limit, FeatureCache& cache,
                  Decision& decision) {
  const MinkowskiDifference difference(a, b);
  Outcome outcome = Outcome::open;
  if (fitsDoubles(difference)) outcome = search<double>(difference, limit, cache, decision);
  if (outcome == Outcome::open) outcome = search<Wide>(difference, limit, cache, decision);
  if (outcome == Outcome::open) decision = decideExactly(difference, cache);
  if (outcome == Outcome::beyondLimit) return false;
  tellFeatures(a, b, cache, decision);
  return true;
}

}  // namespace

std::optional<Decision> decideWithin(const ConvexBody& a, const ConvexBody& b, double limit,
                                     FeatureCache& cache) {
  std::optional<Decision> decision(std::in_place);
  if (!decideWithin(a, b, limit, cache, *decision)) decision.reset();
  return decision;
}

Decision decide(const ConvexBody& a, const ConvexBody& b, FeatureCache& cache) {
  Decision decision;
  decideWithin(a, b, std::numeric_limits<double>::infinity(), cache, decision);
  return decision;
}

double provedSeparation(const ConvexBody& a, const ConvexBody& b, const FeatureCache& cache) {
  if (!(cache.axis.squaredNorm() > 0)) return -std::numeric_limits<double>::infinity();
  VertexPair hint = valid(cache, a, b) ? cache.pairs[0] : VertexPair{};
  const WideVec axis = cache.axis.cast<Wide>();
  const Wide length = axis.norm();
  const Wide proved = leastAlong(MinkowskiDifference(a, b), axis, length, hint).bound / length;
  return static_cast<double>(proved - std::abs(proved) * 2 * kUnit);
}

}  // namespace enfilade::collision
