// Decodes sRGB colours.
#pragma once

#include <algorithm>
#include <cmath>

namespace enfilade::scene {

/// Decodes one sRGB colour channel, 0..1.
inline float srgbToLinear(float c) {
  const double s = std::clamp(static_cast<double>(c), 0.0, 1.0);
  return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

}  // namespace enfilade::scene
