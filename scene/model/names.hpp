// What avatars, captures and worlds may be called.
#pragma once

#include <algorithm>
#include <string>

namespace enfilade::scene {

inline constexpr std::size_t kLongestName = 64;  ///< characters

inline bool isNameLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-';
}

inline bool isName(const std::string& name) {
  return !name.empty() && name.size() <= kLongestName && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), isNameLetter);
}

/// For a person: it follows the name of the field.
inline constexpr const char* kNameRule =
    " must be 1 to 64 letters, digits, '.', '_' or '-', and not begin with '.'";

}  // namespace enfilade::scene
