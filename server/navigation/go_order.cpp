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
  query.mutable_path()->set_max_drop(command.go().max_drop());
  query.mutable_path()->set_lifts(command.go().lifts());
  return query;
}

namespace {

/// The doors that the walk opens, if it does, and the lifts that it rides. `skipped`: points before
/// the first waypoint.
void addBodies(const v1::NavigationPath& path, bool opensDoors, int skipped, v1::Walk& walk) {
  const auto addRide = [&](int point, const v1::NavigationLeg& leg, std::uint32_t level) {
    if (point >= path.points_size()) return;
    v1::Walk::Ride& ride = *walk.add_rides();
    ride.set_waypoint(static_cast<std::uint32_t>(point - skipped));
    ride.set_lift(leg.name());
    ride.set_level(level);
  };
  if (path.legs_size() > 1 && path.legs(0).kind() == v1::NavigationLeg::KIND_ASIDE)
    walk.set_opens_from(path.legs(1).first() + 1 - static_cast<std::uint32_t>(skipped));
  for (const v1::NavigationLeg& leg : path.legs()) {
    const int first = static_cast<int>(leg.first());
    // Also a door that a touch would open: its leaf may swing towards the walker.
    if (opensDoors && leg.kind() == v1::NavigationLeg::KIND_DOOR) walk.add_opens(leg.name());
    if (leg.kind() != v1::NavigationLeg::KIND_LIFT) continue;
    addRide(first, leg, leg.from_level());  // in
    addRide(first + 1, leg, leg.to_level());
    addRide(first + 2, leg, leg.to_level());  // out
  }
}

}  // namespace

std::variant<v1::Command, v1::Error> makeGoOrder(
    const v1::Command& command, const std::variant<v1::NavigationReply, v1::Error>& found) {
  if (const auto* error = std::get_if<v1::Error>(&found)) {
    v1::Error refused = *error;
    if (refused.field().starts_with("navigation.path.to")) refused.set_field("go.to");
    if (refused.field() == "navigation.path.max_drop") refused.set_field("go.max_drop");
    return refused;
  }
  const v1::NavigationPath& path = std::get<v1::NavigationReply>(found).paths(0);
  if (!path.found()) return makeError(v1::ERROR_REFUSED_COMMAND, "go: " + path.reason(), "go.to");
  v1::Command order = command;
  v1::Walk& walk = *order.mutable_walk();
  walk.set_from_floor(true);  // as the proof of the path does
  const int skipped = std::min(1, path.points_size() - 1);
  for (int i = skipped; i < path.points_size(); ++i) *walk.add_along() = path.points(i);
  addBodies(path, command.go().doors() == v1::NavigationQuery::DOORS_OPEN, skipped, walk);
  if (command.go().has_speed()) walk.set_speed(command.go().speed());
  return order;
}

}  // namespace enfilade::server
