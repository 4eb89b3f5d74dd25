// Encodes images and channels in memory: PNG, JPEG, NPY, packed 16-bit depth. Thread-safe; the
// bytes depend only on the pixels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade::render {

using Bytes = std::vector<std::uint8_t>;

/// Non-owning view of pixels, rows from the top: value c of pixel (x, y) is at index
/// (y * width + x) * channels + c.
template <class Value>
struct Raster {
  int width = 0, height = 0;  ///< pixels, at least 1
  int channels = 1;           ///< 1: grey; 3: red, green, blue; 4: with alpha, 8-bit PNG only
  std::span<const Value> values;
};

// All throw std::runtime_error if the number of values is wrong or a library fails.

Bytes encodePng(const Raster<std::uint8_t>& pixels);
Bytes encodePng(const Raster<std::uint16_t>& pixels);

/// `quality` is 1..100; from 90 on, chroma has full resolution. Not suitable for depth or ids.
Bytes encodeJpeg(const Raster<std::uint8_t>& pixels, int quality);

/// NumPy's format, version 1.0, in C order and little-endian. Shape: (height, width), or (height,
/// width, 3) for three channels.
Bytes encodeNpy(const Raster<float>& pixels);
Bytes encodeNpy(const Raster<std::uint32_t>& pixels);
Bytes encodeNpy(const Raster<std::uint16_t>& pixels);
Bytes encodeNpy(const Raster<std::uint8_t>& pixels);

/// Depth quantised to 16-bit steps.
struct Depth16 {
  std::vector<std::uint16_t> steps;  ///< 0: background (NaN); never a surface
  std::size_t clampedPixels = 0;     ///< pixels beyond 65535 steps, clamped to 65535
};
/// Rounds to the nearest step; a surface nearer than half a step becomes 1. `stepsPerMetre` > 0.
Depth16 quantizeDepth(std::span<const float> metres, double stepsPerMetre);

/// A Zstandard frame of 2 * width * height bytes: the difference of each value to its left
/// neighbour, modulo 65536. First column: to the value above; first pixel: to 0. All low bytes come
/// first, then all high bytes. One channel.
Bytes packDepth(const Raster<std::uint16_t>& steps);

}  // namespace enfilade::render
