// Numbers, ranges and points in messages.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string>

#include "collision/types.hpp"

namespace enfilade::scene {

/// Three significant digits: "0.123".
inline std::string formatShortNumber(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// The shortest digits that are read back as the same number; no exponent up to 1e15.
inline std::string formatExactNumber(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "infinity" : "-infinity";
  const double size = std::abs(value);
  const bool plain = size == 0 || (size >= 1e-6 && size < 1e15);
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 plain ? std::chars_format::fixed : std::chars_format::scientific)
                       .ptr;
  return {text.data(), end};
}

/// "speed is 20 m/s; give 0 to 10 m/s". `unit` may be empty.
inline std::string formatRangeError(const std::string& field, double value, double min, double max,
                                    const std::string& unit) {
  const std::string suffix = unit.empty() ? "" : " " + unit;
  return field + " is " + formatExactNumber(value) + suffix + "; give " + formatExactNumber(min) +
         " to " + formatExactNumber(max) + suffix;
}

/// "[1.5, 300, 0]", as a script takes it; rounded to a tenth of a millimetre.
inline std::string formatPoint(const collision::Vec3& point) {
  constexpr double kSteps = 1e4;  // per metre
  std::string text = "[";
  for (int axis = 0; axis < 3; ++axis)
    text +=
        (axis > 0 ? ", " : "") + formatExactNumber(std::round(point[axis] * kSteps) / kSteps + 0.0);
  return text + "]";
}

}  // namespace enfilade::scene
