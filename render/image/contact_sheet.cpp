#include "render/image/contact_sheet.hpp"

#include <algorithm>

#include "render/image/canvas.hpp"

namespace enfilade::render {
namespace {

// Pixels.
constexpr int kMaxCellWidth = 400, kMaxCellHeight = 400;
constexpr int kMargin = 16, kCaptionGap = 5;
constexpr double kTitleSize = 20, kCaptionSize = 11;
constexpr int kTitleLine = 26, kTitleGap = 14, kCaptionLine = 15;
constexpr std::size_t kMaxTitleLines = 4, kMaxCaptionLines = 3;

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

TextStyle makeStyle(double size, Colour colour, bool bold) {
  TextStyle style;
  style.size = size, style.colour = colour, style.bold = bold;
  return style;
}

using Lines = std::vector<std::string>;

void drawLines(Canvas& sheet, const Lines& lines, Point at, double lineHeight,
               const TextStyle& style) {
  for (std::size_t i = 0; i < lines.size(); ++i)
    sheet.text({at.x, at.y + static_cast<double>(i) * lineHeight}, lines[i], style);
}

void drawPicture(Canvas& sheet, const Image& image, Point at, Size cell) {
  if (image.rgb.empty()) return;
  const Size size = fitSize(image, cell);
  sheet.image(resizeImage(image, size.width, size.height),
              {at.x + (cell.width - size.width) / 2.0, at.y + (cell.height - size.height) / 2.0},
              size.width, size.height);
}

}  // namespace

Image makeContactSheet(const std::vector<CaptionedImage>& pictures, const std::string& title,
                       int columns) {
  const Size cell = computeCellSize(pictures);
  const int count = static_cast<int>(pictures.size());
  const int across = std::clamp(columns, 1, std::max(1, count));
  const int down = (count + across - 1) / across;
  const int stepX = cell.width + kMargin, width = kMargin + across * stepX;
  const TextStyle titleStyle = makeStyle(kTitleSize, kTitle, true),
                  captionStyle = makeStyle(kCaptionSize, kCaption, false);

  const Canvas measuring(1, 1, kBackground);
  const Lines titleLines = measuring.wrap(title, titleStyle, width - 2 * kMargin, kMaxTitleLines);
  std::vector<Lines> captions;
  std::size_t captionRows = 1;
  for (const CaptionedImage& picture : pictures) {
    captions.push_back(measuring.wrap(picture.caption, captionStyle, cell.width, kMaxCaptionLines));
    captionRows = std::max(captionRows, captions.back().size());
  }
  const int titleHeight = static_cast<int>(titleLines.size()) * kTitleLine + kTitleGap;
  const int stepY =
      cell.height + kCaptionGap + static_cast<int>(captionRows) * kCaptionLine + kMargin;

  Canvas sheet(width, 2 * kMargin + titleHeight + down * stepY, kBackground);
  drawLines(sheet, titleLines, {kMargin, kMargin}, kTitleLine, titleStyle);
  const double rule = kMargin + titleHeight - 6;
  sheet.line({kMargin, rule}, {sheet.width() - kMargin, rule}, 1, kRule);
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const double left = kMargin + i % across * stepX;
    const double top = 2 * kMargin + titleHeight + i / across * stepY;
    drawPicture(sheet, pictures[index].image, {left, top}, cell);
    drawLines(sheet, captions[index], {left, top + cell.height + kCaptionGap}, kCaptionLine,
              captionStyle);
  }
  return sheet.toImage();
}

}  // namespace enfilade::render
