// A value of a JSON text and its place in it, so that whoever reads it can say where a mistake is.
// Private to scene/.
#pragma once

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::scene {

struct JsonPlace {
  const nlohmann::json& value;
  std::string name;         ///< as "hall.walk.json.bodies[2]"
  std::string prefix = {};  ///< of this object's own keys, as "walk_"; keys without it are not ours

  /// Throws SidecarError.
  [[noreturn]] void fail(const std::string& what) const;
  bool has(const char* key) const { return value.contains(prefix + key); }
  JsonPlace at(const char* key) const {
    return {value.at(prefix + key), name + "." + prefix + key};
  }
  JsonPlace at(std::size_t i) const { return {value.at(i), name + "[" + std::to_string(i) + "]"}; }
};

/// Throws SidecarError where it is no JSON, or says a key twice in one object.
nlohmann::json parsed(std::string_view text, const std::string& source);

/// At most 40 characters of it.
std::string excerpt(const nlohmann::json& value);

// Each fails unless the value is what is wanted.
double numberOf(const JsonPlace& place);
bool truthOf(const JsonPlace& place);
std::string textOf(const JsonPlace& place);  ///< not empty
std::vector<double> numbersOf(const JsonPlace& place);
collision::Vec3 vectorOf(const JsonPlace& place);

/// Fails unless it is an object all of whose keys are among these.
void allowOnly(const JsonPlace& place, const std::vector<const char*>& keys);

}  // namespace enfilade::scene
