// Shape casts by conservative advancement (conservative_advancement.hpp). The motions differ in the
// bound of a step.
//
// Translation. If a plane with normal n separates A and B by d, the motion of A by s * displacement
// leaves a distance of at least d - s * (displacement . n).
//
// Rotation about a fixed line. Let u be the axis and r a vertex relative to the pivot. A rotation
// by phi moves the vertex along n by
//   c sin(phi) + k (1 - cos(phi)),  c = n . (u x r),  k = n . (u x (u x r)),
// whose second derivative is at most |n x u| |u x r|. Two planes are tried, and the longer step is
// taken. A fixed plane bounds the motion of A's vertices. A plane that rotates with A bounds the
// opposite motion of B's vertices. With the second plane, the speed of the far end of a long link
// does not limit the approach of its face to a post.
//
// Uniform motion between two poses: as the rotation, about the moving origin, with a plane that
// does not rotate. A body is near its goal most of the time, where the plane of the nearest face is
// a good one. If both bodies move, the plane moves with the second one; if both rotate, each may
// use up half of the gap.
//
// Departure: Mirtich bounds the speed of all points by one number.
#include "collision/motion/shape_cast.hpp"

#include "collision/motion/conservative_advancement.hpp"
#include "collision/narrow_phase/penetration_depth.hpp"

namespace enfilade::collision {
namespace {

constexpr int kMaxTranslationSteps = 48;  // per target; about five are usual
constexpr int kMaxRotationSteps = 96;     // per target; a dozen is usual
constexpr int kMaxScrewSteps = 200;       // two or three are usual
// Of |displacement|, or of the radius: slower approach counts as none, because the direction of a
// small distance between large bodies has an error of this size.
constexpr double kGrazing = 1e-9;
constexpr double kArrivalTolerance = 1.0 / 32;    // of (rest - min): tolerance at a target
constexpr double kKeptDistanceRatio = 15.0 / 16;  // of an initial distance below min: to be kept
constexpr double kRelativeSlack = 0x1p-40;        // of a step; more than the rounding of a root
constexpr double kMinStepNearContact = 1.0 / 32;  // shorter steps close to contact end the cast
constexpr double kMinStep = 1e-9;                 // shorter steps are no progress

/// A distance to advance to, metres.
struct TargetDistance {
  double distance, tolerance;
};

/// Advances to offset.rest, and from there to offset.min to check that the obstacle really blocks
/// the motion. `cast` advances to a target (advanceTo), and decides where the first target is
/// reached: isLeaving(), for bodies that overlap there, frees the motion; findSecondTarget()
/// returns nullopt if it ends there.
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

// ---- rotation about a fixed line ---------------------------------------------------------------

/// Path of a vertex that rotates about a line; the parameter is the angle.
struct RotationPath {
  const PlacedConvex& body;
  Vec3 normal, pivot, axis;
  Vec3 tangent = normal.cross(axis);  // n . (u x r) = (n x u) . r
  double across = tangent.norm();

  Vec3 arm(const Vec3& vertex) const { return placeVertex(body, vertex) - pivot; }
  double height(const Vec3& r) const { return normal.dot(r); }
  double speed(const Vec3& r) const { return tangent.dot(r); }
  double curvature(const Vec3& r) const { return across * axis.cross(r).norm(); }
};

struct RotationCast {
  const PlacedConvex& a;
  const AxisRotation& rotation;
  const PlacedConvex& b;
  FeatureCache& cache;
  Vec3 axis = rotation.angle > 0 ? rotation.axis : Vec3(-rotation.axis);
  double angle = std::abs(rotation.angle);
  double maxRadius = computeMaxDistance();  ///< of A's points from the pivot, metres

  double computeMaxDistance() const {
    double squared = 0;
    for (const Vec3& v : a.vertices)
      squared = std::max(squared, (placeVertex(a, v) - rotation.pivot).squaredNorm());
    return std::sqrt(squared);
  }

  /// Angle (radians) up to which a gap along `normal` (from A to B) is proved to stay open.
  double computeCertifiedAngle(const PlacedConvex& moved, const Vec3& normal, double gap) const {
    const double fixedPlaneAngle =
        findPlaneCrossing(a.vertices, gap, RotationPath{moved, normal, rotation.pivot, axis});
    const double rotatingPlaneAngle =
        findPlaneCrossing(b.vertices, gap, RotationPath{b, -normal, rotation.pivot, -axis});
    return (1 - kRelativeSlack) * std::max(fixedPlaneAngle, rotatingPlaneAngle);
  }

