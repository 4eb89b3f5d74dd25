// ASCII case conversion, independent of the locale.
#pragma once

#include <algorithm>
#include <string>

namespace enfilade::scene {

constexpr char toLowerCase(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

inline std::string toLowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) { return toLowerCase(c); });
  return text;
}

}  // namespace enfilade::scene
