// Conservative advancement (Mirtich 1996, section 2.3; seed 5.1) for translation. If a plane with
// normal n parts A and B by d, moving A by s * displacement leaves them at least
// d - s * (displacement . n) apart. So A may advance by (d - target) / (displacement . n), after
// which the closest points are computed anew. The first approach aims at `high` and remembers where
// it got there; the second goes on to `low` to see whether the obstacle really stands in the way.
#include "collision/motion/shape_cast.hpp"

#include "collision/narrow_phase/penetration_depth.hpp"

namespace enfilade::collision {
namespace {

constexpr int kAdvanceBound = 48;      // steps a target; a handful is usual
constexpr double kArrived = 1.0 / 32;  // of (high - low): near enough to a target
// Of |displacement|: slower closing is not told from none, since the direction of a small distance
// beside large bodies is known no better.
constexpr double kGrazing = 1e-9;

struct Advance {
  double fraction;
  bool reached;  ///< came as near as the target; else passed with the whole displacement
  bool boundReached = false;
  Decision last;
};

/// Whether last tick's axis alone proves that A keeps `distance` from B on its whole way.
bool axisProvesMiss(const ConvexBody& a, const Vec3& displacement, const ConvexBody& b,
                    double distance, const FeatureCache& cache) {
  const double length = cache.axis.norm();
  if (!(length > 0)) return false;
  const double closing = std::max(0.0, displacement.dot(cache.axis) / length);
  const double rounding = 0x1p-49 * displacement.norm();  // product, sums, length, quotient: < 10u
  return provedSeparation(a, b, cache) > distance + closing + rounding;
}

double closingSpeed(const Vec3& displacement, const Decision& at) {
  const double closing = displacement.dot(at.normal);
  return closing > kGrazing * displacement.norm() ? closing : 0;
}

Advance advanceTo(double target, double tolerance, double from, const ConvexBody& a,
                  const Vec3& displacement, const ConvexBody& b, FeatureCache& cache,
                  SweepResult& result) {
  Advance advance{from, false, false, {}};
  for (int i = 0; i < kAdvanceBound; ++i) {
    ConvexBody moved = a;
    moved.translation += advance.fraction * displacement;
    const double reach = target + tolerance + (1 - advance.fraction) * displacement.norm();
    const std::optional<Decision> decision = decideWithin(moved, b, reach, cache);
    ++result.queries;
    if (!decision) return advance;  // proved too far for the rest of the way
    advance.last = *decision;
    if (advance.last.decidedBy == DecidedBy::rational) ++result.rationals;
    const double distance = advance.last.distance - advance.last.errorBound;
    const bool apart = advance.last.verdict == Verdict::separated;
    const double closing = closingSpeed(displacement, advance.last);
    if (apart && closing == 0) return advance;  // a plane parts them for the rest of the way
    if (!apart || distance <= target + tolerance) {
      advance.reached = true;
      return advance;
    }
    const double step = (distance - target) / closing;
    if (advance.fraction + step >= 1) return advance;
    advance.fraction += step;
  }
  advance.reached = advance.boundReached = true;
  return advance;
}

/// Bodies that already overlap: the axis of least overlap tells which moves close in further.
/// Sets the normal of `at` to it where the bodies penetrate.
bool partsOverlap(const ConvexBody& a, const ConvexBody& b, const Vec3& displacement,
                  const FeatureCache& cache, Decision& at) {
  if (at.verdict == Verdict::penetrating) {
    DepthCache none;
    at.normal = penetrationDepth(a, b, cache, none).normal;
  }
  return displacement.dot(at.normal) <= 0;
}

}  // namespace

SweepResult sweep(const ConvexBody& a, const Vec3& displacement, const ConvexBody& b,
                  const StoppingBand& band, FeatureCache& cache) {
  SweepResult result;
  if (displacement.isZero(0) || axisProvesMiss(a, displacement, b, band.low, cache)) return result;

  const double tolerance = kArrived * (band.high - band.low);
  Advance near = advanceTo(band.high, tolerance, 0, a, displacement, b, cache, result);
  if (!near.reached) return result;
  Advance in = near;
  const bool overlapping = near.last.verdict != Verdict::separated;
  if (overlapping) {
    ConvexBody moved = a;
    moved.translation += near.fraction * displacement;
    if (partsOverlap(moved, b, displacement, cache, near.last)) return result;
  }
  if (!overlapping && !near.boundReached)
    in = advanceTo(band.low, tolerance, near.fraction, a, displacement, b, cache, result);
  if (!in.reached) return result;
  result.stopped = true;
  result.boundReached = in.boundReached;
  result.fraction = near.fraction;
  result.atStop = near.last;
  return result;
}

}  // namespace enfilade::collision
