// Motion of kinematic bodies (doors, lifts, paths): one after the other in model order, cast
// against the avatars at their current positions. The solver moves dynamic bodies away, or they are
// pushed there; kinematic bodies ignore one another.
//  0. Each segment between two key poses of a path is a straight uniform motion of its own.
//  1. Passengers that the body would lift move first. Passengers that it leaves behind follow
//     afterwards.
//  2. The body moves until it, or a dynamic body that rests on it and rises with it, gets close to
//     an avatar. (The solver lifts dynamic bodies after the avatars have moved.) The avatar is
//     pushed along the normal by the remaining displacement. The push is a cast of its own, so that
//     it crosses nothing.
//  3. If the push gains nothing, the body stops, reports `blocked` and tries again in the next
//     tick.
// Static objects do not stop a kinematic body: its limits bound it, and doors touch their frames as
// drawn.
#include "scene/world/bodies/kinematic_motion.hpp"

#include <algorithm>
#include <cmath>

#include "scene/world/bodies/body_state.hpp"
#include "scene/world/bodies/passengers.hpp"
#include "scene/world/contacts/contact_events.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMaxPushes = 64;     // for one segment of one body
constexpr int kMaxPushSlides = 3;  // planes that one push slides along
constexpr double kMinPushGain =
    1e-3;  // fraction of contactOffset: a push that gains less has failed
constexpr double kLevelPushNormalThreshold = 0.7;  // |normal.y| below which a push stays horizontal

collision::ScrewMotion makeScrewMotion(const Body& body, const JointPose& to) {
  const JointPose& from = body.drive.pose;
  return {body.rotation, body.position, to.offset - from.offset, body.spec->axis,
          to.angle - from.angle};
}

/// Position after the motion to `to` of a point that moves with the body.
Vec3 computeCarriedPoint(const Body& body, const JointPose& to, const Vec3& point) {
  const collision::Pose pose = computeBodyPose(*body.spec, to);
  return pose.rotation.toRotationMatrix() * toBodyFrame(body, point) + pose.translation;
}

/// Displacement of an avatar that is pushed by `distance` along `normal`: horizontal, unless the
/// normal is steep.
Vec3 computePushDisplacement(const Vec3& normal, double distance) {
  if (std::abs(normal.y()) >= kLevelPushNormalThreshold) return distance * normal;
  const Vec3 level{normal.x(), 0, normal.z()};
  const double length = level.norm();
  return distance / (length * length) * level;
}

/// Moves the avatar by `displacement` as far as possible, sliding along obstacles. Carried bodies
/// that rise with the body do not obstruct upward motion.
void pushAvatar(WorldData& world, Avatar& avatar, Vec3 displacement,
                const std::vector<CarriedBody>& carriedBodies, QueryCount& count) {
  prepareBodyObstacles(world, avatar);
  collectObstacles(world, avatar);
  if (displacement.y() > 0)
    for (Obstacle& obstacle : avatar.obstacles.list)
      if (std::ranges::find(carriedBodies, obstacle.bodyIndex, &CarriedBody::index) !=
          carriedBodies.end())
        obstacle.box = Aabb();
  const Aabb footBounds = computeAvatarFootBounds(world.settings, avatar);
  avatar.dirty = true;  // a pushed avatar checks its support again, even if the body then stays
  for (int i = 0; i < kMaxPushSlides && !displacement.isZero(0); ++i) {
    const Vec3 granted =
        computeClipFraction(footBounds, avatar.footPosition, displacement) * displacement;
    const ShapeCastHit hit =
        castAvatarShape(*avatar.shape, avatar.footPosition, granted, avatar.obstacles,
                        makeContactOffset(world.settings), count);
    avatar.footPosition += hit.fraction * granted;
    if (hit.entity == 0) return;
    const Vec3 rest = (1 - hit.fraction) * granted;
    displacement = rest - std::min(0.0, rest.dot(hit.normal)) * hit.normal;
  }
}

