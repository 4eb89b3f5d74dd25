// Draws lines, discs, text and other images on images.
#pragma once

#include <array>
#include <string>

#include "render/image/image.hpp"

namespace enfilade::render {

using Colour = std::array<std::uint8_t, 3>;  ///< sRGB

Image makeBlankImage(int width, int height, Colour c);
/// Copies `image` to `onto` at (left, top). It must fit.
void paste(Image& onto, const Image& image, int left, int top);

void drawLine(Image& image, double x0, double y0, double x1, double y1, double thickness, Colour c);
void drawDisc(Image& image, double x, double y, double radius, Colour c);
/// ASCII text in the embedded font; (x, y) is the top left corner; `scale` 1: letters 8 pixels
/// high.
void drawText(Image& image, int x, int y, const std::string& text, int scale, Colour c);

}  // namespace enfilade::render
