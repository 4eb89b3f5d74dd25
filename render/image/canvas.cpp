#include "render/image/canvas.hpp"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <pango/pangocairo.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <span>
#include <stdexcept>

#include "collision/assert.hpp"
#include "render/image/atomic_file.hpp"

namespace enfilade::render {
namespace {

constexpr const char* kFontFamily = "DejaVu Sans";

/// Lengths of dashes and gaps in turn, of the thickness. The round caps lengthen a dash by 1.
std::span<const double> getDashes(LineKind kind) {
  static constexpr std::array<double, 1> kDashed{3};
  static constexpr std::array<double, 2> kLongDashes{7, 3}, kDotted{0.01, 2.5};
  static constexpr std::array<double, 4> kDashDot{6, 2.5, 0.01, 2.5};
  switch (kind) {
    case LineKind::solid:
      return {};
    case LineKind::dashed:
      return kDashed;
    case LineKind::longDashes:
      return kLongDashes;
    case LineKind::dashDot:
      return kDashDot;
    case LineKind::dotted:
      return kDotted;
  }
  return {};
}

void setColour(cairo_t* cairo, Colour c, double opacity = 1) {
  cairo_set_source_rgba(cairo, c[0] / 255.0, c[1] / 255.0, c[2] / 255.0, opacity);
}

bool isFinite(Point p) {
  return std::isfinite(p.x) && std::isfinite(p.y);
}

/// Replaces invalid UTF-8, so that Pango shows the rest.
std::string toUtf8(const std::string& text) {
  char* const valid = g_utf8_make_valid(text.data(), static_cast<gssize>(text.size()));
  std::string result(valid);
  g_free(valid);
  return result;
}

/// The fonts of all threads: Fontconfig loses what a thread's own map holds when the thread ends.
struct Fonts {
  std::recursive_mutex mutex;
  PangoContext* context = pango_font_map_create_context(pango_cairo_font_map_new());
};

Fonts& getFonts() {
  static Fonts shared;
  return shared;
}

/// A layout of Pango for one line of text. Locks the fonts.
class Layout {
 public:
  Layout(cairo_t* cairo, const std::string& text, const TextStyle& style)
      : lock_(getFonts().mutex) {
    pango_cairo_update_context(cairo, getFonts().context);
    layout_ = pango_layout_new(getFonts().context);
    PangoFontDescription* const font = pango_font_description_new();
    pango_font_description_set_family(font, kFontFamily);
    pango_font_description_set_absolute_size(font, style.size * PANGO_SCALE);
    pango_font_description_set_weight(font, style.bold ? PANGO_WEIGHT_BOLD : PANGO_WEIGHT_NORMAL);
    pango_layout_set_font_description(layout_, font);
    pango_font_description_free(font);
    pango_layout_set_single_paragraph_mode(layout_, TRUE);
    pango_layout_set_text(layout_, toUtf8(text).c_str(), -1);
  }
  ~Layout() { g_object_unref(layout_); }
  Layout(const Layout&) = delete;
  Layout& operator=(const Layout&) = delete;

  PangoLayout* get() const { return layout_; }
  TextSize size() const {
    int width = 0, height = 0;
    pango_layout_get_size(layout_, &width, &height);
    return {static_cast<double>(width) / PANGO_SCALE, static_cast<double>(height) / PANGO_SCALE};
  }

