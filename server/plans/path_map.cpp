// Steps: find the walked storeys (peaks of a histogram of the feet's heights). Render a plan of
// each, cut 1.2 m above its floor, around the walked area. Place marks and captions on the plan of
// their nearest storey. Stack the plans with a title, a legend and the captions without space.
#include "server/plans/path_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server/floors/storey_heights.hpp"
#include "server/plans/path_style.hpp"
#include "server/plans/plan_drawing.hpp"
#include "server/plans/storey_marks.hpp"

namespace enfilade::server {
namespace {

using render::Canvas;
using render::Image;
using render::Point;
using render::TextStyle;

constexpr double kMinTickShare = 0.08;  // minimum share of ticks for a storey with a plan
constexpr std::size_t kMaxMapStoreys = 3;
constexpr double kMapMargin = 4.0;  // metres around the walked area
// Metres from the walked area to a refused order that the map still shows.
constexpr double kMaxOrderDistance = 20.0;
constexpr double kMaxMapWidth = 1600, kMaxMapHeight = 1100;  // pixels of one plan
constexpr double kBorder = 48, kLineHeight = 26;             // pixels
constexpr double kTitleSize = 18, kHeadingSize = 14;         // pixels
constexpr std::size_t kMaxTitleLines = 4;

struct MapStorey {
  double floor = 0;
  render::Camera camera;
  PlanPicture picture;
  FloorPlan plan;  ///< empty: none could be had
  std::vector<std::string> heading;
  PlanView view;  ///< once it has a place on the sheet
};

scene::Aabb computeShownBounds(const WalkTrace& trace) {
  scene::Aabb bounds;
  for (const WalkedPath& path : trace.paths) {
    for (const Vec3& footPosition : path.footPositions) bounds.include(footPosition);
  }
  const scene::Aabb reach = collision::inflate(bounds, kMaxOrderDistance);
  for (const MapContact& blocked : trace.blockedWalks) bounds.include(blocked.point);
  for (const MapContact& refused : trace.refusedOrders)
    if (collision::contains(reach, {refused.point, refused.point})) bounds.include(refused.point);
  return collision::inflate(bounds, kMapMargin);
}

TextStyle makeStyle(double size, bool bold = false) {
  TextStyle style;
  style.size = size, style.bold = bold, style.colour = kPlanInk;
  return style;
}

// ---- legend -------------------------------------------------------------------------------------

struct LegendEntry {
  enum class Symbol : std::uint8_t { path, dot, wedge };
  std::string text;
  Symbol symbol = Symbol::dot;
  PathStyle style;
};

std::vector<LegendEntry> makeLegend(const WalkTrace& trace) {
  using Symbol = LegendEntry::Symbol;
  std::vector<LegendEntry> entries;
  const std::vector<PathStyle> styles = makePathStyles(trace.paths);
  for (std::size_t i = 0; i < trace.paths.size(); ++i)
    entries.push_back({trace.paths[i].avatar, Symbol::path, styles[i]});
  if (!trace.contacts.empty())
    entries.push_back({"contact begins (without floors)", Symbol::dot, {kContactColour}});
  if (!trace.blockedWalks.empty() || !trace.refusedOrders.empty())
    entries.push_back({"walk blocked, order refused", Symbol::dot, {kBlockedColour}});
  if (!trace.captures.empty())
    entries.push_back({"picture taken, towards the open end", Symbol::wedge, {}});
  return entries;
}

constexpr double kMinLegendColumn = 240, kLegendIndent = 40, kLegendGap = 24;  // pixels
constexpr double kLegendSize = 14;

/// As wide as the longest text, so that none is cut, and at most the legend.
double computeLegendColumn(const std::vector<LegendEntry>& entries, double width) {
  const Canvas measuring(1, 1, kPlanPaper);
  double column = kMinLegendColumn;
  for (const LegendEntry& entry : entries)
    column = std::max(column, kLegendIndent + kLegendGap +
                                  measuring.measure(entry.text, makeStyle(kLegendSize)).width);
  return std::min(column, width);
}

std::size_t countLegendRows(const std::vector<LegendEntry>& entries, double width) {
  const auto columns =
      static_cast<std::size_t>(std::max(1.0, width / computeLegendColumn(entries, width)));
  return (entries.size() + columns - 1) / columns;
}

void drawSymbol(Canvas& canvas, const LegendEntry& entry, Point middle) {
  using Symbol = LegendEntry::Symbol;
  switch (entry.symbol) {
    case Symbol::path:
      canvas.polyline(std::array{Point{middle.x - 14, middle.y}, Point{middle.x + 14, middle.y}}, 3,
                      entry.style.colour, entry.style.line);
      canvas.disc({middle.x - 14, middle.y}, 5, entry.style.colour);
      return;
    case Symbol::dot:
      return canvas.disc(middle, 6, entry.style.colour);
    case Symbol::wedge:
      return drawWedge(canvas, makeWedge({middle.x - 10, middle.y}, 1, 0));
  }
}

void drawLegend(Canvas& canvas, const std::vector<LegendEntry>& entries, Point at, double width) {
  const std::size_t rows = countLegendRows(entries, width);
  const double column = computeLegendColumn(entries, width);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const double x = at.x + static_cast<double>(i / rows) * column;
    const double y = at.y + static_cast<double>(i % rows) * kLineHeight;
    drawSymbol(canvas, entries[i], {x + 16, y + 9});
    canvas.text({x + kLegendIndent, y},
                canvas.shorten(entries[i].text, makeStyle(kLegendSize), column - kLegendIndent),
                makeStyle(kLegendSize));
  }
}

// ---- sheet --------------------------------------------------------------------------------------

/// The storey's name, if it has any, and its floor; in lines of at most `width` pixels.
std::vector<std::string> makeHeading(const MapStorey& storey, double width) {
  const std::string text = formatFloorAndCut(storey.floor);
  const std::string& name = storey.plan.storey;
  return Canvas(1, 1, kPlanPaper)
      .wrap(name.empty() ? text : name + ": " + text, makeStyle(kHeadingSize), width,
            kMaxTitleLines);
}

void drawLines(Canvas& canvas, const std::vector<std::string>& lines, Point at,
               const TextStyle& style) {
  for (const std::string& line : lines) {
    canvas.text(at, line, style);
    at.y += kLineHeight;
  }
}

double computeHeight(const std::vector<std::string>& lines) {
  return static_cast<double>(lines.size()) * kLineHeight;
}

/// Gives the storeys their places, one below the other, and returns the height of all.
double placeStoreys(std::vector<MapStorey>& storeys, double top) {
  for (MapStorey& storey : storeys) {
    top += computeHeight(storey.heading);
    storey.view = makePlanView(storey.camera, storey.floor, {kBorder, top},
                               storey.camera.height / storey.camera.heightY, 1);
    top += storey.camera.height + kBorder;
  }
  return top;
}

double computeSheetWidth(const std::vector<MapStorey>& storeys) {
  double width = 640;
  for (const MapStorey& storey : storeys)
    width = std::max(width, storey.camera.width + 2 * kBorder);
  return width;
}

/// The places of all parts of a map; pixels.
struct MapLayout {
  double width = 0, legendTop = 0, entriesTop = 0, height = 0;
  std::vector<std::string> title;
  std::vector<StoreyMarks> marks;  ///< of each storey
  std::vector<CaptionEntry> entries;
  std::vector<LegendEntry> legend;

