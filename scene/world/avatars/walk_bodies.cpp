#include "scene/world/avatars/walk_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/data/avatar_shape.hpp"

namespace enfilade::scene {
namespace {

constexpr std::uint32_t kMaxCalls = 3;  // of a door or a lift, on average over those of a walk
constexpr double kEarly = 0.5;      // seconds: a door is open by so much before the avatar comes
constexpr double kUpright = 0.999;  // cosine of the angle between an upright hinge and +Y
constexpr double kSideRoom = 0.05;  // metres between a waiting avatar and the swing of a door

std::uint32_t countBodies(const Walk& walk) {
  return static_cast<std::uint32_t>(walk.opens.size() + walk.rides.size());
}

bool mayCall(const Walk& walk, const Avatar& avatar) {
  return avatar.walk.calls < kMaxCalls * countBodies(walk);
}

/// The box that a door stays in while it opens or closes, scene frame.
Aabb computeSwing(const Body& door) {
  const BodySpec& spec = *door.spec;
  Aabb swing = door.boxes.whole;
  if (!getTraits(spec.kind).rotates) {
    swing.include(computeSweptAabb(door.boxes.whole,
                                   (findOpenLimit(spec) - door.drive.jointPosition) * spec.axis));
    return swing;
  }
  double radius = door.shape->radius;
  if (std::abs(spec.axis.y()) > kUpright) {  // bound: distance to the farthest box corner
    const Vec3 far =
        (spec.anchor - swing.min).cwiseAbs().cwiseMax((spec.anchor - swing.max).cwiseAbs());
    radius = std::min(radius, projectToGround(far).norm());
  }
  const Vec3 reach(radius, 0, radius);
  const Vec3 hinge(spec.anchor.x(), swing.min.y(), spec.anchor.z());
  swing.include(Aabb{hinge - reach, hinge + reach});
  return swing;
}

/// Whether a line from `from` to `to` meets a box.
bool crosses(const Aabb& box, const Vec3& from, const Vec3& to) {
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double difference = to[axis] - from[axis];
    if (difference == 0) {
      if (from[axis] < box.min[axis] || from[axis] > box.max[axis]) return false;
      continue;
    }
    const double a = (box.min[axis] - from[axis]) / difference,
                 b = (box.max[axis] - from[axis]) / difference;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

/// A box that the feet are in when the avatar meets `box`.
Aabb growForFeet(Aabb box, const Avatar& avatar, double room) {
  box.min += Vec3(avatar.shape->box.min.x() - room, -avatar.shape->box.max.y(),
                  avatar.shape->box.min.z() - room);
  box.max += Vec3(avatar.shape->box.max.x() + room, 0, avatar.shape->box.max.z() + room);
  return box;
}

/// Whether the next `length` metres of the walk meet a box of the feet. Not beyond a ride.
bool isAhead(const Walk& walk, const Avatar& avatar, const Aabb& box, double length) {
  Vec3 at = avatar.footPosition;
  for (std::size_t i = avatar.walk.waypointIndex; i < walk.waypoints.size() && length > 0; ++i) {
    const auto isHere = [&](const Ride& ride) { return ride.waypoint == i; };
    if (i > avatar.walk.waypointIndex && std::ranges::any_of(walk.rides, isHere)) return false;
    const Vec3 leg = walk.waypoints[i] - at;
    const double distance = leg.norm();
    const Vec3 end = distance > length ? Vec3(at + (length / distance) * leg) : walk.waypoints[i];
    if (crosses(box, at, end)) return true;
    length -= distance;
    at = end;
  }
  return false;
}

bool isOpen(const Body& door) {
  const KinematicDrive& drive = door.drive;
  const bool isAtLimit =
      drive.jointPosition == door.spec->low || drive.jointPosition == door.spec->high;
  return !drive.moving && isAtLimit && drive.jointPosition != door.spec->closedPosition;
}

/// Lets the avatar wait. The wait may last as long as the body moves to where it should.
void waitFor(const Body& body, double target, const WorldSettings& settings, Avatar& avatar) {
  if (avatar.walk.waitsFor == 0) avatar.walk.waitsFor = body.id;
  if (body.moved && body.drive.target == target) avatar.walk.timeoutLeft = settings.stuckTimeout;
}

void call(WorldData& world, const Walk& walk, Avatar& avatar, const BodyCommand& command) {
  if (!mayCall(walk, avatar)) return;
  ++avatar.walk.calls;
  world.pendingBodyCommands.push_back(command);  // acts at the next tick
}

BodyCommand makeOpenCommand(const BodyHandle& door) {
  return {door, BodyCommand::Action::open, 0, 0, std::nullopt};
}

/// Whether a door that stands open will close by itself in the next ticks.
bool isAboutToClose(const Body& door, double tick) {
  constexpr double kTicks = 3;  // a command acts one tick later
  const double left = door.drive.autoCloseIn < 0 ? door.spec->autoCloseDelay.value_or(kTicks)
                                                 : door.drive.autoCloseIn;
  return door.spec->autoCloseDelay && left <= kTicks * tick;
}

/// Opens the door if the avatar comes to it, and holds it until the avatar has left its swing.
void prepareDoor(WorldData& world, const Walk& walk, Avatar& avatar, const BodyHandle& handle) {
  const Body& door = world.bodies[handle.index];
  const double tick = world.settings.tickDuration, open = findOpenLimit(*door.spec);
  const Vec3& footPosition = avatar.footPosition;
  const Aabb swing = computeSwing(door);
  const Aabb swingOfFeet = growForFeet(swing, avatar, kSideRoom + walk.speed * tick);
  if (isOpen(door)) {
    if (isAboutToClose(door, tick) && isAhead(walk, avatar, swingOfFeet, walk.speed * (2 * kEarly)))
      world.pendingBodyCommands.push_back(makeOpenCommand(handle));
    return;
  }
  const double distance =
      walk.speed * (kEarly + computeMotionSeconds(*door.spec, open - door.drive.jointPosition));
  const Vec3 across = projectToGround(swing.size());
  if (!isAhead(walk, avatar, swingOfFeet, distance) ||
      !isAhead(walk, avatar, growForFeet(door.boxes.whole, avatar, world.settings.contactOffset),
               distance + across.norm()))
    return;
  if (!door.drive.moving || door.drive.target != open)
    call(world, walk, avatar, makeOpenCommand(handle));
  if (contains(swingOfFeet, {footPosition, footPosition}))
    waitFor(door, open, world.settings, avatar);
}

/// Calls the lift if it is not at the stop.
void prepareLift(WorldData& world, const Walk& walk, Avatar& avatar, const Ride& ride) {
  const Body& lift = world.bodies[ride.lift.index];
  const double stop = lift.spec->stops[ride.level];
  if (!lift.drive.moving && lift.drive.jointPosition == stop) return;
  if (!lift.drive.moving || lift.drive.target != stop)
    call(world, walk, avatar,
         {ride.lift, BodyCommand::Action::moveToLevel, 0, ride.level, std::nullopt});
  waitFor(lift, stop, world.settings, avatar);
}

}  // namespace

void commandWalkBodies(WorldData& world, const Walk& walk, Avatar& avatar) {
  const EntityId before = std::exchange(avatar.walk.waitsFor, 0);
  if (countBodies(walk) == 0) return;
  for (const Ride& ride : walk.rides)
    if (ride.waypoint == avatar.walk.waypointIndex) prepareLift(world, walk, avatar, ride);
  if (avatar.walk.waypointIndex >= walk.opensFrom)
    for (const BodyHandle& door : walk.opens) prepareDoor(world, walk, avatar, door);
  if (avatar.walk.waitsFor != before) avatar.walk.timeoutLeft = world.settings.stuckTimeout;
}

std::string describeWait(const WorldData& world, const Walk& walk, const Avatar& avatar) {
  const std::string name = world.findEntityName(avatar.walk.waitsFor);
  if (!mayCall(walk, avatar))
    return name + " did not stay, after " + std::to_string(avatar.walk.calls) + " commands";
  return name + " does not move";
}

}  // namespace enfilade::scene
