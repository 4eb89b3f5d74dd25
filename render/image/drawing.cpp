#include "render/image/drawing.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "render/image/font.hpp"

namespace enfilade::render {
namespace {

void blendPixel(Image& image, int x, int y, double cover, Colour c) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height || !(cover > 0)) return;
  const std::size_t at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                              static_cast<std::size_t>(x));
  const double share = std::min(cover, 1.0);
  for (std::size_t i = 0; i < 3; ++i) {
    const double old = image.rgb[at + i];
    image.rgb[at + i] = static_cast<std::uint8_t>(std::lround(old + share * (c[i] - old)));
  }
}

struct PixelRange {
  int first, last;  ///< last excluded
};

/// The pixels from `low` to `high`, clamped to 0..size; empty if either is NaN.
PixelRange computePixelRange(double low, double high, int size) {
  if (!(low <= high)) return {0, 0};
  return {static_cast<int>(std::floor(std::clamp(low, 0.0, static_cast<double>(size)))),
          static_cast<int>(std::ceil(std::clamp(high, 0.0, static_cast<double>(size))))};
}

}  // namespace

Image makeBlankImage(int width, int height, Colour c) {
  Image image{width, height, {}};
  image.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = c[i % 3];
  return image;
}

void paste(Image& onto, const Image& image, int left, int top) {
  ENFILADE_ASSERT(left >= 0 && left + image.width <= onto.width);
  ENFILADE_ASSERT(top >= 0 && top + image.height <= onto.height);
  for (int y = 0; y < image.height; ++y) {
    const auto from = image.rgb.begin() + static_cast<std::ptrdiff_t>(y) * image.width * 3;
    const auto to =
        onto.rgb.begin() + (static_cast<std::ptrdiff_t>(top + y) * onto.width + left) * 3;
    std::copy(from, from + static_cast<std::ptrdiff_t>(image.width) * 3, to);
  }
}

void drawLine(Image& image, double x0, double y0, double x1, double y1, double thickness,
              Colour c) {
  const double dx = x1 - x0, dy = y1 - y0;
  const double lengthSquared = dx * dx + dy * dy;
  if (!std::isfinite(lengthSquared) || !(thickness > 0)) return;
  const double half = thickness / 2, reach = half + 1;
  const PixelRange rows =
      computePixelRange(std::min(y0, y1) - reach, std::max(y0, y1) + reach, image.height);
  for (int y = rows.first; y < rows.last; ++y) {
    double left = std::min(x0, x1), right = std::max(x0, x1);
    if (std::abs(dy) > 1e-9) {  // only the section of the line near this row
      const double a = x0 + dx * (y + 0.5 - 2 * reach - y0) / dy;
      const double b = x0 + dx * (y + 0.5 + 2 * reach - y0) / dy;
      left = std::max(left, std::min(a, b));
      right = std::min(right, std::max(a, b));
    }
    const PixelRange columns = computePixelRange(left - reach, right + reach, image.width);
    for (int x = columns.first; x < columns.last; ++x) {
      const double px = x + 0.5 - x0, py = y + 0.5 - y0;
      const double fraction =
          lengthSquared > 0 ? std::clamp((px * dx + py * dy) / lengthSquared, 0.0, 1.0) : 0;
      const double distance = std::hypot(px - fraction * dx, py - fraction * dy);
      blendPixel(image, x, y, std::min(half + 0.5 - distance, thickness), c);
    }
  }
}

void drawDisc(Image& image, double x, double y, double radius, Colour c) {
  if (!std::isfinite(x) || !std::isfinite(y) || !(radius > 0)) return;
  const PixelRange rows = computePixelRange(y - radius - 1, y + radius + 1, image.height);
  const PixelRange columns = computePixelRange(x - radius - 1, x + radius + 1, image.width);
  for (int v = rows.first; v < rows.last; ++v) {
    for (int u = columns.first; u < columns.last; ++u) {
      blendPixel(image, u, v, radius + 0.5 - std::hypot(u + 0.5 - x, v + 0.5 - y), c);
    }
  }
}

void drawText(Image& image, int x, int y, const std::string& text, int scale, Colour c) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int left = x + static_cast<int>(i) * kLetterAdvance * scale;
    for (int row = 0; row < kLetterHeight * scale; ++row) {
      for (int column = 0; column < kLetterWidth * scale; ++column) {
        if (isLetterPixel(text[i], column / scale, row / scale))
          blendPixel(image, left + column, y + row, 1, c);
      }
    }
  }
}

}  // namespace enfilade::render
