#include "scene/model/body_spec.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "scene/model/format_number.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMaxSpecNumber = 1e6;          // metres or radians; a larger value is a mistake
constexpr double kMaxSpeed = 1e4;               // per second
constexpr double kMaxDuration = 1e6;            // seconds
constexpr double kAxisLengthTolerance = 1e-9;   // tolerance of an axis' length
constexpr double kMaxDensity = 1e5;             // kg / m^3: five times gold
constexpr double kLoopClosureTolerance = 1e-9;  // metres or radians: tolerance of a loop's end
constexpr std::size_t kMaxPathKeys = 100000;

using OptionalError = std::optional<std::string>;

OptionalError validateFieldRange(const char* field, double value, double min, double max,
                                 const char* unit = "") {
  if (value >= min && value <= max) return std::nullopt;
  return formatRangeError(field, value, min, max, unit);
}

OptionalError validateFieldVector(const char* field, const Vec3& value) {
  for (int i = 0; i < 3; ++i)
    if (auto error = validateFieldRange(field, value[i], -kMaxSpecNumber, kMaxSpecNumber, "m"))
      return error;
  return std::nullopt;
}

OptionalError validateLimits(const BodySpec& body) {
  const bool lift = getTraits(body.kind).takesStops;
  const std::string field = lift ? "stops" : "limits";
  const char* const unit = getTraits(body.kind).rotates ? "radians" : "m";
  if (lift && body.stops.size() < 2) return "stops: a lift needs at least two";
  if (std::adjacent_find(body.stops.begin(), body.stops.end(), std::greater_equal<>()) !=
      body.stops.end())
    return "stops must ascend strictly";
  if (!(body.low <= 0 && body.high >= 0))
    return field + ": 0, the authored position, must lie between the smallest and the largest";
  if (!(body.low < body.high)) return field + ": both are 0: it could not move";
  if (!(body.low >= -kMaxSpecNumber && body.high <= kMaxSpecNumber))
    return field + ": farther than 1000 km";
  for (const double stop : body.stops)
    if (auto error = validateFieldRange("stops", stop, body.low, body.high, "m")) return error;
  if (auto error = validateFieldRange("closed", body.closedPosition, body.low, body.high, unit))
    return error;
  if (body.autoCloseDelay)
    return validateFieldRange("closes_after", *body.autoCloseDelay, 0, kMaxDuration, "s");
  return std::nullopt;
}

OptionalError validatePath(const BodySpec& body) {
  if (body.keys.size() < 2 || body.keys.size() > kMaxPathKeys)
    return "keys: a path needs 2 to " + std::to_string(kMaxPathKeys) + " keys";
  if (body.keys.front().time != 0) return "keys: the first time must be 0";
  double last = -1;
  for (const PathKey& key : body.keys) {
    if (!(key.time > last)) return "keys: times must ascend";
    last = key.time;
    if (auto error = validateFieldRange("time", key.time, 0, kMaxDuration, "s")) return error;
    if (auto error = validateFieldVector("offset", key.offset)) return error;
    if (auto error =
            validateFieldRange("turn", key.angle, -kMaxSpecNumber, kMaxSpecNumber, "radians"))
      return error;
  }
  const PathKey &first = body.keys.front(), &end = body.keys.back();
  const bool closed = (first.offset - end.offset).cwiseAbs().maxCoeff() <= kLoopClosureTolerance;
  if (body.loops && !closed) return "keys: a path that loops must end where it begins";
  const double revolutions = (end.angle - first.angle) / (2 * std::numbers::pi);
  if (body.loops && std::abs(revolutions - std::round(revolutions)) > kLoopClosureTolerance)
    return "keys: a path that loops must end with its initial rotation, or whole turns from it";
  return std::nullopt;
}

OptionalError validatePhysicalProperties(const BodySpec& body) {
  if (auto error = validateFieldRange("density", body.density, 1e-3, kMaxDensity, "kg/m3"))
    return error;
  if (body.mass) {
    if (auto error = validateFieldRange("mass", *body.mass, 1e-6, 1e9, "kg")) return error;
  }
  if (auto error = validateFieldRange("friction", body.friction, 0, 100)) return error;
  for (int i = 0; i < 3; ++i) {
    if (auto error = validateFieldRange("velocity", body.velocity[i], -kMaxSpeed, kMaxSpeed, "m/s"))
      return error;
    if (auto error =
            validateFieldRange("spin", body.angularVelocity[i], -kMaxSpeed, kMaxSpeed, "radians/s"))
      return error;
  }
  return validateFieldRange("restitution", body.restitution, 0, 1);
}

}  // namespace

std::pair<double, double> getJointLimits(const BodySpec& spec) {
  if (getTraits(spec.kind).takesKeys) return {0, spec.keys.back().time};
  return {spec.low, spec.high};
}

double findOpenLimit(const BodySpec& spec) {
  const auto [low, high] = getJointLimits(spec);
  return high - spec.closedPosition >= spec.closedPosition - low ? high : low;
}

double computeMotionSeconds(const BodySpec& spec, double distance) {
  if (distance == 0) return 0;
  // Accelerated and decelerated motion takes no longer than that of both phases one after another.
  return std::abs(distance) / spec.speed +
         (spec.acceleration > 0 ? spec.speed / spec.acceleration : 0);
}

double computeMaxPointSpeed(const BodySpec& spec, double radius) {
  if (getTraits(spec.kind).rotates) return radius;
  if (!getTraits(spec.kind).takesKeys) return 1;
  double maxSpeed = 0;
  for (std::size_t i = 1; i < spec.keys.size(); ++i) {
    const PathKey &from = spec.keys[i - 1], &to = spec.keys[i];
    const double distance =
        (to.offset - from.offset).norm() + std::abs(to.angle - from.angle) * radius;
    maxSpeed = std::max(maxSpeed, distance / (to.time - from.time));
  }
  return maxSpeed;
}

const char* toString(BodySource source) {
  switch (source) {
    case BodySource::sidecar:
      return "sidecar";
    case BodySource::khr:
      return "khr";
    case BodySource::extras:
      return "extras";
    case BodySource::suffix:
      return "suffix";
    case BodySource::ifc:
      return "ifc";
  }
  return "unknown";
}

std::optional<std::string> validateSpeed(double speed) {
  if (!(speed > 0)) return "speed must be above 0";
  return validateFieldRange("speed", speed, 0, kMaxSpeed);
}

std::optional<std::string> validateBody(const BodySpec& body) {
  if (auto error = validateFieldVector("anchor", body.anchor)) return error;
  if (!isKinematic(body.kind)) return validatePhysicalProperties(body);
  if (!(std::abs(body.axis.norm() - 1) <= kAxisLengthTolerance))
    return "axis must have unit length";
  if (auto error = validateSpeed(body.speed)) return error;
  if (auto error = validateFieldRange("acceleration", body.acceleration, 0, kMaxSpecNumber))
    return error;
  return getTraits(body.kind).takesKeys ? validatePath(body) : validateLimits(body);
}

}  // namespace enfilade::scene
