// One line of a script: a JSON object becomes a command. What does not depend on the world is
// judged here, so that a bad script is told before anything moves.
#include "protocol/script/script_line.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <utility>

#include "protocol/json_depth.hpp"

namespace enfilade::protocol {

void refuse(std::string_view field, const std::string& text) {
  throw LineProblem{field.empty() ? text : std::string(field) + ": " + text};
}

namespace {

using nlohmann::json;

constexpr std::size_t kLongestName = 64;
constexpr double kLongestWait = 1e6;         // seconds; eleven days are a slip of the pen
constexpr double kLongestWaitOfOne = 86400;  // seconds
constexpr std::size_t kLongestBodyName = 1000;
constexpr double kRadiansPerDegree = 0.017453292519943295;  // as the sidecar's reader has it
constexpr std::size_t kLongestQuote = 40;
// What a world takes at most (scene/world/avatars/order_validation.cpp); its own limits may be
// lower.
constexpr double kFarthest = 1e7;  // metres
constexpr double kFastest = 1000;  // metres per second
constexpr double kMostDegrees = 1e6;
constexpr double kMostJoint = 1000;  // radians or metres
// Degrees per second: how fast a body's farthest point then is, the world knows and bounds.
constexpr double kFastestTurn = 1e6;
constexpr double kFastestJoint = 20;  // radians or metres per second

/// A value as the script has it, cut to fit a message.
std::string excerpt(const json& value) {
  if (isDeeper(value, kDeepestNest)) return "so deep a nest of lists";
  std::string text = value.dump();
  if (text.size() > kLongestQuote) {
    std::size_t cut = kLongestQuote;
    while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xC0u) == 0x80u) --cut;
    text = text.substr(0, cut) + "...";
  }
  return text;
}

// ---- values ------------------------------------------------------------------------------------

double number(const json& value, std::string_view field, const char* what) {
  if (!value.is_number()) {
    refuse(field, "must be " + std::string(what) + ", not " + excerpt(value));
  }
  return value.get<double>();
}

/// A number from `low` to `high`; `low` itself is refused where `above` is set.
double within(const json& value, std::string_view field, const char* what, double low, double high,
              bool above = false) {
  const double read = number(value, field, what);
  if (read <= high && (above ? read > low : read >= low)) return read;
  refuse(field, excerpt(value) + " is out of range; use " + (above ? "more than " : "") +
                    json(low).dump() + " to " + json(high).dump());
}

bool flag(const json& value, std::string_view field) {
  if (!value.is_boolean()) refuse(field, "must be true or false, not " + excerpt(value));
  return value.get<bool>();
}

void readPoint(const json& value, const std::string& field, v1::Vec3* point) {
  static constexpr std::array<const char*, 3> axes{"x", "y", "z"};
  if (!value.is_array() || value.size() != axes.size()) {
    refuse(field, "must be three numbers [x, y, z] in metres, not " + excerpt(value));
  }
  std::array<double, 3> xyz{};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    xyz[i] = within(value[i], field + "." + axes[i], "a number of metres", -kFarthest, kFarthest);
  }
  point->set_x(xyz[0]);
  point->set_y(xyz[1]);
  point->set_z(xyz[2]);
}

bool isNameLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-';
}

std::string name(const json& value, std::string_view field, const char* what) {
  if (!value.is_string()) {
    refuse(field, "must be " + std::string(what) + " in quotes, not " + excerpt(value));
  }
  std::string text = value.get<std::string>();
  if (text.empty()) refuse(field, "is empty; give " + std::string(what));
  if (text.size() > kLongestName) {
    refuse(field, "has " + std::to_string(text.size()) + " letters; at most " +
                      std::to_string(kLongestName) + " are allowed");
  }
  if (!std::all_of(text.begin(), text.end(), isNameLetter) || text.front() == '.') {
    refuse(field, excerpt(value) +
                      " has a letter that is not allowed; use A-Z, a-z, 0-9, '_', '-' and, but "
                      "not first, '.'");
  }
  return text;
}

const json& required(const json& line, const char* key, const char* example) {
  const auto found = line.find(key);
  if (found == line.end()) refuse(key, std::string("is missing; add ") + example);
  return *found;
}

// ---- the verbs ---------------------------------------------------------------------------------

