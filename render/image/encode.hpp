// Pictures and channels as files in memory: PNG, JPEG, NPY, packed 16-bit depth. Callable from any
// thread, several at once; the bytes depend on the pixels alone.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade::render {

using Bytes = std::vector<std::uint8_t>;

/// Pixels that somebody else owns, rows from the top: value c of pixel (x, y) is at index
/// (y * width + x) * channels + c.
template <class Value>
struct Raster {
  int width = 0, height = 0;  ///< pixels, at least 1
  int channels = 1;           ///< 1: grey, 3: red, green, blue
  std::span<const Value> values;
};

// All throw std::runtime_error: for values that do not fill the picture, and where a library fails.

Bytes encodePng(const Raster<std::uint8_t>& pixels);
Bytes encodePng(const Raster<std::uint16_t>& pixels);

/// `quality` is 1..100; from 90 on colour is kept at full resolution. Never for depth or ids.
Bytes encodeJpeg(const Raster<std::uint8_t>& pixels, int quality);

/// NumPy's format, version 1.0, in C order and little-endian: shape (height, width), or (height,
/// width, 3) where there are three channels.
Bytes encodeNpy(const Raster<float>& pixels);
Bytes encodeNpy(const Raster<std::uint32_t>& pixels);
Bytes encodeNpy(const Raster<std::uint16_t>& pixels);
Bytes encodeNpy(const Raster<std::uint8_t>& pixels);

/// Metres in whole steps, as files of 16-bit depth have them.
struct Depth16 {
  std::vector<std::uint16_t> steps;  ///< 0: nothing is seen there (not a number); never a surface
  std::size_t tooFar = 0;            ///< pixels beyond 65535 steps; they are 65535
};
/// Rounded to the nearest step; a surface nearer than half a step is 1. `stepsPerMetre` > 0.
Depth16 depth16(std::span<const float> metres, double stepsPerMetre);

/// A Zstandard frame of 2 * width * height bytes: each value less its left neighbour's (of the
/// first column, the one's above; of the first pixel, 0) modulo 65536; first the low bytes of all,
/// then the high bytes. One channel.
Bytes packDepth(const Raster<std::uint16_t>& steps);
/// The values again. Throws for bytes that packDepth() did not make for that size.
std::vector<std::uint16_t> unpackDepth(std::span<const std::uint8_t> packed, int width, int height);

}  // namespace enfilade::render
