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
  *query.mutable_path()->mutable_from()->mutable_point() = toProto(end->footPosition);
  *query.mutable_path()->add_to() = command.go().to();
  return query;
}

std::variant<v1::Command, v1::Error> makeWalk(
    const v1::Command& command, const std::variant<v1::NavigationReply, v1::Error>& found) {
  if (const auto* error = std::get_if<v1::Error>(&found)) {
    v1::Error refused = *error;
    if (refused.field().starts_with("navigation.path.to")) refused.set_field("go.to");
    return refused;
  }
  const v1::NavigationPath& path = std::get<v1::NavigationReply>(found).paths(0);
  if (!path.found()) return makeError(v1::ERROR_REFUSED_COMMAND, "go: " + path.reason(), "go.to");
  v1::Command walk = command;
  v1::Walk& order = *walk.mutable_walk();
  for (int i = std::min(1, path.points_size() - 1); i < path.points_size(); ++i)
    *order.add_along() = path.points(i);
  if (command.go().has_speed()) order.set_speed(command.go().speed());
  return walk;
}

}  // namespace enfilade::server
