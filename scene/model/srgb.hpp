// Encodes and decodes sRGB colours (IEC 61966-2-1).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace enfilade::scene {

/// Decodes one sRGB colour channel, 0..1.
inline float srgbToLinear(double c) {
  const double s = std::clamp(c, 0.0, 1.0);
  return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

/// Decodes one channel of a byte, by a table.
inline float srgbByteToLinear(std::uint8_t value) {
  static const std::array<float, 256> kTable = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i)
      table[i] = srgbToLinear(static_cast<double>(i) / 255);
    return table;
  }();
  return kTable[value];
}

/// Encodes one linear colour channel, 0..1.
inline double linearToSrgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// Encodes one linear colour channel as a byte.
inline std::uint8_t linearToSrgbByte(double linear) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(linearToSrgb(linear), 0.0, 1.0) * 255));
}

/// Rounds a channel to 8 bits. Values beyond 0..1 are clamped; NaN becomes 0.
inline std::uint8_t toByte(double c) {
  return c > 0 ? static_cast<std::uint8_t>(std::lround(std::min(c, 1.0) * 255)) : std::uint8_t{0};
}

}  // namespace enfilade::scene
