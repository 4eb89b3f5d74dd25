// Algorithm (Lin 1993, section 5.1; Cohen et al. 1995):
// 1. Compute the exact separation of the two (proximity_query.*).
// 2. Bound the motion of each: velocity, angular velocity, acceleration, and an isotropic speed
//    (Motion::isotropicSpeed) for joints, pushes and the rounding to ticks.
// 3. The gap along a direction closes no faster than these bounds allow. Along the relative
//    velocity this holds for any two entities. Two convex shapes have a second gap, along their
//    separating normal; it closes more slowly, but may be smaller. The better of the two is used.
// 4. Two convex shapes whose present motion is uniform, without such bounds, have a time of impact
//    (Mirtich 1996). It is the answer, or proves that they pass each other.
// Ticks: a fall is a parabola sampled at ticks. A tick that begins at speed s covers (s + g dt / 2)
// dt. A displacement of `d` in the last tick therefore means a speed of d / dt + g dt / 2 now.
// Dynamic bodies fall in substeps, each with its speed after the substep: they are early by at most
// g dt / 2 of speed.
#include "scene/world/queries/time_to_contact_query.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <limits>

#include "collision/compound/nearest_parts.hpp"
#include "collision/motion/time_of_impact.hpp"
#include "scene/world/queries/motion_limits.hpp"

namespace enfilade::scene {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kImpactHorizon = 600;  // seconds that the time of impact looks ahead

/// Bounds of an entity's motion from now on.
struct Motion {
  collision::MotionBounds bounds;
  double isotropicSpeed = 0;   ///< m/s, in any direction, in addition to `bounds`
  double immediateGrowth = 0;  ///< metres by which it may grow instantly
  bool bounded = true;         ///< false: no bound is known

  /// Whether `bounds` are the motion itself: constant velocity and angular velocity.
  bool isUniform() const {
    return bounded && isotropicSpeed == 0 && immediateGrowth == 0 && bounds.acceleration == 0;
  }
};

/// A body's snapshot with its spec: one that may carry or push, or the entity of the query.
struct BodyInfo {
  const BodySnapshot& snapshot;
  const BodySpec& spec;
  double radius;  ///< metres
};

BodyInfo makeBodyInfo(const SceneAt& sceneAt, const BodySnapshot& body) {
  return {body, sceneAt.scene().model().bodies[body.index],
          sceneAt.scene().bodyShape(body.index)->radius};
}

// ---- present motion -----------------------------------------------------------------------------

double computeMaxPointSpeedNow(const BodyInfo& body) {
  return body.snapshot.velocity.norm() + body.snapshot.angularVelocity.norm() * body.radius +
         body.snapshot.velocityDeviation;
}

bool isTouched(const SceneAt& sceneAt, const AvatarSnapshot& avatar, const BodySnapshot& body,
               double within) {
  const PlacedEntity own = makePlacedEntity(sceneAt, avatar.id),
                     other = makePlacedEntity(sceneAt, body.id);
  std::size_t budget = kMaxWorkPerEntity;
  // If the budget does not suffice, it counts as touched.
  return collision::findNearestParts(own.compounds, other.compounds, within, budget).outcome !=
         collision::NearestParts::Outcome::outOfRange;
}

/// Adds the effect of the bodies that the avatar touches: a lift carries an avatar that stands on
/// it.
void addCarrierMotion(const SceneAt& sceneAt, const AvatarSnapshot& avatar,
                      const WorldSettings& settings, Motion& motion) {
  const double within = 4 * settings.contactOffset;
  const Aabb box = collision::inflate(placeBox(avatar.shape->box, avatar.footPosition), 2 * within);
  const bool onDynamicBody = standsOnDynamicBody(sceneAt, avatar);
  for (const BodySnapshot& snapshot : *sceneAt.snapshot.bodies) {
    const BodyInfo body = makeBodyInfo(sceneAt, snapshot);
    if (!isKinematic(body.spec.kind) || !snapshot.moving) continue;
    const bool touched = overlaps(computeBodyAabb(sceneAt, snapshot), box) &&
                         isTouched(sceneAt, avatar, snapshot, within);
    if (!touched && !onDynamicBody) continue;
    if (avatar.groundEntity == snapshot.id && snapshot.angularVelocity.isZero(0)) {
      motion.bounds.velocity += snapshot.velocity;
      motion.isotropicSpeed += kMaxPushFactor * snapshot.velocityDeviation;
    } else {
      motion.isotropicSpeed += kMaxPushFactor * computeMaxPointSpeedNow(body);
    }
  }
}

Motion computeAvatarMotion(const SceneAt& sceneAt, const AvatarSnapshot& avatar,
                           const WorldSettings& settings) {
  Motion motion;
  motion.isotropicSpeed = sumJointSpeeds(avatar, settings);
  motion.bounds.velocity = avatar.move.actualDisplacement / settings.tickDuration;
  addCarrierMotion(sceneAt, avatar, settings, motion);
  if (avatar.grounded || avatar.flying) return motion;
  motion.bounds.velocity.y() -= 0.5 * settings.gravity * settings.tickDuration;
  motion.bounds.acceleration = settings.gravity;
  return motion;
}

/// A freely rotating body conserves its angular momentum; its angular velocity varies below this
/// bound.
double computeMaxAngularSpeed(const SceneAt& sceneAt, const BodySnapshot& body) {
  const Mat3& inertia = sceneAt.scene().bodyShape(body.index)->inertia;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia, Eigen::EigenvaluesOnly);
  const Vec3 local = body.pose.rotation.conjugate() * body.angularVelocity;
  const double minInertia = solver.eigenvalues().minCoeff();
  return std::max(body.angularVelocity.norm(),
                  minInertia > 0 ? (inertia * local).norm() / minInertia : kNever);
}

