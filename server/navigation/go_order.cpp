#include "server/navigation/go_order.hpp"

#include <algorithm>

#include "scene/world/avatars/order_end.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

std::variant<v1::NavigationQuery, v1::Error> makePathQuery(const scene::World& world,
                                                           const v1::Command& command) {
  const auto end = scene::findOrderEnd(world.data(), command.avatar());
  if (!end) return makeUnknownAvatarError(command.avatar(), "avatar");
  if (!(end->height > 0))
    return makeError(v1::ERROR_REFUSED_COMMAND,
                     "go is only for upright avatars without parts and links: give a Walk", "go");
  const double speed = command.go().has_speed() ? command.go().speed() : scene::Walk().speed;
  if (!(speed > 0 && speed <= world.settings().maxSpeed))
    return makeError(
        v1::ERROR_REFUSED_COMMAND,
        "speed must be above 0 and at most " + std::to_string(world.settings().maxSpeed) + " m/s",
        "go.speed");
  v1::NavigationQuery query;
  query.set_radius(end->radius);
  query.set_height(end->height);
  query.set_speed(std::clamp(speed, 0.01, 20.0));
  query.set_doors(command.go().doors());
  *query.mutable_path()->mutable_from()->mutable_point() = toProto(end->footPosition);
  *query.mutable_path()->add_to() = command.go().to();
  return query;
}

namespace {

/// Seconds that the avatar must wait so that it reaches no door before that is open. Those that
/// open by touch need no command.
double openDoors(const v1::NavigationPath& path, double speed,
                 std::vector<v1::BodyCommand>& commands) {
  double wait = 0;
  for (const v1::NavigationDoor& door : path.doors()) {
    if (door.by_touch()) continue;
    v1::BodyCommand& command = commands.emplace_back();
    command.set_body(door.name());
    command.mutable_open();
    wait = std::max(wait, door.seconds() - door.distance() / speed);
  }
  return wait;
}

}  // namespace

std::variant<GoOrders, v1::Error> makeGoOrders(
    const v1::Command& command, const std::variant<v1::NavigationReply, v1::Error>& found) {
  if (const auto* error = std::get_if<v1::Error>(&found)) {
    v1::Error refused = *error;
    if (refused.field().starts_with("navigation.path.to")) refused.set_field("go.to");
    return refused;
  }
  const v1::NavigationPath& path = std::get<v1::NavigationReply>(found).paths(0);
  if (!path.found()) return makeError(v1::ERROR_REFUSED_COMMAND, "go: " + path.reason(), "go.to");
  GoOrders result;
  const double speed = command.go().has_speed() ? command.go().speed() : scene::Walk().speed;
  if (const double wait = openDoors(path, speed, result.doors); wait > 0) {
    v1::Command& order = result.orders.emplace_back();
    order.set_avatar(command.avatar());
    order.mutable_wait()->set_seconds(wait);
  }
  v1::Command& walk = result.orders.emplace_back(command);
  v1::Walk& order = *walk.mutable_walk();
  for (int i = std::min(1, path.points_size() - 1); i < path.points_size(); ++i)
    *order.add_along() = path.points(i);
  if (command.go().has_speed()) order.set_speed(command.go().speed());
  return result;
}

}  // namespace enfilade::server
