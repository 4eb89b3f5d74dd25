// Steps: find the walked storeys (peaks of a histogram of the feet's heights); render a plan of
// each, cut 1.2 m above its floor, around the walked area; draw paths, contacts and captures on
// the plan of their nearest storey; stack the plans with a title and a legend.
#include "server/plans/path_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "collision/assert.hpp"
#include "server/plans/floor_plans.hpp"
#include "server/plans/plan_drawing.hpp"

namespace enfilade::server {
namespace {

using render::Canvas;
using render::Colour;
using render::Image;
using render::Point;
using render::TextStyle;

constexpr double kMinTickShare = 0.08;  // minimum share of ticks for a storey with a plan
constexpr std::size_t kMaxMapStoreys = 3;
constexpr double kMapMargin = 4.0;                           // metres around the walked area
constexpr double kMaxMapWidth = 1600, kMaxMapHeight = 1100;  // pixels of one plan
constexpr double kMaxStoreyDistance = 0.6;        // metres between a walked floor and a storey's
constexpr double kBorder = 48, kLineHeight = 26;  // pixels
constexpr double kMinSupportNormalY = 0.7;        // contacts with a larger y are floors and stairs

constexpr Colour kContact{214, 40, 40}, kBlocked{120, 0, 120}, kCamera{20, 20, 24};

struct StoreyPlan {
  double floor = 0;
  render::Camera camera;
  PlanPicture picture;
  PlanView view;  ///< once it has a place on the sheet
};

const StoreyPlan& findNearestStorey(const std::vector<StoreyPlan>& storeys, double height) {
  ENFILADE_ASSERT(!storeys.empty());
  const auto distance = [&](const StoreyPlan& storey) { return std::abs(storey.floor - height); };
  return *std::min_element(
      storeys.begin(), storeys.end(),
      [&](const StoreyPlan& a, const StoreyPlan& b) { return distance(a) < distance(b); });
}

scene::Aabb computeWalkedBounds(const std::vector<WalkedPath>& paths) {
  scene::Aabb bounds;
  for (const WalkedPath& path : paths) {
    for (const Vec3& feet : path.footPositions) bounds.include(feet);
  }
  return collision::inflated(bounds, kMapMargin);
}

TextStyle makeStyle(double size, bool bold = false) {
  TextStyle style;
  style.size = size, style.bold = bold, style.colour = kPlanInk;
  return style;
}

/// The colour of the path's avatar; half of it for an earlier walk.
Colour colourOf(const WalkedPath& path) {
  Colour colour = computeAvatarColour(path.id);
  if (!path.isEarlier) return colour;
  for (std::uint8_t& part : colour) part = static_cast<std::uint8_t>((part + 255) / 2);
  return colour;
}

void drawDot(Canvas& canvas, Point at, double radius, Colour colour) {
  canvas.disc(at, radius + 1.5, kPlanPaper);
  canvas.disc(at, radius, colour);
}

/// The field of view at `eye` as a wedge along the unit vector (x, y).
void drawWedge(Canvas& canvas, Point eye, double x, double y) {
  constexpr double kLength = 18, kHalfWidth = 9;
  const Point left{eye.x + kLength * x + kHalfWidth * y, eye.y + kLength * y - kHalfWidth * x};
  const Point right{eye.x + kLength * x - kHalfWidth * y, eye.y + kLength * y + kHalfWidth * x};
  canvas.polyline(std::array{left, eye, right}, 2, kCamera);
  canvas.disc(eye, 3, kCamera);
}

/// Draws the marks of a walk on one storey.
class StoreyMarks {
 public:
  StoreyMarks(Canvas& canvas, const std::vector<StoreyPlan>& storeys, const StoreyPlan& storey)
      : canvas_(canvas), storeys_(storeys), storey_(storey), captions_(storey.view) {}

