// Numbers, names and lists. Each error names the field, the value and the allowed range.
#include "scene/world/data/validation.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "scene/model/format_number.hpp"
#include "scene/model/names.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMaxWait = 86400;  // seconds
constexpr std::size_t kMaxWaypoints = 100000;
constexpr double kMaxJointAngle = 1000;  // radians: magnitude of a joint's limits

using OptionalError = std::optional<std::string>;

OptionalError validateRange(const std::string& field, double value, double min, double max,
                            const char* unit) {
  if (value >= min && value <= max) return std::nullopt;
  return formatRangeError(field, value, min, max, unit);
}

/// As validateRange(), but `value` must be above 0.
OptionalError validatePositive(const std::string& field, double value, double max,
                               const char* unit) {
  if (value > 0 && value <= max) return std::nullopt;
  return field + " is " + formatExactNumber(value) + " " + unit +
         "; give more than 0 and at most " + formatExactNumber(max) + " " + unit;
}

OptionalError validatePoint(const std::string& field, const Vec3& point,
                            double maxCoordinate = kMaxCoordinate) {
  constexpr std::array<const char*, 3> kAxes{".x", ".y", ".z"};
  for (int i = 0; i < 3; ++i)
    if (auto error = validateRange(field + kAxes[i], point[i], -maxCoordinate, maxCoordinate, "m"))
      return error;
  return std::nullopt;
}

OptionalError validateName(const std::string& field, const std::string& name) {
  if (isValidName(name)) return std::nullopt;
  return field + kNameRule;
}

OptionalError validatePart(const std::string& field, const std::vector<Vec3>& points) {
  if (points.empty()) return field + " has no point; give the corners of a convex body";
  if (points.size() > kMaxPartPoints)
    return field + " has more than " + std::to_string(kMaxPartPoints) + " points";
  for (std::size_t i = 0; i < points.size(); ++i)
    if (auto error =
            validatePoint(field + "[" + std::to_string(i) + "]", points[i], kMaxPartCoordinate))
      return error;
  return std::nullopt;
}

OptionalError validateLink(const std::string& field, const Link& link, std::size_t index) {
  if (auto error = validatePart(field + ".points", link.points)) return error;
  if (link.parent < -1 || link.parent >= static_cast<std::int32_t>(index))
    return field + ".parent is " + std::to_string(link.parent) +
           "; it must be an earlier link, counted from 0, or -1 for the base";
  const LinkJoint& joint = link.joint;
  if (auto error = validatePoint(field + ".anchor", joint.anchor, kMaxPartCoordinate)) return error;
  if (auto error = validatePoint(field + ".axis", joint.axis, kMaxPartCoordinate)) return error;
  if (!(joint.axis.norm() > 1e-6)) return field + ".axis has no direction; give one, as [0, 1, 0]";
  const bool isRevolute = joint.kind == LinkJoint::Kind::revolute;
  const char* const unit = isRevolute ? "radians" : "m";
  const double maxValue = isRevolute ? kMaxJointAngle : kMaxPartCoordinate;
  if (auto error = validateRange(field + ".low", joint.low, -maxValue, maxValue, unit))
    return error;
  if (auto error = validateRange(field + ".high", joint.high, joint.low, maxValue, unit))
    return error;
  return validateRange(field + ".value", link.value, joint.low, joint.high, unit);
}

OptionalError validateOrder(const Spawn& spawn, const WorldSettings&) {
  if (auto error = validatePoint("at", spawn.position)) return error;
  if (auto error = validateRange("facing", spawn.facing, -1e6, 1e6, "degrees")) return error;
  if (auto error = validateRange("radius", spawn.radius, 0.05, 5, "m")) return error;
  if (auto error = validateRange("height", spawn.height, 0.2, 10, "m")) return error;
  if (spawn.parts.size() > kMaxParts)
    return "parts has more than " + std::to_string(kMaxParts) + " parts";
  if (spawn.links.size() > kMaxLinks)
    return "links has more than " + std::to_string(kMaxLinks) + " links";
  for (std::size_t i = 0; i < spawn.parts.size(); ++i)
    if (auto error = validatePart("parts[" + std::to_string(i) + "]", spawn.parts[i])) return error;
  for (std::size_t i = 0; i < spawn.links.size(); ++i)
    if (auto error = validateLink("links[" + std::to_string(i) + "]", spawn.links[i], i))
      return error;
  return std::nullopt;
}

