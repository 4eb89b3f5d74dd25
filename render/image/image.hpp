// 8-bit images for viewing, and PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "render/frame.hpp"

namespace enfilade::render {

/// An sRGB image, 3 bytes per pixel, row 0 at the top.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

Image toImage(const Frame& frame);

/// PNG in memory. Throws std::runtime_error.
std::vector<std::uint8_t> encodePng(const Image& image);
Image decodePng(const std::vector<std::uint8_t>& png);
/// Writes the file like writeFileAtomically().
void writePng(const std::filesystem::path& file, const Image& image);

/// Box filter in linear light. `width` and `height` are at least 1.
Image resizeImage(const Image& image, int width, int height);

}  // namespace enfilade::render