  double inner() const { return width - 2 * kBorder; }
};

void layOutMap(const WalkTrace& trace, std::vector<MapStorey>& storeys,
               const std::vector<double>& floors, MapLayout& layout) {
  layout.width = computeSheetWidth(storeys);
  layout.title =
      Canvas(1, 1, kPlanPaper)
          .wrap(trace.title, makeStyle(kTitleSize, true), layout.inner(), kMaxTitleLines);
  for (MapStorey& storey : storeys) storey.heading = makeHeading(storey, layout.inner());
  layout.legendTop =
      placeStoreys(storeys, kBorder + computeHeight(layout.title) + kLineHeight) + 2 * kLineHeight;
  for (const MapStorey& storey : storeys)
    layout.marks.emplace_back(storey.view, floors, trace, storey.plan.rooms, layout.entries);
  layout.legend = makeLegend(trace);
  layout.entriesTop =
      layout.legendTop +
      static_cast<double>(countLegendRows(layout.legend, layout.inner())) * kLineHeight;
  layout.height = layout.entriesTop + measureEntries(layout.entries, layout.inner(), 1) + kBorder;
}

Image composeMap(const WalkTrace& trace, std::vector<MapStorey>& storeys,
                 const std::vector<double>& floors) {
  MapLayout layout;
  layOutMap(trace, storeys, floors, layout);
  Canvas canvas(static_cast<int>(layout.width), static_cast<int>(layout.height), kPlanPaper);
  drawLines(canvas, layout.title, {kBorder, kBorder}, makeStyle(kTitleSize, true));
  for (std::size_t i = 0; i < storeys.size(); ++i) {
    const PlanView& view = storeys[i].view;
    const double above = computeHeight(storeys[i].heading) - 4;
    drawLines(canvas, storeys[i].heading, {kBorder, view.topLeft.y - above},
              makeStyle(kHeadingSize));
    drawPlanPicture(canvas, view, storeys[i].picture);
    drawGrid(canvas, view);
    drawFloorPlan(canvas, view, storeys[i].plan);
    layout.marks[i].draw(canvas);
  }
  drawScaleBar(canvas, storeys.front().view, {kBorder, layout.legendTop - 1.6 * kLineHeight},
               storeys.front().plan.north);
  drawLegend(canvas, layout.legend, {kBorder, layout.legendTop}, layout.inner());
  drawEntries(canvas, layout.entries, {kBorder, layout.entriesTop}, layout.inner(), 1);
  reportMissingFont(canvas);
  return canvas.toImage();
}

}  // namespace

