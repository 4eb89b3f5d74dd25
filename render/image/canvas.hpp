// Canvas: anti-aliased lines, areas, pictures and UTF-8 text on an image, an SVG or a PDF page
// (Cairo and Pango).
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "render/image/image.hpp"

namespace enfilade::render {

using Colour = std::array<std::uint8_t, 3>;  ///< sRGB

/// Units of a canvas: pixels of an image, points (1/72 inch) of a page; y points down.
struct Point {
  double x = 0, y = 0;
};

struct TextStyle {
  double size = 12;  ///< height of a line's letters, units
  Colour colour{30, 30, 36};
  bool bold = false;
  double halo = 0;  ///< width of an outline in `haloColour`, units
  Colour haloColour{250, 249, 246};
};

enum class Align : std::uint8_t { left, centre, right };

enum class LineKind : std::uint8_t { solid, dashed, longDashes, dashDot, dotted };

struct TextSize {
  double width = 0, height = 0;  ///< units
};

class Canvas {
 public:
  Canvas(int width, int height, Colour paper);  ///< an image
  explicit Canvas(const Image& image);          ///< a copy of an image, to draw on
  /// A page of a file, .svg or .pdf; finish() writes it. Throws std::invalid_argument for another
  /// extension.
  Canvas(const std::filesystem::path& file, double width, double height, Colour paper);
  ~Canvas();
  Canvas(Canvas&&) noexcept;
  Canvas& operator=(Canvas&&) noexcept;

  double width() const;
  double height() const;

  void line(Point from, Point to, double thickness, Colour colour);
  void polyline(std::span<const Point> points, double thickness, Colour colour,
                LineKind kind = LineKind::solid);
  /// Fills the loops by the even-odd rule.
  void fill(std::span<const std::vector<Point>> loops, Colour colour, double opacity = 1);
  /// Arc from angle `from` to `to`, radians, from +x towards +y.
  void arc(Point centre, double radius, double from, double to, double thickness, Colour colour,
           LineKind kind = LineKind::solid);
  void disc(Point centre, double radius, Colour colour);
  void rectangle(Point topLeft, double width, double height, double thickness, Colour colour);
  /// Draws the image scaled to `width` x `height` units.
  void image(const Image& image, Point topLeft, double width, double height);

  /// (x, y) is the top of the text's line, at its left end, centre or right end. Invalid UTF-8 is
  /// shown with replacement characters.
  void text(Point at, const std::string& text, const TextStyle& style, Align align = Align::left);
  /// The first drawn text with letters that no font of this machine has; empty: none.
  const std::string& textWithoutFont() const;
  TextSize measure(const std::string& text, const TextStyle& style) const;
  /// The text, cut to `width` units with an ellipsis.
  std::string shorten(const std::string& text, const TextStyle& style, double width) const;
  /// Lines of at most `width` units: broken between words, or in a word that is longer. Of more
  /// than `maxLines` the last is cut with an ellipsis.
  std::vector<std::string> wrap(const std::string& text, const TextStyle& style, double width,
                                std::size_t maxLines) const;

  /// Restricts drawing to a rectangle until the next call of endClip().
  void beginClip(Point topLeft, double width, double height);
  void endClip();

  Image toImage() const;  ///< of an image's canvas
  void finish();          ///< of a page's: writes the file. Throws std::runtime_error

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