  void advanceTo(const TargetDistance& target, MotionResult& result) {
    RigidTransform pose;
    PlacedConvex moved;
    advanceFraction(
        kMaxRotationSteps, result,
        [&](double at) {
          pose = computeTransformAfter(a, rotation, at);
          moved = place({a.vertices, a.hull}, pose);
          const double maxTravel = (1 - at) * angle * maxRadius;
          return computeSeparationWithin(moved, b, target.distance + target.tolerance + maxTravel,
                                         cache);
        },
        [&](double, const SeparationResult& separation) {
          const double gap = separation.distance - separation.errorBound - target.distance;
          if (separation.verdict != Verdict::separated || gap <= target.tolerance) return kArrived;
          return computeCertifiedAngle(moved, separation.normal, gap) / angle;
        });
  }

  bool isLeaving(const MotionResult&) const { return false; }

  std::optional<TargetDistance> findSecondTarget(const MotionResult& rest,
                                                 const TargetDistance& min) const {
    const SeparationResult& start = rest.separation;
    if (rest.lo != 0 || start.distance > min.distance + min.tolerance) return min;
    const Vec3 r = start.pointA - rotation.pivot;
    if (start.normal.dot(axis.cross(r)) > kGrazing * maxRadius) return std::nullopt;
    const double kept = kKeptDistanceRatio * start.distance;
    return TargetDistance{kept, std::min(min.tolerance, 0.25 * (start.distance - kept))};
  }
};

// ---- uniform motion between two poses ----------------------------------------------------------

/// Path of a vertex along `normal`, in the body frame at `rotation`; the parameter is the fraction.
struct ScrewPath {
  Vec3 localNormal, tangent;
  double translationSpeed, curvaturePerRadius;

  ScrewPath(const ScrewMotion& motion, const Vec3& relativeTranslation, const Mat3& rotation,
            const Vec3& normal)
      : localNormal(rotation.transpose() * normal),
        // n . (w x r) = (n x w) . r, and n . (w x (w x r)) = (n x w) . (w x r) for any rotated r.
        tangent(rotation.transpose() * normal.cross(motion.angle * motion.axis)),
        translationSpeed(normal.dot(relativeTranslation)),
        curvaturePerRadius(tangent.norm() * std::abs(motion.angle) * (1 + kRelativeSlack)) {}

  const Vec3& arm(const Vec3& vertex) const { return vertex; }
  double height(const Vec3& r) const { return localNormal.dot(r); }
  double speed(const Vec3& r) const { return translationSpeed + tangent.dot(r); }
  double curvature(const Vec3& r) const { return curvaturePerRadius * r.norm(); }
};

/// `still`: B if it is stationary; then `b` is only its shape.
MotionResult castScrew(const MovingShape& a, const MovingShape& b, const PlacedConvex* still,
                       const ContactOffset& offset, FeatureCache& cache) {
  RigidTransform poseA, poseB;
  const Vec3 relativeTranslation = a.motion.translation - b.motion.translation;
  const bool rotatesB = b.motion.angle != 0;
  const auto certify = [&](const Vec3& normal, double gap) {
    const ScrewPath pathA(a.motion, relativeTranslation, poseA.rotation, normal);
    const double share = rotatesB ? gap / 2 : gap;
    const double step = findPlaneCrossing(a.shape.vertices, share, pathA);
    if (!rotatesB) return step;
    const ScrewPath pathB(b.motion, Vec3::Zero(), poseB.rotation, -normal);
    return std::min(step, findPlaneCrossing(b.shape.vertices, share, pathB));
  };
  MotionResult result{.lo = 0};
  double queried = 0;
  advanceFraction(
      kMaxScrewSteps, result,
      [&](double at) {
        queried = at;
        poseA = computeTransformAfter(a.motion, at);
        if (!still) poseB = computeTransformAfter(b.motion, at);
        return std::optional(computeSeparation(place(a.shape, poseA),
                                               still ? *still : place(b.shape, poseB), cache));
      },
      [&](double at, const SeparationResult& separation) {
        if (separation.verdict != Verdict::separated) return kArrived;
        const double distance = separation.distance - separation.errorBound;
        const double certified =
            certify(separation.normal, std::max(0.0, distance - offset.min)) * (1 - kRelativeSlack);
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
