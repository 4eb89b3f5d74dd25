// Conservative advancement (Mirtich 1996, section 2.3) for a rotation about a fixed line. Let n be
// the unit normal of a plane, u the axis and r a vertex relative to the pivot. A rotation by phi
// moves the vertex along n by
//   c sin(phi) + k (1 - cos(phi)),  c = n . (u x r),  k = n . (u x (u x r)),
// whose second derivative is at most K = |n x u| |u x r|. A vertex `behind` metres behind the plane
// thus does not reach it before the root of behind - c phi - K phi^2 / 2. Two planes are tried, and
// the longer step is taken. A fixed plane bounds the motion of A's vertices. A plane that rotates
// with A bounds the opposite motion of B's vertices. With the second plane, the speed of the far
// end of a long link does not limit the approach of its face to a post.
//
// Departure: Mirtich bounds the speed of all points by one number.
#include "collision/motion/rotational_shape_cast.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/motion/moving_pose.hpp"

namespace enfilade::collision {
namespace {

constexpr int kMaxSteps = 96;                     // steps per target; a dozen is usual
constexpr double kArrivalTolerance = 1.0 / 32;    // of (rest - min): tolerance at a target
constexpr double kKeptDistanceRatio = 15.0 / 16;  // of an initial distance below min: to be kept
constexpr double kGrazing = 1e-9;                 // of the radius: slower approach counts as none
constexpr double kRoundingFactor = 1 - 0x1p-40;   // factor of each step
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Rotation by a positive angle; the axis holds the sign.
struct PositiveRotation {
  Vec3 pivot, axis;
  double angle;  ///< > 0
};

Vec3 placeVertex(const PlacedConvex& body, const Vec3& vertex) {
  return (body.rotation ? Vec3(*body.rotation * vertex) : vertex) + body.translation;
}

/// Minimum phi > 0 with behind - closing phi - curvature phi^2 / 2 = 0; behind > 0, curvature >= 0.
double findFirstRoot(double behind, double closing, double curvature) {
  const double root = std::sqrt(closing * closing + 2 * curvature * behind);
  if (closing > 0) return 2 * behind / (closing + root);
  return curvature > 0 ? (root - closing) / curvature : kInfinity;
}

/// Lower bound of the angle (radians) at which a vertex of `body` reaches the plane that lies `gap`
/// metres beyond the foremost vertex along `towards`.
double computeAngleUntil(const PlacedConvex& body, const Vec3& towards, double gap,
                         const PositiveRotation& rotation) {
  double foremost = -kInfinity;
  for (const Vec3& v : body.vertices)
    foremost = std::max(foremost, towards.dot(placeVertex(body, v) - rotation.pivot));
  const Vec3 speed = towards.cross(rotation.axis);  // n . (u x r) = (n x u) . r
  const double across = speed.norm();
  double minAngle = kInfinity;
  for (const Vec3& v : body.vertices) {
    const Vec3 r = placeVertex(body, v) - rotation.pivot;
    const double behind = gap + (foremost - towards.dot(r));
    const double curvature = across * rotation.axis.cross(r).norm();
    minAngle = std::min(minAngle, findFirstRoot(behind, speed.dot(r), curvature));
  }
  return minAngle;
}

/// Angle (radians) up to which a gap along `normal` (from A to B) is proved to stay open.
double computeCertifiedAngle(const PlacedConvex& a, const PlacedConvex& b, const Vec3& normal,
                             double gap, const PositiveRotation& rotation) {
  const double fixedPlaneAngle = computeAngleUntil(a, normal, gap, rotation);
  const double rotatingPlaneAngle =
      computeAngleUntil(b, -normal, gap, {rotation.pivot, -rotation.axis, rotation.angle});
  return kRoundingFactor * std::max(fixedPlaneAngle, rotatingPlaneAngle);
}

double computeMaxDistance(const PlacedConvex& body, const Vec3& pivot) {
  double squared = 0;
  for (const Vec3& v : body.vertices)
    squared = std::max(squared, (placeVertex(body, v) - pivot).squaredNorm());
  return std::sqrt(squared);
}

struct Advance {
  double fraction;
  bool reached = false;  ///< reached the target distance; false: passed with the whole rotation
  bool iterationLimitReached = false;
  SeparationResult last = {};
};

/// A rotating body and a static one during the cast.
struct RotatingPair {
  const PlacedConvex& a;
  const AxisRotation& rotation;
  const PlacedConvex& b;
  PositiveRotation positiveRotation;
  double maxRadius;  ///< maximum distance of A's points from the pivot, metres
  FeatureCache& cache;
  ShapeCastResult& result;

