// What of a command can be judged without the world's state: numbers, names and lists. Whoever is
// refused is told the field, the value and what is allowed, and nothing is changed.
#include <array>
#include <charconv>
#include <cmath>

#include "scene/model/names.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

constexpr double kFarthest = 1e7;       // metres: doubles still resolve a nanometre there
constexpr double kLongestWait = 86400;  // seconds
constexpr std::size_t kMostWayPoints = 100000;
constexpr double kMostTurn = 1000;  // radians: a joint's limits

std::string number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "infinity" : "-infinity";
  std::array<char, 32> text{};  // the shortest form that reads back as the value: 1e+300
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

using Refusal = std::optional<std::string>;

Refusal outside(const std::string& field, double value, double least, double most) {
  if (value >= least && value <= most) return std::nullopt;
  return field + " is " + number(value) + "; it must lie in " + number(least) + ".." + number(most);
}

/// As outside(), but `value` must be above 0.
Refusal notPositive(const std::string& field, double value, double most) {
  if (!(value > 0)) return field + " is " + number(value) + "; it must be above 0";
  return outside(field, value, 0, most);
}

Refusal badPoint(const std::string& field, const Vec3& point, double farthest = kFarthest) {
  constexpr std::array<const char*, 3> kAxes{".x", ".y", ".z"};
  for (int i = 0; i < 3; ++i)
    if (auto why = outside(field + kAxes[i], point[i], -farthest, farthest)) return why;
  return std::nullopt;
}

Refusal badName(const std::string& field, const std::string& name) {
  if (isName(name)) return std::nullopt;
  return field + kNameRule;
}

Refusal badPart(const std::string& field, const std::vector<Vec3>& points) {
  if (points.empty()) return field + " has no point; give the corners of a convex body";
  if (points.size() > kMostPartPoints)
    return field + " has more than " + std::to_string(kMostPartPoints) + " points";
  for (std::size_t i = 0; i < points.size(); ++i)
    if (auto why = badPoint(field + "[" + std::to_string(i) + "]", points[i], kLargestPart))
      return why;
  return std::nullopt;
}

Refusal badLink(const std::string& field, const Link& link, std::size_t index) {
  if (auto why = badPart(field + ".points", link.points)) return why;
  if (link.parent < -1 || link.parent >= static_cast<std::int32_t>(index))
    return field + ".parent is " + std::to_string(link.parent) +
           "; it must be an earlier link, counted from 0, or -1 for the base";
  const LinkJoint& joint = link.joint;
  if (auto why = badPoint(field + ".anchor", joint.anchor, kLargestPart)) return why;
  if (auto why = badPoint(field + ".axis", joint.axis, kLargestPart)) return why;
  if (!(joint.axis.norm() > 1e-6)) return field + ".axis has no direction; give one, as [0, 1, 0]";
  const bool turns = joint.kind == LinkJoint::Kind::revolute;
  const double most = turns ? kMostTurn : kLargestPart;
  if (auto why = outside(field + ".low", joint.low, -most, most)) return why;
  if (auto why = outside(field + ".high", joint.high, joint.low, most)) return why;
  return outside(field + ".value", link.value, joint.low, joint.high);
}

Refusal refusalOf(const Spawn& spawn, const Lengths&) {
  if (auto why = badPoint("at", spawn.at)) return why;
  if (auto why = outside("facing", spawn.facing, -1e6, 1e6)) return why;
  if (auto why = outside("radius", spawn.radius, 0.05, 5)) return why;
  if (auto why = outside("height", spawn.height, 0.2, 10)) return why;
  if (spawn.parts.size() > kMostParts)
    return "parts has more than " + std::to_string(kMostParts) + " parts";
  if (spawn.links.size() > kMostLinks)
    return "links has more than " + std::to_string(kMostLinks) + " links";
  for (std::size_t i = 0; i < spawn.parts.size(); ++i)
    if (auto why = badPart("parts[" + std::to_string(i) + "]", spawn.parts[i])) return why;
  for (std::size_t i = 0; i < spawn.links.size(); ++i)
    if (auto why = badLink("links[" + std::to_string(i) + "]", spawn.links[i], i)) return why;
  return std::nullopt;
}

