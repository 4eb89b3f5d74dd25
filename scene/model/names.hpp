// Rules for the names of avatars, captures and worlds.
#pragma once

#include <algorithm>
#include <string>

namespace enfilade::scene {

inline constexpr std::size_t kMaxNameLength = 64;  ///< characters

inline bool isNameCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-';
}

inline bool isValidName(const std::string& name) {
  return !name.empty() && name.size() <= kMaxNameLength && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), isNameCharacter);
}

/// Error text that follows the field's name.
inline constexpr const char* kNameRule =
    " must be 1 to 64 letters, digits, '.', '_' or '-', and not begin with '.'";

}  // namespace enfilade::scene
