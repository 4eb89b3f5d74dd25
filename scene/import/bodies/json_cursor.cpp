#include "scene/import/bodies/json_cursor.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "scene/import/bodies/sidecar_error.hpp"

namespace enfilade::scene {

using nlohmann::json;

void JsonCursor::fail(const std::string& what) const {
  throw SidecarError(name + ": " + what);
}

namespace {

constexpr int kMaxDepth = 16;  // nested lists and objects

/// Returns whether the nesting is deeper than `depth`. (nlohmann serializes by recursion.)
bool isDeeperThan(const json& value, int depth) {
  if (!value.is_structured()) return false;
  if (depth == 0) return true;
  return std::any_of(value.begin(), value.end(),
                     [&](const json& inner) { return isDeeperThan(inner, depth - 1); });
}

/// Finds a repeated key in an object, of which nlohmann would keep the last. (Its own callback
/// visits the whole list at each object's end.)
struct DuplicateKeyFinder : json::json_sax_t {
  std::vector<std::set<std::string>> open;  // keys so far of each open object
  std::optional<std::string> repeated;

  bool key(string_t& key) override {
    if (open.back().insert(key).second) return true;
    repeated = key;
    return false;
  }
  bool start_object(std::size_t) override { return open.emplace_back(), true; }
  bool end_object() override { return open.pop_back(), true; }
  bool start_array(std::size_t) override { return true; }
  bool end_array() override { return true; }
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool parse_error(std::size_t, const std::string&, const json::exception&) override {
    return false;
  }
};

}  // namespace

json parseJson(std::string_view text, const std::string& source) {
  DuplicateKeyFinder watcher;
  json::sax_parse(text, &watcher);
  if (watcher.repeated)
    throw SidecarError(source + ": the key " + formatExcerpt(*watcher.repeated) +
                       " is repeated in an object");
  try {
    return json::parse(text);
  } catch (const json::exception& problem) {
    throw SidecarError(source + ": is not JSON: " + problem.what());
  }
}

std::string formatExcerpt(const json& value) {
  if (isDeeperThan(value, kMaxDepth)) return "a value nested too deeply";
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return text.size() > 40 ? text.substr(0, 37) + "..." : text;
}

double readNumber(const JsonCursor& cursor) {
  if (!cursor.value.is_number())
    cursor.fail("must be a number, not " + formatExcerpt(cursor.value));
  return cursor.value.get<double>();
}

bool readBool(const JsonCursor& cursor) {
  if (!cursor.value.is_boolean())
    cursor.fail("must be true or false, not " + formatExcerpt(cursor.value));
  return cursor.value.get<bool>();
}

std::string readText(const JsonCursor& cursor) {
  if (!cursor.value.is_string() || cursor.value.get<std::string>().empty())
    cursor.fail("must be a text, not " + formatExcerpt(cursor.value));
  return cursor.value.get<std::string>();
}

std::vector<double> readNumbers(const JsonCursor& cursor) {
  if (!cursor.value.is_array())
    cursor.fail("must be a list of numbers, not " + formatExcerpt(cursor.value));
  std::vector<double> all;
  for (std::size_t i = 0; i < cursor.value.size(); ++i) all.push_back(readNumber(cursor.at(i)));
  return all;
}

collision::Vec3 readVector(const JsonCursor& cursor) {
  const std::vector<double> xyz = readNumbers(cursor);
  if (xyz.size() != 3) cursor.fail("must be three numbers, not " + formatExcerpt(cursor.value));
  return {xyz[0], xyz[1], xyz[2]};
}

void requireKnownKeys(const JsonCursor& cursor, const std::vector<const char*>& keys) {
  if (!cursor.value.is_object())
    cursor.fail("must be an object, not " + formatExcerpt(cursor.value));
  for (const auto& [key, value] : cursor.value.items()) {
    if (key.compare(0, cursor.prefix.size(), cursor.prefix) != 0) continue;
    const bool known = std::any_of(keys.begin(), keys.end(), [&, k = key](const char* allowed) {
      return k == cursor.prefix + allowed;
    });
    if (known) continue;
    std::string all;
    for (const char* allowed : keys) all += (all.empty() ? "" : ", ") + cursor.prefix + allowed;
    cursor.fail("unknown key " + formatExcerpt(key) + "; known here are " + all);
  }
}

}  // namespace enfilade::scene