  Advance advanceTo(double target, double tolerance, double from) {
    Advance advance{from};
    for (int i = 0; i < kMaxSteps; ++i) {
      ENFILADE_ASSERT(advance.fraction >= 0 && advance.fraction < 1);
      const RigidTransform at = computeTransformAfter(a, rotation, advance.fraction);
      const PlacedConvex moved{a.vertices, at.translation, &at.rotation, a.hull};
      const double left = (1 - advance.fraction) * positiveRotation.angle;
      const auto separation =
          computeSeparationWithin(moved, b, target + tolerance + left * maxRadius, cache);
      ++result.queries;
      if (!separation) return advance;
      if (separation->certificate == Certificate::rational) ++result.exactQueries;
      advance.last = *separation;
      const double gap = separation->distance - separation->errorBound - target;
      if (separation->verdict != Verdict::separated || gap <= tolerance) {
        advance.reached = true;
        return advance;
      }
      advance.fraction +=
          computeCertifiedAngle(moved, b, separation->normal, gap, positiveRotation) /
          positiveRotation.angle;
      if (advance.fraction >= 1) return advance;
    }
    advance.reached = advance.iterationLimitReached = true;
    return advance;
  }

  bool isSeparatingAt(const SeparationResult& start) const {
    const Vec3 r = start.pointA - positiveRotation.pivot;
    return start.normal.dot(positiveRotation.axis.cross(r)) <= kGrazing * maxRadius;
  }
};

}  // namespace

RigidTransform computeTransformAfter(const PlacedConvex& body, const AxisRotation& rotation,
                                     double fraction) {
  const Vec3 angularVelocity = rotation.angle * rotation.axis;
  const Mat3 increment = integrateRotation(Mat3::Identity(), angularVelocity, fraction);
  return {body.rotation ? integrateRotation(*body.rotation, angularVelocity, fraction) : increment,
          rotation.pivot + increment * (body.translation - rotation.pivot)};
}

ShapeCastResult castShapeRotating(const PlacedConvex& a, const AxisRotation& rotation,
                                  const PlacedConvex& b, const ContactOffset& offset,
                                  FeatureCache& cache) {
  ShapeCastResult result;
  if (rotation.angle == 0) return result;
  const Vec3 axis = rotation.angle > 0 ? rotation.axis : Vec3(-rotation.axis);
  RotatingPair pair{a,
                    rotation,
                    b,
                    {rotation.pivot, axis, std::abs(rotation.angle)},
                    computeMaxDistance(a, rotation.pivot),
                    cache,
                    result};
  ENFILADE_ASSERT(pair.positiveRotation.angle > 0 && offset.min < offset.rest);
  double minDistance = offset.min, tolerance = kArrivalTolerance * (offset.rest - offset.min);
  const Advance restAdvance = pair.advanceTo(offset.rest, tolerance, 0);
  if (!restAdvance.reached) return result;
  Advance minAdvance = restAdvance;
  const bool separated = restAdvance.last.verdict == Verdict::separated;
  const bool startsClose =
      restAdvance.fraction == 0 && restAdvance.last.distance <= minDistance + tolerance;
  if (startsClose) {
    minDistance = kKeptDistanceRatio * restAdvance.last.distance;
    tolerance = std::min(tolerance, 0.25 * (restAdvance.last.distance - minDistance));
  }
  if (separated && !restAdvance.iterationLimitReached &&
      !(startsClose && !pair.isSeparatingAt(restAdvance.last)))
    minAdvance = pair.advanceTo(minDistance, tolerance, restAdvance.fraction);
  if (!minAdvance.reached) return result;
  result.stopped = true;
  result.iterationLimitReached = minAdvance.iterationLimitReached;
  result.fraction = restAdvance.fraction;
  result.separationAtStop = restAdvance.last;
  return result;
}

}  // namespace enfilade::collision
