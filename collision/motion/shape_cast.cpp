// Conservative advancement (Mirtich 1996, section 2.3; Lin 1993, section 5.1) for translation. If a
// plane with normal n separates A and B by d, the motion of A by s * displacement leaves a distance
// of at least d - s * (displacement . n). A can thus advance by (d - target) / (displacement . n).
// The closest points are then recomputed. The first advance aims at `rest` and records its
// fraction. The second continues to `min` to check that the obstacle really blocks the motion.
#include "collision/motion/shape_cast.hpp"

#include "collision/assert.hpp"
#include "collision/narrow_phase/penetration_depth.hpp"

namespace enfilade::collision {
namespace {

constexpr int kMaxSteps = 48;                   // steps per target; about five are usual
constexpr double kArrivalTolerance = 1.0 / 32;  // of (rest - min): tolerance at a target
// Of |displacement|: slower approach counts as none, because the direction of a small distance
// between large bodies has an error of this size.
constexpr double kGrazing = 1e-9;

struct Advance {
  double fraction;
  bool reached;  ///< reached the target distance; false: passed with the whole displacement
  bool iterationLimitReached = false;
  SeparationResult last;
};

/// True if last tick's axis alone proves that A keeps `distance` from B along the displacement.
bool isMissCertified(const PlacedConvex& a, const Vec3& displacement, const PlacedConvex& b,
                     double distance, const FeatureCache& cache) {
  const double length = cache.axis.norm();
  if (!(length > 0)) return false;
  const double closing = std::max(0.0, displacement.dot(cache.axis) / length);
  const double rounding = 0x1p-49 * displacement.norm();  // product, sums, length, quotient: < 10u
  return computeSeparationLowerBound(a, b, cache) > distance + closing + rounding;
}

double computeClosingSpeed(const Vec3& displacement, const SeparationResult& at) {
  const double closing = displacement.dot(at.normal);
  return closing > kGrazing * displacement.norm() ? closing : 0;
}

Advance advanceTo(double target, double tolerance, double from, const PlacedConvex& a,
                  const Vec3& displacement, const PlacedConvex& b, FeatureCache& cache,
                  ShapeCastResult& result) {
  Advance advance{from, false, false, {}};
  for (int i = 0; i < kMaxSteps; ++i) {
    ENFILADE_ASSERT(advance.fraction >= 0 && advance.fraction < 1);
    PlacedConvex moved = a;
    moved.translation += advance.fraction * displacement;
    const double maxDistance = target + tolerance + (1 - advance.fraction) * displacement.norm();
    const std::optional<SeparationResult> separation =
        computeSeparationWithin(moved, b, maxDistance, cache);
    ++result.queries;
    if (!separation) return advance;  // proved out of range for the remaining motion
    advance.last = *separation;
    if (advance.last.certificate == Certificate::rational) ++result.exactQueries;
    const double distance = advance.last.distance - advance.last.errorBound;
    const bool separated = advance.last.verdict == Verdict::separated;
    const double closing = computeClosingSpeed(displacement, advance.last);
    if (separated && closing == 0) return advance;  // separated for the remaining motion
    if (!separated || distance <= target + tolerance) {
      advance.reached = true;
      return advance;
    }
    const double step = (distance - target) / closing;
    if (advance.fraction + step >= 1) return advance;
    advance.fraction += step;
  }
  advance.reached = advance.iterationLimitReached = true;
  return advance;
}

/// For overlapping bodies: true if the displacement does not increase the overlap along the axis of
/// minimum penetration. If the bodies penetrate, sets the normal of `at` to that axis.
bool isSeparatingMotion(const PlacedConvex& a, const PlacedConvex& b, const Vec3& displacement,
                        const FeatureCache& cache, SeparationResult& at) {
  if (at.verdict == Verdict::penetrating) {
    DepthCache none;
    at.normal = computePenetrationDepth(a, b, cache, none).normal;
  }
  return displacement.dot(at.normal) <= 0;
}

}  // namespace

ShapeCastResult castShape(const PlacedConvex& a, const Vec3& displacement, const PlacedConvex& b,
                          const ContactOffset& offset, FeatureCache& cache) {
  ENFILADE_ASSERT(offset.min < offset.rest);
  ShapeCastResult result;
  if (displacement.isZero(0) || isMissCertified(a, displacement, b, offset.min, cache))
    return result;

  const double tolerance = kArrivalTolerance * (offset.rest - offset.min);
  Advance restAdvance = advanceTo(offset.rest, tolerance, 0, a, displacement, b, cache, result);
  if (!restAdvance.reached) return result;
  Advance minAdvance = restAdvance;
  const bool overlapping = restAdvance.last.verdict != Verdict::separated;
  if (overlapping) {
    PlacedConvex moved = a;
    moved.translation += restAdvance.fraction * displacement;
    if (isSeparatingMotion(moved, b, displacement, cache, restAdvance.last)) return result;
  }
  if (!overlapping && !restAdvance.iterationLimitReached)
    minAdvance =
        advanceTo(offset.min, tolerance, restAdvance.fraction, a, displacement, b, cache, result);
  if (!minAdvance.reached) return result;
  result.stopped = true;
  result.iterationLimitReached = minAdvance.iterationLimitReached;
  result.fraction = restAdvance.fraction;
  result.separationAtStop = restAdvance.last;
  return result;
}

}  // namespace enfilade::collision
