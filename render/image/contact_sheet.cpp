#include "render/image/contact_sheet.hpp"

#include <algorithm>

#include "render/image/canvas.hpp"

namespace enfilade::render {
namespace {

// Pixels.
constexpr int kMaxCellWidth = 400, kMaxCellHeight = 400;
constexpr int kMargin = 16, kCaptionGap = 5;
constexpr double kTitleSize = 20, kCaptionSize = 11;
constexpr int kTitleHeight = 40, kCaptionHeight = kCaptionGap + 15;

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

}  // namespace

Image makeContactSheet(const std::vector<CaptionedImage>& pictures, const std::string& title,
                       int columns) {
  const Size cell = computeCellSize(pictures);
  const int count = static_cast<int>(pictures.size());
  const int across = std::clamp(columns, 1, std::max(1, count));
  const int down = (count + across - 1) / across;
  const int stepX = cell.width + kMargin, stepY = cell.height + kCaptionHeight + kMargin;
  Canvas sheet(kMargin + across * stepX, 2 * kMargin + kTitleHeight + down * stepY, kBackground);

  const double room = sheet.width() - 2 * kMargin;
  TextStyle titleStyle, captionStyle;
  titleStyle.size = kTitleSize, titleStyle.bold = true, titleStyle.colour = kTitle;
  captionStyle.size = kCaptionSize, captionStyle.colour = kCaption;
  sheet.text({kMargin, kMargin}, sheet.shorten(title, titleStyle, room), titleStyle);
  const double rule = kMargin + kTitleHeight - 6;
  sheet.line({kMargin, rule}, {sheet.width() - kMargin, rule}, 1, kRule);

  for (int i = 0; i < count; ++i) {
    const CaptionedImage& picture = pictures[static_cast<std::size_t>(i)];
    const int left = kMargin + i % across * stepX;
    const int top = 2 * kMargin + kTitleHeight + i / across * stepY;
    if (!picture.image.rgb.empty()) {
      const Size size = fitSize(picture.image, cell);
      sheet.image(resizeImage(picture.image, size.width, size.height),
                  {left + (cell.width - size.width) / 2.0, top + (cell.height - size.height) / 2.0},
                  size.width, size.height);
    }
    sheet.text({static_cast<double>(left), static_cast<double>(top + cell.height + kCaptionGap)},
               sheet.shorten(picture.caption, captionStyle, cell.width), captionStyle);
  }
  return sheet.toImage();
}

}  // namespace enfilade::render