/// `"points":[[x,y,z],...]` or `"box":[[x,y,z],[x,y,z]]`.
void readPart(const json& part, const std::string& field, v1::ConvexPart* into) {
  const bool points = part.is_object() && part.contains("points");
  const char* key = points ? "points" : "box";
  const std::string inside = field + "." + key;
  if (!part.is_object() || points == part.contains("box")) {
    refuse(field, R"(must have either "points":[[x,y,z],...] or "box":[[x,y,z],[x,y,z]])");
  }
  const json& corners = part[key];
  if (!corners.is_array() || corners.empty() || (!points && corners.size() != 2)) {
    refuse(inside, std::string("must be ") + (points ? "a list of" : "two") +
                       " points [x,y,z], not " + excerpt(corners));
  }
  if (!points) {
    readPoint(corners[0], inside + "[0]", into->mutable_box()->mutable_min());
    readPoint(corners[1], inside + "[1]", into->mutable_box()->mutable_max());
    return;
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    readPoint(corners[i], inside + "[" + std::to_string(i) + "]", into->add_points());
  }
}

void readParts(const json& parts, v1::Spawn* spawn) {
  if (!parts.is_array()) refuse("parts", "must be a list, not " + excerpt(parts));
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
  readPoint(required(link, "axis", R"("axis":[x,y,z])"), field + ".axis", joint->mutable_axis());
  if (link.contains("anchor"))
    readPoint(link["anchor"], field + ".anchor", joint->mutable_anchor());
  if (!link.contains("limits")) return;
  const json& limits = link["limits"];
  if (!limits.is_array() || limits.size() != 2) {
    refuse(field + ".limits", "must be two numbers [low, high], not " + excerpt(limits));
  }
  const char* what = "radians or metres";
  joint->set_low(within(limits[0], field + ".limits[0]", what, -kMostJoint, kMostJoint));
  joint->set_high(within(limits[1], field + ".limits[1]", what, joint->low(), kMostJoint));
}

void readLink(const json& link, const std::string& field, v1::Link* into) {
  static const std::set<std::string> keys{"parent", "joint",  "anchor", "axis",
                                          "limits", "points", "box",    "value"};
  if (!link.is_object()) refuse(field, "must be an object, not " + excerpt(link));
  for (const auto& [key, value] : link.items()) {
    if (!keys.contains(key)) refuse(field, excerpt(key) + " is no key of a link");
  }
  if (link.contains("parent")) {
    const json& parent = link["parent"];
    if (!parent.is_number_integer()) {
      refuse(field + ".parent",
             "must be the number of an earlier link, from 0, or -1 for the base");
    }
    into->set_parent(static_cast<std::int32_t>(
        within(parent, field + ".parent", "the number of an earlier link", -1, 1000)));
  }
  readJoint(link, field, into->mutable_joint());
  readPart(link, field, into->mutable_part());
  if (link.contains("value")) {
    into->set_value(
        within(link["value"], field + ".value", "radians or metres", -kMostJoint, kMostJoint));
  }
}

void readLinks(const json& links, v1::Spawn* spawn) {
  if (!links.is_array()) refuse("links", "must be a list, not " + excerpt(links));
  for (std::size_t i = 0; i < links.size(); ++i) {
    readLink(links[i], "links[" + std::to_string(i) + "]", spawn->add_links());
  }
}

void readSpawn(const json& line, v1::Spawn* spawn) {
  readPoint(required(line, "at", R"("at":[x,y,z], the place of the feet)"), "at",
            spawn->mutable_at());
  if (line.contains("facing")) {
    spawn->set_facing(
        within(line["facing"], "facing", "a number of degrees", -kMostDegrees, kMostDegrees));
  }
  if (line.contains("radius")) {
    spawn->set_radius(within(line["radius"], "radius", "a number of metres", 0.05, 5));
  }
  if (line.contains("height")) {
    spawn->set_height(within(line["height"], "height", "a number of metres", 0.2, 10));
  }
  if (line.contains("flying")) spawn->set_flying(flag(line["flying"], "flying"));
  if (line.contains("parts")) readParts(line["parts"], spawn);
  if (line.contains("links")) readLinks(line["links"], spawn);
  if (line.contains("self_contact")) {
    spawn->set_self_contact(flag(line["self_contact"], "self_contact"));
  }
}

