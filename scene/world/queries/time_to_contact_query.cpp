// 1. How far apart the two are: exactly (pair_state.*).
// 2. How each may move: a velocity, a spin, an acceleration; and a speed in any direction for what
//    is known no better (Motion::anyway): joints, what pushes, rounding to ticks.
// 3. The gap along a direction closes no faster than those bounds along it. Along the relative
//    velocity this holds for any two entities. Two convex bodies have a second gap, along their
//    separating normal, which closes more slowly, but may be smaller; the better one counts.
//
// Ticks. A fall is a parabola on the ticks: a tick that begins at speed s goes (s + g dt / 2) dt.
// What went `made` in the last tick so has the speed made / dt + g dt / 2 now. Free bodies fall in
// substeps, each by its speed after it: sooner by at most g dt / 2 of speed.
#include "scene/world/queries/time_to_contact_query.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>

namespace enfilade::scene {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
// A push is level although the normal is not: by 1 / 0.714^2 of what the body goes
// (bodies/body_motion.cpp).
constexpr double kMostPush = 2;

/// How one may move from now on.
struct Motion {
  collision::MotionBounds bounds;
  double anyway = 0;    ///< m/s, beside that, in any direction
  double atOnce = 0;    ///< metres that it may grow by in no time
  bool bounded = true;  ///< else nothing is known
};

double jointSpeeds(const AvatarView& avatar, const Lengths& lengths) {
  double speed = 0;
  for (const JointView& joint : avatar.joints) speed += lengths.jointSpeedLimit * joint.lever;
  return speed;
}

/// A body that may carry or push, or the entity that is asked about, with its spec.
struct Moving {
  const BodyView& view;
  const BodySpec& spec;
  double radius;  ///< metres
};

Moving movingOf(const SceneThen& then, const BodyView& body) {
  return {body, then.scene().model().bodies[body.index],
          then.scene().shapeOfBody(body.index)->radius};
}

// ---- present motion -----------------------------------------------------------------------------

double fastestPoint(const Moving& body) {
  return body.view.velocity.norm() + body.view.spin.norm() * body.radius + body.view.swing;
}

bool isTouched(const SceneThen& then, const AvatarView& avatar, const BodyView& body,
               double within) {
  const Placed own = placedParts(then, avatar.id), other = placedParts(then, body.id);
  std::size_t work = kMostWorkOfNear;
  // Where that does not suffice it may be touched.
  return collision::nearestParts(own.trees, other.trees, within, work).found !=
         collision::NearestParts::Found::none;
}

/// Whether the avatar stands on a free body: that may be carried, and the avatar with it, by what
/// is far from both.
bool standsOnFree(const SceneThen& then, const AvatarView& avatar) {
  const BodyView* ground = bodyOf(then, avatar.standsOn);
  return ground && movingOf(then, *ground).spec.kind == BodyKind::rigid;
}

/// Adds what the bodies that the avatar touches do to it: a lift that it stands on carries it.
void addCarriers(const SceneThen& then, const AvatarView& avatar, const Lengths& lengths,
                 Motion& motion) {
  const double within = 4 * lengths.epsilon;
  const Box box = collision::grown(boxAt(avatar.shape->box, avatar.feet), 2 * within);
  const bool onFree = standsOnFree(then, avatar);
  for (const BodyView& view : *then.snapshot.bodies) {
    const Moving body = movingOf(then, view);
    if (!isKinematic(body.spec.kind) || !view.moving) continue;
    const bool touched = overlaps(boxOf(then, view), box) && isTouched(then, avatar, view, within);
    if (!touched && !onFree) continue;
    if (avatar.standsOn == view.id && view.spin.isZero(0)) {
      motion.bounds.velocity += view.velocity;
      motion.anyway += kMostPush * view.swing;
    } else {
      motion.anyway += kMostPush * fastestPoint(body);
    }
  }
}

Motion presentMotion(const SceneThen& then, const AvatarView& avatar, const Lengths& lengths) {
  Motion motion;
  motion.anyway = jointSpeeds(avatar, lengths);
  motion.bounds.velocity = avatar.move.made / lengths.tick;
  addCarriers(then, avatar, lengths, motion);
  if (avatar.grounded || avatar.flying) return motion;
  motion.bounds.velocity.y() -= 0.5 * lengths.gravity * lengths.tick;
  motion.bounds.acceleration = lengths.gravity;
  return motion;
}

/// What turns freely keeps its angular momentum; its spin goes to and fro below this.
double fastestSpin(const SceneThen& then, const BodyView& body) {
  const Mat3& inertia = then.scene().shapeOfBody(body.index)->inertia;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia, Eigen::EigenvaluesOnly);
  const Vec3 local = body.pose.rotation.conjugate() * body.spin;
  const double least = solver.eigenvalues().minCoeff();
  return std::max(body.spin.norm(), least > 0 ? (inertia * local).norm() / least : kNever);
}

Motion presentMotion(const SceneThen& then, const BodyView& view, const Lengths& lengths) {
  const Moving body = movingOf(then, view);
  Motion motion;
  if (!view.moving || body.spec.kind == BodyKind::trigger) return motion;
  motion.bounds.velocity = view.velocity;
  motion.bounds.angularVelocity = view.spin;
  motion.bounds.radius = body.radius;
  motion.anyway = view.swing;
  if (body.spec.kind != BodyKind::rigid) return motion;
  motion.bounds.angularVelocity =
      fastestSpin(then, view) * Vec3::UnitX();  // only its length counts
  motion.bounds.acceleration = lengths.gravity;
  motion.anyway = 0.5 * lengths.gravity * lengths.tick;
  return motion;
}

