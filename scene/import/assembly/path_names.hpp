// Names on the paths of objects: stable, unique, valid UTF-8.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>

namespace enfilade::scene {

/// One path segment: '/', '%', control characters and invalid UTF-8 are percent-encoded.
std::string encodePathSegment(std::string_view name);

/// Makes names unique below one parent.
class SiblingNames {
 public:
  /// `name`, or `name#2`, `name#3`, ... if it is taken.
  std::string makeUnique(const std::string& name);

 private:
  std::set<std::string> taken_;
  std::map<std::string, std::size_t> repeats_;
};

}  // namespace enfilade::scene
