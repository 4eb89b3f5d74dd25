// Steps: find the storeys where the walk went (peaks of a histogram of the feet's heights); take a
// plan of each, cut 1.2 m above its floor, of the part of the scene that was walked in; draw paths,
// contacts and captures on the plan of the storey that they are nearest to; put the plans below one
// another with a title and a legend.
#include "server/plans/path_map.hpp"

#include <algorithm>
#include <cmath>

#include "render/avatar_mesh.hpp"
#include "server/plans/floor_plan_section.hpp"

namespace enfilade::server {
namespace {

using render::Colour;
using render::Image;

constexpr double kLeastShare = 0.08;  // of all ticks, for a storey to get its plan
constexpr std::size_t kMostStoreys = 3;
constexpr double kMargin = 4.0;                    // metres around what was walked
constexpr double kWidest = 1600, kHighest = 1100;  // pixels of one plan
constexpr int kLine = 26;                          // pixels of a line of text
constexpr double kFloorNormal = 0.7;               // steeper contacts are with floors and stairs

constexpr Colour kInk = kPlanInk, kPaper = kPlanPaper, kContact{214, 40, 40}, kStop{120, 0, 120},
                 kCamera{20, 20, 24};

/// As the avatar is painted in the pictures.
Colour colourOf(const WalkedPath& path) {
  const Eigen::Vector3f linear = render::avatarColour(path.id);
  const auto byte = [&](int i) {
    return static_cast<std::uint8_t>(std::lround(255 * std::pow(linear[i], 1 / 2.2f)));
  };
  return {byte(0), byte(1), byte(2)};
}

struct Storey {
  double floor = 0;
  render::Camera camera;
  Image image;
};

Storey* nearestStorey(std::vector<Storey>& storeys, double height) {
  Storey* nearest = nullptr;
  for (Storey& storey : storeys) {
    if (!nearest || std::abs(storey.floor - height) < std::abs(nearest->floor - height)) {
      nearest = &storey;
    }
  }
  return nearest;
}

scene::Box walkedBounds(const std::vector<WalkedPath>& paths) {
  scene::Box bounds;
  for (const WalkedPath& path : paths) {
    for (const Vec3& feet : path.feet) bounds.include(feet);
  }
  return collision::grown(bounds, kMargin);
}

struct Pixel {
  double x = 0, y = 0;
};

Pixel pixelOf(const Storey& storey, const Vec3& point) {
  const Vec3 projected = render::project(storey.camera, point);
  return {projected.x(), projected.y()};
}

void drawDot(Storey& storey, const Vec3& point, double radius, Colour colour) {
  const Pixel at = pixelOf(storey, point);
  render::drawDisc(storey.image, at.x, at.y, radius + 1.5, kPaper);
  render::drawDisc(storey.image, at.x, at.y, radius, colour);
}

void drawPath(std::vector<Storey>& storeys, const WalkedPath& path, Colour colour) {
  for (std::size_t i = 1; i < path.feet.size(); ++i) {
    Storey& storey = *nearestStorey(storeys, path.feet[i].y());
    const Pixel from = pixelOf(storey, path.feet[i - 1]), to = pixelOf(storey, path.feet[i]);
    if (from.x == to.x && from.y == to.y) continue;
    render::drawLine(storey.image, from.x, from.y, to.x, to.y, 3, colour);
  }
  if (path.feet.empty()) return;
  drawDot(*nearestStorey(storeys, path.feet.front().y()), path.feet.front(), 6, colour);
}

/// The angle of view at `eye`: it opens along the unit vector (x, y) in which the eyes look.
void drawWedge(Image& image, const Pixel& eye, double x, double y) {
  constexpr double kLength = 18, kHalfWidth = 9;
  const Pixel left{eye.x + kLength * x + kHalfWidth * y, eye.y + kLength * y - kHalfWidth * x};
  const Pixel right{eye.x + kLength * x - kHalfWidth * y, eye.y + kLength * y + kHalfWidth * x};
  render::drawLine(image, eye.x, eye.y, left.x, left.y, 2, kCamera);
  render::drawLine(image, right.x, right.y, eye.x, eye.y, 2, kCamera);
  render::drawDisc(image, eye.x, eye.y, 3, kCamera);
}

void drawCapture(std::vector<Storey>& storeys, const MapCapture& capture) {
  Storey& storey = *nearestStorey(storeys, capture.eye.y() - 1.6);
  const Pixel eye = pixelOf(storey, capture.eye);
  const double length = std::hypot(capture.gaze.x(), capture.gaze.z());
  const double x = length > 0 ? capture.gaze.x() / length : 1;
  const double y = length > 0 ? capture.gaze.z() / length : 0;
  Image& image = storey.image;
  drawWedge(image, eye, x, y);
  render::drawText(image, static_cast<int>(eye.x) + 6, static_cast<int>(eye.y) + 6, capture.name, 1,
                   kCamera);
}

/// Contacts with walls and furniture; every walker touches floors all the time.
void drawContacts(std::vector<Storey>& storeys, const WalkTrace& trace) {
  for (const MapContact& stop : trace.stops) {
    drawDot(*nearestStorey(storeys, stop.point.y()), stop.point, 6, kStop);
  }
  for (const MapContact& contact : trace.contacts) {
    if (std::abs(contact.normal.y()) > kFloorNormal) continue;
    drawDot(*nearestStorey(storeys, contact.point.y() - 0.8), contact.point, 3.5, kContact);
  }
}

struct LegendEntry {
  std::string text;
  Colour colour;
  bool wedge;  ///< the sign of a capture; else a dot
};

std::vector<LegendEntry> legendOf(const WalkTrace& trace) {
  std::vector<LegendEntry> entries;
  for (const WalkedPath& path : trace.paths)
    entries.push_back({path.avatar, colourOf(path), false});
  entries.push_back({"contact begins (floors left out)", kContact, false});
  entries.push_back({"walk ends blocked", kStop, false});
  entries.push_back({"picture taken, towards the open end", kCamera, true});
  return entries;
}

constexpr int kLegendColumn = 460;  // pixels

int legendRows(const std::vector<LegendEntry>& entries, int width) {
  const int columns = std::max(1, width / kLegendColumn);
  return (static_cast<int>(entries.size()) + columns - 1) / columns;
}

void drawLegend(Image& image, const std::vector<LegendEntry>& entries, int top) {
  const int rows = legendRows(entries, image.width);
  for (int i = 0; i < static_cast<int>(entries.size()); ++i) {
    const LegendEntry& entry = entries[static_cast<std::size_t>(i)];
    const int x = 24 + i / rows * kLegendColumn, y = top + i % rows * kLine;
    if (entry.wedge) {
      drawWedge(image, {x - 8.0, y + 7.0}, 1, 0);
    } else {
      render::drawDisc(image, x, y + 7, 6, entry.colour);
    }
    render::drawText(image, x + 16, y, entry.text, 2, kInk);
  }
}

std::string heading(const Storey& storey) {
  char text[64];
  std::snprintf(text, sizeof text, "floor at %.2f m, cut %.1f m above", storey.floor, kPlanCut);
  return text;
}

Image composed(const WalkTrace& trace, const std::vector<Storey>& storeys) {
  constexpr int kBorder = 16;
  const std::vector<LegendEntry> legend = legendOf(trace);
  int width = 640, height = 2 * kBorder + kLine;
  for (const Storey& storey : storeys) {
    width = std::max(width, storey.image.width + 2 * kBorder);
    height += storey.image.height + kLine + kBorder;
  }
  height += legendRows(legend, width) * kLine;
  Image whole = blankImage(width, height);
  render::drawText(whole, kBorder, kBorder, trace.title, 2, kInk);
  int y = kBorder + kLine;
  for (const Storey& storey : storeys) {
    render::drawText(whole, kBorder, y, heading(storey), 2, kInk);
    paste(whole, storey.image, kBorder, y + kLine);
    y += storey.image.height + kLine + kBorder;
  }
  drawLegend(whole, legend, y);
  return whole;
}

}  // namespace

std::vector<double> walkedStoreys(const std::vector<WalkedPath>& paths) {
  std::vector<WeightedHeight> heights;
  for (const WalkedPath& path : paths) {
    for (std::size_t i = 0; i < path.feet.size(); ++i) {
      // Who stands still for long makes no storey more walked.
      if (i == 0 || path.feet[i] != path.feet[i - 1]) heights.push_back({path.feet[i].y(), 1});
    }
  }
  return storeyHeights(heights, kLeastShare, kMostStoreys);
}

std::optional<Image> drawMap(const WalkTrace& trace, const MapGround& ground) {
  std::vector<Storey> storeys;
  for (const double floor : walkedStoreys(trace.paths)) {
    Storey storey{floor, planCamera(walkedBounds(trace.paths), floor, kWidest, kHighest), {}};
    const std::optional<PlanPicture> plan = ground.picture(storey.camera);
    if (!plan) return std::nullopt;
    storey.image = planGround(*plan);
    if (ground.scene)
      drawCut(storey.image, storey.camera, cutOfStill(*ground.scene, floor + kPlanCut));
    storeys.push_back(std::move(storey));
  }
  if (storeys.empty()) return std::nullopt;
  for (const WalkedPath& path : trace.paths) drawPath(storeys, path, colourOf(path));
  for (const MapCapture& capture : trace.captures) drawCapture(storeys, capture);
  drawContacts(storeys, trace);
  return composed(trace, storeys);
}

}  // namespace enfilade::server
