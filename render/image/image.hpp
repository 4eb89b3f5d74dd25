// Pictures for people: PNG files, a contact sheet of frames with captions, paths drawn on a plan.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "render/frame.hpp"

namespace enfilade::render {

/// sRGB, 3 bytes a pixel, row 0 at the top.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};
using Colour = std::array<std::uint8_t, 3>;

Image colourOf(const Frame& frame);

/// PNG in memory. Throws std::runtime_error.
std::vector<std::uint8_t> encodePng(const Image& image);
Image decodePng(const std::vector<std::uint8_t>& png);
/// Writes to a neighbour file and renames it, so that a file with this name is whole.
/// A link is followed, a device or a pipe written into. Throws std::runtime_error naming the file.
void writeFileWhole(const std::filesystem::path& file, const void* data, std::size_t bytes);
void writePng(const std::filesystem::path& file, const Image& image);

void drawLine(Image& image, double x0, double y0, double x1, double y1, double thickness, Colour c);
void drawDisc(Image& image, double x, double y, double radius, Colour c);
/// ASCII text in an embedded font; (x, y) is its top left; `scale` 1 is about 8 pixels a letter.
void drawText(Image& image, int x, int y, const std::string& text, int scale, Colour c);

/// Box filter in linear light. `width` and `height` are at least 1.
Image scaled(const Image& image, int width, int height);

struct Captioned {
  Image image;
  std::string caption;
};
/// A grid of pictures, each scaled to fit a cell, with its caption below and a title on top.
Image contactSheet(const std::vector<Captioned>& pictures, const std::string& title, int columns);

/// Pixel of a world point in a picture taken with `camera` (x right, y down, from the top left
/// corner); the third is its z-distance. Not a number (x, y) when it is behind a perspective's eye.
Vec3 project(const Camera& camera, const Vec3& worldPoint);

}  // namespace enfilade::render
