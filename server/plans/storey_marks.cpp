// Steps: place all marks and reserve them. Place the names of rooms, which must lie in their rooms.
// Place the names of avatars and pictures in what is left.
#include "server/plans/storey_marks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "collision/assert.hpp"
#include "server/plans/space_names.hpp"

namespace enfilade::server {
namespace {

using render::Canvas;
using render::Colour;
using render::Point;
using render::TextStyle;

constexpr double kMinSupportNormalY = 0.7;  // contacts with a larger y are floors and stairs
constexpr double kEyeHeight = 1.6;          // metres of an eye above the floor of its storey
constexpr double kHandHeight = 0.8;         // metres of a contact above the floor of its storey
// Pixels.
constexpr double kPathWidth = 3, kWedgeWidth = 2, kEyeRadius = 3, kDotBorder = 1.5;
constexpr double kStartRadius = 6, kBlockedRadius = 6, kContactRadius = 3.5;
constexpr double kWedgeLength = 18, kWedgeHalfWidth = 9;
constexpr Colour kCamera{20, 20, 24};

TextStyle makeCaptionStyle(double size, bool bold, Colour colour) {
  TextStyle style;
  style.size = size, style.bold = bold, style.colour = colour, style.halo = 2;
  return style;
}

double findNearest(const std::vector<double>& floors, double height) {
  ENFILADE_ASSERT(!floors.empty());
  return *std::ranges::min_element(floors, {},
                                   [&](double floor) { return std::abs(floor - height); });
}

std::string formatMarkPlace(const Vec3& point) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "at x = %.1f, y = %.1f, z = %.1f", point.x(), point.y(),
                point.z());
  return text.data();
}

}  // namespace

Wedge makeWedge(Point eye, double x, double y) {
  return {eye,
          {eye.x + kWedgeLength * x + kWedgeHalfWidth * y,
           eye.y + kWedgeLength * y - kWedgeHalfWidth * x},
          {eye.x + kWedgeLength * x - kWedgeHalfWidth * y,
           eye.y + kWedgeLength * y + kWedgeHalfWidth * x}};
}

void drawWedge(Canvas& canvas, const Wedge& wedge) {
  canvas.polyline(std::array{wedge.left, wedge.eye, wedge.right}, kWedgeWidth, kCamera);
  canvas.disc(wedge.eye, kEyeRadius, kCamera);
}

StoreyMarks::StoreyMarks(const PlanView& view, const std::vector<double>& floors,
                         const WalkTrace& trace, std::span<const scene::Space> rooms,
                         std::vector<CaptionEntry>& entries)
    : view_(view), floors_(floors), captions_(view.box(), view.unit, entries) {
  const std::vector<PathStyle> styles = makePathStyles(trace.paths);
  for (std::size_t i = 0; i < trace.paths.size(); ++i) addPath(trace.paths[i], styles[i]);
  for (const auto* marks : {&trace.blockedWalks, &trace.refusedOrders})
    for (const MapContact& mark : *marks)
      if (isHere(mark.point.y()))
        blocked_.push_back({view_.at(mark.point), kBlockedRadius, kBlockedColour});
  for (const MapContact& contact : trace.contacts) addContact(contact);
  for (const MapCapture& capture : trace.captures) addWedge(capture);
  for (const auto* dots : {&starts_, &blocked_, &contacts_})
    for (const Dot& dot : *dots) {
      const double radius = dot.radius + kDotBorder;
      captions_.placer.reserve({{dot.at.x - radius, dot.at.y - radius}, 2 * radius, 2 * radius});
    }
  placeSpaceNames(captions_, Canvas(1, 1, kPlanPaper), view_, rooms);
  addCaptions(trace, styles);
}

bool StoreyMarks::isHere(double height) const {
  return findNearest(floors_, height) == view_.floor;
}

