#include "render/image/contact_sheet.hpp"

#include <algorithm>

#include "render/image/drawing.hpp"
#include "render/image/font.hpp"

namespace enfilade::render {
namespace {

// Pixels.
constexpr int kMaxCellWidth = 400, kMaxCellHeight = 400;
constexpr int kMargin = 16, kCaptionGap = 7;
constexpr int kTitleScale = 3, kCaptionScale = 1;
constexpr int kTitleHeight = kTitleScale * kLetterHeight + kMargin;
constexpr int kCaptionHeight = kCaptionGap + kCaptionScale * kLetterHeight;

constexpr Colour kBackground{24, 26, 31}, kTitle{240, 238, 230}, kCaption{176, 180, 188};
constexpr Colour kRule{70, 75, 86};

struct Size {
  int width, height;
};

Size fitSize(const Image& image, Size cell) {
  const double shrink = std::min({1.0, static_cast<double>(cell.width) / image.width,
                                  static_cast<double>(cell.height) / image.height});
  return {std::max(1, static_cast<int>(image.width * shrink + 0.5)),
          std::max(1, static_cast<int>(image.height * shrink + 0.5))};
}

/// The size of the largest image after scaling.
Size computeCellSize(const std::vector<CaptionedImage>& pictures) {
  Size cell{120, 1};
  for (const CaptionedImage& picture : pictures) {
    if (picture.image.rgb.empty()) continue;
    const Size size = fitSize(picture.image, {kMaxCellWidth, kMaxCellHeight});
    cell = {std::max(cell.width, size.width), std::max(cell.height, size.height)};
  }
  return cell;
}

/// Truncates the text to `width` pixels and appends dots.
std::string shortenText(const std::string& text, int width, int scale) {
  const auto maxLetters = static_cast<std::size_t>(std::max(3, width / (kLetterAdvance * scale)));
  return text.size() <= maxLetters ? text : text.substr(0, maxLetters - 2) + "..";
}

}  // namespace

Image makeContactSheet(const std::vector<CaptionedImage>& pictures, const std::string& title,
                       int columns) {
  const Size cell = computeCellSize(pictures);
  const int count = static_cast<int>(pictures.size());
  const int across = std::clamp(columns, 1, std::max(1, count));
  const int down = (count + across - 1) / across;
  const int stepX = cell.width + kMargin, stepY = cell.height + kCaptionHeight + kMargin;
  Image sheet = makeBlankImage(kMargin + across * stepX, 2 * kMargin + kTitleHeight + down * stepY,
                               kBackground);

  const int room = sheet.width - 2 * kMargin;
  const bool large = static_cast<int>(title.size()) * kLetterAdvance * kTitleScale <= room;
  const int titleScale = large ? kTitleScale : kTitleScale - 1;
  drawText(sheet, kMargin, kMargin, shortenText(title, room, titleScale), titleScale, kTitle);
  drawLine(sheet, kMargin, kMargin + kTitleHeight - 4, sheet.width - kMargin,
           kMargin + kTitleHeight - 4, 1, kRule);

  for (int i = 0; i < count; ++i) {
    const CaptionedImage& picture = pictures[static_cast<std::size_t>(i)];
    const int left = kMargin + i % across * stepX;
    const int top = 2 * kMargin + kTitleHeight + i / across * stepY;
    if (!picture.image.rgb.empty()) {
      const Size size = fitSize(picture.image, cell);
      paste(sheet, resizeImage(picture.image, size.width, size.height),
            left + (cell.width - size.width) / 2, top + (cell.height - size.height) / 2);
    }
    drawText(sheet, left, top + cell.height + kCaptionGap,
             shortenText(picture.caption, cell.width, kCaptionScale), kCaptionScale, kCaption);
  }
  return sheet;
}

}  // namespace enfilade::render
