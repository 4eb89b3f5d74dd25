// Parses one line of a script, a JSON object, into a command. All checks that need no world happen
// here, so that an invalid script is reported before the first tick.
#include "protocol/script/script_line.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "protocol/json_depth.hpp"
#include "protocol/nearest_word.hpp"
#include "protocol/script/line_error.hpp"
#include "protocol/script/script_values.hpp"

namespace enfilade::protocol {

namespace {

using nlohmann::json;

constexpr double kMaxWait = 1e6;          // seconds; longer waits are typing errors
constexpr double kMaxAvatarWait = 86400;  // seconds
constexpr std::size_t kMaxBodyNameLength = 1000;
constexpr double kRadiansPerDegree = 0.017453292519943295;  // as in the sidecar reader
// Limits of all worlds (scene/world/data/validation.cpp). A world's own limits may be lower.
constexpr double kMaxSpeed = 1000;  // metres per second
constexpr double kMaxDegrees = 1e6;
constexpr double kMaxJointValue = 1000;  // radians or metres
// Degrees per second. The world also limits the speed of the body's farthest point.
constexpr double kMaxRotationSpeed = 1e6;
constexpr double kMaxJointSpeed = 20;  // radians or metres per second
constexpr double kMaxTurnRate = 1145;  // degrees per second: as the joints

/// `"points":[[x,y,z],...]` or `"box":[[x,y,z],[x,y,z]]`.
void readPart(const json& part, const std::string& field, v1::ConvexPart* into) {
  const bool points = part.is_object() && part.contains("points");
  const char* key = points ? "points" : "box";
  const std::string partField = field + "." + key;
  if (!part.is_object() || points == part.contains("box")) {
    refuse(field, R"(must have either "points":[[x,y,z],...] or "box":[[x,y,z],[x,y,z]])");
  }
  const json& corners = part[key];
  if (!corners.is_array() || corners.empty() || (!points && corners.size() != 2)) {
    refuse(partField, std::string("must be ") + (points ? "a list of" : "two") +
                          " points [x,y,z], not " + makeExcerpt(corners));
  }
  if (!points) {
    readPoint(corners[0], partField + "[0]", into->mutable_box()->mutable_min());
    readPoint(corners[1], partField + "[1]", into->mutable_box()->mutable_max());
    return;
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    readPoint(corners[i], partField + "[" + std::to_string(i) + "]", into->add_points());
  }
}

void readParts(const json& parts, v1::Spawn* spawn) {
  if (!parts.is_array()) refuse("parts", "must be a list, not " + makeExcerpt(parts));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    readPart(parts[i], "parts[" + std::to_string(i) + "]", spawn->add_parts());
  }
}

void readJoint(const json& link, const std::string& field, v1::Joint* joint) {
  const std::string kind =
      link.contains("joint") && link["joint"].is_string() ? link["joint"].get<std::string>() : "";
  if (kind != "revolute" && kind != "prismatic") {
    refuse(field + ".joint", R"(must be "revolute" or "prismatic")");
  }
  joint->set_kind(kind == "revolute" ? v1::Joint::KIND_REVOLUTE : v1::Joint::KIND_PRISMATIC);
  readPoint(requireKey(link, "axis", R"("axis":[x,y,z])"), field + ".axis", joint->mutable_axis());
  if (link.contains("anchor"))
    readPoint(link["anchor"], field + ".anchor", joint->mutable_anchor());
  if (!link.contains("limits")) return;
  const json& limits = link["limits"];
  if (!limits.is_array() || limits.size() != 2) {
    refuse(field + ".limits", "must be two numbers [low, high], not " + makeExcerpt(limits));
  }
  const char* what = "radians or metres";
  joint->set_low(
      parseNumberInRange(limits[0], field + ".limits[0]", what, -kMaxJointValue, kMaxJointValue));
  joint->set_high(
      parseNumberInRange(limits[1], field + ".limits[1]", what, joint->low(), kMaxJointValue));
}

void readLink(const json& link, const std::string& field, v1::Link* into) {
  static const std::set<std::string> keys{"parent", "joint",  "anchor", "axis",
                                          "limits", "points", "box",    "value"};
  if (!link.is_object()) refuse(field, "must be an object, not " + makeExcerpt(link));
  for (const auto& [key, value] : link.items()) {
    if (!keys.contains(key)) refuse(field, makeExcerpt(key) + " is not a key of a link");
  }
  if (link.contains("parent")) {
    const json& parent = link["parent"];
    if (!parent.is_number_integer()) {
      refuse(field + ".parent",
             "must be the number of an earlier link, from 0, or -1 for the base");
    }
    into->set_parent(static_cast<std::int32_t>(
        parseNumberInRange(parent, field + ".parent", "the number of an earlier link", -1, 1000)));
  }
  readJoint(link, field, into->mutable_joint());
  readPart(link, field, into->mutable_part());
  if (link.contains("value")) {
    into->set_value(parseNumberInRange(link["value"], field + ".value", "radians or metres",
                                       -kMaxJointValue, kMaxJointValue));
  }
}

void readLinks(const json& links, v1::Spawn* spawn) {
  if (!links.is_array()) refuse("links", "must be a list, not " + makeExcerpt(links));
  for (std::size_t i = 0; i < links.size(); ++i) {
    readLink(links[i], "links[" + std::to_string(i) + "]", spawn->add_links());
  }
}

void readSpawn(const json& line, v1::Spawn* spawn) {
  readPoint(requireKey(line, "at", R"("at":[x,y,z], the position of the feet)"), "at",
            spawn->mutable_at());
  if (line.contains("facing")) {
    spawn->set_facing(parseNumberInRange(line["facing"], "facing", "a number of degrees",
                                         -kMaxDegrees, kMaxDegrees));
  }
  if (line.contains("radius")) {
    spawn->set_radius(parseNumberInRange(line["radius"], "radius", "a number of metres", 0.05, 5));
  }
  if (line.contains("height")) {
    spawn->set_height(parseNumberInRange(line["height"], "height", "a number of metres", 0.2, 10));
  }
  if (line.contains("flying")) spawn->set_flying(parseFlag(line["flying"], "flying"));
  if (line.contains("parts")) readParts(line["parts"], spawn);
  if (line.contains("links")) readLinks(line["links"], spawn);
  if (line.contains("self_contact")) {
    spawn->set_self_contact(parseFlag(line["self_contact"], "self_contact"));
  }
}

double readSpeed(const json& line) {
  return parseNumberInRange(line["speed"], "speed", "a number of metres per second", 0, kMaxSpeed,
                            true);
}

void readWalk(const json& line, v1::Walk* walk) {
  const bool to = line.contains("to");
  if (to == line.contains("along")) {
    refuse("to", to ? "cannot be combined with \"along\"; keep one of them"
                    : R"(is missing; add "to":[x,y,z] or "along":[[x,y,z],...])");
  }
  if (to) {
    readPoint(line["to"], "to", walk->add_along());
  } else {
    const json& along = line["along"];
    if (!along.is_array() || along.empty()) {
      refuse("along", "must be a list of points [[x,y,z],...], not " + makeExcerpt(along));
    }
    for (std::size_t i = 0; i < along.size(); ++i) {
      readPoint(along[i], "along[" + std::to_string(i) + "]", walk->add_along());
    }
  }
  if (line.contains("speed")) walk->set_speed(readSpeed(line));
  if (!line.contains("opens")) return;
  const json& opens = line["opens"];
  if (!opens.is_array()) refuse("opens", "must be a list of doors, not " + makeExcerpt(opens));
  for (const json& door : opens) {
    if (!door.is_string()) refuse("opens", "must list names of doors, not " + makeExcerpt(door));
    walk->add_opens(door.get<std::string>());
  }
}

void readGo(const json& line, v1::Go* go) {
  const json& to = requireKey(line, "to", R"("to":[x,y,z] or "to":"room:NAME")");
  if (to.is_string()) {
    if (to.get<std::string>().empty())
      refuse("to", "must name a room, a storey, an object or a body");
    go->mutable_to()->set_name(to.get<std::string>());
  } else {
    readPoint(to, "to", go->mutable_to()->mutable_point());
  }
  if (line.contains("speed")) go->set_speed(readSpeed(line));
  if (line.contains("drop"))
    go->set_max_drop(parseNumberInRange(line["drop"], "drop", "a number of metres", 0, 10));
  if (line.contains("lifts")) go->set_lifts(parseFlag(line["lifts"], "lifts"));
  if (!line.contains("doors")) return;
  if (line["doors"] == "open")
    go->set_doors(v1::NavigationQuery::DOORS_OPEN);
  else if (line["doors"] != "as_they_are")
    refuse("doors", R"(must be "open" or "as_they_are", not )" + makeExcerpt(line["doors"]));
}

void readLook(const json& line, v1::Look* look) {
  readPoint(requireKey(line, "at", R"("at":[x,y,z], a point to look at)"), "at",
            look->mutable_at());
}

double readWaitSeconds(const json& line) {
  const double maxSeconds = line.contains("for") ? kMaxAvatarWait : kMaxWait;
  return parseNumberInRange(line["wait"], "wait", "a number of seconds", 0, maxSeconds);
}

void readCapture(const json& line, v1::Capture* capture) {
  capture->set_as(parseName(requireKey(line, "as", R"("as":"name", the file name of the picture)"),
                            "as",
                            "a file "
                            "name"));
}

void readJump(const json& line, v1::Jump* jump) {
  if (line.contains("height")) {
    jump->set_height(
        parseNumberInRange(line["height"], "height", "a number of metres", 0, 1000, true));
  }
  if (line.contains("velocity")) readPoint(line["velocity"], "velocity", jump->mutable_velocity());
}

void readCrouch(const json& line, v1::Crouch* crouch) {
  const json& height =
      requireKey(line, "height", R"("height":metres, lower than the spawn height)");
  crouch->set_height(parseNumberInRange(height, "height", "a number of metres", 0, 10, true));
}

void readJoints(const json& line, v1::DriveJoints* joints) {
  const json& to = requireKey(line, "to", R"("to":[values, null for a joint that stays])");
  if (!to.is_array() || to.empty()) {
    refuse("to", "must be a list of numbers, one per joint, not " + makeExcerpt(to));
  }
  for (std::size_t i = 0; i < to.size(); ++i) {
    v1::DriveJoints::Target& target = *joints->add_to();
    if (to[i].is_null()) continue;
    target.set_value(parseNumberInRange(to[i], "to[" + std::to_string(i) + "]",
                                        "radians or metres, or null", -kMaxJointValue,
                                        kMaxJointValue));
  }
  if (line.contains("speed")) {
    joints->set_speed(parseNumberInRange(line["speed"], "speed", "radians or metres per second", 0,
                                         kMaxJointSpeed, true));
  }
}

double readDegrees(const json& value, const char* key) {
  return parseNumberInRange(value, key, "a number of degrees", -kMaxDegrees, kMaxDegrees);
}

void readTurn(const json& line, v1::Turn* turn) {
  if (line.contains("by") == line.contains("facing"))
    refuse("by", line.contains("by") ? "cannot be combined with \"facing\"; keep one of them"
                                     : R"(is missing; add "by":degrees or "facing":degrees)");
  if (line.contains("by")) turn->set_by(readDegrees(line["by"], "by"));
  if (line.contains("facing")) turn->set_facing(readDegrees(line["facing"], "facing"));
  if (line.contains("rate"))
    turn->set_rate(parseNumberInRange(line["rate"], "rate", "a number of degrees per second", 0,
                                      kMaxTurnRate, true));
}

void readTeleport(const json& line, v1::Teleport* teleport) {
  readPoint(requireKey(line, "at", R"("at":[x,y,z], the new position)"), "at",
            teleport->mutable_at());
  if (line.contains("facing")) teleport->set_facing(readDegrees(line["facing"], "facing"));
}

struct Verb {
  const char* name;
  std::vector<const char*> keys;  ///< other keys than the verb
};

const std::vector<Verb>& listVerbs() {
  static const std::vector<Verb> all{
      {"spawn", {"at", "facing", "radius", "height", "flying", "parts", "links", "self_contact"}},
      {"walk", {"to", "along", "speed", "opens"}},
      {"go", {"to", "speed", "doors", "drop", "lifts"}},
      {"look", {"at"}},
      {"wait", {"for"}},
      {"capture", {"as"}},
      {"leave", {}},
      {"jump", {"height", "velocity"}},
      {"fly", {"on"}},
      {"crouch", {"height"}},
      {"stand", {}},
      {"joints", {"to", "speed"}},
      {"turn", {"by", "facing", "rate"}},
      {"teleport", {"at", "facing"}},
      {"body", {"do", "to", "turn", "level", "speed", "turn_speed"}}};
  return all;
}

std::string listVerbNames() {
  std::string names;
  for (const Verb& verb : listVerbs())
    names += (names.empty() ? "" : ", ") + std::string(verb.name);
  return names;
}

/// Names the verb that a key of the line probably means.
[[noreturn]] void refuseWithoutVerb(const json& line) {
  std::vector<std::string> names;
  for (const Verb& verb : listVerbs()) names.emplace_back(verb.name);
  for (const auto& [key, value] : line.items()) {
    const std::string nearest = findNearestWord(key, names);
    if (!nearest.empty() && key != "avatar")
      refuse("", makeExcerpt(key) + " is not a command; did you mean \"" + nearest + "\"?");
  }
  refuse("", "no command; a line needs one of " + listVerbNames());
}

/// Whether the line has a verb to which this one is a key, as "turn" to "body".
bool isKeyOfOther(const json& line, const Verb& verb) {
  return std::ranges::any_of(listVerbs(), [&](const Verb& other) {
    return line.contains(other.name) &&
           std::ranges::any_of(other.keys,
                               [&](const std::string& key) { return key == verb.name; });
  });
}

const Verb& findVerb(const json& line) {
  const Verb* found = nullptr;
  for (const Verb& verb : listVerbs()) {
    if (!line.contains(verb.name) || isKeyOfOther(line, verb)) continue;
    if (found) {
      refuse("", std::string("\"") + found->name + "\" and \"" + verb.name +
                     "\" are in one line; write two lines");
    }
    found = &verb;
  }
  if (!found) refuseWithoutVerb(line);
  return *found;
}

void refuseUnknownKeys(const json& line, const Verb& verb) {
  for (const auto& [key, value] : line.items()) {
    const bool known =
        key == verb.name || std::any_of(verb.keys.begin(), verb.keys.end(),
                                        [&, k = key](const char* allowed) { return k == allowed; });
    if (known) continue;
    std::string allowed = verb.name;
    for (const char* other : verb.keys) allowed += std::string(", ") + other;
    refuse("", makeExcerpt(key) + " is not a key of the command " + verb.name + "; its keys are " +
                   allowed);
  }
}

void readOrder(const json& line, const std::string& verb, v1::Command& command) {
  const bool waits = verb == "wait";
  command.set_avatar(parseName(line[waits ? "for" : verb.c_str()], waits ? "for" : verb.c_str(),
                               "the avatar's name"));
  if (verb == "spawn") readSpawn(line, command.mutable_spawn());
  if (verb == "walk") readWalk(line, command.mutable_walk());
  if (verb == "go") readGo(line, command.mutable_go());
  if (verb == "look") readLook(line, command.mutable_look());
  if (waits) command.mutable_wait()->set_seconds(readWaitSeconds(line));
  if (verb == "capture") readCapture(line, command.mutable_capture());
  if (verb == "leave") command.mutable_leave();
  if (verb == "jump") readJump(line, command.mutable_jump());
  if (verb == "fly")
    command.mutable_fly()->set_on(!line.contains("on") || parseFlag(line["on"], "on"));
  if (verb == "crouch") readCrouch(line, command.mutable_crouch());
  if (verb == "stand") command.mutable_crouch();
  if (verb == "joints") readJoints(line, command.mutable_drive_joints());
  if (verb == "turn") readTurn(line, command.mutable_turn());
  if (verb == "teleport") readTeleport(line, command.mutable_teleport());
}

/// Body names may contain all characters, because they come from the file's nodes.
std::string parseBodyName(const json& value) {
  if (!value.is_string())
    refuse("body", "must be a body's name in quotes, not " + makeExcerpt(value));
  const std::string text = value.get<std::string>();
  if (text.empty() || text.size() > kMaxBodyNameLength)
    refuse("body", "must have 1 to " + std::to_string(kMaxBodyNameLength) + " characters");
  return text;
}

void readAction(const json& value, v1::BodyCommand& command) {
  if (value == "open") {
    command.mutable_open();
  } else if (value == "close") {
    command.mutable_close();
  } else if (value == "stop") {
    command.mutable_stop();
  } else if (value == "run") {
    command.mutable_run();
  } else {
    refuse("do", R"(must be "open", "close", "stop" or "run", not )" + makeExcerpt(value));
  }
}

void readBodySpeed(const json& line, v1::BodyCommand& command) {
  const bool isRotation = line.contains("turn_speed");
  if (isRotation && line.contains("speed"))
    refuse("speed", R"(conflicts with "turn_speed"; keep one)");
  if (!isRotation && !line.contains("speed")) return;
  const char* key = isRotation ? "turn_speed" : "speed";
  const double maxSpeed = isRotation ? kMaxRotationSpeed : kMaxSpeed;
  const char* what =
      isRotation ? "a number of degrees per second" : "a number of metres per second";
  const double speed = parseNumberInRange(line[key], key, what, 0, maxSpeed, true);
  command.set_speed(isRotation ? kRadiansPerDegree * speed : speed);
}

v1::BodyCommand readBodyCommand(const json& line) {
  v1::BodyCommand command;
  command.set_body(parseBodyName(line["body"]));
  int keyCount = 0;
  for (const char* key : {"do", "to", "turn", "level"}) keyCount += line.contains(key) ? 1 : 0;
  if (keyCount != 1) refuse("body", R"(needs one of "do", "to", "turn" and "level")");
  if (line.contains("to")) {
    command.set_to(parseNumber(line["to"], "to", "a number of metres, or of seconds of a path"));
  } else if (line.contains("turn")) {
    command.set_to(kRadiansPerDegree * parseNumber(line["turn"], "turn", "a number of degrees"));
  } else if (line.contains("level")) {
    const json& level = line["level"];
    if (!level.is_number_integer() || level < 0 || level > 10000)
      refuse("level", "must be a whole number from 0 to 10000, not " + makeExcerpt(level));
    command.set_level(level.get<std::uint32_t>());
  } else {
    readAction(line["do"], command);
  }
  readBodySpeed(line, command);
  return command;
}

// ---- lines -------------------------------------------------------------------------------------

/// Parses the object of a line. Equal keys are refused, where nlohmann would keep the last.
json parseObject(std::string_view text) {
  std::set<std::string> keys;
  std::string repeated;
  const auto watch = [&](int depth, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::key && depth == 1 &&
        !keys.insert(parsed.get<std::string>()).second) {
      repeated = parsed.get<std::string>();
    }
    return true;
  };
  json line;
  try {
    line = json::parse(text, watch);
  } catch (const json::out_of_range&) {
    refuse("", "a number exceeds the range of a double; use metres, seconds and degrees");
  } catch (const json::parse_error& problem) {
    refuse("", "is not JSON at column " + std::to_string(problem.byte) +
                   R"(; write one object per line, for example {"wait":1}, with finite numbers)");
  }
  if (!line.is_object()) {
    refuse("", "must be an object, for example {\"wait\":1}, not " + makeExcerpt(line));
  }
  if (!repeated.empty()) refuse(repeated, "occurs twice in one line; keep one");
  return line;
}

}  // namespace

void checkUtf8(std::string_view text) {
  // nlohmann treats a zero byte as the end of the text.
  if (text.find('\0') != std::string_view::npos) refuse("", "has a zero byte; is it a text file?");
  try {
    static_cast<void>(json(std::string(text)).dump());
  } catch (const json::type_error&) {
    refuse("", "is not UTF-8; save the script as UTF-8");
  }
}

ScriptAction parseLine(std::string_view text, std::uint32_t number) {
  const json line = parseObject(text);
  const Verb& verb = findVerb(line);
  refuseUnknownKeys(line, verb);
  if (verb.name == std::string_view("wait") && !line.contains("for")) {
    return GlobalWait{readWaitSeconds(line)};
  }
  if (verb.name == std::string_view("body")) return readBodyCommand(line);
  v1::Command command;
  command.set_tag(number);
  readOrder(line, verb.name, command);
  return command;
}

}  // namespace enfilade::protocol