bool StoreyMarks::startsHere(const WalkedPath& path) const {
  return !path.footPositions.empty() && isHere(path.footPositions.front().y());
}

/// Steps that change the storey end a line.
void StoreyMarks::addPath(const WalkedPath& path, const PathStyle& style) {
  Line line{{}, style};
  const auto flush = [&] {
    for (std::size_t i = 1; i < line.points.size(); ++i)
      captions_.placer.avoidLine(line.points[i - 1], line.points[i], kPathWidth);
    if (line.points.size() > 1) lines_.push_back(line);
    line.points.clear();
  };
  for (const Vec3& footPosition : path.footPositions) {
    if (!isHere(footPosition.y())) {
      flush();
      continue;
    }
    const Point next = view_.at(footPosition);
    if (line.points.empty() || next.x != line.points.back().x || next.y != line.points.back().y)
      line.points.push_back(next);
  }
  flush();
  if (startsHere(path))
    starts_.push_back({view_.at(path.footPositions.front()), kStartRadius, style.colour});
}

/// Contacts with walls and furniture. Floor contacts are omitted: they are permanent.
void StoreyMarks::addContact(const MapContact& contact) {
  if (std::abs(contact.normal.y()) > kMinSupportNormalY || !isHere(contact.point.y() - kHandHeight))
    return;
  contacts_.push_back({view_.at(contact.point), kContactRadius, kContactColour});
}

void StoreyMarks::addWedge(const MapCapture& capture) {
  if (!isHere(capture.eye.y() - kEyeHeight)) return;
  const double length = std::hypot(capture.viewDirection.x(), capture.viewDirection.z());
  const double x = length > 0 ? capture.viewDirection.x() / length : 1;
  const double y = length > 0 ? capture.viewDirection.z() / length : 0;
  const Wedge wedge = makeWedge(view_.at(capture.eye), x, y);
  for (const Point& end : {wedge.left, wedge.right})
    captions_.placer.reserveLine(wedge.eye, end, kWedgeWidth);
  captions_.placer.reserve(
      {{wedge.eye.x - kEyeRadius, wedge.eye.y - kEyeRadius}, 2 * kEyeRadius, 2 * kEyeRadius});
  wedges_.push_back(wedge);
}

void StoreyMarks::addCaptions(const WalkTrace& trace, const std::vector<PathStyle>& styles) {
  const Canvas measuring(1, 1, kPlanPaper);
  for (std::size_t i = 0; i < trace.paths.size(); ++i) {
    const WalkedPath& path = trace.paths[i];
    if (!startsHere(path)) continue;
    const Vec3& start = path.footPositions.front();
    captions_.add(measuring, {view_.at(start)}, path.avatar,
                  makeCaptionStyle(13, true, makeReadable(styles[i].colour)),
                  formatMarkPlace(start));
  }
  for (const MapCapture& capture : trace.captures) {
    if (!isHere(capture.eye.y() - kEyeHeight)) continue;
    captions_.add(measuring, {view_.at(capture.eye), capture.viewDirection.x() < 0}, capture.name,
                  makeCaptionStyle(11, false, kPlanInk), formatMarkPlace(capture.eye));
  }
}

void StoreyMarks::draw(Canvas& canvas) const {
  canvas.beginClip(view_.topLeft, view_.width(), view_.height());
  captions_.drawLeaders(canvas);
  for (const Line& line : lines_)
    canvas.polyline(line.points, kPathWidth, line.style.colour, line.style.line);
  for (const auto* dots : {&starts_, &blocked_, &contacts_}) {
    for (const Dot& dot : *dots) {
      canvas.disc(dot.at, dot.radius + kDotBorder, kPlanPaper);
      canvas.disc(dot.at, dot.radius, dot.colour);
    }
  }
  for (const Wedge& wedge : wedges_) drawWedge(canvas, wedge);
  captions_.drawTexts(canvas);
  canvas.endClip();
}

}  // namespace enfilade::server
