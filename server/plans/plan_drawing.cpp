#include "server/plans/plan_drawing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/log/log.hpp"

namespace enfilade::server {
namespace {

using render::Canvas;
using render::Colour;
using render::Point;
using render::TextStyle;

constexpr double kMinGridSpacing = 70;  // thin lines between two numbers of the frame
constexpr Colour kWall{52, 54, 62}, kFurniture{206, 210, 220}, kOutline{110, 114, 126},
    kDoor{150, 90, 30}, kGrid{214, 218, 228}, kAxis{180, 60, 40};
constexpr double kTextSize = 13;  // thin lines

std::vector<Point> toPage(const PlanView& view, const std::vector<Vec3>& points) {
  std::vector<Point> page;
  for (const Vec3& point : points) page.push_back(view.at(point));
  return page;
}

std::vector<std::vector<Point>> toPage(const PlanView& view,
                                       const std::vector<std::vector<Vec3>>& lines) {
  std::vector<std::vector<Point>> page;
  for (const auto& line : lines) page.push_back(toPage(view, line));
  return page;
}

/// How the shapes of a kind are drawn.
struct ShapeStyle {
  Colour stroke;
  double thickness = 1;  ///< thin lines
  std::optional<Colour> fill;
  double opacity = 1;  ///< of the fill
  render::LineKind line = render::LineKind::solid;
};

ShapeStyle makeShapeStyle(PlanShape::Kind kind) {
  switch (kind) {
    case PlanShape::Kind::furniture:
      return {kOutline, 0.8, kFurniture, 0.8};
    case PlanShape::Kind::wall:
      return {kWall, 1.2, kWall};
    case PlanShape::Kind::body:
      return {kOutline, 1, kFurniture};
    case PlanShape::Kind::door:
      return {kDoor, 1, kDoor};
    case PlanShape::Kind::openDoor:
      return {kDoor, 1.5, std::nullopt};
    case PlanShape::Kind::swing:
      return {kDoor, 1, std::nullopt, 1, render::LineKind::dashed};
    case PlanShape::Kind::lift:
      return {kDoor, 1, std::nullopt};
  }
  return {kOutline, 1, std::nullopt};
}

void drawShape(Canvas& canvas, const PlanView& view, const PlanShape& shape) {
  const ShapeStyle style = makeShapeStyle(shape.kind);
  std::vector<std::vector<Point>> loops = toPage(view, shape.loops);
  if (style.fill) canvas.fill(loops, *style.fill, style.opacity);
  for (std::vector<Point>& loop : loops) loop.push_back(loop.front());
  for (const auto& lines : {loops, toPage(view, shape.lines)})
    for (const std::vector<Point>& line : lines)
      canvas.polyline(line, style.thickness * view.unit, style.stroke, style.line);
}

// ---- grid ---------------------------------------------------------------------------------------

/// A step of 1, 2 or 5 times a power of ten metres with enough space for the numbers.
double chooseGridStep(const PlanView& view) {
  double step = 0.01;
  for (int i = 0; i < 60; ++i) {  // up to 10^18 m
    if (step * view.unitsPerMetre >= kMinGridSpacing * view.unit) return step;
    step *= i % 3 == 1 ? 2.5 : 2;
  }
  return step;
}

std::string formatNumber(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

/// Calls visit(coordinate) for each grid line of an axis; the axis itself is exactly 0.
template <class Visit>
void forEachGridLine(double from, double to, double step, const Visit& visit) {
  for (double k = std::ceil(from / step); k * step <= to; ++k) visit(k == 0 ? 0.0 : k * step);
}

/// A needle, half filled, and an N beyond its tip. The page's axes are the scene's x and z.
void drawNorthArrow(Canvas& canvas, const PlanView& view, Point centre,
                    const Eigen::Vector2d& north) {
  const double length = 15 * view.unit, half = 6 * view.unit;
  const auto at = [&](double along, double across) {
    return Point{centre.x + along * north.x() - across * north.y(),
                 centre.y + along * north.y() + across * north.x()};
  };
  const Point tip = at(length, 0), notch = at(-0.4 * length, 0);
  const Point left = at(-length, -half), right = at(-length, half);
  canvas.fill(std::vector<std::vector<Point>>{{tip, notch, left}}, kPlanInk);
  canvas.polyline(std::array{tip, left, notch, right, tip}, 1.2 * view.unit, kPlanInk);
  TextStyle style;
  style.size = kTextSize * view.unit, style.colour = kPlanInk, style.bold = true;
  const Point beyond = at(length + 0.8 * style.size, 0);
  canvas.text({beyond.x, beyond.y - 0.6 * style.size}, "N", style, render::Align::centre);
}

}  // namespace

PlanView makePlanView(const render::Camera& camera, double floor, Point topLeft,
                      double unitsPerMetre, double unit) {
  const Vec3 half(0.5 * camera.heightY * camera.width / camera.height, 0, 0.5 * camera.heightY);
  return {{camera.eye - half, camera.eye + half}, floor, topLeft, unitsPerMetre, unit};
}

void drawPlanPicture(Canvas& canvas, const PlanView& view, const PlanPicture& picture) {
  canvas.image(makePlanBackground(picture), view.topLeft, view.width(), view.height());
}

void drawFloorPlan(Canvas& canvas, const PlanView& view, const FloorPlan& plan) {
  canvas.beginClip(view.topLeft, view.width(), view.height());
  for (const PlanShape& shape : plan.shapes) drawShape(canvas, view, shape);
  canvas.endClip();
}

void drawGrid(Canvas& canvas, const PlanView& view) {
  const double step = chooseGridStep(view), text = kTextSize * view.unit;
  const double right = view.topLeft.x + view.width(), bottom = view.topLeft.y + view.height();
  const auto makeLabelStyle = [&](double metres) {
    TextStyle style;
    style.size = text;
    style.colour = metres == 0 ? kAxis : kPlanInk;
    return style;
  };
  forEachGridLine(view.area.min.x(), view.area.max.x(), step, [&](double metres) {
    const double x = view.at({metres, 0, 0}).x;
    canvas.line({x, view.topLeft.y}, {x, bottom}, 0.7 * view.unit, metres == 0 ? kAxis : kGrid);
    canvas.text({x, bottom + 0.4 * text}, formatNumber(metres), makeLabelStyle(metres),
                render::Align::centre);
  });
  forEachGridLine(view.area.min.z(), view.area.max.z(), step, [&](double metres) {
    const double y = view.at({0, 0, metres}).y;
    canvas.line({view.topLeft.x, y}, {right, y}, 0.7 * view.unit, metres == 0 ? kAxis : kGrid);
    canvas.text({view.topLeft.x - 0.5 * text, y - 0.6 * text}, formatNumber(metres),
                makeLabelStyle(metres), render::Align::right);
  });
  canvas.rectangle(view.topLeft, view.width(), view.height(), 1.5 * view.unit, kPlanInk);
}

std::string formatFloorAndCut(double floor) {
  const double rounded = std::round(100 * floor) / 100 + 0.0;  // without the sign of a zero
  char text[64];
  std::snprintf(text, sizeof text, "floor at y = %.2f m, cut %.1f m above", rounded,
                kPlanCutHeight);
  return text;
}

void reportMissingFont(const Canvas& canvas) {
  if (canvas.textWithoutFont().empty()) return;
  logWarning(
      "a plan shows boxes in place of letters of '{}': no font has them here; install one, "
      "e.g. fonts-noto-cjk",
      canvas.textWithoutFont());
}

void drawScaleBar(Canvas& canvas, const PlanView& view, Point at,
                  const std::optional<Eigen::Vector2d>& north) {
  const double step = chooseGridStep(view), length = step * view.unitsPerMetre;
  const double height = 5 * view.unit, middle = at.y + 0.6 * kTextSize * view.unit;
  TextStyle style;
  style.size = kTextSize * view.unit;
  for (int i = 0; i < 2; ++i) {
    const double left = at.x + i * length;
    const Point corner{left, middle - 0.5 * height};
    if (i == 0)
      canvas.fill(std::vector<std::vector<Point>>{{corner,
                                                   {left + length, corner.y},
                                                   {left + length, corner.y + height},
                                                   {left, corner.y + height}}},
                  kPlanInk);
    canvas.rectangle(corner, length, height, view.unit, kPlanInk);
  }
  const double end = at.x + 2 * length + 8 * view.unit;
  const std::string metres = formatNumber(2 * step) + " m";
  canvas.text({end, at.y}, metres, style);
  // The axes: +x right, +z down, as the numbers of the frame run.
  const Point origin{end + canvas.measure(metres, style).width + 30 * view.unit, at.y};
  const double arm = 22 * view.unit, head = 4 * view.unit;
  style.colour = kAxis;
  canvas.line(origin, {origin.x + arm, origin.y}, 1.2 * view.unit, kAxis);
  canvas.polyline(
      std::array{Point{origin.x + arm - head, origin.y - head}, Point{origin.x + arm, origin.y},
                 Point{origin.x + arm - head, origin.y + head}},
      1.2 * view.unit, kAxis);
  canvas.line(origin, {origin.x, origin.y + arm}, 1.2 * view.unit, kAxis);
  canvas.polyline(
      std::array{Point{origin.x - head, origin.y + arm - head}, Point{origin.x, origin.y + arm},
                 Point{origin.x + head, origin.y + arm - head}},
      1.2 * view.unit, kAxis);
  canvas.text({origin.x + arm + 5 * view.unit, origin.y - 0.6 * style.size}, "x", style);
  canvas.text({origin.x + 6 * view.unit, origin.y + arm - 0.8 * style.size}, "z", style);
  if (north)
    drawNorthArrow(canvas, view, {origin.x + arm + 60 * view.unit, origin.y + 0.5 * arm}, *north);
}

// ---- texts around a plan ------------------------------------------------------------------------

namespace {

// Thin lines.
constexpr double kHeadingMargin = 16, kHeadingTop = 10, kHeadingBottom = 9;
constexpr double kTitleLine = 26, kNoteLine = 17;

}  // namespace

PlanHeading makePlanHeading(const std::string& title, const std::string& note, double width,
                            double unit) {
  constexpr std::size_t kMaxLines = 6;  // of a name that fills no page
  PlanHeading heading;
  heading.titleStyle = {.size = 18 * unit, .colour = kPlanInk, .bold = true};
  heading.noteStyle = {.size = 12 * unit, .colour = kPlanInk};
  const Canvas measuring(1, 1, kPlanPaper);
  const double inner = width - 2 * kHeadingMargin * unit;
  heading.title = measuring.wrap(title, heading.titleStyle, inner, kMaxLines);
  heading.note = measuring.wrap(note, heading.noteStyle, inner, kMaxLines);
  heading.height = (kHeadingTop + static_cast<double>(heading.title.size()) * kTitleLine +
                    static_cast<double>(heading.note.size()) * kNoteLine + kHeadingBottom) *
                   unit;
  return heading;
}

void drawPlanHeading(Canvas& canvas, const PlanHeading& heading, double unit) {
  Point at{kHeadingMargin * unit, kHeadingTop * unit};
  for (const std::string& line : heading.title) {
    canvas.text(at, line, heading.titleStyle);
    at.y += kTitleLine * unit;
  }
  for (const std::string& line : heading.note) {
    canvas.text(at, line, heading.noteStyle);
    at.y += kNoteLine * unit;
  }
}

namespace {

constexpr double kEntryLine = 1.5, kEntryKey = 3.5, kEntryGap = 2;  // of the text size

/// Columns as wide as the longest entry, so that none is cut.
struct EntryColumns {
  double width = 0;
  std::size_t rows = 0;
};

EntryColumns computeColumns(const std::vector<CaptionEntry>& entries, double width,
                            const TextStyle& style) {
  const Canvas measuring(1, 1, kPlanPaper);
  double column = 1;
  for (const CaptionEntry& entry : entries)
    column = std::max(
        column, measuring.measure(entry.text, style).width +
                    std::max(kEntryKey * style.size, measuring.measure(entry.key, style).width) +
                    kEntryGap * style.size);
  column = std::min(column, width);
  const auto columns = static_cast<std::size_t>(std::max(1.0, width / column));
  return {column, (entries.size() + columns - 1) / columns};
}

TextStyle makeEntryStyle(double unit) {
  TextStyle style;
  style.size = kTextSize * unit, style.colour = kPlanInk;
  return style;
}

}  // namespace

double measureEntries(const std::vector<CaptionEntry>& entries, double width, double unit) {
  const TextStyle style = makeEntryStyle(unit);
  return static_cast<double>(computeColumns(entries, width, style).rows) * kEntryLine * style.size;
}

void drawEntries(Canvas& canvas, const std::vector<CaptionEntry>& entries, Point at, double width,
                 double unit) {
  const TextStyle style = makeEntryStyle(unit);
  TextStyle bold = style;
  bold.bold = true;
  const EntryColumns columns = computeColumns(entries, width, style);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Point corner{at.x + static_cast<double>(i / columns.rows) * columns.width,
                       at.y + static_cast<double>(i % columns.rows) * kEntryLine * style.size};
    const double key =
        std::max(kEntryKey * style.size, canvas.measure(entries[i].key + " ", bold).width);
    canvas.text(corner, entries[i].key, bold);
    canvas.text({corner.x + key, corner.y},
                canvas.shorten(entries[i].text, style, columns.width - key), style);
  }
}

}  // namespace enfilade::server
