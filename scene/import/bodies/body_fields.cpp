#include "scene/import/bodies/body_fields.hpp"

#include <algorithm>

namespace enfilade::scene {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295;

void allow(const JsonPlace& place, std::vector<const char*> keys,
           const std::vector<const char*>& more) {
  keys.insert(keys.end(), more.begin(), more.end());
  allowOnly(place, keys);
}

/// `scale` is radians per degree for what turns.
void readMotion(const JsonPlace& place, BodySpec& body, double scale) {
  if (place.has("limits")) {
    const std::vector<double> limits = numbersOf(place.at("limits"));
    if (limits.size() != 2) place.at("limits").fail("must be two numbers");
    body.low = scale * limits[0];
    body.high = scale * limits[1];
  }
  if (place.has("closed")) body.closed = scale * numberOf(place.at("closed"));
  if (place.has("speed")) body.speed = scale * numberOf(place.at("speed"));
  if (place.has("acceleration")) body.acceleration = scale * numberOf(place.at("acceleration"));
  if (place.has("closes_after")) body.closesAfter = numberOf(place.at("closes_after"));
  if (!place.has("opened_by")) return;
  const std::string by = textOf(place.at("opened_by"));
  if (by != "touch" && by != "command")
    place.at("opened_by").fail("must be \"touch\" or \"command\"");
  body.openedBy = by == "touch" ? OpenedBy::touch : OpenedBy::command;
}

BodyFields readAxis(const JsonPlace& place, BodySpec& body) {
  BodyFields fields;
  if ((fields.axis = place.has("axis"))) {
    const Vec3 axis = vectorOf(place.at("axis"));
    if (!(axis.norm() > 1e-6) || !axis.allFinite()) place.at("axis").fail("has no direction");
    body.axis = axis.normalized();
  }
  if ((fields.anchor = place.has("anchor"))) body.anchor = vectorOf(place.at("anchor"));
  return fields;
}

const std::vector<const char*> kDoorKeys{"anchor", "axis",         "limits",       "closed",
                                         "speed",  "acceleration", "closes_after", "opened_by"};

void readHinged(const JsonPlace& place, BodySpec& body) {
  body.high = 90 * kRadiansPerDegree;
  body.speed = 90 * kRadiansPerDegree;
  readMotion(place, body, kRadiansPerDegree);
}

void readSliding(const JsonPlace& place, BodySpec& body, bool hasAxis) {
  if (!place.has("limits")) place.fail("limits is missing: [from, to] in metres along the axis");
  if (!hasAxis) body.axis = Vec3::UnitX();
  readMotion(place, body, 1);
}

void readLift(const JsonPlace& place, BodySpec& body) {
  if (!place.has("stops"))
    place.fail("stops is missing: a list of metres along the axis, as [0,3]");
  body.stops = numbersOf(place.at("stops"));
  for (const double stop : body.stops) {
    body.low = std::min(body.low, stop);
    body.high = std::max(body.high, stop);
  }
  readMotion(place, body, 1);
}

PathKey keyOf(const JsonPlace& place) {
  allowOnly(place, {"time", "offset", "turn"});
  PathKey key;
  if (!place.has("time")) place.fail("time is missing: seconds since the path began");
  key.time = numberOf(place.at("time"));
  if (place.has("offset")) key.offset = vectorOf(place.at("offset"));
  if (place.has("turn")) key.turn = kRadiansPerDegree * numberOf(place.at("turn"));
  return key;
}

void readPath(const JsonPlace& place, BodySpec& body) {
  if (!place.has("keys") || !place.at("keys").value.is_array())
    place.fail("keys is missing: a list of {\"time\":s,\"offset\":[x,y,z],\"turn\":degrees}");
  const JsonPlace keys = place.at("keys");
  for (std::size_t i = 0; i < keys.value.size(); ++i) body.keys.push_back(keyOf(keys.at(i)));
  if (place.has("speed")) body.speed = numberOf(place.at("speed"));
  if (place.has("loops")) body.loops = truthOf(place.at("loops"));
  if (place.has("runs")) body.runs = truthOf(place.at("runs"));
}

void readRigid(const JsonPlace& place, BodySpec& body) {
  if (place.has("density") && place.has("mass"))
    place.fail("has a density and a mass: one follows from the other");
  if (place.has("density")) body.density = numberOf(place.at("density"));
  if (place.has("mass")) body.mass = numberOf(place.at("mass"));
  if (place.has("friction")) body.friction = numberOf(place.at("friction"));
  if (place.has("restitution")) body.restitution = numberOf(place.at("restitution"));
}

}  // namespace

BodyKind kindOf(const JsonPlace& place) {
  const std::string word = textOf(place.at("kind"));
  for (const BodyKind kind : {BodyKind::hinged, BodyKind::sliding, BodyKind::lift, BodyKind::path,
                              BodyKind::rigid, BodyKind::trigger})
    if (word == wordOf(kind)) return kind;
  place.at("kind").fail("must be hinged, sliding, lift, path, rigid or trigger, not \"" + word +
                        "\"");
}

BodyFields readBodyFields(const JsonPlace& place, std::vector<const char*> more, BodySpec& body) {
  more.insert(more.end(), {"name", "kind"});
  BodyFields fields;
  switch (body.kind) {
    case BodyKind::hinged:
      allow(place, kDoorKeys, more);
      fields = readAxis(place, body);
      readHinged(place, body);
      break;
    case BodyKind::sliding:
      allow(place, kDoorKeys, more);
      fields = readAxis(place, body);
      readSliding(place, body, fields.axis);
      break;
    case BodyKind::lift:
      allow(place, {"axis", "stops", "speed", "acceleration"}, more);
      fields = readAxis(place, body);
      readLift(place, body);
      break;
    case BodyKind::path:
      allow(place, {"anchor", "axis", "keys", "speed", "loops", "runs"}, more);
      fields = readAxis(place, body);
      readPath(place, body);
      break;
    case BodyKind::rigid:
      allow(place, {"density", "mass", "friction", "restitution"}, more);
      readRigid(place, body);
      break;
    case BodyKind::trigger:
      allow(place, {}, more);
      break;
  }
  return fields;
}

}  // namespace enfilade::scene
