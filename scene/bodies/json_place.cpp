#include "scene/bodies/json_place.hpp"

#include <algorithm>

#include "scene/bodies/sidecar.hpp"

namespace enfilade::scene {

using nlohmann::json;

void JsonPlace::fail(const std::string& what) const {
  throw SidecarError(name + ": " + what);
}

std::string excerpt(const json& value) {
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
