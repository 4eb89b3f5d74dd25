// Trims whitespace from both ends of a text.
#pragma once

#include <string_view>

namespace enfilade::scene {

/// The text without spaces, tabs and line ends around it.
constexpr std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

}  // namespace enfilade::scene
