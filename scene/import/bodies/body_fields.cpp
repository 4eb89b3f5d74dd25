#include "scene/import/bodies/body_fields.hpp"

#include <algorithm>

#include "collision/sine_cosine.hpp"

namespace enfilade::scene {
namespace {

using collision::kRadiansPerDegree;

void allowKeys(const JsonCursor& cursor, std::vector<const char*> keys,
               const std::vector<const char*>& more) {
  keys.insert(keys.end(), more.begin(), more.end());
  requireKnownKeys(cursor, keys);
}

/// `scale`: radians per degree for rotations, else 1.
void readMotion(const JsonCursor& cursor, BodySpec& body, double scale) {
  if (cursor.has("limits")) {
    const std::vector<double> limits = readNumbers(cursor.at("limits"));
    if (limits.size() != 2) cursor.at("limits").fail("must be two numbers");
    body.low = scale * limits[0];
    body.high = scale * limits[1];
  }
  if (cursor.has("closed")) body.closedPosition = scale * readNumber(cursor.at("closed"));
  if (cursor.has("speed")) body.speed = scale * readNumber(cursor.at("speed"));
  if (cursor.has("acceleration")) body.acceleration = scale * readNumber(cursor.at("acceleration"));
  if (cursor.has("closes_after")) body.autoCloseDelay = readNumber(cursor.at("closes_after"));
  if (!cursor.has("opened_by")) return;
  const std::string by = readText(cursor.at("opened_by"));
  if (by != "touch" && by != "command")
    cursor.at("opened_by").fail("must be \"touch\" or \"command\"");
  body.openedBy = by == "touch" ? OpenedBy::touch : OpenedBy::command;
}

ExplicitBodyFields readAxis(const JsonCursor& cursor, BodySpec& body) {
  ExplicitBodyFields fields;
  if ((fields.axis = cursor.has("axis"))) {
    const Vec3 axis = readVector(cursor.at("axis"));
    if (!(axis.norm() > 1e-6) || !axis.allFinite()) cursor.at("axis").fail("has no direction");
    body.axis = axis.normalized();
  }
  if ((fields.anchor = cursor.has("anchor"))) body.anchor = readVector(cursor.at("anchor"));
  return fields;
}

const std::vector<const char*> kDoorKeys{"anchor", "axis",         "limits",       "closed",
                                         "speed",  "acceleration", "closes_after", "opened_by"};

void readHinged(const JsonCursor& cursor, BodySpec& body) {
  body.high = 90 * kRadiansPerDegree;
  body.speed = 90 * kRadiansPerDegree;
  readMotion(cursor, body, kRadiansPerDegree);
}

void readSliding(const JsonCursor& cursor, BodySpec& body, bool hasAxis) {
  if (!cursor.has("limits")) cursor.fail("limits is missing: [from, to] in metres along the axis");
  if (!hasAxis) body.axis = Vec3::UnitX();
  readMotion(cursor, body, 1);
}

void readLift(const JsonCursor& cursor, BodySpec& body) {
  if (!cursor.has("stops"))
    cursor.fail("stops is missing: a list of metres along the axis, as [0,3]");
  body.stops = readNumbers(cursor.at("stops"));
  for (const double stop : body.stops) {
    body.low = std::min(body.low, stop);
    body.high = std::max(body.high, stop);
  }
  readMotion(cursor, body, 1);
}

PathKey readJsonPathKey(const JsonCursor& cursor) {
  requireKnownKeys(cursor, {"time", "offset", "turn"});
  PathKey key;
  if (!cursor.has("time")) cursor.fail("time is missing: seconds since the path began");
  key.time = readNumber(cursor.at("time"));
  if (cursor.has("offset")) key.offset = readVector(cursor.at("offset"));
  if (cursor.has("turn")) key.angle = kRadiansPerDegree * readNumber(cursor.at("turn"));
  return key;
}

void readPath(const JsonCursor& cursor, BodySpec& body) {
  if (!cursor.has("keys") || !cursor.at("keys").value.is_array())
    cursor.fail("keys is missing: a list of {\"time\":s,\"offset\":[x,y,z],\"turn\":degrees}");
  const JsonCursor keys = cursor.at("keys");
  for (std::size_t i = 0; i < keys.value.size(); ++i)
    body.keys.push_back(readJsonPathKey(keys.at(i)));
  if (cursor.has("speed")) body.speed = readNumber(cursor.at("speed"));
  if (cursor.has("loops")) body.loops = readBool(cursor.at("loops"));
  if (cursor.has("runs")) body.autoStart = readBool(cursor.at("runs"));
}

void readRigid(const JsonCursor& cursor, BodySpec& body) {
  if (cursor.has("density") && cursor.has("mass"))
    cursor.fail("has a density and a mass: one follows from the other");
  if (cursor.has("density")) body.density = readNumber(cursor.at("density"));
  if (cursor.has("mass")) body.mass = readNumber(cursor.at("mass"));
  if (cursor.has("friction")) body.friction = readNumber(cursor.at("friction"));
  if (cursor.has("restitution")) body.restitution = readNumber(cursor.at("restitution"));
}

}  // namespace

BodyKind readBodyKind(const JsonCursor& cursor) {
  const std::string word = readText(cursor.at("kind"));
  std::string all;
  for (std::uint8_t i = 0; i < kBodyKindCount; ++i) {
    const auto kind = static_cast<BodyKind>(i);
    if (word == toString(kind)) return kind;
    all += (i == 0 ? "" : i + 1 == kBodyKindCount ? " or " : ", ") + std::string(toString(kind));
  }
  cursor.at("kind").fail("must be " + all + ", not \"" + word + "\"");
}

ExplicitBodyFields readBodyFields(const JsonCursor& cursor, std::vector<const char*> more,
                                  BodySpec& body) {
  more.insert(more.end(), {"name", "kind"});
  ExplicitBodyFields fields;
  switch (body.kind) {
    case BodyKind::hinged:
      allowKeys(cursor, kDoorKeys, more);
      fields = readAxis(cursor, body);
      readHinged(cursor, body);
      break;
    case BodyKind::sliding:
      allowKeys(cursor, kDoorKeys, more);
      fields = readAxis(cursor, body);
      readSliding(cursor, body, fields.axis);
      break;
    case BodyKind::lift:
      allowKeys(cursor, {"axis", "stops", "speed", "acceleration"}, more);
      fields = readAxis(cursor, body);
      readLift(cursor, body);
      break;
    case BodyKind::path:
      allowKeys(cursor, {"anchor", "axis", "keys", "speed", "loops", "runs"}, more);
      fields = readAxis(cursor, body);
      readPath(cursor, body);
      break;
    case BodyKind::rigid:
      allowKeys(cursor, {"density", "mass", "friction", "restitution"}, more);
      readRigid(cursor, body);
      break;
    case BodyKind::trigger:
      allowKeys(cursor, {}, more);
      break;
  }
  return fields;
}

}  // namespace enfilade::scene
