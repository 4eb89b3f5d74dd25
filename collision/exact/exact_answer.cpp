#include "collision/exact/exact_answer.hpp"

namespace enfilade::collision {
namespace {

Vec3 inMetres(const std::array<mpf_class, 3>& point, int scale) {
  return {toDouble(point[0], scale), toDouble(point[1], scale), toDouble(point[2], scale)};
}

void describeSeparation(ExactDifference& difference, const ExactNearest& nearest,
                        ExactAnswer& answer) {
  const ExactPoint sum = weightedSum(difference, nearest);
  const mpf_class total = precise(nearest.face.total);
  const std::array<mpf_class, 3> closest{mpf_class(precise(sum.x) / total),
                                         mpf_class(precise(sum.y) / total),
                                         mpf_class(precise(sum.z) / total)};
  mpf_class squared = precise(0);
  const int scale = difference.scale();
  for (int i = 0; i < 3; ++i) {
    squared += closest[i] * closest[i];
    roundInTwo(closest[i], scale, answer.closest[i], answer.closestTail[i]);
  }
  answer.distance = toDouble(sqrt(squared), scale);
}

}  // namespace

ExactAnswer solveExactly(ExactDifference& difference, FeatureCache& cache) {
  const ExactNearest nearest = nearestExactly(difference, cache);
  cache.size = static_cast<int>(nearest.pairs.size());
  std::copy(nearest.pairs.begin(), nearest.pairs.end(), cache.pairs.begin());

  ExactAnswer answer;
  const auto onA = weightedPoint(difference, nearest, true);
  const auto onB = weightedPoint(difference, nearest, false);
  answer.pointA = inMetres(onA, difference.scale());
  answer.pointB = inMetres(onB, difference.scale());
  if (!isZero(nearest.face.direction)) {
    describeSeparation(difference, nearest, answer);
    answer.normal = unitVector(nearest.face.direction);
    return answer;
  }
  const std::optional<ExactPoint> direction = partingDirection(difference, nearest);
  answer.verdict = direction ? Verdict::touching : Verdict::penetrating;
  if (direction) answer.normal = unitVector(*direction);
  return answer;
}

}  // namespace enfilade::collision
