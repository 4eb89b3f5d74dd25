// Shape casts by conservative advancement (conservative_advancement.hpp). The motions differ in the
// bound of a step.
//
// Translation. Let a plane with normal n separate A and B by d. The motion of A by s * displacement
// leaves a distance of at least d - s * (displacement . n).
//
// Rotation about a fixed line, and uniform motion between two poses: plane_bound.cpp.
#include "collision/motion/shape_cast.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "collision/assert.hpp"
#include "collision/motion/conservative_advancement.hpp"
#include "collision/motion/moving_pose.hpp"
#include "collision/motion/plane_bound.hpp"
#include "collision/narrow_phase/penetration_depth.hpp"

namespace enfilade::collision {
namespace {

constexpr int kMaxTranslationSteps = 48;  // per target; about five are usual
constexpr int kMaxRotationSteps = 96;     // per target; a dozen is usual
constexpr int kMaxScrewSteps = 200;       // two or three are usual
// Of |displacement|, or of the radius. Slower approach counts as none, because the direction of a
// small distance between large bodies has an error of this size.
constexpr double kGrazing = 1e-9;
constexpr double kArrivalTolerance = 1.0 / 32;    // of (rest - min): tolerance at a target
constexpr double kKeptDistanceRatio = 15.0 / 16;  // of an initial distance below min: to be kept
constexpr double kMinStepNearContact = 1.0 / 32;  // shorter steps close to contact end the cast
constexpr double kMinStep = 1e-9;                 // shorter steps are no progress

/// A distance to advance to, metres.
struct TargetDistance {
  double distance, tolerance;
};

/// Advances to offset.rest, and from there to offset.min to check that the obstacle really blocks
/// the motion. `cast` advances to a target (advanceTo), and decides where the first target is
/// reached. Its isLeaving() frees the motion of bodies that overlap there. Its findSecondTarget()
/// returns nullopt if the motion ends there.
template <class Cast>
MotionResult castToOffset(Cast& cast, const ContactOffset& offset) {
  ENFILADE_ASSERT(offset.min < offset.rest);
  const double tolerance = kArrivalTolerance * (offset.rest - offset.min);
  MotionResult result{.lo = 0};
  cast.advanceTo({offset.rest, tolerance}, result);
  if (result.isClear()) return result;
  if (result.separation.verdict != Verdict::separated) {
    if (cast.isLeaving(result)) result.outcome = MotionOutcome::clear;
  } else if (result.outcome == MotionOutcome::contact) {
    if (const auto target = cast.findSecondTarget(result, {offset.min, tolerance})) {
      MotionResult min = result;
      cast.advanceTo(*target, min);
      result.outcome = min.outcome;
      result.queries = min.queries, result.exactQueries = min.exactQueries;
    }
  }
  if (result.isClear()) result.lo = 1;
  return result;
}

// ---- translation -------------------------------------------------------------------------------

struct TranslationCast {
  const PlacedConvex& a;
  const Vec3& displacement;
  const PlacedConvex& b;
  FeatureCache& cache;

  PlacedConvex placeAt(double fraction) const {
    PlacedConvex moved = a;
    moved.translation += fraction * displacement;
    return moved;
  }

  /// True if last tick's axis alone proves that A keeps `distance` from B.
  bool isMissCertified(double distance) const {
    const double length = cache.axis.norm();
    if (!(length > 0)) return false;
    const double closing = std::max(0.0, displacement.dot(cache.axis) / length);
    const double rounding = 0x1p-49 * displacement.norm();  // product, sums, length, quotient < 10u
    return isSeparationProved(a, b, distance + closing + rounding, cache);
  }

  void advanceTo(const TargetDistance& target, MotionResult& result) {
    const double arrival = target.distance + target.tolerance;
    advanceFraction(
        kMaxTranslationSteps, result,
        [&](double at) {
          return computeSeparationWithin(placeAt(at), b, arrival + (1 - at) * displacement.norm(),
                                         cache);
        },
        [&](double, const SeparationResult& separation) {
          double closing = displacement.dot(separation.normal);
          if (!(closing > kGrazing * displacement.norm())) closing = 0;
          if (separation.verdict == Verdict::separated && closing == 0)
            return std::numeric_limits<double>::infinity();
          if (isWithin(separation, arrival)) return kArrived;
          const double gap = separation.distance - separation.errorBound - target.distance;
          return findFirstRoot(gap, closing, 0);
        });
  }

  /// True if the displacement does not increase the overlap along the axis of minimum penetration.
  /// If the bodies penetrate, sets the normal to that axis.
  bool isLeaving(MotionResult& at) {
    if (at.separation.verdict == Verdict::penetrating) {
      DepthCache none;
      at.separation.normal = computePenetrationDepth(placeAt(at.lo), b, cache, none).normal;
    }
    return displacement.dot(at.separation.normal) <= 0;
  }

  std::optional<TargetDistance> findSecondTarget(const MotionResult&, const TargetDistance& min) {
    return min;
  }
};

// ---- rotation ----------------------------------------------------------------------------------

struct RotationCast {
  const PlacedConvex& a;
  const AxisRotation& rotation;
  const PlacedConvex& b;
  FeatureCache& cache;
  Vec3 axis = rotation.angle > 0 ? rotation.axis : Vec3(-rotation.axis);
  double angle = std::abs(rotation.angle);
  double radiusA = computeRadiusAround(a, rotation.pivot);  ///< of the vertices, metres
  double radiusB = -1;                                      ///< the same of B's; < 0: not known yet

