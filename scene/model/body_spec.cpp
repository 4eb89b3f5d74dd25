#include "scene/model/body_spec.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "scene/model/model.hpp"

namespace enfilade::scene {
namespace {

constexpr double kFarthest = 1e6;     // metres or radians; more is a slip of the pen
constexpr double kFastest = 1e4;      // per second
constexpr double kLongest = 1e6;      // seconds
constexpr double kUnitLength = 1e-9;  // how far the length of an axis may be off
constexpr double kMostDense = 1e5;    // kg / m^3: five times gold
constexpr double kSameEnd = 1e-9;     // metres, radians: where a loop must close
constexpr std::size_t kMostKeys = 100000;

using Refusal = std::optional<std::string>;

Refusal outside(const char* field, double value, double least, double most) {
  if (value >= least && value <= most) return std::nullopt;
  return std::string(field) + " is " + std::to_string(value) + "; it must lie in " +
         std::to_string(least) + ".." + std::to_string(most);
}

Refusal outside(const char* field, const Vec3& value) {
  for (int i = 0; i < 3; ++i)
    if (auto why = outside(field, value[i], -kFarthest, kFarthest)) return why;
  return std::nullopt;
}

Refusal refusalOfLimits(const BodySpec& body) {
  const bool lift = body.kind == BodyKind::lift;
  const std::string field = lift ? "stops" : "limits";
  if (lift && body.stops.size() < 2) return "stops: a lift has two at least";
  if (std::adjacent_find(body.stops.begin(), body.stops.end(), std::greater_equal<>()) !=
      body.stops.end())
    return "stops must ascend, each once";
  if (!(body.low <= 0 && body.high >= 0))
    return field + ": 0, where it was drawn, must lie between the least and the greatest";
  if (!(body.low < body.high)) return field + ": both are 0: it could not move";
  if (!(body.low >= -kFarthest && body.high <= kFarthest)) return field + ": farther than 1000 km";
  for (const double stop : body.stops)
    if (auto why = outside("stops", stop, body.low, body.high)) return why;
  if (auto why = outside("closed", body.closed, body.low, body.high)) return why;
  if (body.closesAfter) return outside("closes_after", *body.closesAfter, 0, kLongest);
  return std::nullopt;
}

Refusal refusalOfPath(const BodySpec& body) {
  if (body.keys.size() < 2 || body.keys.size() > kMostKeys)
    return "keys: a path has 2 to " + std::to_string(kMostKeys) + " of them";
  if (body.keys.front().time != 0) return "keys: the first one's time must be 0";
  double last = -1;
  for (const PathKey& key : body.keys) {
    if (!(key.time > last)) return "keys: times must ascend";
    last = key.time;
    if (auto why = outside("time", key.time, 0, kLongest)) return why;
    if (auto why = outside("offset", key.offset)) return why;
    if (auto why = outside("turn (in radians)", key.turn, -kFarthest, kFarthest)) return why;
  }
  const PathKey &first = body.keys.front(), &end = body.keys.back();
  const bool closed = (first.offset - end.offset).cwiseAbs().maxCoeff() <= kSameEnd;
  if (body.loops && !closed) return "keys: a path that loops must end where it begins";
  const double turns = (end.turn - first.turn) / (2 * std::numbers::pi);
  if (body.loops && std::abs(turns - std::round(turns)) > kSameEnd)
    return "keys: a path that loops must end turned as it begins, or by whole turns more";
  return std::nullopt;
}

Refusal refusalOfMatter(const BodySpec& body) {
  if (auto why = outside("density", body.density, 1e-3, kMostDense)) return why;
  if (body.mass) {
    if (auto why = outside("mass", *body.mass, 1e-6, 1e9)) return why;
  }
  if (auto why = outside("friction", body.friction, 0, 100)) return why;
  for (int i = 0; i < 3; ++i) {
    if (auto why = outside("velocity", body.velocity[i], -kFastest, kFastest)) return why;
    if (auto why = outside("spin", body.spin[i], -kFastest, kFastest)) return why;
  }
  return outside("restitution", body.restitution, 0, 1);
}

Refusal refusalOf(const BodySpec& body) {
  if (auto why = outside("anchor", body.anchor)) return why;
  if (!isKinematic(body.kind)) return refusalOfMatter(body);
  if (!(std::abs(body.axis.norm() - 1) <= kUnitLength)) return "axis must have unit length";
  if (auto why = refusalOfSpeed(body.speed)) return why;
  if (auto why = outside("acceleration", body.acceleration, 0, kFarthest)) return why;
  return body.kind == BodyKind::path ? refusalOfPath(body) : refusalOfLimits(body);
}

Refusal refusalOfObjects(const BodySpec& body, const Model& model, std::vector<bool>& taken) {
  if (body.objects.empty()) return "objects: it has none";
  for (const std::uint32_t object : body.objects) {
    if (object >= model.objects.size())
      return "objects: there is no object " + std::to_string(object);
    if (taken[object])
      return "objects: '" + model.objects[object].path + "' is in two bodies, or twice in one";
    taken[object] = true;
  }
  return std::nullopt;
}

}  // namespace

std::pair<double, double> limitsOf(const BodySpec& spec) {
  if (spec.kind == BodyKind::path) return {0, spec.keys.back().time};
  return {spec.low, spec.high};
}

double fastestPointOf(const BodySpec& spec, double radius) {
  if (spec.kind == BodyKind::hinged) return radius;
  if (spec.kind != BodyKind::path) return 1;
  double fastest = 0;
  for (std::size_t i = 1; i < spec.keys.size(); ++i) {
    const PathKey &from = spec.keys[i - 1], &to = spec.keys[i];
    const double way = (to.offset - from.offset).norm() + std::abs(to.turn - from.turn) * radius;
    fastest = std::max(fastest, way / (to.time - from.time));
  }
  return fastest;
}

const char* wordOf(BodyKind kind) {
  switch (kind) {
    case BodyKind::hinged:
      return "hinged";
    case BodyKind::sliding:
      return "sliding";
    case BodyKind::lift:
      return "lift";
    case BodyKind::path:
      return "path";
    case BodyKind::rigid:
      return "rigid";
    case BodyKind::trigger:
      return "trigger";
  }
  return "unknown";
}

const char* wordOf(BodySource source) {
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

std::optional<std::string> refusalOfSpeed(double speed) {
  if (!(speed > 0)) return "speed must be above 0";
  return outside("speed", speed, 0, kFastest);
}

std::optional<std::string> refusalOfBody(const BodySpec& body) {
  return refusalOf(body);
}

std::optional<std::string> refusalOfBodies(const Model& model) {
  std::vector<bool> taken(model.objects.size());
  std::set<std::string> names;
  for (const BodySpec& body : model.bodies) {
    Refusal why = refusalOfObjects(body, model, taken);
    if (!why) why = refusalOf(body);
    if (!why && body.name.empty()) why = "name is empty";
    if (!why && !names.insert(body.name).second) why = "name: another body has it";
    if (why) return "body '" + body.name + "': " + *why;
  }
  return std::nullopt;
}

}  // namespace enfilade::scene