 private:
  std::lock_guard<std::recursive_mutex> lock_;
  PangoLayout* layout_ = nullptr;
};

cairo_surface_t* makeImageSurface(int width, int height) {
  cairo_surface_t* const surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
  if (cairo_surface_status(surface) != CAIRO_STATUS_SUCCESS)
    throw std::runtime_error("cannot make a picture of " + std::to_string(width) + " x " +
                             std::to_string(height) + " pixels");
  return surface;
}

/// Cairo's pixels are 32-bit words 0x00RRGGBB.
cairo_surface_t* toSurface(const Image& image) {
  cairo_surface_t* const surface = makeImageSurface(image.width, image.height);
  unsigned char* const data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  const std::uint8_t* from = image.rgb.data();
  for (int y = 0; y < image.height; ++y) {
    auto* to = reinterpret_cast<std::uint32_t*>(data + static_cast<std::ptrdiff_t>(y) * stride);
    for (int x = 0; x < image.width; ++x, from += 3)
      to[x] = std::uint32_t{from[0]} << 16 | std::uint32_t{from[1]} << 8 | from[2];
  }
  cairo_surface_mark_dirty(surface);
  return surface;
}

cairo_status_t appendBytes(void* bytes, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

struct Canvas::State {
  cairo_surface_t* surface = nullptr;
  cairo_t* cairo = nullptr;
  double width = 0, height = 0;
  std::filesystem::path file;  ///< of a page
  std::string bytes;           ///< of a page
  std::string textWithoutFont;

  State(cairo_surface_t* owned, double w, double h)
      : surface(owned), cairo(cairo_create(owned)), width(w), height(h) {
    cairo_set_line_cap(cairo, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
    cairo_set_fill_rule(cairo, CAIRO_FILL_RULE_EVEN_ODD);
  }
  State() = default;
  ~State() {
    if (cairo) cairo_destroy(cairo);
    if (surface) cairo_surface_destroy(surface);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void stroke(double thickness, Colour colour, LineKind kind = LineKind::solid) const {
    const std::span<const double> shares = getDashes(kind);
    std::array<double, 4> dashes{};
    ENFILADE_ASSERT(shares.size() <= dashes.size());
    std::ranges::transform(shares, dashes.begin(), [&](double share) { return share * thickness; });
    cairo_set_dash(cairo, dashes.data(), static_cast<int>(shares.size()), 0);
    cairo_set_line_width(cairo, thickness);
    setColour(cairo, colour);
    cairo_stroke(cairo);
  }
};

Canvas::Canvas(int width, int height, Colour paper)
    : state_(std::make_unique<State>(makeImageSurface(width, height), width, height)) {
  setColour(state_->cairo, paper);
  cairo_paint(state_->cairo);
}

Canvas::Canvas(const Image& image)
    : state_(std::make_unique<State>(toSurface(image), image.width, image.height)) {}

Canvas::Canvas(const std::filesystem::path& file, double width, double height, Colour paper) {
  const std::string extension = file.extension().string();
  if (extension != ".svg" && extension != ".pdf")
    throw std::invalid_argument(file.string() + ": a page is a .svg or .pdf file");
  state_ = std::make_unique<State>();
  const auto make = extension == ".svg" ? cairo_svg_surface_create_for_stream
                                        : cairo_pdf_surface_create_for_stream;
  auto page =
      std::make_unique<State>(make(appendBytes, &state_->bytes, width, height), width, height);
  std::swap(state_->surface, page->surface);
  std::swap(state_->cairo, page->cairo);
  state_->width = width, state_->height = height, state_->file = file;
  setColour(state_->cairo, paper);
  cairo_paint(state_->cairo);
}

Canvas::~Canvas() = default;
Canvas::Canvas(Canvas&&) noexcept = default;
Canvas& Canvas::operator=(Canvas&&) noexcept = default;

double Canvas::width() const {
  return state_->width;
}
double Canvas::height() const {
  return state_->height;
}

void Canvas::line(Point from, Point to, double thickness, Colour colour) {
  polyline(std::array{from, to}, thickness, colour);
}

void Canvas::polyline(std::span<const Point> points, double thickness, Colour colour,
                      LineKind kind) {
  if (!std::ranges::all_of(points, isFinite)) return;
  for (const Point& p : points) cairo_line_to(state_->cairo, p.x, p.y);
  state_->stroke(thickness, colour, kind);
}

void Canvas::fill(std::span<const std::vector<Point>> loops, Colour colour, double opacity) {
  for (const std::vector<Point>& loop : loops) {
    if (!std::ranges::all_of(loop, isFinite)) continue;
    cairo_new_sub_path(state_->cairo);
    for (const Point& p : loop) cairo_line_to(state_->cairo, p.x, p.y);
    cairo_close_path(state_->cairo);
  }
  setColour(state_->cairo, colour, opacity);
  cairo_fill(state_->cairo);
}

void Canvas::arc(Point centre, double radius, double from, double to, double thickness,
                 Colour colour, LineKind kind) {
  if (!isFinite(centre) || !(radius > 0)) return;
  cairo_new_sub_path(state_->cairo);
  cairo_arc(state_->cairo, centre.x, centre.y, radius, std::min(from, to), std::max(from, to));
  state_->stroke(thickness, colour, kind);
}

void Canvas::disc(Point centre, double radius, Colour colour) {
  if (!isFinite(centre) || !(radius > 0)) return;
  cairo_new_sub_path(state_->cairo);
  cairo_arc(state_->cairo, centre.x, centre.y, radius, 0, 2 * M_PI);
  setColour(state_->cairo, colour);
  cairo_fill(state_->cairo);
}

void Canvas::rectangle(Point topLeft, double width, double height, double thickness,
                       Colour colour) {
  cairo_rectangle(state_->cairo, topLeft.x, topLeft.y, width, height);
  state_->stroke(thickness, colour);
}

void Canvas::image(const Image& image, Point topLeft, double width, double height) {
  cairo_surface_t* const surface = toSurface(image);
  cairo_t* const cairo = state_->cairo;
  cairo_save(cairo);
  cairo_translate(cairo, topLeft.x, topLeft.y);
  cairo_scale(cairo, width / image.width, height / image.height);
  cairo_set_source_surface(cairo, surface, 0, 0);
  // Without this the last row and column blend with the paper.
  cairo_pattern_set_extend(cairo_get_source(cairo), CAIRO_EXTEND_PAD);
  cairo_rectangle(cairo, 0, 0, image.width, image.height);
  cairo_fill(cairo);
  cairo_restore(cairo);
  cairo_surface_destroy(surface);
}

void Canvas::text(Point at, const std::string& text, const TextStyle& style, Align align) {
  if (!isFinite(at)) return;
  const Layout layout(state_->cairo, text, style);
  if (state_->textWithoutFont.empty() && pango_layout_get_unknown_glyphs_count(layout.get()) > 0)
    state_->textWithoutFont = text;
  const double width = layout.size().width;
  const double shift = align == Align::left ? 0 : align == Align::right ? width : width / 2;
  cairo_move_to(state_->cairo, at.x - shift, at.y);
  if (style.halo > 0) {
    pango_cairo_layout_path(state_->cairo, layout.get());
    state_->stroke(2 * style.halo, style.haloColour);
    cairo_move_to(state_->cairo, at.x - shift, at.y);
  }
  setColour(state_->cairo, style.colour);
  pango_cairo_show_layout(state_->cairo, layout.get());
  cairo_new_path(state_->cairo);
}

const std::string& Canvas::textWithoutFont() const {
  return state_->textWithoutFont;
}

TextSize Canvas::measure(const std::string& text, const TextStyle& style) const {
  return Layout(state_->cairo, text, style).size();
}

std::string Canvas::shorten(const std::string& text, const TextStyle& style, double width) const {
  const Layout whole(state_->cairo, text, style);
  if (whole.size().width <= width) return text;
  const std::string valid = toUtf8(text);
  const char* const begin = valid.c_str();
  for (const char* end = begin + valid.size(); end > begin;) {
    end = g_utf8_prev_char(end);
    const std::string cut = std::string(begin, end) + "…";
    if (measure(cut, style).width <= width) return cut;
  }
  return "…";
}

std::vector<std::string> Canvas::wrap(const std::string& text, const TextStyle& style, double width,
                                      std::size_t maxLines) const {
  ENFILADE_ASSERT(maxLines > 0);
  const std::string valid = toUtf8(text);
  const Layout layout(state_->cairo, valid, style);
  pango_layout_set_width(layout.get(), std::max(1, static_cast<int>(width * PANGO_SCALE)));
  pango_layout_set_wrap(layout.get(), PANGO_WRAP_WORD_CHAR);
  std::vector<std::string> lines;
  const int count = pango_layout_get_line_count(layout.get());
  for (int i = 0; i < count; ++i) {
    const auto first =
        static_cast<std::size_t>(pango_layout_get_line_readonly(layout.get(), i)->start_index);
    if (lines.size() + 1 == maxLines) {
      lines.push_back(shorten(valid.substr(first), style, width));
      break;
    }
    const auto length =
        static_cast<std::size_t>(pango_layout_get_line_readonly(layout.get(), i)->length);
    std::string line = valid.substr(first, length);
    line.erase(line.find_last_not_of(' ') + 1);
    lines.push_back(std::move(line));
  }
  return lines;
}

void Canvas::beginClip(Point topLeft, double width, double height) {
  cairo_save(state_->cairo);
  cairo_rectangle(state_->cairo, topLeft.x, topLeft.y, width, height);
  cairo_clip(state_->cairo);
}

void Canvas::endClip() {
  cairo_restore(state_->cairo);
}

Image Canvas::toImage() const {
  ENFILADE_ASSERT(state_->file.empty());
  cairo_surface_flush(state_->surface);
  Image image{static_cast<int>(state_->width), static_cast<int>(state_->height), {}};
  image.rgb.resize(3 * static_cast<std::size_t>(image.width) *
                   static_cast<std::size_t>(image.height));
  const unsigned char* const data = cairo_image_surface_get_data(state_->surface);
  const int stride = cairo_image_surface_get_stride(state_->surface);
  std::uint8_t* to = image.rgb.data();
  for (int y = 0; y < image.height; ++y) {
    const auto* from =
        reinterpret_cast<const std::uint32_t*>(data + static_cast<std::ptrdiff_t>(y) * stride);
    for (int x = 0; x < image.width; ++x) {
      *to++ = static_cast<std::uint8_t>(from[x] >> 16);
      *to++ = static_cast<std::uint8_t>(from[x] >> 8);
      *to++ = static_cast<std::uint8_t>(from[x]);
    }
  }
  return image;
}

void Canvas::finish() {
  ENFILADE_ASSERT(!state_->file.empty());
  cairo_surface_finish(state_->surface);
  const cairo_status_t status = cairo_surface_status(state_->surface);
  if (status != CAIRO_STATUS_SUCCESS)
    throw std::runtime_error(state_->file.string() + ": " + cairo_status_to_string(status));
  writeFileAtomically(state_->file, state_->bytes);
}

}  // namespace enfilade::render
