#include "server/messages/body_messages.hpp"

#include <filesystem>
#include <variant>

#include "collision/assert.hpp"
#include "server/messages/name_suggestions.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

scene::BodyCommand::Action actionFromProto(v1::BodyCommand::ActionCase action) {
  using Action = scene::BodyCommand::Action;
  switch (action) {
    case v1::BodyCommand::kOpen:
      return Action::open;
    case v1::BodyCommand::kClose:
      return Action::close;
    case v1::BodyCommand::kTo:
      return Action::moveTo;
    case v1::BodyCommand::kLevel:
      return Action::moveToLevel;
    case v1::BodyCommand::kRun:
      return Action::run;
    case v1::BodyCommand::kStop:
    case v1::BodyCommand::ACTION_NOT_SET:
      break;
  }
  return Action::stop;
}

/// Returns the command, or an error that names a missing field. The world validates the values.
std::variant<scene::BodyCommand, v1::Error> bodyCommandFromProto(const v1::BodyCommand& message) {
  if (message.action_case() == v1::BodyCommand::ACTION_NOT_SET)
    return makeError(v1::ERROR_BAD_MESSAGE,
                     "action is missing: give open, close, stop, to, level or run", "body.action");
  scene::BodyCommand command;
  command.body = message.body();
  command.action = actionFromProto(message.action_case());
  command.target = message.to();
  command.level = message.level();
  if (message.has_speed()) command.speed = message.speed();
  return command;
}

}  // namespace

v1::Body toProto(const scene::Scene& scene, std::size_t index) {
  ENFILADE_ASSERT(index < scene.model().bodies.size());
  const scene::BodySpec& spec = scene.model().bodies[index];
  ENFILADE_ASSERT(!spec.objects.empty());
  const scene::BodyShape& shape = *scene.bodyShape(index);
  v1::Body message;
  message.set_id(spec.objects[0] + 1);
  message.set_name(spec.name);
  message.set_kind(scene::toString(spec.kind));
  message.set_source(scene::toString(spec.source));
  for (const std::uint32_t object : spec.objects) message.add_objects(object + 1);
  *message.mutable_origin() = toProto(shape.origin);
  message.set_approximate(shape.approximateCount);
  if (isDynamic(spec.kind)) message.set_mass(shape.mass);
  if (!scene::isKinematic(spec.kind)) return message;
  const auto [low, high] = scene::getJointLimits(spec);
  *message.mutable_axis() = toProto(spec.axis);
  message.set_low(low);
  message.set_high(high);
  message.mutable_stops()->Assign(spec.stops.begin(), spec.stops.end());
  message.set_speed(spec.speed);
  if (spec.autoCloseDelay) message.set_closes_after(*spec.autoCloseDelay);
  message.set_loops(spec.loops);
  message.set_closed(spec.closedPosition);
  return message;
}

v1::Scene toProto(const scene::Scene& scene) {
  const scene::Model& model = scene.model();
  v1::Scene message;
  message.set_source(std::filesystem::path(model.source).filename().string());
  message.set_hash(scene.hash());
  message.set_objects(static_cast<std::uint32_t>(model.objects.size()));
  *message.mutable_bounds()->mutable_min() = toProto(scene.bounds().min);
  *message.mutable_bounds()->mutable_max() = toProto(scene.bounds().max);
  message.set_metres_per_unit(model.metresPerUnit);
  message.set_up(toString(model.upAxis));
  *message.mutable_offset() = toProto(model.offset);
  for (std::size_t i = 0; i < model.bodies.size(); ++i) *message.add_bodies() = toProto(scene, i);
  return message;
}

std::optional<v1::Error> submitBodyCommand(scene::World& world, const v1::BodyCommand& message) {
  auto command = bodyCommandFromProto(message);
  if (auto* error = std::get_if<v1::Error>(&command)) return std::move(*error);
  if (auto refusal =
          scene::submitBodyCommand(world, std::get<scene::BodyCommand>(std::move(command))))
    return makeError(v1::ERROR_REFUSED_COMMAND, *refusal + suggestBody(world, message.body()),
                     "body." + refusal->substr(0, refusal->find_first_of(" :'")));
  return std::nullopt;
}

v1::BodyState toProto(const scene::World& world, const scene::BodySnapshot& body) {
  ENFILADE_ASSERT(body.index < world.scene().model().bodies.size());
  v1::BodyState message;
  message.set_id(body.id);
  message.set_name(world.scene().model().bodies[body.index].name);
  *message.mutable_position() = toProto(body.pose.translation);
  message.mutable_orientation()->set_x(body.pose.rotation.x());
  message.mutable_orientation()->set_y(body.pose.rotation.y());
  message.mutable_orientation()->set_z(body.pose.rotation.z());
  message.mutable_orientation()->set_w(body.pose.rotation.w());
  message.set_coordinate(body.jointPosition);
  *message.mutable_velocity() = toProto(body.velocity);
  *message.mutable_spin() = toProto(body.angularVelocity);
  message.set_moving(body.moving);
  message.set_blocked_by(body.blockedBy);
  return message;
}

}  // namespace enfilade::server
