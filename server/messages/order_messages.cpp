// Orders from messages: what is missing in them is told here, what is absurd the world refuses.
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using OrderOrError = std::variant<scene::Order, v1::Error>;

OrderOrError missing(const std::string& field, const char* what = "a point") {
  return errorOf(v1::ERROR_BAD_MESSAGE, field + " is missing: give " + what, field);
}

/// The corners of a box that is inside out, or has a NaN, are the world's to refuse.
std::vector<scene::Vec3> pointsFrom(const v1::ConvexPart& part) {
  std::vector<scene::Vec3> points;
  for (const v1::Vec3& point : part.points()) points.push_back(vectorFrom(point));
  if (!points.empty() || !part.has_box()) return points;
  const scene::Vec3 min = vectorFrom(part.box().min()), max = vectorFrom(part.box().max());
  for (int corner = 0; corner < 8; ++corner) {
    points.emplace_back(corner & 1 ? max.x() : min.x(), corner & 2 ? max.y() : min.y(),
                        corner & 4 ? max.z() : min.z());
  }
  return points;
}

scene::Link linkFrom(const v1::Link& message) {
  scene::Link link;
  if (message.has_parent()) link.parent = message.parent();
  const v1::Joint& joint = message.joint();
  if (joint.kind() == v1::Joint::KIND_PRISMATIC) {
    link.joint.kind = scene::LinkJoint::Kind::prismatic;
    link.joint.low = 0;
    link.joint.high = 1;
  }
  link.joint.anchor = vectorFrom(joint.anchor());
  link.joint.axis = vectorFrom(joint.axis());
  if (joint.has_low()) link.joint.low = joint.low();
  if (joint.has_high()) link.joint.high = joint.high();
  link.points = pointsFrom(message.part());
  link.value = message.value();
  return link;
}

OrderOrError orderFrom(const v1::Spawn& message) {
  if (!message.has_at()) return missing("spawn.at");
  scene::Spawn spawn;
  spawn.at = vectorFrom(message.at());
  spawn.facing = message.facing();
  if (message.has_radius()) spawn.radius = message.radius();
  if (message.has_height()) spawn.height = message.height();
  spawn.flying = message.flying();
  spawn.selfContact = message.self_contact();
  for (const v1::ConvexPart& part : message.parts()) spawn.parts.push_back(pointsFrom(part));
  for (const v1::Link& link : message.links()) {
    const std::string field = "spawn.links[" + std::to_string(spawn.links.size()) + "]";
    if (!link.has_joint() || !link.joint().has_axis())
      return missing(field + ".joint.axis", "a direction");
    if (!v1::Joint::Kind_IsValid(link.joint().kind())) {
      return errorOf(v1::ERROR_BAD_MESSAGE,
                     "kind: give revolute or prismatic, not " + std::to_string(link.joint().kind()),
                     field + ".joint.kind");
    }
    spawn.links.push_back(linkFrom(link));
  }
  return scene::Order(std::move(spawn));
}

OrderOrError orderFrom(const v1::Walk& message) {
  if (message.along().empty()) return missing("walk.along");
  scene::Walk walk;
  for (const v1::Vec3& point : message.along()) walk.along.push_back(vectorFrom(point));
  if (message.has_speed()) walk.speed = message.speed();
  return scene::Order(std::move(walk));
}

scene::Order orderFrom(const v1::Jump& message) {
  scene::Jump jump;
  if (message.has_height()) jump.height = message.height();
  if (message.has_velocity()) jump.velocity = vectorFrom(message.velocity());
  return jump;
}

/// Absent is "as spawned", which the scene writes as 0; a 0 that is given is absurd, not absent.
OrderOrError orderFrom(const v1::Crouch& message) {
  if (message.has_height() && !(message.height() > 0)) {
    return errorOf(v1::ERROR_BAD_MESSAGE, "height must be above 0; leave it out to stand up",
                   "crouch.height");
  }
  return scene::Order(scene::Crouch{message.height()});
}

scene::Order orderFrom(const v1::DriveJoints& message) {
  scene::DriveJoints drive;
  for (const v1::DriveJoints::Target& target : message.to()) {
    drive.to.emplace_back();
    if (target.has_value()) drive.to.back() = target.value();
  }
  if (message.has_speed()) drive.speed = message.speed();
  drive.atOnce = message.at_once();
  return drive;
}

OrderOrError orderFrom(const v1::Command& message) {
  switch (message.order_case()) {
    case v1::Command::kSpawn:
      return orderFrom(message.spawn());
    case v1::Command::kWalk:
      return orderFrom(message.walk());
    case v1::Command::kLook:
      if (!message.look().has_at()) return missing("look.at");
      return scene::Order(scene::Look{vectorFrom(message.look().at())});
    case v1::Command::kWait:
      return scene::Order(scene::Wait{message.wait().seconds()});
    case v1::Command::kCapture:
      return scene::Order(scene::Capture{message.capture().as()});
    case v1::Command::kLeave:
      return scene::Order(scene::Leave{});
    case v1::Command::kDrive:
      if (!message.drive().has_velocity())
        return missing("drive.velocity", "metres per second along x, y and z");
      return scene::Order(scene::Drive{vectorFrom(message.drive().velocity())});
    case v1::Command::kJump:
      return orderFrom(message.jump());
    case v1::Command::kFly:
      return scene::Order(scene::Fly{!message.fly().has_on() || message.fly().on()});
    case v1::Command::kCrouch:
      return orderFrom(message.crouch());
    case v1::Command::kDriveJoints:
      return orderFrom(message.drive_joints());
    case v1::Command::ORDER_NOT_SET:
      break;
  }
  return errorOf(
      v1::ERROR_BAD_MESSAGE,
      "order is missing: give spawn, walk, look, wait, capture, leave, drive, jump, fly, "
      "crouch or drive_joints",
      "order");
}

}  // namespace

std::variant<scene::Command, v1::Error> commandFrom(const v1::Command& message) {
  OrderOrError order = orderFrom(message);
  if (auto* error = std::get_if<v1::Error>(&order)) return std::move(*error);
  return scene::Command{message.avatar(), std::get<scene::Order>(std::move(order)), message.tag()};
}

}  // namespace enfilade::server