  void draw(const WalkTrace& trace) {
    canvas_.beginClip(storey_.view.topLeft, storey_.view.width(), storey_.view.height());
    for (const WalkedPath& path : trace.paths) drawPath(path);
    for (const MapContact& blockedWalk : trace.blockedWalks)
      if (isHere(blockedWalk.point.y())) drawDot(canvas_, at(blockedWalk.point), 6, kBlocked);
    for (const MapContact& contact : trace.contacts) drawContact(contact);
    for (const MapCapture& capture : trace.captures) drawCapture(capture);
    for (const WalkedPath& path : trace.paths) drawName(path);
    canvas_.endClip();
  }

 private:
  bool isHere(double height) const { return &findNearestStorey(storeys_, height) == &storey_; }
  Point at(const Vec3& point) const { return storey_.view.at(point); }

  /// Steps that change the storey end a line.
  void drawPath(const WalkedPath& path) {
    std::vector<Point> line;
    const auto flush = [&] {
      if (line.size() > 1) canvas_.polyline(line, 3, colourOf(path), path.isEarlier);
      line.clear();
    };
    for (const Vec3& feet : path.footPositions) {
      if (!isHere(feet.y())) {
        flush();
        continue;
      }
      const Point next = at(feet);
      if (line.empty() || next.x != line.back().x || next.y != line.back().y) line.push_back(next);
    }
    flush();
    if (startsHere(path)) drawDot(canvas_, at(path.footPositions.front()), 6, colourOf(path));
  }

  bool startsHere(const WalkedPath& path) const {
    return !path.footPositions.empty() && isHere(path.footPositions.front().y());
  }

  void drawName(const WalkedPath& path) {
    if (!startsHere(path)) return;
    TextStyle style = makeStyle(13, true);
    style.colour = colourOf(path), style.halo = 2;
    captions_.draw(canvas_, at(path.footPositions.front()), path.avatar, style);
  }

  void drawCapture(const MapCapture& capture) {
    if (!isHere(capture.eye.y() - 1.6)) return;
    const Point eye = at(capture.eye);
    const double length = std::hypot(capture.viewDirection.x(), capture.viewDirection.z());
    const double x = length > 0 ? capture.viewDirection.x() / length : 1;
    const double y = length > 0 ? capture.viewDirection.z() / length : 0;
    drawWedge(canvas_, eye, x, y);
    captions_.reserve({eye.x - 4, eye.y - 4}, 8, 8);
    TextStyle style = makeStyle(11);
    style.halo = 2;
    captions_.draw(canvas_, eye, capture.name, style);
  }

  /// Contacts with walls and furniture. Floor contacts are omitted: they are permanent.
  void drawContact(const MapContact& contact) {
    if (std::abs(contact.normal.y()) > kMinSupportNormalY || !isHere(contact.point.y() - 0.8))
      return;
    drawDot(canvas_, at(contact.point), 3.5, kContact);
  }