  void advanceTo(const TargetDistance& target, MotionResult& result) {
    RigidTransform pose;
    PlacedConvex moved;
    advanceFraction(
        kMaxRotationSteps, result,
        [&](double at) {
          pose = computeTransformAfter(a, rotation, at);
          moved = place({a.vertices, a.hull}, pose);
          const double maxTravel = (1 - at) * angle * radiusA;
          return computeSeparationWithin(moved, b, target.distance + target.tolerance + maxTravel,
                                         cache);
        },
        [&](double at, const SeparationResult& separation) {
          const double distance = separation.distance - separation.errorBound;
          if (separation.verdict != Verdict::separated ||
              distance - target.distance <= target.tolerance)
            return kArrived;
          if (radiusB < 0) radiusB = computeRadiusAround(b, rotation.pivot);
          PairMotion pair;
          pair.a = {moved, rotation.pivot - moved.translation, angle * axis, radiusA};
          pair.b = {b, rotation.pivot - b.translation, Vec3::Zero(), radiusB};
          pair.keptDistance = target.distance;
          return computeCertifiedStep(pair, {separation.normal, distance}, cache, 1 - at);
        });
  }

  bool isLeaving(const MotionResult&) const { return false; }

  std::optional<TargetDistance> findSecondTarget(const MotionResult& rest,
                                                 const TargetDistance& min) const {
    const SeparationResult& start = rest.separation;
    if (rest.lo != 0 || start.distance > min.distance + min.tolerance) return min;
    const Vec3 r = start.pointA - rotation.pivot;
    if (start.normal.dot(axis.cross(r)) > kGrazing * radiusA) return std::nullopt;
    const double kept = kKeptDistanceRatio * start.distance;
    return TargetDistance{kept, std::min(min.tolerance, 0.25 * (start.distance - kept))};
  }
};

// ---- uniform motion between two poses ----------------------------------------------------------

/// `stationary`: B if it is stationary; then `b` is only its shape.
MotionResult castScrew(const MovingShape& a, const MovingShape& b, const PlacedConvex* stationary,
                       const ContactOffset& offset, FeatureCache& cache) {
  RigidTransform poseA, poseB;
  PairMotion pair;
  pair.velocity = b.motion.translation - a.motion.translation;
  pair.keptDistance = offset.min;
  pair.a.angularVelocity = a.motion.angle * a.motion.axis;
  pair.b.angularVelocity = b.motion.angle * b.motion.axis;
  pair.a.radius = computeRadiusAround({a.shape.vertices}, Vec3::Zero());
  if (!stationary) pair.b.radius = computeRadiusAround({b.shape.vertices}, Vec3::Zero());
  MotionResult result{.lo = 0};
  double queried = 0;
  advanceFraction(
      kMaxScrewSteps, result,
      [&](double at) {
        queried = at;
        poseA = computeTransformAfter(a.motion, at);
        if (!stationary) poseB = computeTransformAfter(b.motion, at);
        return std::optional(computeSeparation(
            place(a.shape, poseA), stationary ? *stationary : place(b.shape, poseB), cache));
      },
      [&](double at, const SeparationResult& separation) {
        if (separation.verdict != Verdict::separated) return kArrived;
        const double distance = separation.distance - separation.errorBound;
        pair.a.body = place(a.shape, poseA);
        pair.b.body = stationary ? *stationary : place(b.shape, poseB);
        const Vec3 between = pair.b.body.translation - poseA.translation;
        if (stationary) {  // about A's origin: the offset and what the bound adds for it are 0
          pair.b.reference = -between;
          pair.b.radius = computeRadiusAround(*stationary, poseA.translation);
        } else {
          pair.offset = between;
        }
        const double certified =
            computeCertifiedStep(pair, {separation.normal, distance}, cache, 1 - at);
        const double minStep = distance <= offset.rest ? kMinStepNearContact : kMinStep;
        return at + certified < 1 && certified < minStep ? kArrived : certified;
      });
  if (!result.isClear()) result.lo = queried;
  return result;
}

}  // namespace

MotionResult castShape(const PlacedConvex& a, const Vec3& displacement, const PlacedConvex& b,
                       const ContactOffset& offset, FeatureCache& cache) {
  TranslationCast cast{a, displacement, b, cache};
  if (displacement.isZero(0) || cast.isMissCertified(offset.min)) return {};
  return castToOffset(cast, offset);
}

MotionResult castShape(const PlacedConvex& a, const AxisRotation& rotation, const PlacedConvex& b,
                       const ContactOffset& offset, FeatureCache& cache) {
  if (rotation.angle == 0) return {};
  RotationCast cast{a, rotation, b, cache};
  return castToOffset(cast, offset);
}

MotionResult castShape(const MovingShape& a, const PlacedConvex& b, const ContactOffset& offset,
                       FeatureCache& cache) {
  const ScrewMotion none{};
  return castScrew(a, {{b.vertices, b.hull}, none}, &b, offset, cache);
}

MotionResult castShape(const MovingShape& a, const MovingShape& b, const ContactOffset& offset,
                       FeatureCache& cache) {
  return castScrew(a, b, nullptr, offset, cache);
}

}  // namespace enfilade::collision
