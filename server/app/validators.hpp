// Validators of option values. Each error says what to give, with its unit.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/model/format_number.hpp"
#include "server/base/parse_number.hpp"

namespace enfilade::server {

/// A number from `low` to `high`. `name`: of the value in --help, such as METRES.
inline CLI::Validator makeRangeValidator(double low, double high, const std::string& name) {
  return CLI::Validator(
      [low, high, name](const std::string& text) -> std::string {
        const auto number = parseNumber<double>(text);
        if (number && *number >= low && *number <= high) return "";
        return text + ": give " + name + " from " + scene::formatExactNumber(low) + " to " +
               scene::formatExactNumber(high);
      },
      name);
}

inline CLI::Validator makeWholeRangeValidator(std::uint64_t low, std::uint64_t high,
                                              const std::string& name) {
  return CLI::Validator(
      [low, high, name](const std::string& text) -> std::string {
        const auto number = parseNumber<std::uint64_t>(text);
        if (number && *number >= low && *number <= high) return "";
        return text + ": give " + name + " from " + std::to_string(low) + " to " +
               std::to_string(high) + ", a whole number";
      },
      name);
}

/// One of these words.
inline CLI::Validator makeChoiceValidator(const std::vector<std::string>& words) {
  std::string name, list;
  for (std::size_t i = 0; i < words.size(); ++i) {
    name += (i == 0 ? "" : "|") + words[i];
    list += (i == 0 ? "" : i + 1 < words.size() ? ", " : " or ") + words[i];
  }
  return CLI::Validator(
      [words, list](const std::string& text) {
        const bool known = std::find(words.begin(), words.end(), text) != words.end();
        return known ? std::string() : text + ": give " + list;
      },
      name);
}

/// One of several numbers, for an option of numbers.
inline std::string validateAnyNumber(const std::string& text) {
  return parseNumber<double>(text) ? "" : text + ": give a number";
}

/// The name of a file that exists.
inline std::string validateExistingFile(const std::string& text) {
  if (std::filesystem::is_directory(text)) return text + ": a folder; give a file";
  return std::filesystem::exists(text) ? "" : text + ": no such file; check the path";
}

}  // namespace enfilade::server