Motion computeBodyMotion(const SceneAt& sceneAt, const BodySnapshot& snapshot,
                         const WorldSettings& settings) {
  const BodyInfo body = makeBodyInfo(sceneAt, snapshot);
  Motion motion;
  if (!snapshot.moving || isTrigger(body.spec.kind)) return motion;
  motion.bounds.velocity = snapshot.velocity;
  motion.bounds.angularVelocity = snapshot.angularVelocity;
  motion.bounds.radius = body.radius;
  motion.isotropicSpeed = snapshot.velocityDeviation;
  if (!isDynamic(body.spec.kind)) return motion;
  motion.bounds.angularVelocity =
      computeMaxAngularSpeed(sceneAt, snapshot) * Vec3::UnitX();  // only its length matters
  motion.bounds.acceleration = settings.gravity;
  motion.isotropicSpeed = 0.5 * settings.gravity * settings.tickDuration;
  return motion;
}

// ---- any command --------------------------------------------------------------------------------

double computeBodySpeedLimit(const BodyInfo& body, const WorldSettings& settings) {
  return computeBodySpeedLimit(body.spec, body.radius, settings);
}

/// Bounds under any command. Until the gap of `distance` has closed, neither entity moves farther
/// than that; therefore all bodies count that can reach the avatar meanwhile.
Motion boundAvatarMotion(const SceneAt& sceneAt, const AvatarSnapshot& avatar,
                         const WorldSettings& settings, double distance) {
  Motion motion;
  motion.immediateGrowth = computeGrowthLimit(avatar);
  const double ownSpeed = computeAvatarSpeedLimit(avatar, settings);
  motion.isotropicSpeed = ownSpeed;
  const Aabb box = placeBoxOutward(avatar.shape->box, avatar.footPosition);
  const bool onDynamicBody = standsOnDynamicBody(sceneAt, avatar);
  for (const BodySnapshot& snapshot : *sceneAt.snapshot.bodies) {
    const BodyInfo body = makeBodyInfo(sceneAt, snapshot);
    if (!isKinematic(body.spec.kind)) continue;
    const double maxSpeed = computeBodySpeedLimit(body, settings);
    const double maxApproach = distance * (1 + maxSpeed / ownSpeed) + motion.immediateGrowth;
    if (onDynamicBody || computeGap(box, computeBodyAabb(sceneAt, snapshot)) <= maxApproach)
      motion.isotropicSpeed += kMaxPushFactor * maxSpeed;
  }
  return motion;
}

Motion boundBodyMotion(const SceneAt& sceneAt, const BodySnapshot& snapshot,
                       const WorldSettings& settings) {
  Motion motion;
  motion.isotropicSpeed = computeBodySpeedLimit(makeBodyInfo(sceneAt, snapshot), settings);
  motion.bounded = motion.isotropicSpeed < kNever;
  return motion;
}

Motion computeMotion(const SceneAt& sceneAt, EntityId entity, const WorldSettings& settings,
                     MotionAssumption assumption, double distance) {
  const bool present = assumption == MotionAssumption::presentMotion;
  if (const AvatarSnapshot* avatar = findAvatarSnapshot(sceneAt, entity))
    return present ? computeAvatarMotion(sceneAt, *avatar, settings)
                   : boundAvatarMotion(sceneAt, *avatar, settings, distance);
  if (const BodySnapshot* body = findBodySnapshot(sceneAt, entity))
    return present ? computeBodyMotion(sceneAt, *body, settings)
                   : boundBodyMotion(sceneAt, *body, settings);
  return {};
}

