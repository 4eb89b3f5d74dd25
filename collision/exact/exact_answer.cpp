#include "collision/exact/exact_answer.hpp"

namespace enfilade::collision {
namespace {

Vec3 toMetres(const std::array<mpf_class, 3>& point, int scale) {
  return {toDouble(point[0], scale), toDouble(point[1], scale), toDouble(point[2], scale)};
}

void describeSeparation(ExactMinkowskiDifference& difference, const ExactNearestFeature& nearest,
                        ExactSeparation& result) {
  const ExactPoint sum = computeWeightedSum(difference, nearest);
  const mpf_class total = toPreciseFloat(nearest.face.total);
  const std::array<mpf_class, 3> closest{mpf_class(toPreciseFloat(sum.x) / total),
                                         mpf_class(toPreciseFloat(sum.y) / total),
                                         mpf_class(toPreciseFloat(sum.z) / total)};
  mpf_class squared = toPreciseFloat(0);
  const int scale = difference.scale();
  for (int i = 0; i < 3; ++i) {
    squared += closest[i] * closest[i];
    splitToDoubles(closest[i], scale, result.closest[i], result.closestTail[i]);
  }
  result.distance = toDouble(sqrt(squared), scale);
}

}  // namespace

ExactSeparation computeExactSeparation(ExactMinkowskiDifference& difference, FeatureCache& cache) {
  const ExactNearestFeature nearest = findNearestExactly(difference, cache);
  cache.size = static_cast<int>(nearest.pairs.size());
  std::copy(nearest.pairs.begin(), nearest.pairs.end(), cache.pairs.begin());

  ExactSeparation result;
  const auto onA = computeWeightedPoint(difference, nearest, true);
  const auto onB = computeWeightedPoint(difference, nearest, false);
  result.pointA = toMetres(onA, difference.scale());
  result.pointB = toMetres(onB, difference.scale());
  if (!isZero(nearest.face.direction)) {
    describeSeparation(difference, nearest, result);
    result.normal = toUnitVector(nearest.face.direction);
    return result;
  }
  const std::optional<ExactPoint> direction = findSeparatingDirection(difference, nearest);
  result.verdict = direction ? Verdict::touching : Verdict::penetrating;
  if (direction) result.normal = toUnitVector(*direction);
  return result;
}

}  // namespace enfilade::collision
