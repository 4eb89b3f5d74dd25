#include "server/messages/order_messages.hpp"

#include "scene/model/box_mesh.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using OrderOrError = std::variant<scene::Order, v1::Error>;

OrderOrError makeMissingFieldError(const std::string& field, const char* remedy = "a point") {
  return makeError(v1::ERROR_BAD_MESSAGE, field + " is missing: give " + remedy, field);
}

/// Points of a part, or the corners of its box. The world rejects inverted boxes and NaN.
std::vector<scene::Vec3> pointsFromProto(const v1::ConvexPart& part) {
  std::vector<scene::Vec3> points;
  for (const v1::Vec3& point : part.points()) points.push_back(vectorFromProto(point));
  if (!points.empty() || !part.has_box()) return points;
  const scene::Aabb box{vectorFromProto(part.box().min()), vectorFromProto(part.box().max())};
  for (unsigned corner = 0; corner < 8; ++corner)
    points.push_back(scene::computeBoxCorner(box, corner));
  return points;
}

scene::Link linkFromProto(const v1::Link& message) {
  scene::Link link;
  if (message.has_parent()) link.parent = message.parent();
  const v1::Joint& joint = message.joint();
  if (joint.kind() == v1::Joint::KIND_PRISMATIC) {
    link.joint.kind = scene::LinkJoint::Kind::prismatic;
    link.joint.low = 0;
    link.joint.high = 1;
  }
  link.joint.anchor = vectorFromProto(joint.anchor());
  link.joint.axis = vectorFromProto(joint.axis());
  if (joint.has_low()) link.joint.low = joint.low();
  if (joint.has_high()) link.joint.high = joint.high();
  link.points = pointsFromProto(message.part());
  link.value = message.value();
  return link;
}

OrderOrError spawnFromProto(const v1::Spawn& message) {
  if (!message.has_at()) return makeMissingFieldError("spawn.at");
  scene::Spawn spawn;
  spawn.position = vectorFromProto(message.at());
  spawn.facing = message.facing();
  if (message.has_radius()) spawn.radius = message.radius();
  if (message.has_height()) spawn.height = message.height();
  spawn.flying = message.flying();
  spawn.selfContact = message.self_contact();
  for (const v1::ConvexPart& part : message.parts()) spawn.parts.push_back(pointsFromProto(part));
  for (const v1::Link& link : message.links()) {
    const std::string field = "spawn.links[" + std::to_string(spawn.links.size()) + "]";
    if (!link.has_joint() || !link.joint().has_axis())
      return makeMissingFieldError(field + ".joint.axis", "a direction");
    if (!v1::Joint::Kind_IsValid(link.joint().kind())) {
      return makeError(
          v1::ERROR_BAD_MESSAGE,
          "kind: give revolute or prismatic, not " + std::to_string(link.joint().kind()),
          field + ".joint.kind");
    }
    spawn.links.push_back(linkFromProto(link));
  }
  return scene::Order(std::move(spawn));
}

OrderOrError walkFromProto(const v1::Walk& message) {
  if (message.along().empty()) return makeMissingFieldError("walk.along");
  scene::Walk walk;
  for (const v1::Vec3& point : message.along()) walk.waypoints.push_back(vectorFromProto(point));
  if (message.has_speed()) walk.speed = message.speed();
  walk.opens.assign(message.opens().begin(), message.opens().end());
  walk.opensFrom = message.opens_from();
  walk.fromFloor = message.from_floor();
  for (const v1::Walk::Ride& ride : message.rides())
    walk.rides.push_back({ride.waypoint(), ride.lift(), ride.level()});
  return scene::Order(std::move(walk));
}

scene::Order jumpFromProto(const v1::Jump& message) {
  scene::Jump jump;
  if (message.has_height()) jump.height = message.height();
  if (message.has_velocity()) jump.velocity = vectorFromProto(message.velocity());
  return jump;
}