// ---- any command --------------------------------------------------------------------------------

/// Metres a second: no point of the body is ever faster, whatever it is told.
double fastestEver(const Moving& body, const Lengths& lengths) {
  if (body.spec.kind == BodyKind::rigid) return kNever;
  if (body.spec.kind == BodyKind::trigger) return 0;
  return std::max(lengths.speedLimit, body.spec.speed * fastestPointOf(body.spec, body.radius));
}

/// What an avatar does by itself: it walks, steps up or falls, and keeps epsilon away.
double fastestAlone(const AvatarView& avatar, const Lengths& lengths) {
  const double slack = lengths.stepHeight + 16 * lengths.epsilon;  // metres a tick
  return 2 * lengths.speedLimit + slack / lengths.tick + jointSpeeds(avatar, lengths);
}

/// Before the gap of `distance` has closed neither went farther than that. So bodies count that can
/// come to the avatar meanwhile.
Motion anyMotion(const SceneThen& then, const AvatarView& avatar, const Lengths& lengths,
                 double distance) {
  Motion motion;
  motion.atOnce = avatar.standing - avatar.height;  // it may have crouched
  const double alone = fastestAlone(avatar, lengths);
  motion.anyway = alone;
  const Box box = boxAt(avatar.shape->box, avatar.feet);
  const bool onFree = standsOnFree(then, avatar);
  for (const BodyView& view : *then.snapshot.bodies) {
    const Moving body = movingOf(then, view);
    if (!isKinematic(body.spec.kind)) continue;
    const double fastest = fastestEver(body, lengths);
    const double comes = distance * (1 + fastest / alone) + motion.atOnce;
    if (onFree || gapOf(box, boxOf(then, view)) <= comes) motion.anyway += kMostPush * fastest;
  }
  return motion;
}

Motion anyMotion(const SceneThen& then, const BodyView& view, const Lengths& lengths) {
  Motion motion;
  motion.anyway = fastestEver(movingOf(then, view), lengths);
  motion.bounded = motion.anyway < kNever;
  return motion;
}

Motion motionOf(const SceneThen& then, EntityId entity, const Lengths& lengths, Assume assume,
                double distance) {
  const bool present = assume == Assume::presentMotion;
  if (const AvatarView* avatar = avatarOf(then, entity))
    return present ? presentMotion(then, *avatar, lengths)
                   : anyMotion(then, *avatar, lengths, distance);
  if (const BodyView* body = bodyOf(then, entity))
    return present ? presentMotion(then, *body, lengths) : anyMotion(then, *body, lengths);
  return {};
}

// ---- the gap ------------------------------------------------------------------------------------

/// A gap and how fast it closes.
struct Approach {
  double gap = 0;  ///< metres: proved
  collision::ClosingBounds closing;
  double contact() const { return collision::timeToContact(gap, closing); }
};

/// `direction`: unit.
Approach approachAlong(const Vec3& direction, double gap, const Motion& a, const Motion& b) {
  // Spins are even, so that any interval will do.
  Approach approach{gap - a.atOnce - b.atOnce,
                    collision::closingBounds(a.bounds, b.bounds, direction, 0)};
  approach.closing.speed += a.anyway + b.anyway;
  return approach;
}

Approach slowestApproach(const collision::NearestParts& parts, bool convex, const Motion& a,
                         const Motion& b) {
  const collision::Decision& decision = parts.decision;
  const Vec3 relative = a.bounds.velocity - b.bounds.velocity;
  const Vec3 direction = relative.norm() > 0 ? Vec3(relative.normalized()) : decision.normal;
  const Approach any = approachAlong(direction, decision.distance - decision.errorBound, a, b);
  if (!convex) return any;
  collision::FeatureCache along;
  along.axis = decision.normal;
  const double gap = collision::provedSeparation(parts.a, parts.b, along);
  const Approach square = approachAlong(decision.normal, gap, a, b);
  return square.contact() > any.contact() ? square : any;
}

}  // namespace

std::variant<TimeApart, NoAnswer> timeApart(const SceneThen& then, const Lengths& lengths,
                                            EntityId a, EntityId b, Assume assume, double least,
                                            std::size_t& work) {
  const auto first = solidParts(then, a, "a"), second = solidParts(then, b, "b");
  for (const auto* one : {&first, &second})
    if (const auto* why = std::get_if<NoAnswer>(one)) return *why;
  const auto &placedA = std::get<Placed>(first), &placedB = std::get<Placed>(second);
  const auto parts = collision::nearestParts(placedA.trees, placedB.trees, kNever, work);
  if (parts.found != collision::NearestParts::Found::nearest) return tooComplex("b");
  const Motion motionA = motionOf(then, a, lengths, assume, parts.decision.distance),
               motionB = motionOf(then, b, lengths, assume, parts.decision.distance);
  TimeApart apart;
  apart.now = {a, b, parts.decision, 0};
  apart.bounded = motionA.bounded && motionB.bounded;
  if (!apart.bounded) {
    apart.again = {least, false};
    return apart;
  }
  const bool convex = placedA.parts == 1 && placedB.parts == 1;
  const Approach approach = slowestApproach(parts, convex, motionA, motionB);
  apart.closing = approach.closing;
  apart.contact = approach.contact();
  apart.again = collision::wakeUp(approach.gap, approach.closing, least, lengths.epsilon);
  return apart;
}

}  // namespace enfilade::scene
