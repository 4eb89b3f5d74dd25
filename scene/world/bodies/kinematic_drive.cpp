// Drive of kinematic bodies: executes commands, automatic closing and doors opened by touch, and
// computes the motion planned for the tick.
#include "scene/world/bodies/kinematic_drive.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "scene/model/format_number.hpp"

namespace enfilade::scene {
namespace {

constexpr double kTimeRounding = 1e-9;  // seconds; tolerance of summed ticks against a delay

void startMotionTo(Body& body, double target, double speed) {
  KinematicDrive& drive = body.drive;
  drive.target = target;
  drive.speed = speed;
  drive.moving = isLoopingPath(*body.spec) || target != drive.jointPosition;
  drive.autoCloseIn = -1;
}

void applyBodyCommand(Body& body, const BodyCommand& command) {
  const double speed = command.speed.value_or(body.spec->speed);
  switch (command.action) {
    case BodyCommand::Action::open:
    case BodyCommand::Action::run:
      return startMotionTo(body, findOpenLimit(*body.spec), speed);
    case BodyCommand::Action::close:
      return startMotionTo(body, body.spec->closedPosition, speed);
    case BodyCommand::Action::moveTo:
      return startMotionTo(body, command.target, speed);
    case BodyCommand::Action::moveToLevel:
      return startMotionTo(body, body.spec->stops[command.level], speed);
    case BodyCommand::Action::stop:
      body.drive.moving = false;
      body.drive.jointVelocity = 0;
      body.drive.autoCloseIn = -1;
  }
}

/// A door opened by touch opens away from the avatar, or the other way if its limits allow no
/// other.
void openDoorFor(Body& body, const Contact& contact) {
  const BodySpec& spec = *body.spec;
  if (spec.openedBy != OpenedBy::touch || body.drive.moving) return;
  const Vec3 push = contact.separation.normal;  // from the avatar to the body
  const Vec3 arm = contact.separation.pointB - body.position;
  const double openingSense = getTraits(spec.kind).rotates ? spec.axis.dot(arm.cross(push)) : 0;
  double target = findOpenLimit(spec);
  if (openingSense != 0) target = openingSense > 0 ? spec.high : spec.low;
  startMotionTo(body, target == spec.closedPosition ? findOpenLimit(spec) : target, spec.speed);
}

void openTouchedDoors(WorldData& world) {
  for (const Avatar& avatar : world.avatars) {
    const auto found = world.bodyIndexById.find(avatar.blockedBy);
    if (avatar.blockedBy == 0 || found == world.bodyIndexById.end()) continue;
    Body& body = world.bodies[found->second];
    for (const Contact& contact : avatar.contacts)
      if (contact.other == body.id) openDoorFor(body, contact);
  }
}

/// Runs the timer of a door that stands open, and closes the door when the timer expires.
void updateAutoClose(Body& body, double tick) {
  KinematicDrive& drive = body.drive;
  if (!body.spec->autoCloseDelay || drive.moving ||
      drive.jointPosition == body.spec->closedPosition)
    return;
  if (drive.autoCloseIn < 0) drive.autoCloseIn = *body.spec->autoCloseDelay;
  drive.autoCloseIn -= tick;
  if (drive.autoCloseIn <= kTimeRounding) {
    startMotionTo(body, body.spec->closedPosition, body.spec->speed);
  }
}

/// Signed velocity for this tick, limited by the spec's acceleration.
double computeJointVelocity(const Body& body, double remaining, double tick) {
  const KinematicDrive& drive = body.drive;
  const double sense = remaining < 0 ? -1 : 1;
  const double a = body.spec->acceleration;
  if (a == 0) return sense * drive.speed;
  const double speed = std::min(sense * drive.jointVelocity + a * tick, drive.speed);
  return sense * std::min(speed, std::sqrt(2 * a * std::abs(remaining)));
}

/// Joint position wanted at the end of the tick, and the velocity there.
std::pair<double, double> computeNextJointPosition(const Body& body, double tick) {
  const KinematicDrive& drive = body.drive;
  if (isLoopingPath(*body.spec)) {
    const double next = drive.jointPosition + drive.speed * tick;
    return {std::fmod(next, body.spec->keys.back().time), drive.speed};
  }
  const double remaining = drive.target - drive.jointPosition;
  const double jointVelocity = computeJointVelocity(body, remaining, tick);
  if (std::abs(jointVelocity) * tick >= std::abs(remaining) && jointVelocity * remaining >= 0)
    return {drive.target, 0};
  const auto [low, high] = getJointLimits(*body.spec);
  return {std::clamp(drive.jointPosition + jointVelocity * tick, low, high), jointVelocity};
}

/// Rotation of a looping path in one period, radians: 0 or whole turns.
double computeAnglePerPeriod(const BodySpec& spec) {
  return spec.keys.back().angle - spec.keys.front().angle;
}

/// Joint pose of a looping path `time` seconds after a period began. Angles accumulate from period
/// to period; the keys' angles are those of period number `countedPeriods`.
JointPose interpolateLoop(const BodySpec& spec, double time, double countedPeriods) {
  const double period = spec.keys.back().time, at = std::fmod(time, period);
  JointPose jointPose = computeJointPose(spec, at);
  jointPose.angle +=
      (std::round((time - at) / period) - countedPeriods) * computeAnglePerPeriod(spec);
  return jointPose;
}

/// Adds whole periods of rotation until the angle is nearest to that of `jointPose`.
double unwrapAngle(const JointPose& jointPose, double angle, const BodySpec& spec) {
  const double anglePerPeriod = computeAnglePerPeriod(spec);
  return anglePerPeriod == 0
             ? angle
             : angle - std::round((angle - jointPose.angle) / anglePerPeriod) * anglePerPeriod;
}

/// Computes the key poses of a path at the end of each solver substep; the last one is the goal.
void planPathSegments(Body& body, double tick) {
  KinematicTarget& target = body.kinematicTarget;
  const BodySpec& spec = *body.spec;
  const double now = body.drive.jointPosition;
  const bool loops = isLoopingPath(spec);
  const double duration =
      loops ? body.drive.speed * tick : target.jointPosition - now;  // seconds of the path
  const double countedPeriods =
      loops ? std::round((now + duration - target.jointPosition) / spec.keys.back().time) : 0;
  target.segments = kSolverSubsteps;
  for (std::size_t i = 1; i < kSolverSubsteps; ++i) {
    const double at = now + static_cast<double>(i) / kSolverSubsteps * duration;
    target.keyPoses[i] =
        loops ? interpolateLoop(spec, at, countedPeriods) : computeJointPose(spec, at);
  }
  target.keyPoses[kSolverSubsteps] = computeJointPose(spec, target.jointPosition);
  if (!loops) return;
  double& angle = body.drive.pose.angle;
  angle = unwrapAngle(interpolateLoop(spec, now, countedPeriods), angle, spec);
  target.keyPoses[0].angle = angle;
}

/// Maximum deviation of a path from uniform motion.
double computeVelocityDeviation(const KinematicTarget& target, double radius, double tick) {
  if (target.segments == 1) return 0;
  const JointPose &start = target.keyPoses[0], &end = target.keyPoses[target.segments];
  const auto n = static_cast<double>(target.segments);
  const Vec3 meanOffset = (end.offset - start.offset) / n;
  const double meanAngle = (end.angle - start.angle) / n;
  double maxDeviation = 0;
  for (std::size_t i = 0; i < target.segments; ++i) {
    const JointPose &from = target.keyPoses[i], &to = target.keyPoses[i + 1];
    maxDeviation = std::max(maxDeviation, (to.offset - from.offset - meanOffset).norm() +
                                              std::abs(to.angle - from.angle - meanAngle) * radius);
  }
  return n * maxDeviation / tick;
}

/// Whether no motion is planned: then all fields but the pose and the position are as in a new one.
bool isEmpty(const KinematicTarget& target) {
  const JointPose& next = target.keyPoses[1];
  return target.segments == 1 && target.maxDisplacement == 0 && target.velocityDeviation == 0 &&
         next.angle == 0 && next.offset.isZero(0);
}

void planKinematicTarget(Body& body, double tick) {
  KinematicTarget& target = body.kinematicTarget;
  if (!isEmpty(target)) target = {};
  target.keyPoses[0] = body.drive.pose;
  target.jointPosition = body.drive.jointPosition;
  if (!body.drive.moving) return;
  std::tie(target.jointPosition, body.drive.jointVelocity) = computeNextJointPosition(body, tick);
  if (getTraits(body.spec->kind).takesKeys)
    planPathSegments(body, tick);
  else
    target.keyPoses[1] = computeJointPose(*body.spec, target.jointPosition);
  for (std::size_t i = 1; i <= target.segments; ++i)
    target.maxDisplacement =
        std::max(target.maxDisplacement,
                 computeDisplacementBound(*body.shape, target.keyPoses[0], target.keyPoses[i]));
  target.velocityDeviation = computeVelocityDeviation(target, body.shape->radius, tick);
}

}  // namespace

void initKinematicDrive(Body& body) {
  KinematicDrive& drive = body.drive;
  drive.speed = body.spec->speed;
  drive.pose = computeJointPose(*body.spec, 0);
  drive.moving = getTraits(body.spec->kind).takesKeys && body.spec->autoStart;
  drive.target = drive.moving ? findOpenLimit(*body.spec) : 0;
  const collision::Pose pose = computeStartPose(*body.spec);
  setBodyPose(body, pose.translation, pose.rotation);
}

void applyBodyCommands(WorldData& world) {
  for (const BodyCommand& command : world.pendingBodyCommands)
    applyBodyCommand(world.bodies[command.body.index], command);
  world.pendingBodyCommands.clear();
  openTouchedDoors(world);
}

void planKinematicMotion(WorldData& world) {
  const double margin = computeContactQueryMargin(world.settings);
  world.movingBodies.clear();
  for (const std::uint32_t i : world.kinematicBodies) {
    Body& body = world.bodies[i];
    const bool hadMotionBounds = body.moved || body.kinematicTarget.maxDisplacement > 0;
    body.moved = false;
    body.velocity = body.angularVelocity = Vec3::Zero();
    body.previousPosition = body.position;
    body.previousOrientation = body.orientation;
    updateAutoClose(body, world.settings.tickDuration);
    planKinematicTarget(body, world.settings.tickDuration);
    if (body.drive.moving) world.movingBodies.push_back(i);
    if (body.kinematicTarget.maxDisplacement == 0 && !hadMotionBounds) continue;
    body.motionBounds = body.boxes.whole;
    if (body.kinematicTarget.maxDisplacement > 0)
      body.motionBounds = inflate(body.motionBounds, body.kinematicTarget.maxDisplacement + margin);
    world.broadPhase.move(body.proxy, body.motionBounds);
  }
}

double computePushMargin(const WorldData& world, const Avatar& avatar) {
  std::vector<std::uint32_t> rest = world.movingBodies;
  double room = 0;
  // A pushed body may enter the path of another one: at most as many passes as bodies.
  for (bool more = !rest.empty(); more;) {
    more = false;
    const Aabb within = inflate(avatar.motionBounds, room);
    std::erase_if(rest, [&](std::uint32_t i) {
      const Body& body = world.bodies[i];
      if (!overlaps(within, body.motionBounds)) return false;
      room += body.kinematicTarget.maxDisplacement + 4 * world.settings.contactOffset;
      return more = true;
    });
  }
  // Dynamic bodies push and carry, too, as far as kinematic bodies drive them.
  double maxPush = 0;
  for (const auto& overlap : world.broadPhase.getOverlaps(avatar.proxy)) {
    const std::uint32_t body = overlap.isDynamic ? world.findBodyByProxy(overlap.id) : kNoBody;
    if (body != kNoBody) maxPush = std::max(maxPush, world.bodies[body].kinematicPushBound);
  }
  return maxPush > 0 ? room + maxPush + 4 * world.settings.contactOffset : room;
}

namespace {

std::string describeAcceptedCommands(const BodySpec& spec) {
  if (getTraits(spec.kind).takesStops) return "use to, level or stop";
  if (!getTraits(spec.kind).takesKeys) return "use open, close, to or stop";
  return spec.loops ? "use run or stop" : "use to, run or stop";
}

}  // namespace

std::optional<std::string> validateBodyCommand(const WorldData& world, const BodyCommand& command) {
  using Action = BodyCommand::Action;
  if (command.body.index >= world.bodies.size())
    return "unknown body " + std::to_string(command.body.index);
  const Body& body = world.bodies[command.body.index];
  const BodySpec& spec = *body.spec;
  const std::string kind = toString(spec.kind);
  if (!isKinematic(spec.kind))
    return "body '" + spec.name + "' is " + kind + ": it accepts no commands";
  const bool door = getTraits(spec.kind).isDoor;
  const auto [low, high] = getJointLimits(spec);
  if ((command.action == Action::open || command.action == Action::close) && !door)
    return "body '" + spec.name + "' is not a door but " + kind + ": " +
           describeAcceptedCommands(spec);
  if (command.action == Action::run && !getTraits(spec.kind).takesKeys)
    return "run is for paths; body '" + spec.name + "' is " + kind + ": " +
           describeAcceptedCommands(spec);
  if (command.action == Action::moveTo && isLoopingPath(spec))
    return "to: body '" + spec.name + "' is a looping path; " + describeAcceptedCommands(spec);
  if (command.action == Action::moveTo && !(command.target >= low && command.target <= high))
    return formatRangeError("to", command.target, low, high,
                            getTraits(spec.kind).rotates     ? "radians"
                            : getTraits(spec.kind).takesKeys ? "s"
                                                             : "m");
  if (command.action == Action::moveToLevel && command.level >= spec.stops.size())
    return "level is " + std::to_string(command.level) + "; body '" + spec.name + "' has " +
           std::to_string(spec.stops.size()) + " stops, counted from 0";
  if (!command.speed) return std::nullopt;
  if (auto error = validateSpeed(*command.speed)) return error;
  const double maxSpeed = *command.speed * computeMaxPointSpeed(spec, body.shape->radius);
  if (maxSpeed <= world.settings.maxSpeed) return std::nullopt;
  return "speed is " + std::to_string(*command.speed) + ", which moves a point at " +
         std::to_string(maxSpeed) + " m/s; the limit is " +
         std::to_string(world.settings.maxSpeed) + " m/s";
}

std::optional<std::string> validateWalkBodies(const WorldData& world, const Walk& walk) {
  const auto validate = [&](const std::string& field, const BodyCommand& command) {
    auto error = validateBodyCommand(world, command);
    return error ? std::optional(field + ": " + *error) : std::nullopt;
  };
  for (std::size_t i = 0; i < walk.opens.size(); ++i)
    if (auto error = validate("opens[" + std::to_string(i) + "]",
                              {walk.opens[i], BodyCommand::Action::open, 0, 0, std::nullopt}))
      return error;
  for (std::size_t i = 0; i < walk.rides.size(); ++i)
    if (auto error = validate("rides[" + std::to_string(i) + "]",
                              {walk.rides[i].lift, BodyCommand::Action::moveToLevel, 0,
                               walk.rides[i].level, std::nullopt}))
      return error;
  return std::nullopt;
}

}  // namespace enfilade::scene