/// An absent height means "as spawned", which the scene encodes as 0. An explicit 0 is an error.
OrderOrError crouchFromProto(const v1::Crouch& message) {
  if (message.has_height() && !(message.height() > 0)) {
    return makeError(v1::ERROR_BAD_MESSAGE, "height must be above 0; leave it out to stand up",
                     "crouch.height");
  }
  return scene::Order(scene::Crouch{message.height()});
}

scene::Order driveJointsFromProto(const v1::DriveJoints& message) {
  scene::DriveJoints drive;
  for (const v1::DriveJoints::Target& target : message.to()) {
    drive.targets.emplace_back();
    if (target.has_value()) drive.targets.back() = target.value();
  }
  if (message.has_speed()) drive.speed = message.speed();
  drive.immediate = message.at_once();
  return drive;
}

OrderOrError turnFromProto(const v1::Turn& message) {
  if (message.angle_case() == v1::Turn::ANGLE_NOT_SET)
    return makeMissingFieldError("turn.by", "by or facing, in degrees");
  scene::Turn turn;
  turn.relative = message.has_by();
  turn.angle = message.has_by() ? message.by() : message.facing();
  if (message.has_rate()) turn.rate = message.rate();
  return scene::Order(turn);
}

OrderOrError teleportFromProto(const v1::Teleport& message) {
  if (!message.has_at()) return makeMissingFieldError("teleport.at");
  scene::Teleport teleport{vectorFromProto(message.at()), std::nullopt};
  if (message.has_facing()) teleport.facing = message.facing();
  return scene::Order(teleport);
}

OrderOrError orderFromProto(const v1::Command& message) {
  switch (message.order_case()) {
    case v1::Command::kSpawn:
      return spawnFromProto(message.spawn());
    case v1::Command::kWalk:
      return walkFromProto(message.walk());
    case v1::Command::kLook:
      if (!message.look().has_at()) return makeMissingFieldError("look.at");
      return scene::Order(scene::Look{vectorFromProto(message.look().at())});
    case v1::Command::kWait:
      return scene::Order(scene::Wait{message.wait().seconds()});
    case v1::Command::kCapture:
      return scene::Order(scene::Capture{message.capture().as()});
    case v1::Command::kLeave:
      return scene::Order(scene::Leave{});
    case v1::Command::kDrive:
      if (!message.drive().has_velocity())
        return makeMissingFieldError("drive.velocity", "metres per second along x, y and z");
      return scene::Order(scene::Drive{vectorFromProto(message.drive().velocity())});
    case v1::Command::kJump:
      return jumpFromProto(message.jump());
    case v1::Command::kFly:
      return scene::Order(scene::Fly{!message.fly().has_on() || message.fly().on()});
    case v1::Command::kCrouch:
      return crouchFromProto(message.crouch());
    case v1::Command::kDriveJoints:
      return driveJointsFromProto(message.drive_joints());
    case v1::Command::kTurn:
      return turnFromProto(message.turn());
    case v1::Command::kTeleport:
      return teleportFromProto(message.teleport());
    case v1::Command::kGo:  // the server submits the Walk
      return makeError(v1::ERROR_REFUSED_COMMAND, "go needs a server that finds the path", "go");
    case v1::Command::ORDER_NOT_SET:
      break;
  }
  return makeError(
      v1::ERROR_BAD_MESSAGE,
      "order is missing: give spawn, walk, look, wait, capture, leave, drive, jump, fly, "
      "crouch, drive_joints, go, turn or teleport",
      "order");
}

}  // namespace

std::variant<scene::Command, v1::Error> commandFromProto(const v1::Command& message) {
  OrderOrError order = orderFromProto(message);
  if (auto* error = std::get_if<v1::Error>(&order)) return std::move(*error);
  return scene::Command{message.avatar(), std::get<scene::Order>(std::move(order)), message.tag()};
}

}  // namespace enfilade::server
