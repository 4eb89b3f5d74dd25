// The verdict comes from decide(), with how it was found; the numbers come from exact integers,
// rounded once at the end. Distances are those of the exact closest features, depths those of the
// nearest facet of the Minkowski difference.
#include "collision/narrow_phase/refine.hpp"

#include "collision/exact/exact_answer.hpp"
#include "collision/exact/exact_depth.hpp"
#include "collision/narrow_phase/feature_classification.hpp"
#include "collision/narrow_phase/penetration_depth.hpp"

namespace enfilade::collision {
namespace {

void describePenetration(const ConvexBody& a, const ConvexBody& b, const FeatureCache& decided,
                         Refinement& refinement) {
  DepthCache none;
  const Depth depth = penetrationDepth(a, b, decided, none);
  const double atMost = (depth.depth + depth.errorBound) * (1 + 4 * kUnit);
  const ExactFacet facet = nearestFacetExactly(a, b, atMost);
  const mpf_class squared = precise(dot(facet.normal, facet.normal));
  const mpf_class offset = precise(facet.offset);
  refinement.penetration = toDouble(mpf_class(offset / sqrt(squared)), facet.scale);
  const std::array<const Integer*, 3> normal{&facet.normal.x, &facet.normal.y, &facet.normal.z};
  for (int i = 0; i < 3; ++i) {
    const mpf_class way = -precise(*normal[i]) * offset / squared;
    roundInTwo(way, facet.scale, refinement.closest[i], refinement.closestTail[i]);
  }
}

/// |sum of weight * w / total| * 2^scale < limit, in integers.
bool isNearerExactly(ExactDifference& difference, const ExactNearest& nearest, double limit) {
  const ExactPoint sum = weightedSum(difference, nearest);
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

Refinement refine(const ConvexBody& a, const ConvexBody& b, FeatureCache& cache) {
  Refinement refinement;
  refinement.decidedBy = decide(a, b, cache).decidedBy;
  const FeatureCache decided = cache;
  ExactDifference difference(a, b);
  const ExactAnswer exact = solveExactly(difference, cache);
  refinement.verdict = exact.verdict;
  refinement.distance = exact.distance;
  refinement.closest = exact.closest;
  refinement.closestTail = exact.closestTail;
  refinement.pointA = exact.pointA;
  refinement.pointB = exact.pointB;
  tellFeatures(a, b, cache, refinement);
  if (exact.verdict == Verdict::penetrating) describePenetration(a, b, decided, refinement);
  return refinement;
}

bool isNearerThan(const ConvexBody& a, const ConvexBody& b, double limit, FeatureCache& cache) {
  return isNearerThan(decide(a, b, cache), a, b, limit, cache);
}

bool isNearerThan(const Decision& decision, const ConvexBody& a, const ConvexBody& b, double limit,
                  FeatureCache& cache) {
  if (!(limit > 0)) return false;
  if (limit == std::numeric_limits<double>::infinity()) return true;
  if (decision.verdict != Verdict::separated) return true;
  // A limit at twice the distance or more is no question; below, the difference rounds by less.
  const double margin = decision.errorBound * (1 + 4 * kUnit) + 4 * kUnit * limit;
  if (std::abs(decision.distance - limit) > margin) return decision.distance < limit;
  ExactDifference difference(a, b);
  return isNearerExactly(difference, nearestExactly(difference, cache), limit);
}

}  // namespace enfilade::collision
