// A JSON value with its path in the document, so that errors can name the place. Private to scene/.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::scene {

/// A JSON value and its path.
struct JsonCursor {
  const nlohmann::json& value;
  std::string name;  ///< such as "hall.walk.json.bodies[2]"
  /// prefix of this object's own keys, such as "walk_"; other keys are ignored
  std::string prefix = {};

  /// Throws SidecarError.
  [[noreturn]] void fail(const std::string& what) const;
  bool has(const char* key) const { return value.contains(prefix + key); }
  JsonCursor at(const char* key) const {
    return {value.at(prefix + key), name + "." + prefix + key};
  }
  JsonCursor at(std::size_t i) const { return {value.at(i), name + "[" + std::to_string(i) + "]"}; }
};

/// Parses a text. Throws SidecarError if it is not JSON or repeats a key in an object.
nlohmann::json parseJson(std::string_view text, const std::string& source);

/// Returns at most 40 characters of the value.
std::string formatExcerpt(const nlohmann::json& value);

// Each throws SidecarError unless the value has the type.
double readNumber(const JsonCursor& cursor);
bool readBool(const JsonCursor& cursor);
std::string readText(const JsonCursor& cursor);  ///< not empty
std::vector<double> readNumbers(const JsonCursor& cursor);
collision::Vec3 readVector(const JsonCursor& cursor);

/// Throws SidecarError unless the value is an object with only these keys.
void requireKnownKeys(const JsonCursor& cursor, const std::vector<const char*>& keys);

}  // namespace enfilade::scene
