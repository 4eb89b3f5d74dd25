#include "server/messages/body_messages.hpp"

#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

scene::BodyCommand::Action actionOf(v1::BodyCommand::ActionCase action) {
  using Action = scene::BodyCommand::Action;
  switch (action) {
    case v1::BodyCommand::kOpen:
      return Action::open;
    case v1::BodyCommand::kClose:
      return Action::close;
    case v1::BodyCommand::kTo:
      return Action::to;
    case v1::BodyCommand::kLevel:
      return Action::level;
    case v1::BodyCommand::kRun:
      return Action::run;
    default:
      return Action::stop;
  }
}

}  // namespace

v1::Body bodyMessageOf(const scene::Scene& scene, std::size_t index) {
  const scene::BodySpec& spec = scene.model().bodies[index];
  const scene::BodyShape& shape = *scene.shapeOfBody(index);
  v1::Body message;
  message.set_id(spec.objects[0] + 1);
  message.set_name(spec.name);
  message.set_kind(scene::wordOf(spec.kind));
  message.set_source(scene::wordOf(spec.source));
  for (const std::uint32_t object : spec.objects) message.add_objects(object + 1);
  *message.mutable_origin() = messageOf(shape.origin);
  message.set_approximate(shape.approximate);
  if (spec.kind == scene::BodyKind::rigid) message.set_mass(shape.mass);
  if (!scene::isKinematic(spec.kind)) return message;
  const auto [low, high] = scene::limitsOf(spec);
  *message.mutable_axis() = messageOf(spec.axis);
  message.set_low(low);
  message.set_high(high);
  message.mutable_stops()->Assign(spec.stops.begin(), spec.stops.end());
  message.set_speed(spec.speed);
  if (spec.closesAfter) message.set_closes_after(*spec.closesAfter);
  message.set_loops(spec.loops);
  message.set_closed(spec.closed);
  return message;
}

std::variant<scene::BodyCommand, v1::Error> commandFrom(const v1::BodyCommand& message) {
  if (message.action_case() == v1::BodyCommand::ACTION_NOT_SET)
    return errorOf(v1::ERROR_BAD_MESSAGE,
                   "action is missing: give open, close, stop, to, level or run", "body.action");
  scene::BodyCommand command;
  command.body = message.body();
  command.action = actionOf(message.action_case());
  command.to = message.to();
  command.level = message.level();
  if (message.has_speed()) command.speed = message.speed();
  return command;
}

std::optional<v1::Error> submit(scene::World& world, const v1::BodyCommand& message) {
  auto command = commandFrom(message);
  if (auto* error = std::get_if<v1::Error>(&command)) return std::move(*error);
  if (auto why = scene::submit(world, std::get<scene::BodyCommand>(std::move(command))))
    return errorOf(v1::ERROR_REFUSED_COMMAND, *why,
                   "body." + why->substr(0, why->find_first_of(" :'")));
  return std::nullopt;
}

v1::BodyState messageOf(const scene::World& world, const scene::BodyView& view) {
  v1::BodyState message;
  message.set_id(view.id);
  message.set_name(world.scene().model().bodies[view.index].name);
  *message.mutable_position() = messageOf(view.pose.translation);
  message.mutable_orientation()->set_x(view.pose.rotation.x());
  message.mutable_orientation()->set_y(view.pose.rotation.y());
  message.mutable_orientation()->set_z(view.pose.rotation.z());
  message.mutable_orientation()->set_w(view.pose.rotation.w());
  message.set_coordinate(view.coordinate);
  *message.mutable_velocity() = messageOf(view.velocity);
  *message.mutable_spin() = messageOf(view.spin);
  message.set_moving(view.moving);
  message.set_blocked_by(view.blockedBy);
  return message;
}

}  // namespace enfilade::server