/// First avatar that stops the body, and the cast that found it.
struct FirstHit {
  Avatar* avatar = nullptr;
  const CarriedBody* carried =
      nullptr;  ///< carried body that hit the avatar; null: the body itself
  collision::MotionResult cast;
};

collision::MotionResult castPart(const collision::Hull& part, const collision::ScrewMotion& motion,
                                 const collision::PlacedConvex& other,
                                 const collision::ContactOffset& contactOffset, QueryCount& count) {
  collision::FeatureCache cache;
  const collision::MotionResult cast =
      collision::castShape({makeConvexShape(part), motion}, other, contactOffset, cache);
  count.add(cast);
  return cast;
}

void findFirstHit(const Body& body, const collision::ScrewMotion& motion, double maxDisplacement,
                  Avatar& avatar, const WorldData& world, FirstHit& firstHit, QueryCount& count) {
  const collision::ContactOffset contactOffset = makeContactOffset(world.settings);
  for (const AvatarPart& avatarPart : avatar.shape->parts) {
    const Aabb box = inflate(placeBox(avatarPart.box, avatar.footPosition),
                             contactOffset.rest + maxDisplacement);
    for (std::uint32_t part = 0; part < getPartCount(body); ++part) {
      if (!overlaps(box, getPartBox(body, part))) continue;
      const collision::MotionResult cast =
          castPart(body.shape->parts[part], motion,
                   placeAvatarPart(avatarPart, avatar.footPosition), contactOffset, count);
      if (!cast.isClear() && (!firstHit.avatar || cast.lo < firstHit.cast.lo))
        firstHit = {&avatar, nullptr, cast};
    }
  }
}

/// The same for a carried body that is lifted.
void findFirstCarriedHit(const CarriedBody& carried, Avatar& avatar, const WorldData& world,
                         FirstHit& firstHit, QueryCount& count) {
  const collision::ContactOffset contactOffset = makeContactOffset(world.settings);
  const Body& body = world.bodies[carried.index];
  const double from = carried.appliedLift(), lift = carried.lift + carried.remainingLift - from;
  const Vec3 appliedLift(0, from, 0);
  const collision::ScrewMotion motion{
      body.rotation, Vec3(body.position + appliedLift), {0, lift, 0}, Vec3::UnitY(), 0};
  for (const AvatarPart& avatarPart : avatar.shape->parts) {
    Aabb box = inflate(placeBox(avatarPart.box, avatar.footPosition), contactOffset.rest + lift);
    box.min -= appliedLift, box.max -= appliedLift;
    for (std::uint32_t part = 0; part < getPartCount(body); ++part) {
      if (!overlaps(box, getPartBox(body, part))) continue;
      collision::MotionResult cast =
          castPart(body.shape->parts[part], motion,
                   placeAvatarPart(avatarPart, avatar.footPosition), contactOffset, count);
      if (cast.isClear()) continue;
      cast.lo = (from + cast.lo * lift - carried.lift) / carried.remainingLift;
      if (!firstHit.avatar || cast.lo < firstHit.cast.lo) firstHit = {&avatar, &carried, cast};
    }
  }
}

void applyJointPose(Body& body, const JointPose& to, double fraction) {
  JointPose& jointPose = body.drive.pose;
  if (fraction == 1) {
    jointPose = to;
  } else {
    jointPose = interpolateJointPose(jointPose, to, fraction);
  }
  const collision::Pose pose = computeBodyPose(*body.spec, jointPose);
  setBodyPose(body, pose.translation, pose.rotation);
  body.moved = body.moved || (fraction > 0 && body.kinematicTarget.maxDisplacement > 0);
}