OptionalError validateOrder(const Walk& walk, const WorldSettings& settings) {
  if (walk.waypoints.empty()) return "along has no waypoint; give at least one";
  if (walk.waypoints.size() > kMaxWaypoints)
    return "along has more than " + std::to_string(kMaxWaypoints) + " waypoints";
  for (std::size_t i = 0; i < walk.waypoints.size(); ++i)
    if (auto error = validatePoint("along[" + std::to_string(i) + "]", walk.waypoints[i]))
      return error;
  if (walk.opens.size() > kMaxWalkDoors)
    return "opens has more than " + std::to_string(kMaxWalkDoors) + " doors";
  if (walk.opensFrom > walk.waypoints.size())
    return "opens_from is " + std::to_string(walk.opensFrom) + "; there are " +
           std::to_string(walk.waypoints.size()) + " waypoints";
  if (walk.rides.size() > kMaxRides)
    return "rides has more than " + std::to_string(kMaxRides) + " rides";
  for (std::size_t i = 0; i < walk.rides.size(); ++i) {
    const std::string field = "rides[" + std::to_string(i) + "].waypoint";
    if (walk.rides[i].waypoint >= walk.waypoints.size())
      return field + " is " + std::to_string(walk.rides[i].waypoint) + "; there are " +
             std::to_string(walk.waypoints.size()) + " waypoints, counted from 0";
    if (i > 0 && walk.rides[i].waypoint <= walk.rides[i - 1].waypoint)
      return field + " must be above that of the ride before";
  }
  return validatePositive("speed", walk.speed, settings.maxSpeed, "m/s");
}

OptionalError validateOrder(const Look& look, const WorldSettings&) {
  return validatePoint("at", look.target);
}
OptionalError validateOrder(const Wait& wait, const WorldSettings&) {
  return validateRange("seconds", wait.seconds, 0, kMaxWait, "s");
}
OptionalError validateOrder(const Capture& capture, const WorldSettings&) {
  return validateName("as", capture.name);
}
OptionalError validateOrder(const Leave&, const WorldSettings&) {
  return std::nullopt;
}

OptionalError validateVelocity(const Vec3& velocity, const WorldSettings& settings) {
  if (auto error = validatePoint("velocity", velocity)) return error;
  return validateRange("velocity's length", velocity.norm(), 0, settings.maxSpeed, "m/s");
}

OptionalError validateOrder(const Drive& drive, const WorldSettings& settings) {
  return validateVelocity(drive.velocity, settings);
}
OptionalError validateOrder(const Jump& jump, const WorldSettings& settings) {
  if (auto error = validatePositive("height", jump.height, settings.maxJumpHeight, "m"))
    return error;
  return jump.velocity ? validateVelocity(*jump.velocity, settings) : std::nullopt;
}
OptionalError validateOrder(const Fly&, const WorldSettings&) {
  return std::nullopt;
}
OptionalError validateOrder(const Crouch& crouch, const WorldSettings&) {
  return validateRange("height", crouch.height, 0, 10, "m");
}

OptionalError validateOrder(const DriveJoints& drive, const WorldSettings& settings) {
  if (drive.targets.empty())
    return "to has no value; give one for each joint, or none for those that stay";
  if (drive.targets.size() > kMaxLinks)
    return "to has more than " + std::to_string(kMaxLinks) + " values";
  for (std::size_t i = 0; i < drive.targets.size(); ++i)
    if (drive.targets[i])
      if (auto error = validateRange("to[" + std::to_string(i) + "]", *drive.targets[i],
                                     -kMaxJointAngle, kMaxJointAngle, "radians or m"))
        return error;
  return validatePositive("speed", drive.speed, settings.maxJointSpeed, "radians/s or m/s");
}

OptionalError validateOrder(const Turn& turn, const WorldSettings& settings) {
  if (auto error = validateRange(turn.relative ? "by" : "facing", turn.angle, -1e6, 1e6, "degrees"))
    return error;
  return validatePositive("rate", turn.rate, settings.maxJointSpeed * 180 / std::numbers::pi,
                          "degrees/s");
}

OptionalError validateOrder(const Teleport& teleport, const WorldSettings&) {
  if (auto error = validatePoint("at", teleport.position)) return error;
  return validateRange("facing", teleport.facing.value_or(0), -1e6, 1e6, "degrees");
}

}  // namespace

std::optional<std::string> validateCommandFields(const Command& command,
                                                 const WorldSettings& settings) {
  if (auto error = validateName("avatar", command.avatar)) return error;
  return std::visit([&](const auto& order) { return validateOrder(order, settings); },
                    command.order);
}

std::optional<std::string> validateWorldSettings(const WorldSettings& settings) {
  if (auto error = validateRange("epsilon", settings.contactOffset, 1e-6, 0.05, "m")) return error;
  if (auto error = validateRange("step height", settings.stepHeight, 0, 2, "m")) return error;
  if (auto error = validateRange("near miss", settings.nearMissDistance, 0, 10, "m")) return error;
  if (auto error = validateRange("walkable normal", settings.walkableNormalY, 0.01, 1, ""))
    return error;
  if (auto error = validateRange("gravity", settings.gravity, 0.01, 100, "m/s2")) return error;
  if (auto error = validateRange("speed limit", settings.maxSpeed, 0.01, 1e4, "m/s")) return error;
  if (auto error = validateRange("tick", settings.tickDuration, 1e-4, 1, "s")) return error;
  if (auto error =
          validateRange("patience", settings.stuckTimeout, settings.tickDuration, 3600, "s"))
    return error;
  if (auto error = validateRange("jump limit", settings.maxJumpHeight, 0, 1000, "m")) return error;
  if (auto error =
          validateRange("joint speed limit", settings.maxJointSpeed, 0, 100, "radians/s or m/s"))
    return error;
  return validateRange("push force", settings.maxPushForce, 0, 1e6, "N");
}

}  // namespace enfilade::scene