Refusal refusalOf(const Walk& walk, const Lengths& lengths) {
  if (walk.along.empty()) return "along has no way point; give at least one";
  if (walk.along.size() > kMostWayPoints)
    return "along has more than " + std::to_string(kMostWayPoints) + " way points";
  for (std::size_t i = 0; i < walk.along.size(); ++i)
    if (auto why = badPoint("along[" + std::to_string(i) + "]", walk.along[i])) return why;
  return notPositive("speed", walk.speed, lengths.speedLimit);
}

Refusal refusalOf(const Look& look, const Lengths&) {
  return badPoint("at", look.at);
}
Refusal refusalOf(const Wait& wait, const Lengths&) {
  return outside("seconds", wait.seconds, 0, kLongestWait);
}
Refusal refusalOf(const Capture& capture, const Lengths&) {
  return badName("as", capture.as);
}
Refusal refusalOf(const Leave&, const Lengths&) {
  return std::nullopt;
}

Refusal badVelocity(const Vec3& velocity, const Lengths& lengths) {
  if (auto why = badPoint("velocity", velocity)) return why;
  return outside("velocity's length", velocity.norm(), 0, lengths.speedLimit);
}

Refusal refusalOf(const Drive& drive, const Lengths& lengths) {
  return badVelocity(drive.velocity, lengths);
}
Refusal refusalOf(const Jump& jump, const Lengths& lengths) {
  if (auto why = notPositive("height", jump.height, lengths.jumpLimit)) return why;
  return jump.velocity ? badVelocity(*jump.velocity, lengths) : std::nullopt;
}
Refusal refusalOf(const Fly&, const Lengths&) {
  return std::nullopt;
}
Refusal refusalOf(const Crouch& crouch, const Lengths&) {
  return outside("height", crouch.height, 0, 10);
}

Refusal refusalOf(const DriveJoints& drive, const Lengths& lengths) {
  if (drive.to.empty())
    return "to has no value; give one for each joint, or none for those that stay";
  if (drive.to.size() > kMostLinks)
    return "to has more than " + std::to_string(kMostLinks) + " values";
  for (std::size_t i = 0; i < drive.to.size(); ++i)
    if (drive.to[i])
      if (auto why = outside("to[" + std::to_string(i) + "]", *drive.to[i], -kMostTurn, kMostTurn))
        return why;
  return notPositive("speed", drive.speed, lengths.jointSpeedLimit);
}

}  // namespace

std::optional<std::string> refusalOf(const Command& command, const Lengths& lengths) {
  if (auto why = badName("avatar", command.avatar)) return why;
  return std::visit([&](const auto& order) { return refusalOf(order, lengths); }, command.order);
}

std::optional<std::string> lengthsProblem(const Lengths& l) {
  if (auto why = outside("epsilon", l.epsilon, 1e-6, 0.05)) return why;
  if (auto why = outside("step height", l.stepHeight, 0, 2)) return why;
  if (auto why = outside("near miss", l.nearMiss, 0, 10)) return why;
  if (auto why = outside("walkable normal", l.walkableNormalY, 0.01, 1)) return why;
  if (auto why = outside("gravity", l.gravity, 0.01, 100)) return why;
  if (auto why = outside("speed limit", l.speedLimit, 0.01, 1e4)) return why;
  if (auto why = outside("tick", l.tick, 1e-4, 1)) return why;
  if (auto why = outside("patience", l.patience, l.tick, 3600)) return why;
  if (auto why = outside("jump limit", l.jumpLimit, 0, 1000)) return why;
  if (auto why = outside("joint speed limit", l.jointSpeedLimit, 0, 100)) return why;
  return outside("push force", l.pushForce, 0, 1e6);
}

}  // namespace enfilade::scene