// ---- the gap ------------------------------------------------------------------------------------

/// A gap and the bound of its closing speed.
struct ClosingGap {
  double gap = 0;  ///< metres, certified
  collision::ClosingBounds closing;
  double computeSeparatedUntil() const { return collision::computeTimeToContact(gap, closing); }
};

/// `direction` has unit length.
ClosingGap computeClosingGapAlong(const Vec3& direction, double gap, const Motion& a,
                                  const Motion& b) {
  // Angular velocities are constant, so any interval is valid.
  ClosingGap closingGap{gap - a.immediateGrowth - b.immediateGrowth,
                        collision::computeClosingBounds(a.bounds, b.bounds, direction, 0)};
  closingGap.closing.speed += a.isotropicSpeed + b.isotropicSpeed;
  return closingGap;
}

ClosingGap computeSlowestClosingGap(const collision::NearestParts& parts, bool convex,
                                    const Motion& a, const Motion& b) {
  const collision::SeparationResult& separation = parts.separation;
  const Vec3 relative = a.bounds.velocity - b.bounds.velocity;
  const Vec3 direction = relative.norm() > 0 ? Vec3(relative.normalized()) : separation.normal;
  const ClosingGap alongVelocity =
      computeClosingGapAlong(direction, separation.distance - separation.errorBound, a, b);
  if (!convex) return alongVelocity;
  collision::FeatureCache cache;
  cache.axis = separation.normal;
  const double gap = collision::computeSeparationLowerBound(parts.a, parts.b, cache);
  const ClosingGap alongNormal = computeClosingGapAlong(separation.normal, gap, a, b);
  return alongNormal.computeSeparatedUntil() > alongVelocity.computeSeparatedUntil()
             ? alongNormal
             : alongVelocity;
}

/// Seconds up to which two convex shapes in uniform motion are proved separated.
double computeSeparatedUntil(const collision::NearestParts& parts, const Motion& a, const Motion& b,
                             std::size_t& budget) {
  const auto moving = [](const collision::PlacedConvex& part, const Motion& motion) {
    return collision::MovingBody{
        part, {motion.bounds.velocity, Vec3::Zero(), motion.bounds.angularVelocity}};
  };
  collision::FeatureCache cache;
  cache.axis = parts.separation.normal;
  const collision::MotionResult impact =
      collision::computeTimeOfImpact(moving(parts.a, a), moving(parts.b, b), kImpactHorizon, cache);
  budget -= std::min<std::size_t>(budget, impact.queries);
  return impact.lo;
}

}  // namespace

std::variant<TimeToContact, QueryError> computeTimeToContact(const SceneAt& sceneAt,
                                                             const WorldSettings& settings,
                                                             EntityId a, EntityId b,
                                                             MotionAssumption assumption,
                                                             double minWait, std::size_t& budget) {
  const auto first = findSolidParts(sceneAt, a, "a"), second = findSolidParts(sceneAt, b, "b");
  for (const auto* one : {&first, &second})
    if (const auto* error = std::get_if<QueryError>(one)) return *error;
  const auto &placedA = std::get<PlacedEntity>(first), &placedB = std::get<PlacedEntity>(second);
  const auto parts =
      collision::findNearestParts(placedA.compounds, placedB.compounds, kNever, budget);
  if (parts.outcome != collision::NearestParts::Outcome::nearest) return makeTooComplexError("b");
  const Motion motionA = computeMotion(sceneAt, a, settings, assumption, parts.separation.distance),
               motionB = computeMotion(sceneAt, b, settings, assumption, parts.separation.distance);
  TimeToContact result;
  result.proximity = {a, b, parts.separation, 0};
  result.bounded = motionA.bounded && motionB.bounded;
  if (!result.bounded) {
    result.nextCheck = {minWait, false};
    return result;
  }
  const bool convex = placedA.partCount == 1 && placedB.partCount == 1;
  const ClosingGap closingGap = computeSlowestClosingGap(parts, convex, motionA, motionB);
  result.closing = closingGap.closing;
  result.separatedUntil = closingGap.computeSeparatedUntil();
  result.nextCheck =
      collision::scheduleCheck(closingGap.gap, closingGap.closing, minWait, settings.contactOffset);
  const bool isUniform =
      assumption == MotionAssumption::presentMotion && motionA.isUniform() && motionB.isUniform();
  if (!convex || !isUniform || result.separatedUntil == kNever) return result;
  const double until = computeSeparatedUntil(parts, motionA, motionB, budget);
  if (until > result.separatedUntil) {
    result.separatedUntil = until;
    result.nextCheck = {std::max(until, minWait), result.nextCheck.proved || until >= minWait};
  }
  return result;
}

}  // namespace enfilade::scene
