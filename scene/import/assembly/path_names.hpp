// Names on the paths of objects: stable, unique, valid UTF-8.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <unordered_map>

namespace enfilade::scene {

/// One path segment: '/', '%', control characters and invalid UTF-8 are percent-encoded.
std::string encodePathSegment(std::string_view name);

/// encodePathSegment() of a node's name; "node" if it has none, or one that assimp generated.
std::string makeNodeSegment(std::string_view name);

/// Reads each byte that is not part of UTF-8 as a character of Windows-1252. Returns their number.
std::size_t decodeOtherBytes(std::string& text);

/// Makes names unique below one parent.
class SiblingNames {
 public:
  SiblingNames() = default;
  /// `count`: of the names to come; some parents have a million children.
  explicit SiblingNames(std::size_t count) { repeats_.reserve(count); }

  /// `name`, or `name#2`, `name#3`, ... if it is taken.
  std::string makeUnique(const std::string& name);

 private:
  std::unordered_map<std::string, std::size_t> repeats_;  // of each name that is taken
};

}  // namespace enfilade::scene
