// Steps: find the walked storeys (peaks of a histogram of the feet's heights); render a plan of
// each, cut 1.2 m above its floor, around the walked area; draw paths, contacts and captures on
// the plan of the nearest storey; stack the plans with a title and a legend.
#include "server/plans/path_map.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "server/plans/floor_plan_section.hpp"

namespace enfilade::server {
namespace {

using render::Colour;
using render::Image;

constexpr double kMinTickShare = 0.08;  // minimum share of ticks for a storey with a plan
constexpr std::size_t kMaxMapStoreys = 3;
constexpr double kMapMargin = 4.0;                           // metres around the walked area
constexpr double kMaxMapWidth = 1600, kMaxMapHeight = 1100;  // pixels of one plan
constexpr int kLineHeight = 26;                              // pixels of a line of text
constexpr double kMinSupportNormalY = 0.7;  // contacts with a larger y are floors and stairs

constexpr Colour kInk = kPlanInk, kPaper = kPlanPaper, kContact{214, 40, 40}, kBlocked{120, 0, 120},
                 kCamera{20, 20, 24};

struct Storey {
  double floor = 0;
  render::Camera camera;
  Image image;
};

Storey& findNearestStorey(std::vector<Storey>& storeys, double height) {
  ENFILADE_ASSERT(!storeys.empty());
  const auto distance = [&](const Storey& storey) { return std::abs(storey.floor - height); };
  return *std::min_element(storeys.begin(), storeys.end(), [&](const Storey& a, const Storey& b) {
    return distance(a) < distance(b);
  });
}

scene::Aabb computeWalkedBounds(const std::vector<WalkedPath>& paths) {
  scene::Aabb bounds;
  for (const WalkedPath& path : paths) {
    for (const Vec3& feet : path.footPositions) bounds.include(feet);
  }
  return collision::inflated(bounds, kMapMargin);
}

struct Pixel {
  double x = 0, y = 0;
};

Pixel toPixel(const Storey& storey, const Vec3& point) {
  const Vec3 projected = render::project(storey.camera, point);
  return {projected.x(), projected.y()};
}

void drawDot(Storey& storey, const Vec3& point, double radius, Colour colour) {
  const Pixel at = toPixel(storey, point);
  render::drawDisc(storey.image, at.x, at.y, radius + 1.5, kPaper);
  render::drawDisc(storey.image, at.x, at.y, radius, colour);
}

void drawPath(std::vector<Storey>& storeys, const WalkedPath& path, Colour colour) {
  for (std::size_t i = 1; i < path.footPositions.size(); ++i) {
    Storey& storey = findNearestStorey(storeys, path.footPositions[i].y());
    const Pixel from = toPixel(storey, path.footPositions[i - 1]),
                to = toPixel(storey, path.footPositions[i]);
    if (from.x == to.x && from.y == to.y) continue;
    render::drawLine(storey.image, from.x, from.y, to.x, to.y, 3, colour);
  }
  if (path.footPositions.empty()) return;
  drawDot(findNearestStorey(storeys, path.footPositions.front().y()), path.footPositions.front(), 6,
          colour);
}

/// Draws the field of view at `eye` as a wedge along the unit vector (x, y).
void drawWedge(Image& image, const Pixel& eye, double x, double y) {
  constexpr double kLength = 18, kHalfWidth = 9;
  const Pixel left{eye.x + kLength * x + kHalfWidth * y, eye.y + kLength * y - kHalfWidth * x};
  const Pixel right{eye.x + kLength * x - kHalfWidth * y, eye.y + kLength * y + kHalfWidth * x};
  render::drawLine(image, eye.x, eye.y, left.x, left.y, 2, kCamera);
  render::drawLine(image, right.x, right.y, eye.x, eye.y, 2, kCamera);
  render::drawDisc(image, eye.x, eye.y, 3, kCamera);
}

void drawCapture(std::vector<Storey>& storeys, const MapCapture& capture) {
  Storey& storey = findNearestStorey(storeys, capture.eye.y() - 1.6);
  const Pixel eye = toPixel(storey, capture.eye);
  const double length = std::hypot(capture.viewDirection.x(), capture.viewDirection.z());
  const double x = length > 0 ? capture.viewDirection.x() / length : 1;
  const double y = length > 0 ? capture.viewDirection.z() / length : 0;
  Image& image = storey.image;
  drawWedge(image, eye, x, y);
  render::drawText(image, static_cast<int>(eye.x) + 6, static_cast<int>(eye.y) + 6, capture.name, 1,
                   kCamera);
}

/// Draws contacts with walls and furniture. Floor contacts are omitted: they are permanent.
void drawContacts(std::vector<Storey>& storeys, const WalkTrace& trace) {
  for (const MapContact& blockedWalk : trace.blockedWalks) {
    drawDot(findNearestStorey(storeys, blockedWalk.point.y()), blockedWalk.point, 6, kBlocked);
  }
  for (const MapContact& contact : trace.contacts) {
    if (std::abs(contact.normal.y()) > kMinSupportNormalY) continue;
    drawDot(findNearestStorey(storeys, contact.point.y() - 0.8), contact.point, 3.5, kContact);
  }
}

struct LegendEntry {
  std::string text;
  Colour colour;
  bool wedge;  ///< true: wedge of a capture; false: dot
};

std::vector<LegendEntry> makeLegend(const WalkTrace& trace) {
  std::vector<LegendEntry> entries;
  for (const WalkedPath& path : trace.paths)
    entries.push_back({path.avatar, computeAvatarColour(path.id), false});
  entries.insert(entries.end(), {{"contact begins (without floors)", kContact, false},
                                 {"walk ends blocked", kBlocked, false},
                                 {"picture taken, towards the open end", kCamera, true}});
  return entries;
}

constexpr int kLegendColumn = 460;  // pixels

int countLegendRows(const std::vector<LegendEntry>& entries, int width) {
  const int columns = std::max(1, width / kLegendColumn);
  return (static_cast<int>(entries.size()) + columns - 1) / columns;
}

void drawLegend(Image& image, const std::vector<LegendEntry>& entries, int top) {
  const int rows = countLegendRows(entries, image.width);
  for (int i = 0; i < static_cast<int>(entries.size()); ++i) {
    const LegendEntry& entry = entries[static_cast<std::size_t>(i)];
    const int x = 24 + i / rows * kLegendColumn, y = top + i % rows * kLineHeight;
    if (entry.wedge) {
      drawWedge(image, {x - 8.0, y + 7.0}, 1, 0);
    } else {
      render::drawDisc(image, x, y + 7, 6, entry.colour);
    }
    render::drawText(image, x + 16, y, entry.text, 2, kInk);
  }
}

std::string formatHeading(const Storey& storey) {
  char text[64];
  std::snprintf(text, sizeof text, "floor at %.2f m, cut %.1f m above", storey.floor,
                kPlanCutHeight);
  return text;
}

Image composeMap(const WalkTrace& trace, const std::vector<Storey>& storeys) {
  constexpr int kBorder = 16;
  const std::vector<LegendEntry> legend = makeLegend(trace);
  int width = 640, height = 2 * kBorder + kLineHeight;
  for (const Storey& storey : storeys) {
    width = std::max(width, storey.image.width + 2 * kBorder);
    height += storey.image.height + kLineHeight + kBorder;
  }
  height += countLegendRows(legend, width) * kLineHeight;
  Image sheet = render::makeBlankImage(width, height, kPlanPaper);
  render::drawText(sheet, kBorder, kBorder, trace.title, 2, kInk);
  int y = kBorder + kLineHeight;
  for (const Storey& storey : storeys) {
    render::drawText(sheet, kBorder, y, formatHeading(storey), 2, kInk);
    render::paste(sheet, storey.image, kBorder, y + kLineHeight);
    y += storey.image.height + kLineHeight + kBorder;
  }
  drawLegend(sheet, legend, y);
  return sheet;
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
  std::vector<Storey> storeys;
  for (const double floor : findWalkedStoreys(trace.paths)) {
    Storey storey{
        floor,
        makePlanCamera(computeWalkedBounds(trace.paths), floor, kMaxMapWidth, kMaxMapHeight),
        {}};
    const std::optional<PlanPicture> plan = background.renderPlan(storey.camera);
    if (!plan) return std::nullopt;
    storey.image = makePlanBackground(*plan);
    if (background.scene)
      drawSection(storey.image, storey.camera,
                  cutStatic(*background.scene, floor + kPlanCutHeight));
    storeys.push_back(std::move(storey));
  }
  if (storeys.empty()) return std::nullopt;
  for (const WalkedPath& path : trace.paths) drawPath(storeys, path, computeAvatarColour(path.id));
  for (const MapCapture& capture : trace.captures) drawCapture(storeys, capture);
  drawContacts(storeys, trace);
  return composeMap(trace, storeys);
}

}  // namespace enfilade::server