void readWalk(const json& line, v1::Walk* walk) {
  const bool to = line.contains("to");
  if (to == line.contains("along")) {
    refuse("to", to ? "stands beside \"along\"; keep one of them"
                    : R"(is missing; add "to":[x,y,z] or "along":[[x,y,z],...])");
  }
  if (to) {
    readPoint(line["to"], "to", walk->add_along());
  } else {
    const json& along = line["along"];
    if (!along.is_array() || along.empty()) {
      refuse("along", "must be a list of points [[x,y,z],...], not " + excerpt(along));
    }
    for (std::size_t i = 0; i < along.size(); ++i) {
      readPoint(along[i], "along[" + std::to_string(i) + "]", walk->add_along());
    }
  }
  if (line.contains("speed")) {
    walk->set_speed(
        within(line["speed"], "speed", "a number of metres per second", 0, kFastest, true));
  }
}

void readLook(const json& line, v1::Look* look) {
  readPoint(required(line, "at", R"("at":[x,y,z], a point to look at)"), "at", look->mutable_at());
}

double readWaitSeconds(const json& line) {
  const double most = line.contains("for") ? kLongestWaitOfOne : kLongestWait;
  return within(line["wait"], "wait", "a number of seconds", 0, most);
}

void readCapture(const json& line, v1::Capture* capture) {
  capture->set_as(
      name(required(line, "as", R"("as":"name", the picture's file name)"), "as", "a file name"));
}

void readJump(const json& line, v1::Jump* jump) {
  if (line.contains("height")) {
    jump->set_height(within(line["height"], "height", "a number of metres", 0, 1000, true));
  }
  if (line.contains("velocity")) readPoint(line["velocity"], "velocity", jump->mutable_velocity());
}

void readCrouch(const json& line, v1::Crouch* crouch) {
  const json& height = required(line, "height", R"("height":metres, lower than it was spawned)");
  crouch->set_height(within(height, "height", "a number of metres", 0, 10, true));
}

void readJoints(const json& line, v1::DriveJoints* joints) {
  const json& to = required(line, "to", R"("to":[values, null where a joint stays])");
  if (!to.is_array() || to.empty()) {
    refuse("to", "must be a list of numbers, one a joint, not " + excerpt(to));
  }
  for (std::size_t i = 0; i < to.size(); ++i) {
    v1::DriveJoints::Target& target = *joints->add_to();
    if (to[i].is_null()) continue;
    target.set_value(within(to[i], "to[" + std::to_string(i) + "]", "radians or metres, or null",
                            -kMostJoint, kMostJoint));
  }
  if (line.contains("speed")) {
    joints->set_speed(
        within(line["speed"], "speed", "radians or metres per second", 0, kFastestJoint, true));
  }
}

struct Verb {
  const char* name;
  std::vector<const char*> keys;  ///< besides the verb itself
};

const std::vector<Verb>& verbs() {
  static const std::vector<Verb> all{
      {"spawn", {"at", "facing", "radius", "height", "flying", "parts", "links", "self_contact"}},
      {"walk", {"to", "along", "speed"}},
      {"look", {"at"}},
      {"wait", {"for"}},
      {"capture", {"as"}},
      {"leave", {}},
      {"jump", {"height", "velocity"}},
      {"fly", {"on"}},
      {"crouch", {"height"}},
      {"stand", {}},
      {"joints", {"to", "speed"}},
      {"body", {"do", "to", "turn", "level", "speed", "turn_speed"}}};
  return all;
}

std::string verbNames() {
  std::string names;
  for (const Verb& verb : verbs()) names += (names.empty() ? "" : ", ") + std::string(verb.name);
  return names;
}

const Verb& verbOf(const json& line) {
  const Verb* found = nullptr;
  for (const Verb& verb : verbs()) {
    if (!line.contains(verb.name)) continue;
    if (found) {
      refuse("", std::string("\"") + found->name + "\" and \"" + verb.name +
                     "\" stand in one line; write two lines");
    }
    found = &verb;
  }
  if (!found) refuse("", "no command; a line has one of " + verbNames());
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
    refuse("", excerpt(key) + " is no key of a line that says " + verb.name + "; its keys are " +
                   allowed);
  }
}

