// The certificate comes from computeSeparation(); the verdict and all numbers come from exact
// integers, rounded once at the end. Distances are those of the exact closest features, depths
// those of the nearest facet of the Minkowski difference.
#include "collision/narrow_phase/refine.hpp"

#include "collision/exact/exact_answer.hpp"
#include "collision/exact/exact_depth.hpp"
#include "collision/narrow_phase/feature_classification.hpp"
#include "collision/narrow_phase/penetration_depth.hpp"

namespace enfilade::collision {
namespace {

void describePenetration(const PlacedConvex& a, const PlacedConvex& b, const FeatureCache& features,
                         RefinedSeparation& refinement) {
  DepthCache emptyCache;
  const PenetrationResult depth = computePenetrationDepth(a, b, features, emptyCache);
  const double depthBound = (depth.depth + depth.errorBound) * (1 + 4 * kRoundoff);
  const ExactFacet facet = findNearestFacetExactly(a, b, depthBound);
  const mpf_class squared = toPreciseFloat(dot(facet.normal, facet.normal));
  const mpf_class offset = toPreciseFloat(facet.offset);
  refinement.penetration = toDouble(mpf_class(offset / sqrt(squared)), facet.scale);
  const std::array<const Integer*, 3> normal{&facet.normal.x, &facet.normal.y, &facet.normal.z};
  for (int i = 0; i < 3; ++i) {
    const mpf_class component = -toPreciseFloat(*normal[i]) * offset / squared;
    splitToDoubles(component, facet.scale, refinement.closest[i], refinement.closestTail[i]);
  }
}

/// |sum of weight * w / total| * 2^scale < limit, in integers.
bool isCloserExactly(ExactMinkowskiDifference& difference, const ExactNearestFeature& nearest,
                     double limit) {
  const ExactPoint sum = computeWeightedSum(difference, nearest);
  int exponent = 0;
  Integer mantissa(std::ldexp(std::frexp(limit, &exponent), 53));
  const int shift = exponent - 53 - difference.scale();
  Integer bound = mantissa * nearest.face.total;
  Integer squared = dot(sum, sum);
  if (shift >= 0) {
    bound <<= static_cast<unsigned>(shift);
  } else {
    squared <<= static_cast<unsigned>(-2 * shift);
  }
  return squared < bound * bound;
}

}  // namespace

RefinedSeparation refineSeparation(const PlacedConvex& a, const PlacedConvex& b,
                                   FeatureCache& cache) {
  RefinedSeparation refinement;
  refinement.certificate = computeSeparation(a, b, cache).certificate;
  const FeatureCache features = cache;
  ExactMinkowskiDifference difference(a, b);
  const ExactSeparation exact = computeExactSeparation(difference, cache);
  refinement.verdict = exact.verdict;
  refinement.distance = exact.distance;
  refinement.closest = exact.closest;
  refinement.closestTail = exact.closestTail;
  refinement.pointA = exact.pointA;
  refinement.pointB = exact.pointB;
  assignFeatures(a, b, cache, refinement);
  if (exact.verdict == Verdict::penetrating) describePenetration(a, b, features, refinement);
  return refinement;
}

bool isCloserThan(const PlacedConvex& a, const PlacedConvex& b, double limit, FeatureCache& cache) {
  return isCloserThan(computeSeparation(a, b, cache), a, b, limit, cache);
}

bool isCloserThan(const SeparationResult& separation, const PlacedConvex& a, const PlacedConvex& b,
                  double limit, FeatureCache& cache) {
  if (!(limit > 0)) return false;
  if (limit == std::numeric_limits<double>::infinity()) return true;
  if (separation.verdict != Verdict::separated) return true;
  // If the limit is twice the distance or more, the comparison is clear. Otherwise the rounding of
  // the difference is below the margin.
  const double margin = separation.errorBound * (1 + 4 * kRoundoff) + 4 * kRoundoff * limit;
  if (std::abs(separation.distance - limit) > margin) return separation.distance < limit;
  ExactMinkowskiDifference difference(a, b);
  return isCloserExactly(difference, findNearestExactly(difference, cache), limit);
}

}  // namespace enfilade::collision
