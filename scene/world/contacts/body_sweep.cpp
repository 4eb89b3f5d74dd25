// Conservative advancement (Mirtich 1996) as in collision/motion/time_of_impact.cpp, with
// a simplification: the separating plane does not rotate.
//  1. A plane with normal n separates the bodies by d at s.
//  2. A vertex r of the part lies g >= 0 behind the foremost vertex. It moves along n by c = n . (v
//     + w x r), with a quadratic term of at most b s^2, b = |n x w| |w| |r| / 2. Until s exceeds
//     the smallest root, over all vertices, of
//       d - min + g - c s - b s^2
// the plane separates the two by at least `min`.
//  3. Advance to that s and query again. The cast stops at the first s with a distance of `rest`.
// If both bodies move, the plane moves with the second one; if both rotate, each may use up half of
// d - min.
// Departure: collision::computeTimeOfImpact() finds the time of touching. A body must stop at a
// distance before that, and is near its goal most of the time; there the plane of the nearest face
// is a good one.
#include "scene/world/contacts/body_sweep.hpp"

#include <algorithm>
#include <cmath>

#include "scene/model/rotation.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMaxIterations = 200;               // two or three are usual
constexpr double kRelativeSlack = 0x1p-40;        // relative; more than the rounding of a root
constexpr double kMinStepNearContact = 1.0 / 32;  // fraction of the motion: shorter steps close to
                                                  // contact end the cast
constexpr double kMinStep = 1e-9;  // fraction of the motion: shorter steps are no progress

/// Smallest s > 0 with gap - speed s - curvature s^2 = 0; gap and curvature >= 0.
double findSmallestRoot(double gap, double speed, double curvature) {
  const double root = std::sqrt(speed * speed + 4 * curvature * gap);
  if (speed > 0) return 2 * gap / (speed + root);
  if (curvature > 0) return (root - speed) / (2 * curvature);
  return std::numeric_limits<double>::infinity();
}

/// Fraction of the motion for which the plane along `normal` certifies a distance above the gap.
double computeCertifiedStep(const MovingPart& part, const collision::Mat3& rotation,
                            const Vec3& normal, double gap) {
  const ScrewMotion& motion = part.motion;
  const Vec3 rotationVector = motion.angle * motion.axis;
  const Vec3 localNormal = rotation.transpose() * normal;
  const Vec3 localTangent =
      rotation.transpose() * normal.cross(rotationVector);  // n . (w x r) = (n x w) . r
  double maxProjection = -std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : part.hull.vertices)
    maxProjection = std::max(maxProjection, localNormal.dot(vertex));
  // n . (w x (w x r)) = (n x w) . (w x r), for every rotated r.
  const double curvature =
      0.5 * localTangent.norm() * std::abs(motion.angle) * (1 + kRelativeSlack);
  const double approachSpeed = normal.dot(motion.translation);
  double step = std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : part.hull.vertices) {
    const double depthBehind = std::max(0.0, maxProjection - localNormal.dot(vertex));
    const double speed = approachSpeed + localTangent.dot(vertex);
    step = std::min(step, findSmallestRoot(gap + depthBehind, speed, curvature * vertex.norm()));
  }
  return step * (1 - kRelativeSlack);
}

collision::PlacedConvex makePlacedConvexAt(const MovingPart& part, double s,
                                           const collision::Mat3& rotation) {
  return {part.hull.vertices, part.motion.positionAt(s), &rotation, &part.hull};
}

/// `query` computes the separation at fraction s of the motions; `step` returns the certified
/// advance for a plane and its gap.
template <class Query, class Step>
PartCastResult advanceConservatively(const collision::ContactOffset& contactOffset,
                                     QueryCount& count, Query query, Step step) {
  PartCastResult result;
  double s = 0;
  for (int i = 0; i < kMaxIterations; ++i) {
    const collision::SeparationResult separation = query(s);
    ++count.narrow;
    if (separation.certificate == collision::Certificate::rational) ++count.rational;
    result.separation = separation;
    result.fraction = s;
    result.stopped = true;
    const double distance = separation.distance - separation.errorBound;
    result.reachedRestOffset =
        separation.verdict != collision::Verdict::separated || distance <= contactOffset.rest;
    if (separation.verdict != collision::Verdict::separated) return result;
    const double certified = step(separation.normal, std::max(0.0, distance - contactOffset.min));
    if (s + certified >= 1) return {};
    if (certified < (distance <= contactOffset.rest ? kMinStepNearContact : kMinStep))
      return result;
    s += certified;
  }
  ++count.bounded;
  return result;
}

}  // namespace

collision::Mat3 ScrewMotion::rotationAt(double s) const {
  if (angle == 0 || s == 0) return rotation;
  return makeAxisRotation(axis, s * angle).normalized().toRotationMatrix() * rotation;
}

PartCastResult castMovingPart(const MovingPart& part, const collision::PlacedConvex& other,
                              const collision::ContactOffset& contactOffset, QueryCount& count) {
  collision::FeatureCache cache;
  collision::Mat3 rotation;
  return advanceConservatively(
      contactOffset, count,
      [&](double s) {
        rotation = part.motion.rotationAt(s);
        return collision::computeSeparation(makePlacedConvexAt(part, s, rotation), other, cache);
      },
      [&](const Vec3& normal, double gap) {
        return computeCertifiedStep(part, rotation, normal, gap);
      });
}

PartCastResult castMovingParts(const MovingPart& part, const MovingPart& other,
                               const collision::ContactOffset& contactOffset, QueryCount& count) {
  collision::FeatureCache cache;
  collision::Mat3 rotation, otherRotation;
  ScrewMotion relative = part.motion, otherRotating = other.motion;
  relative.translation -= other.motion.translation;
  otherRotating.translation = Vec3::Zero();
  const double gapShare = otherRotating.angle == 0 ? 1 : 0.5;
  return advanceConservatively(
      contactOffset, count,
      [&](double s) {
        rotation = part.motion.rotationAt(s);
        otherRotation = other.motion.rotationAt(s);
        return collision::computeSeparation(makePlacedConvexAt(part, s, rotation),
                                            makePlacedConvexAt(other, s, otherRotation), cache);
      },
      [&](const Vec3& normal, double gap) {
        const double step =
            computeCertifiedStep({part.hull, relative}, rotation, normal, gapShare * gap);
        if (otherRotating.angle == 0) return step;
        return std::min(step, computeCertifiedStep({other.hull, otherRotating}, otherRotation,
                                                   -normal, gap / 2));
      });
}

}  // namespace enfilade::scene
