#include <algorithm>
#include <array>

#include "render/image/font.hpp"
#include "render/image/image.hpp"

namespace enfilade::render {
namespace {

// Pixels.
constexpr int kWidestCell = 400, kTallestCell = 400;
constexpr int kMargin = 16, kCaptionGap = 7;
constexpr int kTitleScale = 3, kCaptionScale = 1;
constexpr int kTitleHeight = kTitleScale * kLetterHeight + kMargin;
constexpr int kCaptionHeight = kCaptionGap + kCaptionScale * kLetterHeight;

constexpr Colour kBackground{24, 26, 31}, kTitle{240, 238, 230}, kCaption{176, 180, 188};
constexpr Colour kRule{70, 75, 86};

struct Size {
  int width, height;
};

Size fitted(const Image& image, Size cell) {
  const double shrink = std::min({1.0, static_cast<double>(cell.width) / image.width,
                                  static_cast<double>(cell.height) / image.height});
  return {std::max(1, static_cast<int>(image.width * shrink + 0.5)),
          std::max(1, static_cast<int>(image.height * shrink + 0.5))};
}

/// As large as the largest picture once it is scaled to fit.
Size cellFor(const std::vector<Captioned>& pictures) {
  Size cell{120, 1};
  for (const Captioned& picture : pictures) {
    if (picture.image.rgb.empty()) continue;
    const Size size = fitted(picture.image, {kWidestCell, kTallestCell});
    cell = {std::max(cell.width, size.width), std::max(cell.height, size.height)};
  }
  return cell;
}

void paste(Image& sheet, const Image& image, int left, int top) {
  const std::size_t row = 3 * static_cast<std::size_t>(image.width);
  for (int y = 0; y < image.height; ++y) {
    const std::size_t from = static_cast<std::size_t>(y) * row;
    const std::size_t to =
        3 * (static_cast<std::size_t>(top + y) * static_cast<std::size_t>(sheet.width) +
             static_cast<std::size_t>(left));
    std::copy_n(image.rgb.begin() + static_cast<std::ptrdiff_t>(from), row,
                sheet.rgb.begin() + static_cast<std::ptrdiff_t>(to));
  }
}

Image blank(int width, int height, Colour c) {
  Image image{width, height, {}};
  image.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = c[i % 3];
  return image;
}

/// Cut to what fits into `width` pixels, with dots for the rest.
std::string shortened(const std::string& text, int width, int scale) {
  const auto most = static_cast<std::size_t>(std::max(3, width / (kLetterAdvance * scale)));
  return text.size() <= most ? text : text.substr(0, most - 2) + "..";
}

}  // namespace

Image contactSheet(const std::vector<Captioned>& pictures, const std::string& title, int columns) {
  const Size cell = cellFor(pictures);
  const int count = static_cast<int>(pictures.size());
  const int across = std::clamp(columns, 1, std::max(1, count));
  const int down = (count + across - 1) / across;
  const int stepX = cell.width + kMargin, stepY = cell.height + kCaptionHeight + kMargin;
  Image sheet =
      blank(kMargin + across * stepX, 2 * kMargin + kTitleHeight + down * stepY, kBackground);

  const int room = sheet.width - 2 * kMargin;
  const bool large = static_cast<int>(title.size()) * kLetterAdvance * kTitleScale <= room;
  const int titleScale = large ? kTitleScale : kTitleScale - 1;
  drawText(sheet, kMargin, kMargin, shortened(title, room, titleScale), titleScale, kTitle);
  drawLine(sheet, kMargin, kMargin + kTitleHeight - 4, sheet.width - kMargin,
           kMargin + kTitleHeight - 4, 1, kRule);

  for (int i = 0; i < count; ++i) {
    const Captioned& picture = pictures[static_cast<std::size_t>(i)];
    const int left = kMargin + i % across * stepX;
    const int top = 2 * kMargin + kTitleHeight + i / across * stepY;
    if (!picture.image.rgb.empty()) {
      const Size size = fitted(picture.image, cell);
      paste(sheet, scaled(picture.image, size.width, size.height),
            left + (cell.width - size.width) / 2, top + (cell.height - size.height) / 2);
    }
    drawText(sheet, left, top + cell.height + kCaptionGap,
             shortened(picture.caption, cell.width, kCaptionScale), kCaptionScale, kCaption);
  }
  return sheet;
}

}  // namespace enfilade::render