std::vector<double> findWalkedStoreys(const std::vector<WalkedPath>& paths) {
  std::vector<WeightedHeight> heights;
  for (const WalkedPath& path : paths) {
    for (std::size_t i = 0; i < path.footPositions.size(); ++i) {
      // Ticks without motion do not count.
      if (i == 0 || path.footPositions[i] != path.footPositions[i - 1])
        heights.push_back({path.footPositions[i].y(), 1});
    }
  }
  return findStoreyHeights(heights, kMinTickShare, kMaxMapStoreys);
}

std::optional<Image> drawMap(const WalkTrace& trace, const MapBackground& background) {
  std::vector<double> floors = findWalkedStoreys(trace.paths);
  for (const double floor : trace.floors)
    if (std::ranges::none_of(floors, [&](double one) { return std::abs(one - floor) < 1; }))
      floors.push_back(floor);
  std::ranges::sort(floors);
  std::vector<MapStorey> storeys;
  for (const double floor : floors) {
    MapStorey storey;
    storey.floor = floor;
    storey.camera = makePlanCamera(computeShownBounds(trace), floor, kMaxMapWidth, kMaxMapHeight);
    std::optional<PlanPicture> picture = background.renderPlan(storey.camera);
    if (!picture) return std::nullopt;
    storey.picture = std::move(*picture);
    if (background.findFloorPlan)
      storey.plan = background.findFloorPlan(floor).value_or(FloorPlan());
    storeys.push_back(std::move(storey));
  }
  if (storeys.empty()) return std::nullopt;
  return composeMap(trace, storeys, floors);
}

}  // namespace enfilade::server