void readOrder(const json& line, const std::string& verb, v1::Command& command) {
  const bool waits = verb == "wait";
  command.set_avatar(
      name(line[waits ? "for" : verb.c_str()], waits ? "for" : verb.c_str(), "the avatar's name"));
  if (verb == "spawn") readSpawn(line, command.mutable_spawn());
  if (verb == "walk") readWalk(line, command.mutable_walk());
  if (verb == "look") readLook(line, command.mutable_look());
  if (waits) command.mutable_wait()->set_seconds(readWaitSeconds(line));
  if (verb == "capture") readCapture(line, command.mutable_capture());
  if (verb == "leave") command.mutable_leave();
  if (verb == "jump") readJump(line, command.mutable_jump());
  if (verb == "fly") command.mutable_fly()->set_on(!line.contains("on") || flag(line["on"], "on"));
  if (verb == "crouch") readCrouch(line, command.mutable_crouch());
  if (verb == "stand") command.mutable_crouch();
  if (verb == "joints") readJoints(line, command.mutable_drive_joints());
}

/// Bodies may be named as the file's nodes are.
std::string bodyName(const json& value) {
  if (!value.is_string()) refuse("body", "must be a body's name in quotes, not " + excerpt(value));
  const std::string text = value.get<std::string>();
  if (text.empty() || text.size() > kLongestBodyName)
    refuse("body", "must have 1 to " + std::to_string(kLongestBodyName) + " letters");
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
    refuse("do", R"(must be "open", "close", "stop" or "run", not )" + excerpt(value));
  }
}

void readBodySpeed(const json& line, v1::BodyCommand& command) {
  const bool turns = line.contains("turn_speed");
  if (turns && line.contains("speed")) refuse("speed", R"(stands beside "turn_speed"; keep one)");
  if (!turns && !line.contains("speed")) return;
  const char* key = turns ? "turn_speed" : "speed";
  const double most = turns ? kFastestTurn : kFastest;
  const char* what = turns ? "a number of degrees per second" : "a number of metres per second";
  const double speed = within(line[key], key, what, 0, most, true);
  command.set_speed(turns ? kRadiansPerDegree * speed : speed);
}

v1::BodyCommand readBodyCommand(const json& line) {
  v1::BodyCommand command;
  command.set_body(bodyName(line["body"]));
  int said = 0;
  for (const char* key : {"do", "to", "turn", "level"}) said += line.contains(key) ? 1 : 0;
  if (said != 1) refuse("body", R"(needs one of "do", "to", "turn" and "level")");
  if (line.contains("to")) {
    command.set_to(number(line["to"], "to", "a number of metres, or of seconds of a path"));
  } else if (line.contains("turn")) {
    command.set_to(kRadiansPerDegree * number(line["turn"], "turn", "a number of degrees"));
  } else if (line.contains("level")) {
    const json& level = line["level"];
    if (!level.is_number_integer() || level < 0 || level > 10000)
      refuse("level", "must be a whole number from 0 to 10000, not " + excerpt(level));
    command.set_level(level.get<std::uint32_t>());
  } else {
    readAction(line["do"], command);
  }
  readBodySpeed(line, command);
  return command;
}

// ---- lines -------------------------------------------------------------------------------------

/// The object of a line. nlohmann keeps the last of two equal keys; we refuse them.
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
    refuse("", "a number is beyond what a double holds; use metres, seconds and degrees");
  } catch (const json::parse_error& problem) {
    refuse("", "is not JSON at column " + std::to_string(problem.byte) +
                   R"(; write one object a line, as {"wait":1}, with finite numbers)");
  }
  if (!line.is_object()) {
    refuse("", "must be an object, as {\"wait\":1}, not " + excerpt(line));
  }
  if (!repeated.empty()) refuse(repeated, "stands twice in one line; keep one");
  return line;
}

}  // namespace

void checkUtf8(std::string_view text) {
  // nlohmann takes a zero byte for the end of the text.
  if (text.find('\0') != std::string_view::npos) refuse("", "has a zero byte; is it a text file?");
  try {
    static_cast<void>(json(std::string(text)).dump());
  } catch (const json::type_error&) {
    refuse("", "is not UTF-8; save the script as UTF-8");
  }
}

std::variant<v1::Command, v1::BodyCommand, GlobalWait> parseLine(std::string_view text,
                                                                 std::uint32_t number) {
  const json line = parseObject(text);
  const Verb& verb = verbOf(line);
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
