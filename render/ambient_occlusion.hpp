// Shade in hollows: corners, joints and what stands on something look joined to it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/camera.hpp"

namespace enfilade::render {

/// Works on a picture's depth alone, so that both renderers shade alike.
class Hollows {
 public:
  /// `depth` is Frame::depth of a picture taken with `camera`; kept by reference.
  Hollows(const std::vector<float>& depth, const Camera& camera);

  /// Of each pixel of row `y`, how much of its colour is left: 255 all of it. Rows may be asked for
  /// by several threads.
  void row(int y, std::span<std::uint8_t> left) const;

 private:
  const std::vector<float>& depth_;
  std::size_t width_;
  bool parallel_;
  std::size_t columns_;         ///< of the points
  std::vector<float> places_;   ///< z-distance of each point, metres; nothing: very far
  std::vector<float> shadows_;  ///< of each point, what it takes from a byte of 255
};

/// Darkens sRGB bytes. `clear`: 255 where nothing hides the hollow from the eye, 0 where all does.
inline void darken(const std::uint8_t* from, std::uint8_t left, std::uint8_t clear,
                   std::uint8_t* to) {
  constexpr unsigned kAll = 255 * 255;
  if (clear == 255) {  // mostly; a division by 255, rounded, without one
    const auto shaded = [left](unsigned value) {
      const unsigned product = value * left + 128;
      return static_cast<std::uint8_t>((product + (product >> 8)) >> 8);
    };
    const std::uint8_t r = shaded(from[0]), g = shaded(from[1]), b = shaded(from[2]);
    to[0] = r, to[1] = g, to[2] = b;
    return;
  }
  const unsigned kept = kAll - unsigned{clear} * (255u - left);
  for (int i = 0; i < 3; ++i) to[i] = static_cast<std::uint8_t>((from[i] * kept + kAll / 2) / kAll);
}

}  // namespace enfilade::render
