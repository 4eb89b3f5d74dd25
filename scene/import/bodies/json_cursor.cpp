#include "scene/import/bodies/json_cursor.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "scene/import/bodies/sidecar.hpp"

namespace enfilade::scene {

using nlohmann::json;

void JsonPlace::fail(const std::string& what) const {
  throw SidecarError(name + ": " + what);
}

namespace {

constexpr int kDeepest = 16;  // lists and objects in one another

/// Whether more than `depth` lie in one another. (nlohmann writes them by recursion.)
bool isDeeper(const json& value, int depth) {
  if (!value.is_structured()) return false;
  if (depth == 0) return true;
  return std::any_of(value.begin(), value.end(),
                     [&](const json& inner) { return isDeeper(inner, depth - 1); });
}

/// Finds a key that is there twice in one object: nlohmann keeps the last one. (Its own callback
/// goes through the whole list at each object's end.)
struct KeyWatcher : json::json_sax_t {
  std::vector<std::set<std::string>> open;  // objects, by their keys so far
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

json parsed(std::string_view text, const std::string& source) {
  KeyWatcher watcher;
  json::sax_parse(text, &watcher);
  if (watcher.repeated)
    throw SidecarError(source + ": the key " + excerpt(*watcher.repeated) +
                       " is there twice in one object");
  try {
    return json::parse(text);
  } catch (const json::exception& problem) {
    throw SidecarError(source + ": is not JSON: " + problem.what());
  }
}

std::string excerpt(const json& value) {
  if (isDeeper(value, kDeepest)) return "so deep a nest of lists";
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return text.size() > 40 ? text.substr(0, 37) + "..." : text;
}

double numberOf(const JsonPlace& place) {
  if (!place.value.is_number()) place.fail("must be a number, not " + excerpt(place.value));
  return place.value.get<double>();
}

bool truthOf(const JsonPlace& place) {
  if (!place.value.is_boolean()) place.fail("must be true or false, not " + excerpt(place.value));
  return place.value.get<bool>();
}

std::string textOf(const JsonPlace& place) {
  if (!place.value.is_string() || place.value.get<std::string>().empty())
    place.fail("must be a text, not " + excerpt(place.value));
  return place.value.get<std::string>();
}

std::vector<double> numbersOf(const JsonPlace& place) {
  if (!place.value.is_array()) place.fail("must be a list of numbers, not " + excerpt(place.value));
  std::vector<double> all;
  for (std::size_t i = 0; i < place.value.size(); ++i) all.push_back(numberOf(place.at(i)));
  return all;
}

collision::Vec3 vectorOf(const JsonPlace& place) {
  const std::vector<double> xyz = numbersOf(place);
  if (xyz.size() != 3) place.fail("must be three numbers, not " + excerpt(place.value));
  return {xyz[0], xyz[1], xyz[2]};
}

void allowOnly(const JsonPlace& place, const std::vector<const char*>& keys) {
  if (!place.value.is_object()) place.fail("must be an object, not " + excerpt(place.value));
  for (const auto& [key, value] : place.value.items()) {
    if (key.compare(0, place.prefix.size(), place.prefix) != 0) continue;
    const bool known = std::any_of(keys.begin(), keys.end(), [&, k = key](const char* allowed) {
      return k == place.prefix + allowed;
    });
    if (known) continue;
    std::string all;
    for (const char* allowed : keys) all += (all.empty() ? "" : ", ") + place.prefix + allowed;
    place.fail("unknown key " + excerpt(key) + "; known here are " + all);
  }
}

}  // namespace enfilade::scene
