#include "protocol/script/script_values.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "protocol/json_depth.hpp"
#include "protocol/script/line_error.hpp"

namespace enfilade::protocol {

using nlohmann::json;

namespace {

constexpr std::size_t kMaxNameLength = 64;
constexpr std::size_t kMaxQuoteLength = 40;
constexpr double kMaxCoordinate = 1e7;  // metres; scene/world/data/validation.cpp

bool isNameLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-';
}

/// "1000000" rather than "1000000.0" or "1e+06".
std::string formatLimit(double limit) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.15g", limit);
  return text.data();
}

}  // namespace

std::string makeExcerpt(const json& value) {
  if (isDeeperThan(value, kMaxJsonDepth)) return "a too deeply nested value";
  std::string text = value.dump();
  if (text.size() > kMaxQuoteLength) {
    std::size_t cut = kMaxQuoteLength;
    while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xC0u) == 0x80u) --cut;
    text = text.substr(0, cut) + "...";
  }
  return text;
}

double parseNumber(const json& value, std::string_view field, const char* what) {
  if (!value.is_number()) {
    refuse(field, "must be " + std::string(what) + ", not " + makeExcerpt(value));
  }
  return value.get<double>();
}

double parseNumberInRange(const json& value, std::string_view field, const char* what, double low,
                          double high, bool above) {
  const double read = parseNumber(value, field, what);
  if (read <= high && (above ? read > low : read >= low)) return read;
  const std::string range =
      above ? " above " + formatLimit(low) + " and at most " : " from " + formatLimit(low) + " to ";
  refuse(field, makeExcerpt(value) + " is out of range; give " + what + range + formatLimit(high));
}

bool parseFlag(const json& value, std::string_view field) {
  if (!value.is_boolean()) refuse(field, "must be true or false, not " + makeExcerpt(value));
  return value.get<bool>();
}

void readPoint(const json& value, const std::string& field, v1::Vec3* point) {
  static constexpr std::array<const char*, 3> axes{"x", "y", "z"};
  if (!value.is_array() || value.size() != axes.size()) {
    refuse(field, "must be three numbers [x, y, z] in metres, not " + makeExcerpt(value));
  }
  std::array<double, 3> xyz{};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    xyz[i] = parseNumberInRange(value[i], field + "." + axes[i], "a number of metres",
                                -kMaxCoordinate, kMaxCoordinate);
  }
  point->set_x(xyz[0]);
  point->set_y(xyz[1]);
  point->set_z(xyz[2]);
}

std::string parseName(const json& value, std::string_view field, const char* what) {
  if (!value.is_string()) {
    refuse(field, "must be " + std::string(what) + " in quotes, not " + makeExcerpt(value));
  }
  std::string text = value.get<std::string>();
  if (text.empty()) refuse(field, "is empty; give " + std::string(what));
  if (text.size() > kMaxNameLength) {
    refuse(field, "has " + std::to_string(text.size()) + " characters; at most " +
                      std::to_string(kMaxNameLength) + " are allowed");
  }
  if (!std::all_of(text.begin(), text.end(), isNameLetter) || text.front() == '.') {
    refuse(field, makeExcerpt(value) +
                      " has a character that is not allowed; use A-Z, a-z, 0-9, '_', '-' and "
                      "'.' (not first)");
  }
  return text;
}

const json& requireKey(const json& line, const char* key, const char* example) {
  const auto found = line.find(key);
  if (found == line.end()) refuse(key, std::string("is missing; add ") + example);
  return *found;
}

}  // namespace enfilade::protocol