  Canvas& canvas_;
  const std::vector<StoreyPlan>& storeys_;
  const StoreyPlan& storey_;
  CaptionPlacer captions_;
};

struct LegendEntry {
  std::string text;
  Colour colour;
  bool wedge;  ///< true: wedge of a capture; false: dot
};

std::vector<LegendEntry> makeLegend(const WalkTrace& trace) {
  std::vector<LegendEntry> entries;
  for (const WalkedPath& path : trace.paths)
    entries.push_back({path.avatar, colourOf(path), false});
  if (!trace.contacts.empty())
    entries.push_back({"contact begins (without floors)", kContact, false});
  if (!trace.blockedWalks.empty()) entries.push_back({"walk ends blocked", kBlocked, false});
  if (!trace.captures.empty())
    entries.push_back({"picture taken, towards the open end", kCamera, true});
  return entries;
}

constexpr double kLegendColumn = 320;  // pixels

std::size_t countLegendRows(const std::vector<LegendEntry>& entries, double width) {
  const auto columns = static_cast<std::size_t>(std::max(1.0, width / kLegendColumn));
  return (entries.size() + columns - 1) / columns;
}

void drawLegend(Canvas& canvas, const std::vector<LegendEntry>& entries, double top) {
  const std::size_t rows = countLegendRows(entries, canvas.width());
  const TextStyle style = makeStyle(14);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const double x = kBorder + 6 + static_cast<double>(i / rows) * kLegendColumn;
    const double y = top + static_cast<double>(i % rows) * kLineHeight;
    if (entries[i].wedge) {
      drawWedge(canvas, {x - 8, y + 9}, 1, 0);
    } else {
      canvas.disc({x, y + 9}, 6, entries[i].colour);
    }
    canvas.text({x + 16, y}, canvas.shorten(entries[i].text, style, kLegendColumn - 40), style);
  }
}

/// The storey of the file at this floor; null: none is near.
const StoreyFloor* findStoreyAt(const std::vector<StoreyFloor>& storeys, double floor) {
  const auto distanceOf = [&](const StoreyFloor& s) { return std::abs(s.height - floor); };
  const auto nearest = std::ranges::min_element(storeys, {}, distanceOf);
  return nearest != storeys.end() && distanceOf(*nearest) < kMaxStoreyDistance ? &*nearest
                                                                               : nullptr;
}

std::string formatHeading(const StoreyPlan& storey, const StoreyFloor* named) {
  const std::string text = formatFloorAndCut(storey.floor);
  return named != nullptr && !named->name.empty() ? named->name + ": " + text : text;
}

/// Gives the storeys their places, one below the other, and returns the height of all.
double placeStoreys(std::vector<StoreyPlan>& storeys, double top) {
  for (StoreyPlan& storey : storeys) {
    storey.view = makePlanView(storey.camera, storey.floor, {kBorder, top + kLineHeight},
                               storey.camera.height / storey.camera.heightY, 1);
    top += kLineHeight + storey.camera.height + kBorder;
  }
  return top;
}

Image composeMap(const WalkTrace& trace, std::vector<StoreyPlan>& storeys,
                 const scene::Scene* scene) {
  const std::vector<LegendEntry> legend = makeLegend(trace);
  double width = 640;
  for (const StoreyPlan& storey : storeys)
    width = std::max(width, storey.camera.width + 2 * kBorder);
  const double legendTop = placeStoreys(storeys, kBorder + 2 * kLineHeight) + 2 * kLineHeight;
  const double height =
      legendTop + static_cast<double>(countLegendRows(legend, width)) * kLineHeight + kBorder;
  const std::vector<StoreyFloor> namedStoreys =
      scene ? findStoreys(*scene) : std::vector<StoreyFloor>();
  Canvas canvas(static_cast<int>(width), static_cast<int>(height), kPlanPaper);
  const TextStyle title = makeStyle(18, true), heading = makeStyle(14);
  canvas.text({kBorder, kBorder}, canvas.shorten(trace.title, title, width - 2 * kBorder), title);
  for (const StoreyPlan& storey : storeys) {
    const PlanView& view = storey.view;
    const StoreyFloor* const named = findStoreyAt(namedStoreys, storey.floor);
    canvas.text({kBorder, view.topLeft.y - kLineHeight + 4},
                canvas.shorten(formatHeading(storey, named), heading, width - 2 * kBorder),
                heading);
    drawPlanPicture(canvas, view, storey.picture);
    drawGrid(canvas, view);
    if (scene) drawCut(canvas, view, *scene);
    StoreyMarks(canvas, storeys, storey).draw(trace);
    if (named != nullptr && named->storey)  // above the paths, which would strike them through
      drawSpaceNames(canvas, view, scene->model(), *named->storey);
  }
  drawScaleBar(canvas, storeys.front().view, {kBorder, legendTop - 1.6 * kLineHeight},
               scene ? scene->model().north : std::nullopt);
  drawLegend(canvas, legend, legendTop);
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
  std::vector<StoreyPlan> storeys;
  for (const double floor : floors) {
    StoreyPlan storey;
    storey.floor = floor;
    storey.camera =
        makePlanCamera(computeWalkedBounds(trace.paths), floor, kMaxMapWidth, kMaxMapHeight);
    std::optional<PlanPicture> picture = background.renderPlan(storey.camera);
    if (!picture) return std::nullopt;
    storey.picture = std::move(*picture);
    storeys.push_back(std::move(storey));
  }
  if (storeys.empty()) return std::nullopt;
  return composeMap(trace, storeys, background.scene);
}

}  // namespace enfilade::server
