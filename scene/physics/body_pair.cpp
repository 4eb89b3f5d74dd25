// Normal selection. Any plane that separates the bodies keeps them apart. Such a plane is the one
// of the closest points, or that of a face of either body that looks along it.
//   - Near rest a face normal is better. Where edges of equal boxes are aligned, the closest
//     points lie on rounded corners, and their normal changes with the slightest displacement.
//   - In motion the plane that opposes the predicted motion least is best. A box that slides over
//     a triangulated floor comes close to edges ahead; their normals would stop it (ghost
//     collisions on seams).
//
// Most pairs need no narrow phase. Either their bounding spheres are apart, or the last separating
// axis still separates them by a certified distance. A pair that rested on a face keeps that face.
// The separation along it must be about the distance of the nearest facing points.
#include "scene/physics/body_pair.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/narrow_phase/axis_separation.hpp"
#include "collision/narrow_phase/contact_manifold.hpp"
#include "collision/shapes/hull.hpp"

namespace enfilade::scene {
namespace {

using collision::PlacedConvex;
using collision::placeVertex;
using collision::SeparationResult;
using collision::Verdict;

/// Fraction of the possible approach in a step that is added to the query distance. It saves
/// queries in later steps.
constexpr double kQueryMarginFactor = 1;
/// Tangential motion and rotation of two dynamic bodies reduce the distance by far less than their
/// bound. Only this fraction of the bound, up to so many contact offsets, is expected. Where more
/// occurs, the continuous check stops the bodies before contact, at a small loss of momentum.
constexpr double kTangentialFraction = 0.3, kMaxTangentialOffsets = 8;
/// Fraction of the distance: a face plane that separates resting bodies by at least this much is
/// preferred.
constexpr double kFacePreference = 0.8;
/// Fraction of the smaller radius: a contact point that moved less matches the one of the last
/// step.
constexpr double kPointMatchFraction = 0.25;
/// Fraction of the coordinates: exceeds the rounding error of bounding spheres and of placed
/// bodies.
constexpr double kSphereRounding = 0x1p-44;
constexpr double kAheadCosine = 0.5;  // cosine of 60 degrees about the motion

struct ContactAxis {
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B
  double separation = 0;        ///< metres
  Vec3 pointA = Vec3::Zero(), pointB = Vec3::Zero();
};

bool isTriangle(const PlacedConvex& shape) {
  return !shape.hull && shape.vertices.size() == 3;
}

Vec3 rotateToBody(const PlacedConvex& shape, const Vec3& world) {
  return shape.rotation ? Vec3(shape.rotation->transpose() * world) : world;
}

/// Returns the normal (world) of the face that looks along `direction` most; zero without faces.
Vec3 findFacingNormal(const PhysicsBody& body, std::uint32_t part, const PlacedConvex& shape,
                      const Vec3& direction) {
  if (isTriangle(shape)) {
    const auto& v = shape.vertices;
    const Vec3 normal = (v[1] - v[0]).cross(v[2] - v[0]);
    const double length = normal.norm(), projection = normal.dot(rotateToBody(shape, direction));
    if (!(length > 0)) return Vec3::Zero();
    const Vec3 world = shape.rotation ? Vec3(*shape.rotation * normal) : normal;
    return (projection < 0 ? -1 : 1) / length * world;
  }
  if (part >= body.parts.size() || body.parts[part].faceNormals.empty()) return Vec3::Zero();
  const Vec3 directionInBody = rotateToBody(shape, direction);
  const Vec3* best = nullptr;
  double maxProjection = -2;
  for (const Vec3& normal : body.parts[part].faceNormals) {
    const double projection = normal.dot(directionInBody);
    if (projection > maxProjection) maxProjection = projection, best = &normal;
  }
  ENFILADE_ASSERT(best);
  return shape.rotation ? Vec3(*shape.rotation * *best) : *best;
}

/// Returns the contact axis along `normal` (from A to B).
ContactAxis makeContactAxis(const Vec3& normal, const PlacedConvex& a,
                            const collision::AxisSeparation& separation) {
  ContactAxis axis{normal, separation.value, placeVertex(a, a.vertices[separation.vertices.a]),
                   Vec3::Zero()};
  // A manifold starts from two points that face each other.
  axis.pointB = axis.pointA + axis.separation * normal;
  return axis;
}

Vec3 predictVelocity(const PhysicsBody& body, const PairStepSettings& step) {
  if (!body.isAwake()) return body.isDynamic() ? Vec3(Vec3::Zero()) : body.motion.velocity;
  return body.motion.velocity + step.seconds * step.gravity;
}

/// Chooses the contact axis as the head of this file describes. `closest`: the bodies are
/// separated.
ContactAxis chooseContactAxis(const ContactAxis& closest, const BodyPair& pair,
                              const PhysicsBody& a, const PhysicsBody& b,
                              const PairStepSettings& step, PairCache::NormalSource& source) {
  const PlacedConvex shapeA = placePart(a, pair.key.partA), shapeB = placePart(b, pair.key.partB);
  const Vec3 displacement = step.seconds * (predictVelocity(b, step) - predictVelocity(a, step));
  const auto predictSeparation = [&](const ContactAxis& axis) {
    return axis.separation + axis.normal.dot(displacement);
  };
  const bool resting = closest.separation < 2 * step.contactOffset;
  ContactAxis best = closest;
  double bestValue = resting ? kFacePreference * closest.separation : predictSeparation(closest);
  const auto consider = [&](const Vec3& normal, PairCache::NormalSource candidateSource) {
    if (normal.isZero(0)) return;
    const ContactAxis axis =
        makeContactAxis(normal, shapeA, collision::computeAxisSeparation(shapeA, shapeB, normal));
    if (!(axis.separation > 0)) return;
    const double value = resting ? axis.separation : predictSeparation(axis);
    if (value > bestValue) bestValue = value, best = axis, source = candidateSource;
  };
  source = PairCache::NormalSource::closestPoints;
  consider(findFacingNormal(a, pair.key.partA, shapeA, closest.normal),
           PairCache::NormalSource::faceA);
  consider(-findFacingNormal(b, pair.key.partB, shapeB, -closest.normal),
           PairCache::NormalSource::faceB);
  return best;
}

Vec3 computeVelocity(const PhysicsBody& body) {
  return body.asleep ? Vec3(Vec3::Zero()) : body.motion.velocity;
}
/// Bound of the speed that rotation adds, in m/s.
double computeRotationalSpeed(const PhysicsBody& body) {
  return body.asleep ? 0 : body.motion.angularVelocity.norm() * body.radius;
}

/// Metres by which the pair can approach in the step at the present velocities.
struct ApproachBound {
  double max;       ///< bound over all points
  double expected;  ///< smaller for two dynamic bodies; see kTangentialFraction
};
ApproachBound computeApproachBound(const BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b,
                                   const PairStepSettings& step) {
  const Vec3 velocity = computeVelocity(a) - computeVelocity(b);
  const bool isFalling = a.isAwake() || b.isAwake();
  const Vec3 gainedVelocity = isFalling ? Vec3(step.seconds * step.gravity) : Vec3(Vec3::Zero());
  const double rotationalSpeed = computeRotationalSpeed(a) + computeRotationalSpeed(b);
  const double pushSpeed =
      a.maxPushForce > 0 || b.maxPushForce > 0 ? (a.targetVelocity - b.targetVelocity).norm() : 0;
  const double drivenSpeed = pushSpeed + a.maxVelocityDeviation() + b.maxVelocityDeviation();
  const double maxApproach =
      step.seconds * (velocity.norm() + gainedVelocity.norm() + rotationalSpeed + drivenSpeed);
  if (!a.isDynamic() || !b.isDynamic() || pair.separatingAxis.isZero(0))
    return {maxApproach, maxApproach};
  const double closingSpeed = velocity.dot(pair.separatingAxis),
               gainedClosingSpeed = gainedVelocity.dot(pair.separatingAxis);
  const double normalSpeed =
      std::max(0.0, closingSpeed) + std::abs(gainedClosingSpeed) + drivenSpeed;
  const double tangentialApproach =
      step.seconds * (rotationalSpeed + (velocity - closingSpeed * pair.separatingAxis).norm() +
                      (gainedVelocity - gainedClosingSpeed * pair.separatingAxis).norm());
  const double ignoredApproach =
      (1 - kTangentialFraction) *
      std::min(tangentialApproach, kMaxTangentialOffsets * step.contactOffset);
  return {maxApproach, step.seconds * normalSpeed + tangentialApproach - ignoredApproach};
}

/// Stores the distance bound or the penetration, and returns the axis of the closest or deepest
/// points.
ContactAxis measureDistance(BodyPair& pair, const PlacedConvex& a, const PlacedConvex& b,
                            const SeparationResult& result) {
  if (result.verdict != Verdict::penetrating) {
    pair.lowerBound = result.distance - result.errorBound;
    return {result.normal, result.distance, result.pointA, result.pointB};
  }
  PairCache& cache = *pair.cache;
  if (!cache.depth) cache.depth = std::make_unique<collision::DepthCache>();
  const collision::PenetrationResult depth =
      collision::computePenetrationDepth(a, b, cache.features, *cache.depth);
  pair.lowerBound = 0;
  ENFILADE_ASSERT(depth.depth >= 0);
  cache.penetration = depth.depth;
  return {depth.normal, -depth.depth, depth.pointA, depth.pointB};
}

Vec3 projectOntoPlane(const Vec3& v, const Vec3& normal) {
  return v - v.dot(normal) * normal;
}

/// Returns the dynamic body whose frame holds the anchors: B, unless only A is dynamic.
const PhysicsBody& selectAnchorBody(const PhysicsBody& a, const PhysicsBody& b) {
  return b.isDynamic() ? b : a;
}

/// Returns the index of the closest unused point of the last step; before.pointCount: none.
std::size_t findMatchingPoint(const ContactConstraint& before, const ContactAnchors& anchorsBefore,
                              const Vec3& anchor, double maxDistance, std::array<bool, 4>& taken) {
  double nearest = maxDistance * maxDistance;
  std::size_t match = before.pointCount;
  for (std::size_t k = 0; k < before.pointCount; ++k) {
    const double squared = (anchorsBefore[k] - anchor).squaredNorm();
    if (!taken[k] && squared < nearest) nearest = squared, match = k;
  }
  if (match < before.pointCount) taken[match] = true;
  return match;
}

/// Copies impulses from the matching points of the last step and keeps their order. The sequential
/// solver comes to rest only in a constant order.
void inheritImpulses(const ContactConstraint& before, const ContactAnchors& anchorsBefore,
                     double maxDistance, PairCache& cache) {
  if (before.pointCount == 0) return;
  ContactConstraint& constraint = cache.constraint;
  std::array<bool, ContactConstraint::kMaxPoints> taken{};
  std::array<std::size_t, ContactConstraint::kMaxPoints> sources{};
  for (std::size_t i = 0; i < constraint.pointCount; ++i) {
    sources[i] = findMatchingPoint(before, anchorsBefore, cache.anchors[i], maxDistance, taken);
    if (sources[i] == before.pointCount) continue;
    constraint.points[i].impulse = before.points[sources[i]].impulse;
    constraint.points[i].motorImpulse = before.points[sources[i]].motorImpulse;
  }
  for (std::size_t i = 1; i < constraint.pointCount; ++i)
    for (std::size_t k = i; k > 0 && sources[k] < sources[k - 1]; --k) {
      std::swap(sources[k], sources[k - 1]);
      std::swap(constraint.points[k], constraint.points[k - 1]);
      std::swap(cache.anchors[k], cache.anchors[k - 1]);
    }
  if (!(constraint.friction > 0)) return;
  constraint.tangentImpulse = projectOntoPlane(before.tangentImpulse, constraint.normal);
  constraint.torsionImpulse = before.torsionImpulse;
}

void setMotor(const PhysicsBody& a, const PhysicsBody& b, ContactConstraint& constraint) {
  constraint.targetSpeed = constraint.maxPushForce = 0;
  for (const PhysicsBody* pusher : {&a, &b}) {
    if (pusher->maxPushForce == 0) continue;
    const double sign = pusher == &a ? 1 : -1;
    constraint.targetSpeed = std::max(0.0, sign * constraint.normal.dot(pusher->targetVelocity));
    constraint.maxPushForce = constraint.targetSpeed > 0 ? pusher->maxPushForce : 0;
  }
}

collision::ContactManifold computeManifold(const BodyPair& pair, const ContactAxis& axis,
                                           double limit, const PhysicsBody& a,
                                           const PhysicsBody& b) {
  const auto getFaceNormals = [](const PhysicsBody& body, std::uint32_t part) {
    return part < body.parts.size() ? std::span<const Vec3>(body.parts[part].faceNormals)
                                    : std::span<const Vec3>();
  };
  return collision::computeContactManifold(
      placePart(a, pair.key.partA), placePart(b, pair.key.partB),
      {axis.normal, axis.pointA, axis.pointB, limit, ContactConstraint::kMaxPoints,
       getFaceNormals(a, pair.key.partA), getFaceNormals(b, pair.key.partB)});
}

void buildConstraint(BodyPair& pair, const collision::ContactManifold& manifold,
                     const PhysicsBody& a, const PhysicsBody& b) {
  PairCache& cache = *pair.cache;
  const ContactConstraint before = pair.hasConstraint ? cache.constraint : ContactConstraint{};
  const auto anchorsBefore = cache.anchors;
  ENFILADE_ASSERT(manifold.size <= ContactConstraint::kMaxPoints);
  pair.hasConstraint = manifold.size > 0;
  pair.separatingAxis = manifold.normal;
  ContactConstraint& constraint = cache.constraint;
  constraint = ContactConstraint{};
  constraint.normal = manifold.normal;
  constraint.restitution = std::max(a.motion.restitution, b.motion.restitution);
  const PhysicsBody& anchorBody = selectAnchorBody(a, b);
  for (const collision::ContactPoint& point : manifold.activePoints()) {
    cache.anchors[constraint.pointCount] =
        anchorBody.rotation.transpose() * (point.pointB - anchorBody.motion.centre);
    constraint.points[constraint.pointCount++] = {
        point.pointA - a.motion.centre, point.pointB - b.motion.centre, point.separation, 0, 0};
  }
  const bool hasFriction = !isReleased(pair, a, b);
  constraint.friction = hasFriction ? std::sqrt(a.motion.friction * b.motion.friction) : 0;
  setMotor(a, b, constraint);
  inheritImpulses(before, anchorsBefore, kPointMatchFraction * std::min(a.radius, b.radius), cache);
}

// ---- without a narrow-phase query --------------------------------------------------------------

void setLowerBound(BodyPair& pair, double lowerBound, const PhysicsBody& a, const PhysicsBody& b) {
  pair.lowerBound = lowerBound;
  pair.teleportedAtBound = a.teleportedDistance + b.teleportedDistance;
  pair.verdict = Verdict::separated;
}

/// Returns whether the bounding spheres are farther apart than `limit`.
bool isFarBySpheres(BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b, double limit) {
  const Vec3 between = b.motion.centre - a.motion.centre;
  const double radii = a.radius + b.radius;
  const double minDistance = (radii + limit) * (1 + kSphereRounding);
  if (!(between.squaredNorm() > minDistance * minDistance)) return false;
  const double coordinates =
      a.motion.centre.cwiseAbs().maxCoeff() + b.motion.centre.cwiseAbs().maxCoeff() + radii;
  const double distance = between.norm() - radii - kSphereRounding * coordinates;
  if (!(distance > limit)) return false;
  setLowerBound(pair, distance, a, b);
  return true;
}

/// Returns whether the last separating axis still separates the pair by more than `limit`.
bool isFarAlongAxis(BodyPair& pair, const PlacedConvex& shapeA, const PlacedConvex& shapeB,
                    const PhysicsBody& a, const PhysicsBody& b, double limit) {
  if (pair.separatingAxis.isZero(0) || pair.constraint()) return false;
  const collision::AxisSeparation separation =
      collision::computeAxisSeparation(shapeA, shapeB, pair.separatingAxis);
  if (!(separation.lowerBound > limit)) return false;
  setLowerBound(pair, separation.lowerBound, a, b);
  return true;
}

/// Of the best-facing faces of A and B, the one with the larger separation.
struct FaceSeparation {
  PairCache::NormalSource source =
      PairCache::NormalSource::closestPoints;  ///< closestPoints: there is no face
  Vec3 normal;
  collision::AxisSeparation separation;
};
FaceSeparation findWidestFace(const BodyPair& pair, const PlacedConvex& shapeA,
                              const PlacedConvex& shapeB, const PhysicsBody& a,
                              const PhysicsBody& b, const Vec3& direction) {
  FaceSeparation best;
  const auto consider = [&](const Vec3& normal, PairCache::NormalSource source) {
    if (normal.isZero(0)) return;
    const collision::AxisSeparation separation =
        collision::computeAxisSeparation(shapeA, shapeB, normal);
    if (best.source == PairCache::NormalSource::closestPoints ||
        separation.value > best.separation.value)
      best = {source, normal, separation};
  };
  consider(findFacingNormal(a, pair.key.partA, shapeA, direction), PairCache::NormalSource::faceA);
  consider(-findFacingNormal(b, pair.key.partB, shapeB, -direction),
           PairCache::NormalSource::faceB);
  return best;
}

/// Keeps the face contact of the last step where it is still valid; see the head of this file.
bool reuseFaceContact(BodyPair& pair, const PlacedConvex& shapeA, const PlacedConvex& shapeB,
                      const PhysicsBody& a, const PhysicsBody& b, double limit,
                      double contactOffset) {
  const ContactConstraint* constraint = pair.constraint();
  if (!constraint || pair.cache->normalSource == PairCache::NormalSource::closestPoints)
    return false;
  const FaceSeparation face = findWidestFace(pair, shapeA, shapeB, a, b, constraint->normal);
  if (face.source == PairCache::NormalSource::closestPoints) return false;
  if (!(face.separation.lowerBound > 0 && face.separation.value < 2 * contactOffset)) return false;
  const collision::ContactManifold manifold =
      computeManifold(pair, makeContactAxis(face.normal, shapeA, face.separation), limit, a, b);
  double nearest = std::numeric_limits<double>::infinity();
  for (const collision::ContactPoint& point : manifold.activePoints())
    nearest = std::min(nearest, point.separation);
  if (!manifold.overlap || !(face.separation.value >= kFacePreference * nearest)) return false;
  pair.cache->normalSource = face.source;
  setLowerBound(pair, face.separation.lowerBound, a, b);
  buildConstraint(pair, manifold, a, b);
  return true;
}

// ---- with a narrow-phase query -----------------------------------------------------------------

/// Queries the narrow phase. The pair gets no constraint if its distance exceeds `limit`.
void runNarrowPhase(BodyPair& pair, const PlacedConvex& shapeA, const PlacedConvex& shapeB,
                    const PhysicsBody& a, const PhysicsBody& b, double limit, double maxDistance,
                    const PairStepSettings& step) {
  if (!pair.cache) pair.cache = std::make_unique<PairCache>();
  PairCache& cache = *pair.cache;
  const auto result =
      collision::computeSeparationWithin(shapeA, shapeB, maxDistance, cache.features);
  setLowerBound(pair, maxDistance, a, b);
  if (!cache.features.axis.isZero(0)) pair.separatingAxis = cache.features.axis.stableNormalized();
  if (!result) {
    pair.hasConstraint = false;
    return;
  }
  pair.verdict = result->verdict;
  const ContactAxis closest = measureDistance(pair, shapeA, shapeB, *result);
  cache.normalSource = PairCache::NormalSource::closestPoints;
  ContactAxis axis = closest;
  if (closest.separation > 0 && closest.separation <= limit)
    axis = chooseContactAxis(closest, pair, a, b, step, cache.normalSource);
  if (axis.separation > limit) {
    pair.hasConstraint = false;
  } else {
    buildConstraint(pair, computeManifold(pair, axis, limit, a, b), a, b);
  }
}

}  // namespace

SpeedBound computeSpeedBound(const PhysicsBody& body, const Vec3& referenceVelocity) {
  const double speed = (computeVelocity(body) - referenceVelocity).norm() +
                       computeRotationalSpeed(body) + body.maxVelocityDeviation();
  return {(speed + body.targetVelocity.norm()) * kRoundUpFactor, body.teleportedDistance,
          body.isDynamic(), body.isAwake(), body.isActuated()};
}

bool isCertifiedFar(const BodyPair& pair, const SpeedBound& a, const SpeedBound& b,
                    const PairStepSettings& step) {
  const double gainedSpeed = step.gravity.norm() * step.seconds;
  const double approach = step.seconds * (a.speed + b.speed + gainedSpeed);
  return computeLowerBound(pair, a.teleportedDistance + b.teleportedDistance) >
         (2 * step.contactOffset + approach) * kRoundUpFactor;
}

bool updatePair(BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b,
                const PairStepSettings& step) {
  const ApproachBound approach = computeApproachBound(pair, a, b, step);
  const double limit = 2 * step.contactOffset + approach.expected;
  const double maxDistance = limit + kQueryMarginFactor * (approach.max + step.contactOffset);
  if (computeLowerBound(pair, a, b) > limit || isFarBySpheres(pair, a, b, maxDistance)) {
    pair.hasConstraint = false;
    return false;
  }
  const PlacedConvex shapeA = placePart(a, pair.key.partA), shapeB = placePart(b, pair.key.partB);
  if (isFarAlongAxis(pair, shapeA, shapeB, a, b, limit)) return true;
  if (!reuseFaceContact(pair, shapeA, shapeB, a, b, limit, step.contactOffset))
    runNarrowPhase(pair, shapeA, shapeB, a, b, limit, maxDistance, step);
  return true;
}

bool penetratesKinematic(const BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b) {
  return pair.penetration() > 0 && pair.hasConstraint && (a.isKinematic() || b.isKinematic());
}

bool isReleased(const BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b) {
  if (!penetratesKinematic(pair, a, b)) return false;
  const ContactConstraint& constraint = *pair.constraint();
  ENFILADE_ASSERT(constraint.pointCount > 0);
  const PhysicsBody& kinematic = a.isKinematic() ? a : b;
  const Vec3& arm = a.isKinematic() ? constraint.points[0].armA : constraint.points[0].armB;
  const Vec3 velocity = kinematic.motion.velocity + kinematic.motion.angularVelocity.cross(arm);
  const double ahead = (a.isKinematic() ? 1 : -1) * constraint.normal.dot(velocity);
  return !(ahead > kAheadCosine * velocity.norm());
}

bool isTouching(const BodyPair& pair, double contactOffset) {
  const ContactConstraint* constraint = pair.constraint();
  if (!constraint) return false;
  for (const ContactConstraintPoint& point : constraint->activePoints())
    if (point.separation < 2 * contactOffset) return true;
  return false;
}

}  // namespace enfilade::scene
