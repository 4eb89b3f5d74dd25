#include "protocol/script.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <sstream>
#include <utility>

namespace enfilade::protocol {
namespace {

using nlohmann::json;

constexpr std::size_t kLargestScript = std::size_t{64} << 20;  // bytes
constexpr std::size_t kLongestLine = std::size_t{1} << 20;     // bytes
constexpr std::size_t kMostErrorsTold = 20;
constexpr std::size_t kLongestName = 64;
constexpr double kLongestWait = 1e6;  // seconds; eleven days are a slip of the pen
constexpr std::size_t kLongestQuote = 40;

/// What is wrong with a line, without file and number.
struct LineProblem {
  std::string text;
};

[[noreturn]] void refuse(std::string_view field, const std::string& text) {
  throw LineProblem{field.empty() ? text : std::string(field) + ": " + text};
}

/// A value as the script has it, cut to fit a message.
std::string excerpt(const json& value) {
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

void readPoint(const json& value, const std::string& field, v1::Vec3* point) {
  static constexpr std::array<const char*, 3> axes{"x", "y", "z"};
  if (!value.is_array() || value.size() != axes.size()) {
    refuse(field, "must be three numbers [x, y, z] in metres, not " + excerpt(value));
  }
  std::array<double, 3> xyz{};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    xyz[i] = number(value[i], field + "." + axes[i], "a number of metres");
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

void readSpawn(const json& line, v1::Spawn* spawn) {
  readPoint(required(line, "at", R"("at":[x,y,z], the place of the feet)"), "at",
            spawn->mutable_at());
  if (line.contains("facing")) {
    spawn->set_facing(number(line["facing"], "facing", "a number of degrees"));
  }
  if (line.contains("radius")) {
    spawn->set_radius(number(line["radius"], "radius", "a number of metres"));
  }
  if (line.contains("height")) {
    spawn->set_height(number(line["height"], "height", "a number of metres"));
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
    walk->set_speed(number(line["speed"], "speed", "a number of metres per second"));
  }
}

void readLook(const json& line, v1::Look* look) {
  readPoint(required(line, "at", R"("at":[x,y,z], a point to look at)"), "at", look->mutable_at());
}

double readWaitSeconds(const json& line) {
  const double seconds = number(line["wait"], "wait", "a number of seconds");
  if (!(seconds >= 0) || seconds > kLongestWait) {
    refuse("wait", excerpt(line["wait"]) + " is out of range; use 0 to 1000000 seconds");
  }
  return seconds;
}

void readCapture(const json& line, v1::Capture* capture) {
  capture->set_as(
      name(required(line, "as", R"("as":"name", the picture's file name)"), "as", "a file name"));
}

struct Verb {
  const char* name;
  std::vector<const char*> keys;  ///< besides the verb itself
};

const std::vector<Verb>& verbs() {
  static const std::vector<Verb> all{{"spawn", {"at", "facing", "radius", "height"}},
                                     {"walk", {"to", "along", "speed"}},
                                     {"look", {"at"}},
                                     {"wait", {"for"}},
                                     {"capture", {"as"}},
                                     {"leave", {}}};
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

/// Throws LineProblem for bytes that are not UTF-8 text.
void checkUtf8(std::string_view text) {
  // nlohmann takes a zero byte for the end of the text.
  if (text.find('\0') != std::string_view::npos) refuse("", "has a zero byte; is it a text file?");
  try {
    static_cast<void>(json(std::string(text)).dump());
  } catch (const json::type_error&) {
    refuse("", "is not UTF-8; save the script as UTF-8");
  }
}

std::variant<v1::Command, GlobalWait> parseLine(std::string_view text, std::uint32_t number) {
  const json line = parseObject(text);
  const Verb& verb = verbOf(line);
  refuseUnknownKeys(line, verb);
  if (verb.name == std::string_view("wait") && !line.contains("for")) {
    return GlobalWait{readWaitSeconds(line)};
  }
  v1::Command command;
  command.set_tag(number);
  readOrder(line, verb.name, command);
  return command;
}

bool isSkipped(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return true;
  text.remove_prefix(first);
  return text.starts_with('#') || text.starts_with("//");
}

/// Takes the next line off `text`, without its end.
std::string_view takeLine(std::string_view& text) {
  const std::size_t end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

/// Remembers the captures' names, so that no picture overwrites another.
class CaptureNames {
 public:
  void add(const ScriptLine& line) {
    const auto* command = std::get_if<v1::Command>(&line.what);
    if (!command || !command->has_capture()) return;
    const auto [place, isNew] = lineOf_.try_emplace(command->capture().as(), line.number);
    if (!isNew) {
      refuse("as", "\"" + place->first + "\" is already the picture of line " +
                       std::to_string(place->second) + "; give another name");
    }
  }

 private:
  std::map<std::string, std::uint32_t> lineOf_;
};

ScriptLine readLine(std::string_view text, std::uint32_t number) {
  if (text.size() > kLongestLine) {
    refuse("", "has " + std::to_string(text.size()) + " bytes; at most " +
                   std::to_string(kLongestLine) + " are allowed");
  }
  return {number, parseLine(text, number)};
}

[[noreturn]] void throwErrors(const std::vector<std::string>& errors, std::size_t count,
                              std::uint32_t firstLine) {
  std::string text;
  for (const std::string& error : errors) text += (text.empty() ? "" : "\n") + error;
  if (count > errors.size()) {
    text += "\nand " + std::to_string(count - errors.size()) + " more bad lines";
  }
  throw ScriptError(text, firstLine);
}

}  // namespace

ScriptError::ScriptError(const std::string& text, std::uint32_t firstBadLine)
    : std::runtime_error(text), line(firstBadLine) {}

Script parseScript(std::string_view text, const std::string& source) {
  constexpr std::string_view byteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(byteOrderMark)) text.remove_prefix(byteOrderMark.size());
  Script script{source, {}};
  CaptureNames captures;
  std::vector<std::string> errors;
  std::size_t errorCount = 0;
  std::uint32_t firstBadLine = 0;
  for (std::uint32_t number = 1; !text.empty(); ++number) {
    const std::string_view line = takeLine(text);
    try {
      checkUtf8(line);
      if (isSkipped(line)) continue;
      ScriptLine read = readLine(line, number);
      captures.add(read);
      script.lines.push_back(std::move(read));
    } catch (const LineProblem& problem) {
      if (errorCount++ == 0) firstBadLine = number;
      if (errors.size() < kMostErrorsTold) {
        errors.push_back(source + ":" + std::to_string(number) + ": " + problem.text);
      }
    }
  }
  if (errorCount > 0) throwErrors(errors, errorCount, firstBadLine);
  return script;
}

Script readScript(const std::filesystem::path& file) {
  std::error_code problem;
  const auto status = std::filesystem::status(file, problem);
  if (std::filesystem::is_directory(status)) {
    throw ScriptError(file.string() + ": is a folder; give the script's file", 0);
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    throw ScriptError(file.string() + ": cannot be opened; does it exist, and may it be read?", 0);
  }
  std::string text;
  std::array<char, 1 << 16> piece{};
  while (stream.read(piece.data(), piece.size()) || stream.gcount() > 0) {
    text.append(piece.data(), static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kLargestScript) {
      throw ScriptError(file.string() + ": is larger than " + std::to_string(kLargestScript >> 20) +
                            " MiB; is it a script?",
                        0);
    }
  }
  if (stream.bad()) throw ScriptError(file.string() + ": cannot be read to its end", 0);
  return parseScript(text, file.string());
}

}  // namespace enfilade::protocol