/// Pushes the avatar that was hit; returns false if the body gains nothing.
bool pushHitAvatar(WorldData& world, const Body& body, const JointPose& to, const FirstHit& hit,
                   const std::vector<CarriedBody>& carriedBodies, QueryCount& count) {
  const collision::SeparationResult& at = hit.cast.separation;
  if (at.verdict != collision::Verdict::separated) return false;
  const double remaining = 1 - hit.cast.lo;  // applies to a carried body; the body itself was
                                             // already advanced
  const Vec3 displacement = hit.carried
                                ? Vec3(0, remaining * hit.carried->remainingLift, 0)
                                : Vec3(computeCarriedPoint(body, to, at.pointA) - at.pointA);
  const double needed = at.normal.dot(displacement);
  const double clearance = std::max(0.0, makeContactOffset(world.settings).rest - at.distance);
  const Vec3 before = hit.avatar->footPosition;
  pushAvatar(world, *hit.avatar,
             computePushDisplacement(at.normal, std::max(0.0, needed) + clearance), carriedBodies,
             count);
  return (hit.avatar->footPosition - before).dot(at.normal) >
         kMinPushGain * world.settings.contactOffset;
}

void emitBodyBlocked(const WorldData& world, Body& body, const FirstHit& hit, TickReport& report) {
  const bool alreadyReported = body.blockedBy == hit.avatar->id;
  body.blockedBy = hit.avatar->id;
  body.drive.jointVelocity = 0;
  if (alreadyReported) return;
  Contact contact;
  contact.other = hit.avatar->id;
  contact.separation = hit.cast.separation;
  report.contacts.push_back(makeContactEvent(world, ContactEvent::Kind::blocked, body.id, contact));
}

/// Updates the lift of the carried bodies: so far, and remaining on the motion to `to`.
void updateCarriedLifts(WorldData& world, const Body& body, const JointPose& to,
                        std::vector<CarriedBody>& carriedBodies) {
  if (carriedBodies.empty()) return;
  const collision::Pose pose = computeBodyPose(*body.spec, to);
  const Mat3 rotation = pose.rotation.toRotationMatrix();
  for (CarriedBody& carried : carriedBodies) {
    const double height = (body.rotation * carried.centre + body.position).y();
    carried.lift = height - carried.initialHeight;
    carried.remainingLift = (rotation * carried.centre + pose.translation).y() - height;
    world.bodies[carried.index].pendingLift = std::max(carried.appliedLift(), 0.0);
  }
}

bool isAvatarLifted(const Passengers& passengers, const Avatar& avatar) {
  return std::ranges::any_of(passengers.avatars, [&](const CarriedAvatar& carriedAvatar) {
    return carriedAvatar.avatar == &avatar && carriedAvatar.fullyLifted;
  });
}

/// Moves and pushes until the body is at `to` or blocked. Returns the completed fraction.
double moveUntilBlocked(WorldData& world, Body& body, const JointPose& to, Passengers& passengers,
                        TickReport& report, QueryCount& count) {
  double remaining = 1;
  FirstHit hit;
  for (int i = 0; i < kMaxPushes; ++i) {
    hit = {};
    if (!passengers.nearbyAvatars.empty()) makePartBoxes(body);
    const collision::ScrewMotion motion = makeScrewMotion(body, to);
    const double maxDisplacement = computeDisplacementBound(*body.shape, body.drive.pose, to);
    updateCarriedLifts(world, body, to, passengers.bodies);
    for (Avatar* avatar : passengers.nearbyAvatars)
      findFirstHit(body, motion, maxDisplacement, *avatar, world, hit, count);
    for (const CarriedBody& carried : passengers.bodies)
      for (Avatar* avatar : carried.nearbyAvatars)
        if (carried.isLifted() && !isAvatarLifted(passengers, *avatar))
          findFirstCarriedHit(carried, *avatar, world, hit, count);
    applyJointPose(body, to, hit.cast.lo);
    remaining *= 1 - hit.cast.lo;
    if (!hit.avatar) return 1;
    if (!pushHitAvatar(world, body, to, hit, passengers.bodies, count)) break;
    if (i + 1 == kMaxPushes) ++count.bounded;
  }
  emitBodyBlocked(world, body, hit, report);
  return 1 - remaining;
}

/// As moveUntilBlocked(), and moves the passengers along. A carried body settles by itself, and
/// avatars on it settle afterwards.
double moveWithPassengers(WorldData& world, Body& body, const JointPose& to, Passengers& passengers,
                          TickReport& report, QueryCount& count) {
  std::vector<Vec3> before;
  for (CarriedAvatar& carriedAvatar : passengers.avatars) {
    before.push_back(body.rotation * carriedAvatar.contact + body.position);
    const Vec3 displacement = computeCarriedPoint(body, to, before.back()) - before.back();
    const double low = carriedAvatar.avatar->footPosition.y();
    if (displacement.y() > 0)
      pushAvatar(world, *carriedAvatar.avatar, displacement, passengers.bodies, count);
    const double lift = carriedAvatar.avatar->footPosition.y() - low;
    carriedAvatar.fullyLifted =
        displacement.y() > 0 &&
        lift >= displacement.y() - kMinPushGain * world.settings.contactOffset;
  }
  const double fraction = moveUntilBlocked(world, body, to, passengers, report, count);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const CarriedAvatar& carriedAvatar = passengers.avatars[i];
    Vec3 displacement = body.rotation * carriedAvatar.contact + body.position - before[i];
    if (displacement.y() > 0) continue;
    if (carriedAvatar.onCarriedBody) displacement.y() = 0;
    pushAvatar(world, *carriedAvatar.avatar, displacement, passengers.bodies, count);
  }
  return fraction;
}

/// Moves along the planned segments until one is blocked. Returns the completed fraction of the
/// plan. Key poses that were not reached are replaced by the final pose.
double moveAlongSegments(WorldData& world, Body& body, Passengers& passengers, TickReport& report,
                         QueryCount& count) {
  KinematicTarget& target = body.kinematicTarget;
  for (std::size_t i = 0; i < target.segments; ++i) {
    const double fraction =
        moveWithPassengers(world, body, target.keyPoses[i + 1], passengers, report, count);
    if (fraction == 1) continue;
    std::fill(target.keyPoses.begin() + static_cast<std::ptrdiff_t>(i) + 1, target.keyPoses.end(),
              body.drive.pose);
    return (static_cast<double>(i) + fraction) / static_cast<double>(target.segments);
  }
  body.blockedBy = 0;
  return 1;
}

void updateJointPosition(Body& body, double fraction, double tick) {
  KinematicDrive& drive = body.drive;
  const double jointPosition = body.kinematicTarget.jointPosition;
  if (fraction == 1)
    drive.jointPosition = jointPosition;
  else if (isLoopingPath(*body.spec))
    drive.jointPosition =
        std::fmod(drive.jointPosition + fraction * drive.speed * tick, body.spec->keys.back().time);
  else
    drive.jointPosition += fraction * (jointPosition - drive.jointPosition);
  drive.moving = isLoopingPath(*body.spec) || drive.jointPosition != drive.target;
}

void moveKinematicBody(WorldData& world, Body& body, const SupportGraph& supportGraph,
                       TickReport& report, QueryCount& count) {
  updatePartBoxes(world, body);
  const Vec3 before = body.position;
  const double tick = world.settings.tickDuration;
  Passengers passengers = findPassengers(world, body, supportGraph);
  updateJointPosition(body, moveAlongSegments(world, body, passengers, report, count), tick);
  updatePartBoxes(world, body);
  updateCarriedLifts(world, body, body.drive.pose, passengers.bodies);
  body.velocity = (body.position - before) / tick;
  body.angularVelocity =
      (body.drive.pose.angle - body.kinematicTarget.keyPoses[0].angle) / tick * body.spec->axis;
}

}  // namespace

void moveKinematicBodies(WorldData& world, TickReport& report, QueryCount& count) {
  const SupportGraph supportGraph = buildSupportGraph(world);
  for (const std::uint32_t index : world.movingBodies)
    moveKinematicBody(world, world.bodies[index], supportGraph, report, count);
}

}  // namespace enfilade::scene
